"""Controls of the network: a preset, main settings, possible faults, and free text for other settings."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from app.compute.state import Sent, Spec
from app.screens.network.export import deliver_command
from app.screens.network.labels import CODINGS, NETWORKS, REQUESTABLE, ways
from app.screens.network.lesson import NetworkLook
from app.screens.network.place import show, shown, text_of, values_of
from app.screens.network.what_if import WhatIf
from app.web.markup import Markdown
from app.window.ui import Ui
from network_sim.advice.no_effect import without_effect
from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.settings import differences, key_of, settings, with_settings

TITLES = {preset.title: name for name, preset in NETWORKS.items()}
CODING_NAMES = {title: name for name, title in CODINGS.items()}
NOTHING = "nothing"
FIRST = next(iter(NETWORKS))
MOMENTS, FEWEST = 20, 4
"""Moments of a delivery, and their least number: where a lesson looks at a plan, the last one is enough."""
BURST_FRAMES = NetworkLook().burst_frames
OF_NODES = ("off", "wall", "moved")
FREE = Markdown(
    """Settings that `packetmesh simulate --describe` lists, separated by spaces, for example
`radio.capture_db=6 nodes.deadline_s=4`. The settings of the second run apply only to that run."""
)


class NetworkSetup:
    """The controls of a delivery, or of one or two street runs."""

    def __init__(self, ui: Ui, on_change: Callable[[], None]) -> None:
        """Add the first controls; ``on_change`` is called after a change of the settings."""
        gui = ui.gui
        self._ui, self._on_change = ui, on_change
        self._extra: tuple[str, ...] = ()
        self._beside_extra: tuple[str, ...] = ()
        self._ways = ways(FIRST)
        self._own: dict[str, str] = {}
        """Values of the controls before the user changes them."""
        self._pending: dict[str, str] = {}
        """Values for the nodes, which are known only after a delivery has come."""
        self._preset = gui.add_dropdown("Preset", list(TITLES), hint="Network that carries the images.")
        self._coding = gui.add_dropdown(
            "Coding", list(CODING_NAMES), hint="How images are encoded, and which bytes are sent first."
        )
        self._leave_out = gui.add_checkbox(
            "Leave out seen tiles",
            False,
            hint="Every camera first sends a coarse image. The sink then tells each the tiles that another "
            "camera shows, and these are not sent. Needs two cameras, the coding with AVIF colour, and a "
            "radio by which the sink reaches them.",
        )
        self._by_worth = gui.add_checkbox(
            "Most surface first",
            False,
            hint="Every camera first sends a coarse image. By these the sink asks each for the tiles that "
            "add most to the surface first. Needs the coding with AVIF colour, a radio by which the sink "
            "reaches the cameras, and cameras that stand: a walking one sends its images as it takes them.",
        )
        self._share = gui.add_slider(
            "Lose packets (%)",
            0.0,
            50.0,
            0.5,
            0.0,
            hint="Share of the frames lost on every link, in addition to collisions.",
        )
        self._burst = gui.add_slider(
            "in bursts of (frames)",
            1,
            50,
            1,
            BURST_FRAMES,
            hint="Mean number of frames lost in a row.",
        )
        self._retransmit = gui.add_checkbox(
            "Send lost packets again",
            True,
            hint="Sends a packet again after the radio has given it up. IEEE 802.11 itself tries up to "
            "seven times, which repairs single losses but not bursts.",
        )
        self._vehicles = gui.add_slider("Vehicles", 1, 120, 1, 60, hint="Number of vehicles with a camera.")
        self._scheme = gui.add_dropdown("Scheme", ["-"], hint="Rule by which access points request images.")
        self._beside = gui.add_dropdown(
            "Compare with", [NOTHING], hint="A second run with the same settings but this scheme."
        )
        self._seed = gui.add_slider(
            "Seed", 0, 50, 1, 0, hint="Seed of all random numbers; the same seed gives the same run."
        )
        ui.when_changed(self._preset, self._picked)
        for handle in (
            *(self._coding, self._leave_out, self._by_worth, self._share, self._burst, self._retransmit),
            *(self._vehicles, self._scheme, self._beside, self._seed),
        ):
            ui.when_changed(handle, on_change)

    def add_what_if(self, below: str) -> None:
        """Add the controls of the nodes' faults; the faults are drawn below this scene node."""
        self.what_if = WhatIf(self._ui, below, self._on_change)

    def add_advanced(self) -> None:
        """Add medium access, moments, and free text for all other settings."""
        gui, ui = self._ui.gui, self._ui
        self._access = gui.add_dropdown(
            "Medium access", list(self._ways), hint="Rule by which nodes share the channel."
        )
        self._shadowing = gui.add_slider(
            "Shadowing (dB)",
            0.0,
            12.0,
            0.5,
            0.0,
            hint="Standard deviation of each link's constant gain or loss.",
        )
        self._moments = gui.add_slider(
            "Moments",
            FEWEST,
            40,
            1,
            MOMENTS,
            hint="Number of times at which the surface is rebuilt, after equal shares of the bytes.",
        )
        for handle in (self._access, self._shadowing, self._moments):
            ui.when_changed(handle, self._on_change)
        gui.add_markdown(FREE)
        self._text = gui.add_text("Setting key=value", "", hint="For example nodes.deadline_s=4")
        self._beside_text = gui.add_text(
            "Second run", "", hint="Settings of the second run only; the run is added if there is none."
        )
        gui.add_button(
            "Use these settings", icon=viser.Icon.CHECK, hint="Simulates the network again."
        ).on_click(lambda _: ui.post(self._use_text))
        self._idle = gui.add_markdown(Markdown(""))
        self.reset()

    @property
    def preset(self) -> str:
        """Name of the preset."""
        return TITLES[self._preset.value]

    @property
    def street(self) -> bool:
        """Whether vehicles send, instead of the scene's cameras."""
        return NETWORKS[self.preset].street

    def reset(self) -> None:
        """Restore the first settings."""
        self._preset.value = NETWORKS[FIRST].title
        self._coding.value = CODINGS[NetworkLook().coding]
        self._leave_out.value = self._by_worth.value = False
        self._moments.value, self._burst.value = MOMENTS, BURST_FRAMES
        self.what_if.forget()
        self._load()
        self._own |= self._values()

    def place(self) -> str:
        """Return the settings as text for the address."""
        values, own = self._values() | self._pending, self._own | {"preset": FIRST}
        return text_of({"preset": self.preset, **values}, own)

    def take_place(self, place: str) -> None:
        """Set the controls from an address; values of nodes wait until the nodes are known.

        Raises:
            InputError: some of the text is unknown; all else is set.
        """
        values, wrong = values_of(place), list[InputError]()
        preset = values.pop("preset", FIRST)
        self.reset()
        if preset in NETWORKS:
            self._preset.value = NETWORKS[preset].title
            self._load()
        else:
            wrong.append(InputError(f"The address has the network {preset[:40]}; try {', '.join(NETWORKS)}"))
        self._pending = {name: values.pop(name) for name in OF_NODES if name in values}
        self._text.value, self._beside_text.value = values.pop("extra", ""), values.pop("beside-extra", "")
        handles = self._handles()
        for name, text in values.items():
            try:
                if name not in handles:
                    raise InputError(f"The address has {name[:40]}, no control of this network; leave it out")
                show(name, handles[name], text)
            except InputError as error:
                wrong.append(error)
        try:
            self._read_text()
        except InputError as error:
            wrong.append(error)
        self.apply_pending()
        if wrong:
            raise wrong[0]

    def apply_pending(self) -> bool:
        """Apply node settings that were requested before the nodes existed. Returns whether any were."""
        pending, what_if = self._pending, self.what_if
        if not pending or not what_if.in_room:
            return False
        self._pending, moved = {}, pending.pop("moved", "").split(",")
        for name, text in pending.items():
            if text in what_if.handles[name].options:
                what_if.handles[name].value = text
        for name, *place_m in zip(moved[::3], moved[1::3], moved[2::3], strict=False):
            with contextlib.suppress(ValueError):
                what_if.put(name, np.array([float(text) for text in place_m]))
        return True

    def _handles(self) -> dict[str, Any]:
        names = {
            "coding": self._coding,
            "leave-out": self._leave_out,
            "by-worth": self._by_worth,
            "lose": self._share,
            "burst": self._burst,
            "again": self._retransmit,
            "vehicles": self._vehicles,
            "scheme": self._scheme,
            "beside": self._beside,
            "seed": self._seed,
            "access": self._access,
            "shadowing": self._shadowing,
            "moments": self._moments,
        }
        return names | self.what_if.handles

    def _values(self) -> dict[str, str]:
        """Return the values of the controls by their names in the address."""
        texts = {"extra": " ".join(self._extra), "beside-extra": " ".join(self._beside_extra)}
        return {name: shown(handle) for name, handle in self._handles().items()} | {
            **texts,
            "moved": self.what_if.moved,
        }

    def take(self, look: NetworkLook) -> None:
        """Set the controls for a stop of a lesson."""
        self._preset.value = NETWORKS[look.preset].title
        self._load()
        if look.way:
            (self._scheme if self.street else self._access).value = look.way
        if look.beside:
            self._beside.value = look.beside
        self._coding.value = CODINGS[look.coding]
        self._leave_out.value = self._by_worth.value = False
        self._share.value, self._burst.value = look.lose_percent, look.burst_frames
        self._retransmit.value = look.again and self._retransmit.value
        self._moments.value = FEWEST if look.plan.show else MOMENTS
        self.what_if.forget()
        self._pending = {"off": look.off} if look.off else {}
        self.apply_pending()
        self._extra = look.settings
        self._text.value = " ".join(look.settings)

    def sent(self) -> Sent:
        """Return the delivery that the controls set.

        Raises:
            InputError: a setting is invalid, or some contradict each other.
        """
        changes = (
            f"radio.shadowing_db={float(self._shadowing.value)}",
            f"run.seed={int(self._seed.value)}",
            f"loss.share={float(self._share.value) / 100.0:.4g}",
            f"nodes.retransmit={str(bool(self._retransmit.value)).lower()}",
            *((f"loss.burst_packets={float(self._burst.value)}",) if self._share.value else ()),
            *self._ways[self._access.value],
            *self.what_if.settings(),
            *self._extra,
        )
        network = with_settings(PRESETS[self.preset], changes)
        coding, moments = CODING_NAMES[self._coding.value], int(self._moments.value)
        order, leave_out = self._can_request(coding, network)
        return Sent(
            network,
            coding,
            moments,
            self.what_if.off,
            leave_out and bool(self._leave_out.value),
            "worth" if order and self._by_worth.value else "own",
        )

    def _can_request(self, coding: str, network: NetworkConfig) -> tuple[bool, bool]:
        """Return whether the sink can ask for an order of the tiles, and that some are left out, as far as is
        known before the cameras have sent."""
        what_if = self.what_if
        alone = what_if.in_room and what_if.count - len(what_if.off) < 2
        can = coding == REQUESTABLE and network.mac.reaches_nodes and not what_if.walks
        return can, can and not alone

    def runs(self) -> dict[str, NetworkConfig]:
        """Return the street runs that the controls set, by their labels.

        Raises:
            InputError: some settings contradict each other.
        """
        way, beside = self._scheme.value, self._beside.value
        runs = {way: self._run(way, self._extra)}
        if beside != NOTHING or self._beside_extra:
            second_way = way if beside == NOTHING else beside
            label = " ".join((second_way, *self._beside_extra))
            label = label if label not in runs else f"{label} again"
            runs[label] = self._run(second_way, (*self._extra, *self._beside_extra))
        return runs

    def command(self, spec: Spec) -> str:
        """Return the command lines that compute the same."""
        if not self.street:
            return deliver_command(spec, self.preset, self.sent())
        lines = []
        for config in self.runs().values():
            words = ["packetmesh", "simulate", "--preset", self.preset]
            if changed := differences(config, PRESETS[self.preset]):
                words += ["--set", *changed]
            lines.append(shlex.join(words))
        return "\n".join(lines)

    def _run(self, way: str, extra: tuple[str, ...]) -> NetworkConfig:
        config = with_settings(PRESETS[self.preset], NETWORKS[self.preset].settings)
        shown = (f"street.vehicles={int(self._vehicles.value)}", f"run.seed={int(self._seed.value)}")
        return with_settings(config, (*shown, *self._ways[way], *extra))

    def _picked(self) -> None:
        self.what_if.put_back()  # the sink of another preset has another place
        self._load()
        self._on_change()

    def _load(self) -> None:
        """Show the preset's own values and its controls."""
        own, street = settings(PRESETS[self.preset]), self.street
        self._ways = ways(self.preset)
        self._seed.value = int(own["run.seed"])
        self._share.value = 100.0 * float(own["loss.share"])
        self._retransmit.value = own["nodes.retransmit"] == "true"
        self._shadowing.value = float(own["radio.shadowing_db"])
        self._vehicles.value = int(own["street.vehicles"])
        if street:
            self._scheme.options, self._beside.options = tuple(self._ways), (NOTHING, *self._ways)
            self._scheme.value, self._beside.value = next(iter(self._ways)), NOTHING
        else:
            self._access.options = tuple(self._ways)
            self._access.value = next(iter(self._ways))
        for handle in (
            *(self._coding, self._leave_out, self._by_worth),
            *(self._share, self._burst, self._retransmit),
        ):
            handle.visible = not street
        for handle in (self._access, self._shadowing, self._moments):
            handle.visible = not street
        self.what_if.show(not street)
        for handle in (self._vehicles, self._scheme, self._beside, self._beside_text):
            handle.visible = street
        self._extra = self._beside_extra = ()
        self._text.value = self._beside_text.value = ""
        loaded = ("seed", "lose", "again", "shadowing", "vehicles", "scheme", "beside", "access")
        self._own |= {name: shown(self._handles()[name]) for name in loaded}

    def _use_text(self) -> None:
        """Take the free settings; if they are wrong, the previous ones stay."""
        self._read_text()
        self._on_change()

    def show_idle(self) -> None:
        """Show why some of the given settings change nothing, and disable what cannot be chosen."""
        if not self.street:
            sent = self.sent()
            can = self._can_request(sent.coding, sent.network)
            self._by_worth.disabled, self._leave_out.disabled = (not one for one in can)
        given = [key_of(change) for change in (*self._extra, *self._beside_extra)]
        if self._shadowing.value and not self.street:
            given.append("radio.shadowing_db")
        configs = list(self.runs().values()) if self.street else [self.sent().network]
        said = [set(without_effect(config, given)) for config in configs]
        sentences = [one for one in without_effect(configs[0], given) if all(one in other for other in said)]
        self._idle.content = Markdown("\n\n").join(map(Markdown.escape, sentences))

    def _read_text(self) -> None:
        before = self._extra, self._beside_extra
        self._extra = tuple(self._text.value.split())
        self._beside_extra = tuple(self._beside_text.value.split()) if self.street else ()
        try:
            self.runs() if self.street else self.sent()
        except InputError:
            self._extra, self._beside_extra = before
            raise

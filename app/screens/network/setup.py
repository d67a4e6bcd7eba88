"""What is simulated: a preset, a few settings, free text for all others, and a second run beside."""

from __future__ import annotations

import shlex
from collections.abc import Callable

import viser

from app.screens.network.labels import NETWORKS, ways
from app.ui import Ui
from network_sim.config import PRESETS, NetworkConfig
from packetmesh.errors import InputError
from packetmesh.settings import differences, settings, with_settings

TITLES = {preset.title: name for name, preset in NETWORKS.items()}
NOTHING = "nothing"
FIRST = next(iter(NETWORKS))
WAY_HINTS = {
    True: "Which images are asked for: all, what adds coverage, or each with a probability.",
    False: "Who may send when.",
}
FREE = """Any setting of `packetmesh simulate --describe`, several separated by spaces, for example
`radio.capture_db=6 nodes.images=2`. Those for the second run apply to it alone."""


class NetworkSetup:
    """The controls of one run or two."""

    def __init__(
        self,
        ui: Ui,
        on_change: Callable[[], None],
    ) -> None:
        """Add the controls of the first screen.

        Args:
            ui: where to add them.
            on_change: called when something else is wanted.
        """
        gui = ui.gui
        self._ui, self._on_change = ui, on_change
        self._extra: tuple[str, ...] = ()
        self._beside_extra: tuple[str, ...] = ()
        self._ways = ways(FIRST)
        self._preset = gui.add_dropdown("Preset", list(TITLES), hint="Which network to begin with.")
        self._count = gui.add_slider("Nodes", 1, 10, 1, 3, hint="How many nodes or vehicles have a camera.")
        self._shadowing = gui.add_slider(
            "Shadowing (dB)",
            0.0,
            12.0,
            0.5,
            0.0,
            hint="Standard deviation of each link's own constant gain or loss.",
        )
        self._way = gui.add_dropdown("Medium access", list(self._ways), hint=WAY_HINTS[False])
        self._seed = gui.add_slider(
            "Seed", 0, 50, 1, 0, hint="Everything that is drawn at random; the same seed gives the same run."
        )
        self._beside = gui.add_dropdown(
            "Beside", [NOTHING, *self._ways], hint="A second run with the same settings but this one."
        )
        ui.when_changed(self._preset, self._picked)
        for handle in (self._count, self._shadowing, self._way, self._seed, self._beside):
            ui.when_changed(handle, on_change)
        self.reset()

    def add_advanced(self) -> None:
        """Free text for every other setting."""
        gui = self._ui.gui
        gui.add_markdown(FREE)
        self._text = gui.add_text("Setting key=value", "", hint="For example nodes.images=2")
        self._beside_text = gui.add_text(
            "Second run", "", hint="Settings that only a second run has; it is added if there is none."
        )
        gui.add_button("Use these settings", icon=viser.Icon.CHECK, hint="Simulates again.").on_click(
            lambda _: self._ui.post(self._use_text)
        )

    @property
    def preset(self) -> str:
        """Name of the preset."""
        return TITLES[self._preset.value]

    def reset(self) -> None:
        """Go back to the settings of the start."""
        self._preset.value = NETWORKS[FIRST].title
        self._load()

    def runs(self) -> dict[str, NetworkConfig]:
        """The runs that the controls ask for, each by what the screen calls it.

        Raises:
            InputError: settings that do not go together.
        """
        way, beside = self._way.value, self._beside.value
        runs = {way: self._config(way, self._extra)}
        if beside != NOTHING or self._beside_extra:
            second_way = way if beside == NOTHING else beside
            label = " ".join((second_way, *self._beside_extra))
            label = label if label not in runs else f"{label} again"
            runs[label] = self._config(second_way, (*self._extra, *self._beside_extra))
        return runs

    def command(self) -> str:
        """The command lines that simulate the same."""
        base = PRESETS[self.preset]
        lines = []
        for config in self.runs().values():
            words = ["packetmesh", "simulate", "--preset", self.preset]
            if changed := differences(config, base):
                words += ["--set", *changed]
            lines.append(shlex.join(words))
        return "\n".join(lines)

    def _config(self, way: str, extra: tuple[str, ...]) -> NetworkConfig:
        network = NETWORKS[self.preset]
        config = with_settings(PRESETS[self.preset], network.settings)
        shown = (
            f"{network.count_key}={int(self._count.value)}",
            f"radio.shadowing_db={float(self._shadowing.value)}",
            f"run.seed={int(self._seed.value)}",
        )
        return with_settings(config, (*shown, *self._ways[way], *extra))

    def _picked(self) -> None:
        self._load()
        self._on_change()

    def _load(self) -> None:
        """Show the preset's own values."""
        network, own = NETWORKS[self.preset], settings(PRESETS[self.preset])
        self._ways = ways(self.preset)
        self._count.label = network.count_label
        self._count.value = 1  # never beyond the ends while they move
        self._count.max = max(network.most, int(own[network.count_key]))
        self._count.value = int(own[network.count_key])
        self._shadowing.value = float(own["radio.shadowing_db"])
        self._seed.value = int(own["run.seed"])
        self._way.label = "Scheme" if network.schemes else "Medium access"
        self._way.options = tuple(self._ways)
        self._way.value = next(iter(self._ways))
        self._beside.options = (NOTHING, *self._ways)
        self._beside.value = NOTHING
        self._extra = self._beside_extra = ()
        if hasattr(self, "_text"):
            self._text.value = self._beside_text.value = ""

    def _use_text(self) -> None:
        """Take the free settings, unless they are wrong: then the ones before stay."""
        before = self._extra, self._beside_extra
        self._extra, self._beside_extra = (
            tuple(self._text.value.split()),
            tuple(self._beside_text.value.split()),
        )
        try:
            self.runs()
        except InputError:
            self._extra, self._beside_extra = before
            raise
        self._on_change()

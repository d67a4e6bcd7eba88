"""Faults of a delivery's nodes: a node fails, a wall stands before it, or its radio moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from app.drawing.colors import NEUTRAL
from app.drawing.poses import place
from app.screens.network.delivery_view import DeliveryView
from app.web.markup import Markdown
from app.window.ui import Ui
from network_sim.radio.propagation import IEEE80211B
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.types import FloatArray

NO_NODE = "none"
SINK = "sink"
RETRIES: dict[str, tuple[str, ...]] = {
    "standard": (),
    **{str(count): (f"mac.retries={count}",) for count in (0, 1, 2, 5, 10)},
}
RATES: dict[str, tuple[str, ...]] = {
    f"{rate_bps / 1e6:g} Mbit/s": (f"mac.rate_bps={rate_bps:g}",) if index else ()
    for index, rate_bps in enumerate(sorted(IEEE80211B, reverse=True))
}
WALL_AWAY, WALL_HALF = 0.2, 0.25
"""Distance of the wall from its node, and half its length, over the path from the node to the sink."""
MOST_AWAY_M, MOST_HALF_M = 1.0, 1.0
APART = 0.4
"""Largest half length of the wall over its node's distance to the nearest other node, so that it affects
few other nodes."""
MOVED_TEXT = Markdown(
    "Drag the arrows: the radio moves and frames are sent from there; its camera stays. Choose *none* to "
    "put all radios back."
)
WALL_DB = 30.0


class WhatIf:
    """The controls of faults and the changes that they make to a network."""

    def __init__(self, ui: Ui, below: str, on_change: Callable[[], None]) -> None:
        """Add the controls.

        Args:
            ui: the panel and the scene.
            below: scene node below which walls and arrows are drawn.
            on_change: called after a change.
        """
        gui = ui.gui
        self._ui, self._below, self._on_change = ui, below, on_change
        self._places_m: dict[str, FloatArray] = {}
        """(2,) place of every node and of the sink before anything was moved."""
        self._moved_m: dict[str, FloatArray] = {}
        self._drawn: list[Any] = []
        self._off = gui.add_dropdown("Switch off", [NO_NODE], hint="Node that has failed and sends nothing.")
        self._walled = gui.add_dropdown(
            "Wall at",
            [NO_NODE],
            hint="Puts a wall between this node and the sink, which also blocks nodes straight behind; it "
            "has no effect on serial lines, recorded links and cellular modules.",
        )
        self._wall_db = gui.add_slider(
            "Wall loss (dB)",
            0.0,
            80.0,
            1.0,
            WALL_DB,
            hint="Attenuation of every frame that crosses the wall.",
        )
        self._retries = gui.add_dropdown(
            "Retries",
            list(RETRIES),
            hint="How often a frame without acknowledgement is sent again; without ACK no frame is, and "
            "Bluetooth LE repeats a frame until it arrives.",
        )
        self._rate = gui.add_dropdown(
            "802.11b rate",
            list(RATES),
            hint="Frames at a lower rate take longer but reach farther and through thicker walls. Other "
            "radios have one rate each, set by Medium access.",
        )
        self._mover = gui.add_dropdown(
            "Move radio of",
            [NO_NODE],
            hint="Node whose radio the arrows move; its camera stays in place. Not for a walking camera.",
        )
        self._text = gui.add_markdown(Markdown(""))
        self._visible = True
        self._controls = (self._off, self._walled, self._wall_db, self._retries, self._rate)
        for handle in self._controls:
            ui.when_changed(handle, on_change)
        ui.when_changed(self._mover, self._put_back_or_show)
        self._at_m: Callable[[str], FloatArray] | None = None
        self.walks = False
        """Whether the node is the walking camera of a recording."""

    @property
    def off(self) -> tuple[str, ...]:
        """The failed node, if any."""
        return () if self._off.value == NO_NODE else (self._off.value,)

    @property
    def count(self) -> int:
        """Number of nodes of the room, those that have failed included."""
        return len(self._off.options) - 1

    @property
    def handles(self) -> dict[str, Any]:
        """The controls by their names in an address."""
        names = ("off", "wall", "wall-db", "retries", "rate")
        return dict(zip(names, self._controls, strict=True))

    @property
    def moved(self) -> str:
        """The moved radios, each as name, metres east and north."""
        return ",".join(f"{name},{_text(place_m)}" for name, place_m in self._moved_m.items())

    @property
    def in_room(self) -> bool:
        """Whether the nodes of the room are known."""
        return self._at_m is not None or len(self._off.options) > 1

    def settings(self) -> tuple[str, ...]:
        """Return the changes of the network as ``key=value``."""
        changes = []
        places_m = self._places_m | self._moved_m
        if self._moved_m:
            flat = np.concatenate([places_m[name] for name in self._places_m])
            changes.append(f"nodes.count={len(self._places_m) - 1}")
            changes.append("nodes.places_m=" + _text(flat))
        if self._walled.value in places_m:
            changes.append("radio.walls_m=" + _text(wall_m(places_m, self._walled.value)))
            changes.append(f"radio.wall_db={float(self._wall_db.value):g}")
        return (*changes, *RETRIES[self._retries.value], *RATES[self._rate.value])

    def forget(self) -> None:
        """Remove all faults."""
        for handle in (self._off, self._walled):
            handle.value = NO_NODE
        self._wall_db.value = WALL_DB
        self._retries.value = next(iter(RETRIES))
        self._rate.value = next(iter(RATES))
        self.put_back()

    def put_back(self) -> None:
        """Put all radios back to their cameras; remove the drawn arrows and wall, not the wall's setting."""
        self._mover.value = NO_NODE
        self._moved_m.clear()
        self._text.content = Markdown("")
        self.clear()

    def leave_room(self) -> bool:
        """Forget the nodes of the room, as the next room has others. Returns whether there were faults."""
        happened = bool(self.off or self.settings())
        self.forget()
        self._places_m, self._at_m, self.walks = {}, None, False
        self.offer([])
        return happened

    def show(self, visible: bool) -> None:
        """Show or hide the controls and their drawings."""
        for handle in (*self._controls, self._mover, self._text):
            handle.visible = visible
        self._visible = visible
        if not visible:
            self.clear()

    def load(self, view: DeliveryView, at_m: Callable[[str], FloatArray]) -> None:
        """Take a delivery: offer its nodes and draw their faults.

        Args:
            view: the delivery.
            at_m: returns the (3,) drawn place of a node, or of the sink, by its name.
        """
        if not view.sent.network.nodes.places_m:
            self._places_m = places_of(view)
        self.offer(view.node_names, apart=_apart(view))
        self.walks = bool(view.walk)
        self._at_m = at_m
        self._draw()

    def offer(self, names: Sequence[str], apart: bool = True) -> None:
        """Offer these nodes in the drop-downs; a single one cannot be switched off.

        Args:
            names: names of the nodes.
            apart: whether each camera has a place of its own; otherwise no radio can be moved.
        """
        for handle in (self._off, self._walled, self._mover):
            able = apart if handle is self._mover else handle is self._walled or len(names) > 1
            options = (NO_NODE, *names) if able else (NO_NODE,)
            if tuple(handle.options) != options:
                chosen = handle.value
                handle.options = options
                handle.value = chosen if chosen in options else NO_NODE

    def _put_back_or_show(self) -> None:
        """Show arrows at the chosen node; without one, all radios go back to their cameras."""
        self._text.content = Markdown("") if self._mover.value == NO_NODE else MOVED_TEXT
        self._draw()
        if self._mover.value == NO_NODE and self._moved_m:
            self._moved_m.clear()
            self._on_change()

    def clear(self) -> None:
        """Remove the drawings."""
        while self._drawn:
            self._drawn.pop().remove()

    def _draw(self) -> None:
        self.clear()
        if self._at_m is None or not self._visible:
            return
        if self._walled.value in self._places_m:
            self._draw_wall(self._at_m(self._walled.value), self._at_m(SINK))
        if self._mover.value in self._places_m:
            self._draw_arrows(self._mover.value, self._at_m(self._mover.value))

    def _draw_wall(self, node_m: FloatArray, sink_m: FloatArray) -> None:
        """Draw the wall across the drawn path of the frames; the sink may be drawn nearer than it is."""
        way_m = sink_m - node_m
        length_m = float(np.linalg.norm(way_m))
        size_m = 0.35 * length_m
        wall = self._ui.scene.add_box(
            f"{self._below}/wall", NEUTRAL, (0.04 * length_m, size_m, size_m), opacity=0.7, cast_shadow=False
        )
        turn = rotation_exp(np.array([0.0, 0.0, np.arctan2(way_m[1], way_m[0])]))
        place(wall, rigid(turn, node_m + WALL_AWAY * way_m))
        self._drawn.append(wall)

    def _draw_arrows(self, name: str, at_m: FloatArray) -> None:
        scale = 0.5 * float(np.linalg.norm(np.subtract(at_m, self._at_m(SINK)))) if self._at_m else 1.0
        arrows = self._ui.scene.add_transform_controls(
            f"{self._below}/arrows",
            scale=max(scale, 0.3),
            active_axes=(True, True, False),
            disable_rotations=True,
            depth_test=False,
        )
        place(arrows, rigid(np.eye(3), at_m))
        start_m = (self._places_m | self._moved_m)[name]

        def dragged(event: Any) -> None:
            if event.phase == "end":
                by_m = np.array(arrows.position) - at_m
                self._ui.post(partial(self.move, name, start_m + by_m[:2]))

        arrows.on_update(dragged)
        self._drawn.append(arrows)

    def move(self, name: str, place_m: FloatArray) -> None:
        """Move the radio of a node of this room to a (2,) place, and recompute."""
        if self.put(name, place_m):
            self._on_change()

    def put(self, name: str, place_m: FloatArray) -> bool:
        """Move a radio to a (2,) place without recomputing. Returns whether the node exists."""
        if name in self._places_m:
            self._moved_m[name] = place_m
        return name in self._places_m


def places_of(view: DeliveryView) -> dict[str, FloatArray]:
    """Return (2,) places of a delivery's nodes and, last, its sink, m; of a failed node, its camera's."""
    positions_m = view.run.positions_m(view.run.start_ns)
    if view.walk:
        return {view.node_names[0]: positions_m[0], SINK: positions_m[view.run.roles.index(SINK)]}
    places_m = {
        node.name: positions_m[node.row] if node.row >= 0 else node.T_world_camera[:2, 3]
        for node in view.nodes
    }
    return places_m | {SINK: positions_m[view.run.roles.index(SINK)]}


def _apart(view: DeliveryView) -> bool:
    """Whether each camera has a place of its own: not in a rig without poses, nor if one camera walks."""
    if view.walk:
        return False
    cameras_m = np.array([node.T_world_camera[:3, 3] for node in view.nodes])
    return len(cameras_m) == 1 or bool(np.ptp(cameras_m, axis=0).max() > 1e-6)


def wall_m(places_m: dict[str, FloatArray], name: str) -> FloatArray:
    """Return (4,) both ends of a wall across a node's path to the sink, metres east and north. It is short,
    but it also crosses the path of a node that stands straight behind this one.
    """
    way_m = places_m[SINK] - places_m[name]
    length_m = max(float(np.linalg.norm(way_m)), 1e-6)
    others_m = [place_m for other, place_m in places_m.items() if other not in (name, SINK)]
    free_m = min((float(np.linalg.norm(one - places_m[name])) for one in others_m), default=np.inf)
    half_m = min(WALL_HALF * length_m, APART * free_m, MOST_HALF_M)
    middle_m = places_m[name] + way_m / length_m * min(WALL_AWAY * length_m, MOST_AWAY_M)
    across_m = half_m / length_m * np.array([-way_m[1], way_m[0]])
    return np.concatenate([middle_m - across_m, middle_m + across_m])


def _text(values: FloatArray) -> str:
    return ",".join(f"{value:.3f}" for value in values)

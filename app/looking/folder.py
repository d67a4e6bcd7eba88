"""The folder *Look* of a screen: cuts, wireframe, light, size of points, scale bar and axes.

The page's script ``look.js`` applies the settings, so that no mesh is sent again when a cut moves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from app.compute.cuts import Box, Cut, Place, Plane, Top, planes_of
from app.looking import labels
from app.looking.handles import CutHandles
from app.looking.look import MOST_POINT_MM, Look, look_of, text_of
from app.looking.room import Room, room_of
from app.web.markup import Markdown, Markup
from app.window.page import page_call
from app.window.panel import PanelSession
from pipeline.types import FloatArray

LIGHT_DEG = (120, 35)
"""First azimuth and elevation of the light set by hand: light from the side shows an uneven surface."""
STEP_M = 0.01
SPARE_M = 0.05
"""Distance of the highest cut above the points that were seen."""
MARGIN = 0.15
"""Distance of a new box's faces from the extent, as a share of it: walls and floor are at the ends of the
extent, and some points and inferred surface beyond them.
"""


class LookFolder:
    """Display settings of a screen's drawing. A part of the address (``InAddress``)."""

    def __init__(
        self, session: PanelSession, below: str, parts: Sequence[str] = (), surface: bool = True
    ) -> None:
        """Add the folder to the current container.

        Args:
            session: the session of the screen.
            below: the screen's scene node.
            parts: nodes below it that may be moved, such as a second mesh; the cut moves with each.
            surface: whether the screen draws surfaces; else it draws points.
        """
        self._session, self._below, self._parts = session, below, parts
        self._look = Look()
        self._source = session.spec.source
        self._known: tuple[object, Room] | None = None
        self._sent = 0
        self._handles = CutHandles(session.ui.scene, f"{below}/look", session.ui.post, self._dragged)
        self._mark = session.ui.gui.add_html(Markup(""))  # outside the folder, which may be closed
        self._folder = session.ui.gui.add_folder("Look", expand_by_default=False)
        with self._folder:
            self._add_cut()
            self._add_drawing(surface)
        self._show()

    def _add_cut(self) -> None:
        ui, hints = self._session.ui, labels.HINTS
        ui.gui.add_markdown(labels.TEXT)
        self._cut = ui.gui.add_dropdown("Cut away", list(labels.CUTS), hint=hints["cut"])
        self._note = ui.gui.add_markdown(Markdown(""), visible=False)
        self._height = ui.gui.add_slider("Height (m)", 0.0, 3.0, STEP_M, 3.0, hint=hints["height"])
        facings = {
            one: self._facing(one) for one in (labels.X, labels.Y, labels.LEVEL, labels.VIEW, labels.FLIP)
        }
        self._plane = ui.buttons("Plane", facings, hints["plane"], visible=False)
        self._turn = ui.gui.add_slider("Turn (°)", -90, 90, 1, 0, hint=hints["turn"])
        self._inside = ui.gui.add_checkbox("Cut away the inside", False, hint=hints["inside"])
        ui.when_changed(self._cut, self._picked)
        for handle in (self._height, self._turn, self._inside):
            ui.when_changed(handle, self._set)

    def _add_drawing(self, surface: bool) -> None:
        ui, hints = self._session.ui, labels.HINTS
        self._drawn = ui.gui.add_dropdown("Draw", list(labels.DRAWN), visible=surface, hint=hints["draw"])
        self._light = ui.gui.add_vector2(
            "Light (°)", LIGHT_DEG, min=(-180, -90), max=(180, 90), step=5, hint=hints["light"]
        )
        self._size = ui.gui.add_slider(
            "Points (mm)", 0, MOST_POINT_MM, 1, 0, visible=not surface, hint=hints["points"]
        )
        self._ruler = ui.gui.add_checkbox("Scale bar and axes", False, hint=hints["ruler"])
        for handle in (self._drawn, self._light, self._size, self._ruler):
            ui.when_changed(handle, self._set)

    @property
    def cut(self) -> Cut:
        """The present cut, world frame; ``parts`` are cut as if they had not been moved."""
        return self._look.cut

    # The room.

    @property
    def _room(self) -> Room | None:
        """The shown scene's room; None before there is one."""
        view = self._session.results.view("scene")
        if view is None:
            return None
        if self._known is None or self._known[0] is not view:
            self._known = view, room_of(view)
        return self._known[1]

    def on_spec(self) -> None:
        """Drop the cut if the scene has changed, because the cut belongs to the earlier one."""
        if self._session.spec.source != self._source:
            self._source = self._session.spec.source
            self._take(replace(self._look, cut=None))

    def show(self, there: bool) -> None:
        """Show or hide the folder, and drop the look of what is no room."""
        self._folder.visible = there
        if not there:
            self._take(Look())

    def redraw(self) -> None:
        """Draw the handles again after the screen has cleared its drawing."""
        if self._look.cut is not None:
            self._show()

    # Changes by the controls.

    def _picked(self) -> None:
        """Start a cut of the chosen kind."""
        cut: Cut = None
        room = self._room
        if room is not None and self._cut.value == labels.TOP:
            above_m = float(room.high_m[2]) + SPARE_M
            cut = Top(above_m if room.ceiling_m is None else room.ceiling_m)
        elif room is not None and self._cut.value == labels.PLANE:
            cut = Plane(_place(room.centre_m), self._view_direction(level=True))
        elif room is not None and self._cut.value == labels.BOX:
            cut = Box(_place(room.centre_m), _place((1.0 + 2.0 * MARGIN) * room.size_m))
        self._take(replace(self._look, cut=cut))

    def _set(self) -> None:
        """Take the values of all controls but the kind of cut."""
        cut = self._look.cut
        if isinstance(cut, Top):
            cut = Top(float(self._height.value))
        elif isinstance(cut, Box):
            cut = replace(cut, turn_deg=float(self._turn.value), inside=bool(self._inside.value))
        drawn, (azimuth, height) = self._drawn.value, self._light.value
        light_deg = (round(azimuth), round(height)) if drawn == labels.LIT else None
        size_mm = round(self._size.value)
        self._take(Look(cut, drawn == labels.WIRE, size_mm, light_deg, bool(self._ruler.value)))

    def _facing(self, way: str) -> Callable[[], None]:
        """Return the action of a button of the plane."""
        normals: dict[str, Place] = {
            labels.X: (1.0, 0.0, 0.0),
            labels.Y: (0.0, 1.0, 0.0),
            labels.LEVEL: (0.0, 0.0, -1.0),
        }

        def press() -> None:
            cut = self._look.cut
            if not isinstance(cut, Plane):
                return
            if way == labels.FLIP:
                normal = _place(-np.array(cut.normal))
            else:
                normal = normals.get(way) or self._view_direction(level=False)
            self._take(replace(self._look, cut=Plane(cut.point_m, normal)))

        return press

    def _view_direction(self, level: bool) -> Place:
        """Return the unit direction of view, or of its horizontal part. A plane with this normal cuts off the
        front.
        """
        client = next(iter(self._session.clients()), None)
        if client is not None and client.camera.position is not None:
            direction = np.asarray(client.camera.look_at, float) - np.asarray(client.camera.position, float)
            direction[2] *= not level
            length = float(np.linalg.norm(direction))
            if length > 1e-6:
                return _place(direction / length)
        return (0.0, 1.0, 0.0)

    # Changes by the handles.

    def _dragged(self, cut: Cut, ended: bool) -> None:
        if type(cut) is not type(self._look.cut):
            return  # another kind was chosen meanwhile
        if ended:
            self._take(replace(self._look, cut=cut))
        else:
            self._handles.follow(cut)

    # The folder and the picture.

    def _take(self, look: Look) -> None:
        self._look = look
        self._show()

    def _show(self) -> None:
        """Show the look in the folder and in the picture."""
        look, room = self._look, self._room if self._look.cut is not None else None
        with self._session.ui.atomic():
            self._show_cut(look.cut, room)
            self._drawn.value = labels.WIRE if look.wire else labels.LIT if look.light_deg else labels.USUAL
            self._light.visible = look.light_deg is not None
            if look.light_deg is not None:
                self._light.value = (float(look.light_deg[0]), float(look.light_deg[1]))
            self._size.value = look.point_mm
            self._ruler.value = look.ruler
            self._handles.draw(look.cut, room)
            self._send()

    def _show_cut(self, cut: Cut, room: Room | None) -> None:
        kinds = {Top: labels.TOP, Plane: labels.PLANE, Box: labels.BOX}
        self._cut.value = kinds.get(type(cut), labels.NOTHING)
        self._note.visible = self._height.visible = isinstance(cut, Top)
        self._plane.visible = isinstance(cut, Plane)
        self._turn.visible = self._inside.visible = isinstance(cut, Box)
        if isinstance(cut, Top):
            self._note.content = labels.top_text(room)
            if room is not None:
                self._height.min = round(min(float(room.low_m[2]), cut.height_m), 2)
                self._height.max = round(max(float(room.high_m[2]) + SPARE_M, cut.height_m), 2)
            self._height.value = cut.height_m
        elif isinstance(cut, Box):
            self._turn.value, self._inside.value = round(cut.turn_deg), cut.inside

    def _send(self) -> None:
        """Send the settings to the page's script."""
        look, handles = self._look, self._handles.planes
        planes = [
            {"point": point_m.tolist(), "normal": normal.tolist()}
            | ({} if row >= len(handles) else {"handle": handles[row][0], "axis": handles[row][1]})
            for row, (point_m, normal) in enumerate(planes_of(look.cut))
        ]
        state: dict[str, Any] = {
            "planes": planes,
            "inside": isinstance(look.cut, Box) and look.cut.inside,
            "wire": look.wire,
            "point": 0.001 * look.point_mm,
            "light": look.light_deg,
            "ruler": look.ruler,
        }
        self._sent += 1
        self._mark.content = page_call("look", self._below, list(self._parts), state, mark=self._sent)

    # The address.

    def place(self) -> str:
        """Return the look as text; empty for the default."""
        return text_of(self._look)

    def take(self, place: str) -> None:
        """Take the look of an address.

        Raises:
            InputError: the text is no look.
        """
        self._take(look_of(place))


def _place(values: FloatArray) -> Place:
    x, y, z = np.asarray(values, float).tolist()
    return (x, y, z)

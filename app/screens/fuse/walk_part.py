"""The walk of a recording on the Fuse screen: its controls, its dock, and its picture."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Hashable, Iterable
from functools import partial
from typing import Any

import viser

from app.dock.dock import Dock
from app.drawing.clouds import clear
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.screens.fuse.walk_draw import COLORS, WalkDrawing, enlarging
from app.screens.fuse.walk_lane import WalkLane, drift_lane
from app.screens.fuse.walk_lesson import KIND, SHIPPED, WalkLook, frame_of, loop_of, numbers
from app.screens.fuse.walk_numbers import legend_html, loop_html, loop_name, moment_html, walk_table
from app.screens.fuse.walk_view import NO_PICTURES, Pictures, WalkView
from app.web.markup import Markdown, Markup
from app.window.in_address import STOP, CallbackState, InAddress
from app.window.panel import PanelSession
from packetmesh.errors import InputError

BELOW = "/fuse/walk"
TEXT = Markdown(
    """**What you see.** One camera walked through the room. Each frame is registered with a keyframe. Small
errors add up to drift; loops correct it. Press **Play** below (space), or click a loop in the dock."""
)
WAITING = Markdown("The walk is shown as soon as the recording is tracked.")
NO_LOOP = "none"
DRAW_S = 0.1
"""Least time between two pictures while the clock moves."""
RUN_S = (12.0, 30.0)
"""Shortest and longest time in which the whole recording is played at the initial speed."""


class WalkPart:
    """Requests the walk, and plays it."""

    def __init__(self, session: PanelSession, choose: Callable[[], None]) -> None:
        """Start without controls; ``choose`` makes the screen show the walk.

        ``choose`` raises InputError if the scene is no recording.
        """
        self._session, self._ui, self._choose_walk = session, session.ui, choose
        self._asked: Hashable = None
        """Key of the recording whose walk was requested last."""
        self._view: WalkView | None = None
        self._drawing: WalkDrawing | None = None
        self._pictures, self._reading, self._visible = NO_PICTURES, False, False
        self._drawn, self._frame, self._drawn_s = 0, -1, 0.0
        self._framed: tuple[tuple[int, float, int], ...] = ()
        self._requested_frame: int | None = None
        """Frame from the address, kept until the walk is computed; ``_requested_loop`` likewise."""
        self._requested_loop = ""
        self._rest = self._ui.debounce(DRAW_S, self._draw)

    # The controls.

    def add_lesson(self) -> None:
        """Add the lesson and the text."""
        shipped = {f"{STOP}-walk": SHIPPED}
        self.lessons = ScreenLessons(self._ui, KIND, shipped, self._take_look, self._numbers)
        self._text = self._ui.gui.add_markdown(TEXT)

    def add_controls(self) -> None:
        """Add legend, controls, numbers and dock."""
        gui, ui = self._ui.gui, self._ui
        self._status = gui.add_markdown(WAITING)
        self._picture = gui.add_html(Markup(""))
        self._loop = gui.add_dropdown(
            "Loop",
            [NO_LOOP],
            hint="Two keyframes that show the same place; those that moved the camera farthest come first.",
        )
        self._loop_numbers = gui.add_html(Markup(""))
        self._large = gui.add_checkbox(
            "Enlarge the drift",
            True,
            hint="Draws the path by tracking alone farther from the final one than it is, so that the "
            "difference can be seen; the legend has the factor.",
        )
        self._legend = gui.add_html(Markup(""))
        self._table = gui.add_html(Markup(""))
        ui.when_changed(self._loop, self._picked_loop)
        ui.when_changed(self._large, self._enlarge)
        self._dock = Dock(ui, self._moved, self._clicked)
        self.in_address: dict[str, InAddress] = {
            "frame": CallbackState(self._moment, self._take_moment),
            "loop": CallbackState(self._loop_text, self._take_loop),
        }

    # Requests and results.

    def begin(self) -> None:
        """Request the walk of the loaded recording, or the pictures of one that is shown without them."""
        session = self._session
        key = session.spec.key("scene")
        if key != self._asked and session.results.fresh("scene", session.spec):
            self._asked = key
            session.quick_job("fuse.walk_job:walk_job", on_end=partial(self._take, key))
        elif self._view is not None and not self._reading and not self._pictures.files:
            self._read_pictures(self._view)

    def forget(self) -> None:
        """Remove the walk, because another scene was loaded."""
        self._asked = self._view = self._drawing = None
        self._reading, self._pictures = False, NO_PICTURES
        with self._ui.atomic():
            clear(self._ui.scene, BELOW)
            self._dock.show(False)
            self._status.content = WAITING
            for html in (self._picture, self._legend, self._loop_numbers, self._table):
                html.content = Markup("")
            self._loop.options = (NO_LOOP,)

    def show(self, visible: bool) -> None:
        """Show or hide the dock, at once or as soon as the walk is computed."""
        self._visible = visible
        self._dock.show(visible and self._view is not None)

    def look(self, clients: Iterable[viser.ClientHandle]) -> bool:
        """Turn the view to the walk, once per window shape. Returns False while no walk is drawn."""
        if self._drawing is None:
            return False
        clients = list(clients)
        shape = tuple(
            (client.client_id, round(client.camera.aspect, 1), client.camera.image_height)
            for client in clients
        )
        if shape != self._framed and clients:
            self._framed = shape
            self._drawing.look(clients)
        return True

    def _take(self, key: Hashable, view: WalkView | None) -> None:
        if key != self._asked:
            return
        if view is None:
            self._asked = None
            return
        with self._ui.atomic():
            self._load(view)
            self.lessons.refresh()
        if self._visible:
            self._session.frame_view()
        self._read_pictures(view)

    def _read_pictures(self, view: WalkView) -> None:
        self._reading = True
        ended = partial(self._take_pictures, self._asked)
        self._session.side_job("fuse.walk_job:pictures_job", view.keyframes, on_end=ended)

    def _take_pictures(self, key: Hashable, pictures: Pictures | None) -> None:
        if key != self._asked or self._drawing is None:
            return
        self._reading = False
        if pictures is not None:
            self._pictures = self._drawing.pictures = pictures
            self._frame = -1
            with self._ui.atomic():
                self._draw()
                self._show_loop()

    def _load(self, view: WalkView) -> None:
        self._view, self._drawn = view, self._drawn + 1
        clear(self._ui.scene, BELOW)
        self._drawing = WalkDrawing(self._ui.scene, f"{BELOW}/{self._drawn}", view)
        self._framed = ()
        self._status.content = Markdown("")
        self._table.content = walk_table(view)
        self._loop.options = (NO_LOOP, *(loop_name(loop) for loop in view.loops))
        self._enlarge()
        end_ns = int(view.times_ns[-1])
        run_s = min(max(end_ns / 1e9, RUN_S[0]), RUN_S[1])
        self._dock.load(0, end_ns, view.times_ns, self._lanes(), run_s=run_s)
        self._dock.show(self._visible)
        requested, self._requested_frame = self._requested_frame, None
        self._dock.seek(end_ns if requested is None else self._time_of(requested))
        self._picked_loop()
        self._take_waiting_look()
        loop, self._requested_loop = self._requested_loop, ""
        if loop in self._pairs():
            self._take_loop(loop)
        elif loop:
            self._ui.post(self._take_loop, loop)  # it says that there is no such loop

    # The moment.

    def _moved(self, now_ns: int) -> None:
        if time.monotonic() - self._drawn_s >= DRAW_S:
            self._draw()
        else:
            self._rest.restart()

    def _draw(self) -> None:
        """Draw the frame at the clock's time."""
        if self._view is None or self._drawing is None:
            return
        frame = self._view.frame_at(self._dock.now_ns)
        if frame != self._frame:
            self._frame, self._drawn_s = frame, time.monotonic()
            with self._ui.atomic():
                self._drawing.show(frame)
                self._picture.content = moment_html(self._view, frame, self._pictures)

    def _time_of(self, frame: int) -> int:
        """Return the time of a frame, ns; of the last frame if there are fewer."""
        assert self._view is not None
        return int(self._view.times_ns[min(frame, self._view.frames - 1)])

    def _moment(self) -> str:
        """Return the frame for the address; empty for the last one."""
        if self._requested_frame is not None:
            return str(self._requested_frame)
        if self._view is None:
            return ""
        frame = self._view.frame_at(self._dock.rest_ns)
        return "" if frame == self._view.frames - 1 else str(frame)

    def _take_moment(self, text: str) -> None:
        if text and re.fullmatch(r"\d{1,7}", text) is None:
            raise InputError(f"The address has frame={text[:20]}; try the number of a frame, such as 30")
        frame = int(text) if text else None
        if self._view is None:
            self._requested_frame = frame
        else:
            self._dock.seek(self._time_of(self._view.frames - 1 if frame is None else frame))

    # The loops.

    def _lanes(self) -> list[Any]:
        assert self._view is not None
        return [WalkLane(self._view, self._chosen), drift_lane(self._view)]

    @property
    def _chosen(self) -> int:
        """Index of the chosen loop; -1 for none."""
        return self._loop.options.index(self._loop.value) - 1

    def _clicked(self, lane: int, item: int) -> None:
        if lane == 0 and item >= 0:
            self._loop.value = self._loop.options[item + 1]
            self._picked_loop()

    def _picked_loop(self) -> None:
        if self._view is not None:
            self._dock.update(self._lanes())
            self._dock.mark(0, self._chosen)
            self._show_loop()

    def _show_loop(self) -> None:
        """Show the cameras and the numbers of the chosen loop."""
        if self._view is None or self._drawing is None:
            return
        loop = None if self._chosen < 0 else self._view.loops[self._chosen]
        with self._ui.atomic():
            self._drawing.choose(loop)
            self._picture.visible = loop is None
            self._loop_numbers.content = (
                Markup("") if loop is None else loop_html(self._view, loop, self._pictures)
            )

    def _loop_text(self) -> str:
        """Return ``12-140`` for the address: the chosen loop's keyframes; empty for none."""
        if self._view is None:
            return self._requested_loop
        return "" if self._chosen < 0 else self._pairs()[self._chosen]

    def _pairs(self) -> list[str]:
        assert self._view is not None
        return ["{}-{}".format(*loop.frames) for loop in self._view.loops]

    def _take_loop(self, text: str) -> None:
        if text and re.fullmatch(r"\d{1,7}-\d{1,7}", text) is None:
            raise InputError(f"The address has loop={text[:20]}; try two keyframes, as in 0-180")
        if self._view is None:
            self._requested_loop = text
            return
        names = ["", *self._pairs()]
        if text not in names:
            raise InputError(f"The address has loop={text}, which is no loop; choose one from the list")
        self._loop.value = self._loop.options[names.index(text)]
        self._picked_loop()

    # The drift and the lesson.

    def _enlarge(self) -> None:
        if self._view is not None and self._drawing is not None:
            times = enlarging(self._view) if self._large.value else 1
            with self._ui.atomic():
                self._drawing.enlarge(times)
                self._legend.content = legend_html(COLORS, times)
                self._frame = -1
                self._draw()

    def _take_look(self, look: WalkLook) -> None:
        """Show a stop of the lesson, at once or as soon as the walk is computed."""
        self._choose_walk()
        self.lessons.waiting = look
        self._take_waiting_look()

    def _take_waiting_look(self) -> None:
        look, view = self.lessons.waiting, self._view
        if look is None or view is None:
            return
        self.lessons.waiting = None
        self._dock.seek(self._time_of(frame_of(look, view)))
        self._loop.value = self._loop.options[1 + loop_of(look, view)]
        self._large.value = look.enlarged
        self._enlarge()
        self._picked_loop()

    def _numbers(self) -> Numbers:
        """Return the numbers of the lesson's texts; empty until the scene's walk is computed."""
        session = self._session
        if self._view is None or not session.results.fresh("scene", session.spec):
            return {}
        scene = session.results.view("scene")
        surface = session.results.view("surface") if session.results.fresh("surface", session.spec) else None
        return numbers(scene.title, self._view, surface, enlarging(self._view))

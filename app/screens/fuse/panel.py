"""The Fuse screen's panel: registration of the nodes, and a race of up to four methods."""

from __future__ import annotations

import functools
from collections.abc import Hashable
from dataclasses import replace
from typing import Any, ClassVar, TypeAlias

import numpy as np

from app.compute.records import DepthView, Stage
from app.compute.state import Spec, Step
from app.drawing.clouds import clear
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.screens.fuse.board import Board
from app.screens.fuse.capture import CaptureFolder
from app.screens.fuse.charts import RaceCharts
from app.screens.fuse.draw import ROOM_STAGE, NodesDrawing, RaceDrawing, RaceFraming
from app.screens.fuse.export import race_offers
from app.screens.fuse.gizmo import StartGizmo
from app.screens.fuse.labels import ADVANCED, MARKS, RUNNING, SINGLE, TEXT
from app.screens.fuse.lesson import KIND, SHIPPED, RaceLook, numbers
from app.screens.fuse.numbers import places_table, race_table, winner
from app.screens.fuse.place import moment_of, moment_text, race_of, race_text
from app.screens.fuse.player import END, RacePlayer
from app.screens.fuse.setup import RaceSetup
from app.screens.fuse.shown import ShownChoice
from app.screens.fuse.view import OF_NODES, CaptureView, FuseView, Race, RaceView, Start
from app.screens.fuse.walk_part import BELOW, WalkPart
from app.web.markup import Markdown, Markup
from app.window.controls import Controls
from app.window.in_address import STOP, CallbackState
from app.window.panel import Offers, Panel
from pipeline.sources import Recorded

_RaceRequest: TypeAlias = tuple[tuple[Hashable, ...], Race]
"""The key of the clouds, and the race between them."""


class FusePanel(Panel):
    """Panel of the races, the nodes' registration and the walk; races are played step by step."""

    title = "Fuse"
    step: ClassVar[Step | None] = "fuse"
    drawn_below = "/fuse"
    _raced: _RaceRequest | None
    """The race that was submitted last."""
    _arrived: _RaceRequest | None
    """The race that is shown."""
    _mapped: _RaceRequest | None
    """The race whose capture range was submitted last."""

    def build(self) -> None:
        """Add lesson, methods, player, charts and table; the other controls are in folders."""
        gui = self.gui
        self._raced = self._arrived = self._mapped = None
        self._view: RaceView | None = None
        self._drawing: RaceDrawing | None = None
        self._seek_at: float | None = 0.0
        """Iteration or millisecond to which the player goes in the next race; None is its end."""
        self._framing = RaceFraming()
        self._here = False
        self._seen: tuple[int, ...] = ()
        """The step of each lane that is shown."""
        self._result = NodesDrawing(self.scene, "/fuse/result")
        self._walk = WalkPart(self.session, self._choose_walk)
        self._shown = ShownChoice(self.ui, self._picked_shown)
        with self._shown.group(walk=False):
            gui.add_markdown(TEXT)
            self._single = gui.add_markdown(SINGLE, visible=False)
            shipped = {STOP: SHIPPED}
            self._lessons = ScreenLessons(self.ui, KIND, shipped, self._take_stop, self._lesson_numbers)
        with self._shown.group(walk=True):
            self._walk.add_lesson()
        self._shown.add()
        with self._shown.group(walk=False):
            self._build_race()
        with self._shown.group(walk=True):
            self._walk.add_controls()
        self._shown.expect(walk=isinstance(self.session.spec.source, Recorded))
        self.in_address |= self._lessons.in_address | self._walk.lessons.in_address | {"show": self._shown}
        self.in_address["race"] = CallbackState(self._race_text, self._take_race_text)
        self.in_address["t"] = CallbackState(self._moment, self._take_moment)
        self.in_address |= self._walk.in_address

    def _build_race(self) -> None:
        gui, self._setup = self.gui, RaceSetup(self.ui, self._start)
        self._setup.add_comparisons()
        self._setup.add_preset()
        self._player = RacePlayer(self.ui, self._moved, self._clocked)
        self._board = Board(self.ui)
        self._winner = gui.add_markdown(Markdown(""))
        self._table = gui.add_html(Markup(""))
        self._charts = RaceCharts(self.ui)
        self._build_folders()
        self._rows = gui.add_html(Markup(""))

    def _build_folders(self) -> None:
        gui, session = self.gui, self.session
        with gui.add_folder("Methods, nodes and pairs", expand_by_default=False):
            self._setup.add_methods([f"Method {mark}" for mark in MARKS])
            self._setup.add_nodes()
            self._player.add_axis()
        with gui.add_folder("Start by hand", expand_by_default=False):
            self._gizmo = StartGizmo(self.ui, self._dragged)
            self._setup.add_numbers()
        with gui.add_folder("Degrade the moving cloud", expand_by_default=False):
            self._setup.add_degradations()
        self._capture = CaptureFolder(self.ui, self._map, session.cancel_side_job, self._picked_cell)
        with gui.add_folder("Chain", expand_by_default=False):
            self._controls = Controls(self.ui, ADVANCED, session.spec.config, session.edit)

    def on_spec(self, spec: Spec) -> None:
        """Show the current settings."""
        self._controls.write(spec.config)
        if not self.session.results.fresh("scene", spec):
            self._shown.expect(walk=isinstance(spec.source, Recorded))
            self._show_parts()

    def on_view(self, step: Step, view: Any) -> None:
        """Take a view: a new scene drops the race, new clouds set the nodes, new poses start a race."""
        if step == "scene":
            self._forget()
            self._offer(single=len(view.nodes) == 1, walk=view.has_walk)
        if step == "depth":
            self._choose_nodes(view)
        if step == "fuse":
            self._draw_result(view)
            self._rows.content = places_table(view)
            self._start()

    def on_show(self) -> None:
        """Start the race, or request the walk, if none is there yet."""
        self._here = True
        self._framing.anew()
        self._show_parts()
        self._start()

    def on_hide(self) -> None:
        """Hide the board and dock and restore the field of view."""
        self._here = False
        self._show_parts()
        self._framing.widen(self.session.clients())

    def on_action(self, action: str) -> None:
        """Restore the first race on *Reset*, after the session has restored its settings."""
        if action == "Reset":
            self.ui.post(self._reset)

    def offers(self) -> tuple[Offers, ...]:
        """Return the exports of the race that is shown, once it has run."""
        return () if self._arrived is None else (race_offers(self._arrived[1]),)

    # The methods and nodes of the race.

    def _offer(self, single: bool, walk: bool) -> None:
        with self.ui.atomic():
            self._single.visible = single
            self._walk.forget()
            self._shown.offer(single, walk)
            self._arrange()
        if self._here:
            self._start()

    def _choose_nodes(self, depth: DepthView) -> None:
        with self.ui.atomic():
            self._setup.choose_nodes([node.name for node in depth.nodes])
            self._setup.choose_mode(self._shown.mode or self._offered(self._setup.race).mode)

    @property
    def _racing(self) -> bool:
        """Whether a race is shown."""
        return self._shown.mode is not None and self._view is not None

    def _picked_shown(self) -> None:
        if self._shown.mode is not None:
            self._setup.choose_mode(self._shown.mode)
        self._start()
        self._arrange()

    def _choose_walk(self) -> None:
        """Show the walk for a stop of its lesson."""
        self._shown.walk()
        self._picked_shown()

    def _take_stop(self, stop: RaceLook) -> None:
        """Set the controls for a stop of the lesson, and race."""
        race = self._offered(stop.race)
        with self.ui.atomic():
            self._shown.race(race.mode)
            self._setup.write(race)
            self._player.choose(stop.in_ms)
        self._seek_at = stop.place
        if not self._start() and self._view is not None:
            self._take_race(self._view)
        self._charts.choose_lane(stop.lane)

    def _offered(self, race: Race) -> Race:
        """Return the race or, of two nodes in a scene with one, the first race that is offered."""
        return race if race.mode in self._shown.races else replace(race, mode=self._shown.races[0])

    def _reset(self) -> None:
        with self.ui.atomic():
            self._shown.restart()
            self._setup.reset(self._shown.mode or self._shown.races[0])
            self._player.choose(in_ms=False)
            self._gizmo.hide()
            self._capture.forget()
            self._mapped = None
        if not self._start() and self._view is not None:
            self._player.load(self._view.lanes, self._view.reference)
        self._charts.choose_lane(0)
        self._arrange()

    def _picked_cell(self, turn_deg: float, shift_m: float) -> None:
        with self.ui.atomic():
            self._setup.write_start(Start.towards(turn_deg, 100.0 * shift_m, self._setup.race.seed))
        self._start()

    def _lesson_numbers(self) -> Numbers:
        """Return the numbers of the current race; empty while it is computed."""
        scene = self.session.results.view("scene")
        if scene is None or self._view is None or self._request() != self._arrived:
            return {}
        return numbers(scene.title, self._setup.race, self._view)

    # The race's parts of the address.

    def _race_text(self) -> str:
        return race_text(self._setup.race)

    def _take_race_text(self, text: str) -> None:
        race = self._offered(race_of(text))
        with self.ui.atomic():
            if self._shown.mode is not None:
                self._shown.race(race.mode)
            self._setup.choose(race)
            if self.session.results.fresh("depth", self.session.spec):
                self._choose_nodes(self.session.results.view("depth"))
        self._start()

    def _moment(self) -> str:
        """Return the iteration or millisecond for the address; empty at the start."""
        waiting = END if self._seek_at is None else f"{self._seek_at:.6g}"
        at = waiting if waiting != "0" else self._player.rest if self._racing else ""
        return moment_text(at, self._player.in_ms)

    def _take_moment(self, text: str) -> None:
        self._seek_at, in_ms = moment_of(text)
        self._player.choose(in_ms)
        if not self._start() and self._view is not None:
            self._take_race(self._view)

    # The race.

    def _start(self) -> bool:
        """Race if anything has changed, or request the walk. Returns False if this race is already shown."""
        session = self.session
        if self._shown.walking:
            self._walk.begin()
            return True
        if session.results.view("depth") is None or not session.results.fresh("fuse", session.spec):
            return True
        request = self._request()
        if request != self._raced:
            if self._mapped not in (None, _anywhere(request)):
                self._capture.forget()
            self._raced = request
            ended = functools.partial(self._finished, request)
            session.side_job("fuse.race_job:race_job", request[1], on_end=ended)
        return request != self._arrived

    def _request(self) -> _RaceRequest:
        return (self.session.spec.key("fuse"), self._setup.race)

    def _forget(self) -> None:
        """Remove the race of another scene."""
        self._raced = self._arrived = self._view = self._drawing = None
        self._gizmo.forget()
        with self.ui.atomic():
            clear(self.scene, "/fuse/race")
            self._board.load(None)
            self._winner.content = Markdown("")
            self._table.content = self._rows.content = Markup("")
            self._capture.forget()

    def _finished(self, request: _RaceRequest, view: RaceView | None) -> None:
        if request != self._raced:
            return
        if view is None:
            self._raced = None
            return
        self._arrived = request
        self._take_race(view)

    def _take_race(self, view: RaceView) -> None:
        self._view = view
        with self.ui.atomic():
            self._drawing = RaceDrawing(self.scene, "/fuse/race", view, self._stage())
            self._framing.anew()
            self._seen = ()
            assert self._arrived is not None
            self._gizmo.load(self._drawing, view, self._arrived[1].start)
            self._board.load(view)
            self._winner.content, self._table.content = RUNNING, Markup("")
            self._player.load(view.lanes, view.reference)
            self._player.seek_at(self._seek_at)
            self._seek_at = 0.0
            self._arrange()
            self._lessons.refresh()

    def _show_parts(self) -> None:
        """Show the board and dock of the race, or the dock of the walk, while it is shown."""
        self._board.show(self._racing and self._here)
        self._player.show(self._racing and self._here)
        self._walk.show(self._shown.walking and self._here)

    def _clocked(self) -> None:
        if self._view is not None and self._player.clock is not None:
            self._charts.load(self._view, self._player.clock)

    def _moved(self, now_ns: int) -> None:
        clock = self._player.clock
        if self._drawing is None or clock is None or clock.rows(now_ns) == self._seen:
            return
        self._seen = clock.rows(now_ns)
        with self.ui.atomic():
            self._drawing.show(self._seen)
            self._board.mark(self._seen)
            self._charts.mark(float(clock.shown(np.array(now_ns))), self._seen)
            if now_ns >= clock.end_ns and self._view is not None:
                self._winner.content = winner(self._view.reference, self._view.lanes)
                self._table.content = race_table(self._view.reference, self._view.lanes)

    def _dragged(self, start: Start, ended: bool) -> None:
        self._setup.write_start(start)
        if ended and not self._start():
            self._seen = ()
            self._moved(self._player.now_ns)

    # The capture range.

    def _map(self) -> None:
        session = self.session
        if session.results.view("depth") is None:
            return
        self._capture.wait()
        self._mapped = request = _anywhere(self._request())
        ended = functools.partial(self._take_capture, request)
        session.side_job("fuse.capture_job:capture_job", request[1], on_end=ended)

    def _take_capture(self, request: _RaceRequest, view: CaptureView | None) -> None:
        with self.ui.atomic():
            self._capture.load(view if request == _anywhere(self._request()) else None)
        self._start()

    # The 3-D view.

    def _stage(self) -> Stage:
        """Return the viewpoint for the race that has arrived: its room, or the scene."""
        if self._arrived is not None and self._arrived[1].mode not in OF_NODES:
            return ROOM_STAGE
        stage: Stage = self.session.results.view("scene").stage
        return stage

    def look(self) -> bool:
        """Fit all lanes into the picture, once per window shape. Returns False if nothing is drawn yet."""
        if self._drawing is None or not self._racing:
            self._framing.widen(self.session.clients())
            return self._shown.walking and self._walk.look(self.session.clients())
        self._framing.frame(self._drawing, self.session.clients())
        return True

    def _draw_result(self, view: FuseView) -> None:
        depth: DepthView | None = self.session.results.view("depth")
        if depth is None or len(depth.nodes) != len(view.registered):
            return
        with self.ui.atomic():
            self._result.draw(depth, view)
            self._arrange()

    def _arrange(self) -> None:
        """Show the walk, the race, or the nodes at their poses before or after registration."""
        racing, walking = self._racing, self._shown.walking
        (self._lessons if walking else self._walk.lessons).leave()
        self._show_parts()
        shown = {"/fuse/race": racing, BELOW: walking, "/fuse/result": not (racing or walking)}
        for name, visible in shown.items():
            frame = self.scene.get_handle_by_name(name)
            if frame is not None:
                frame.visible = visible
        self.session.frame_view()
        self._result.place(before=self._shown.before)


def _anywhere(request: _RaceRequest) -> _RaceRequest:
    """Return the race without its start, on which its capture range does not depend."""
    return (request[0], replace(request[1], start=Start()))

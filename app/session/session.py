"""One browser's session: its spec, its results, and the one thread on which its callbacks run."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Hashable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import viser

from app.compute import jobs
from app.compute.lane import LatestWins, Submission, Track, UrgentLanes
from app.compute.pool import ComputePool, Outcome
from app.compute.shared import SharedViews
from app.compute.state import CHAIN, STEPS, Results, Spec, Step
from app.compute.store import Store
from app.session.framing import Framing
from app.session.palettes import Palettes
from app.session.places import Places
from app.session.views import Views
from app.web.uploads import Uploads, plain
from app.web.viser_private import call_in_order
from app.window.gui import Gui
from app.window.header import Header
from app.window.page import screen_mark
from app.window.panel import Offers, Panel
from app.window.ui import SharedBy, Target, Teaching, Ui
from packetmesh.errors import PacketMeshError
from packetmesh.files import file_trouble
from packetmesh.progress import Progress
from pipeline.config import PipelineConfig

logger = logging.getLogger(__name__)

CANCELLED = "Cancelled."


class Session:
    """Runs the chain for one browser and keeps its panels up to date.

    All callbacks are posted to one thread: they need no lock, and none of them may be slow.
    """

    def __init__(
        self,
        target: Target,
        pool: ComputePool,
        store: Store,
        uploads: Uploads,
        shared: SharedViews,
        spec: Spec,
        panels: Sequence[type[Panel]],
        lecture: SharedBy | None = None,
        teaching: Teaching | None = None,
    ) -> None:
        self.target = target
        call_in_order(target)
        self.gui, self.scene = Gui(target.gui), target.scene
        own = (self.post, target.atomic, target.flush, lecture, teaching or Teaching())
        self.ui = Ui(self.gui, target.scene, *own)
        self.store, self.uploads, self._shared = store, uploads, shared
        self.spec, self.results = spec, Results()
        self.folder = self.new_folder()
        self._tracks = (
            Track(LatestWins(pool, self), CHAIN),
            Track(LatestWins(pool, object()), ("calibrate",)),
            Track(LatestWins(pool, object()), ("network",)),
        )
        self._side, self._quick = LatestWins(pool, self), UrgentLanes(pool)
        self._closed = False
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="session")
        self.panels: Sequence[Panel] = [panel(self) for panel in panels]
        self.current = self.panels[0]
        self.views = Views(target) if isinstance(target, viser.ClientHandle) else None
        self._framing = Framing(self, self.views)
        self.palettes = Palettes(self, self._framing)
        self.places = Places(self, self.views, self.palettes.accept)
        self.built = self._thread.submit(self._guarded, self._build_in_turn)
        """Done when the panels are built."""
        if isinstance(target, viser.ClientHandle):
            target.camera.on_update(lambda _: self._framing.follow_window())

    # Called by others, from any thread.

    def post(self, function: Callable[..., None], *arguments: Any) -> None:
        """Run a function on the session's thread; its errors become notifications."""
        self._submit(function, *arguments)

    def _submit(self, function: Callable[..., None], *arguments: Any) -> Future[None] | None:
        if not self._closed:
            with contextlib.suppress(RuntimeError):
                return self._thread.submit(self._guarded, function, *arguments)
        return None

    def _post_in_turn(self, function: Callable[..., None], *arguments: Any) -> None:
        """Post a function that draws much: like ``post``, but it waits until no other session draws."""
        self._shared.turns.give(lambda: self._submit(function, *arguments))

    def close(self) -> None:
        """End the session on its own thread; functions posted before that have not run are dropped."""
        self._closed = True
        with contextlib.suppress(RuntimeError):
            self._thread.submit(self._end)
        self._thread.shutdown(wait=False)

    def _end(self) -> None:
        """Stop the jobs and release the uploads; the browser is gone."""
        for lane in self._lanes:
            lane.stop()
        self.ui.close()
        self.uploads.leave(self)

    @property
    def owners(self) -> list[object]:
        """The owners of this session's jobs in the pool."""
        return [lane.owner for lane in self._lanes]

    @property
    def _lanes(self) -> list[LatestWins]:
        return [self._side, *self._quick.values(), *(track.lane for track in self._tracks)]

    def clients(self) -> Iterable[viser.ClientHandle]:
        """Return the browsers whose view this session turns."""
        if isinstance(self.target, viser.ViserServer):
            return self.ui.lecture.followers() if self.ui.lecture is not None else ()
        return [self.target]

    def notify(self, title: str, sentence: str, color: Any = "red") -> None:
        """Show a notification in all browsers of the session."""
        everybody = self.clients() if self.ui.lecture is None else self.ui.lecture.everybody()
        for client in everybody:
            client.add_notification(title, plain(sentence), color=color, auto_close_seconds=15.0)

    # Called by panels, on the session's thread.

    def new_folder(self) -> Path:
        """Make a folder for an upload, or for files made from one."""
        return self.uploads.new_folder(self)

    def edit(self, change: Callable[[PipelineConfig], PipelineConfig]) -> None:
        """Change the settings and recompute what depends on them."""
        self.want(replace(self.spec, config=change(self.spec.config)))

    def want(self, spec: Spec) -> None:
        """Change the spec and recompute what depends on the difference."""
        if spec != self.spec:
            self.spec = spec
            self.uploads.keep(spec.source, self)
            for panel in self.panels:
                panel.on_spec(spec)
        self.advance()

    def side_job(
        self,
        job: str,
        *arguments: Any,
        on_end: Callable[[Any], None],
        on_partial: Callable[[Any], None] = lambda _: None,
    ) -> None:
        """Run a job with the store, the spec and these arguments, in place of the side job before it.

        It waits for the chain's running step and for a step that the current callback submits. On the
        session's thread, ``on_partial`` gets partial results, and ``on_end`` the result or None on failure.
        """
        self.post(self._run_in_lane, self._side, job, arguments, on_end, on_partial)

    def quick_job(
        self, job: str, *arguments: Any, on_end: Callable[[Any], None], key: Hashable = None
    ) -> None:
        """Run a short job as ``PanelSession.quick_job`` defines it: in parallel with the chain."""
        view = None if key is None else self._shared.get(key)
        if view is None:
            self._run_in_lane(self._quick[job.partition(":")[0]], job, arguments, on_end, lambda _: None, key)
        else:
            self.post(on_end, view)

    def _run_in_lane(
        self,
        lane: LatestWins,
        job: str,
        arguments: tuple[Any, ...],
        on_end: Callable[[Any], None],
        on_partial: Callable[[Any], None],
        key: Hashable = None,
    ) -> None:
        def progressed(value: Any) -> None:
            if not isinstance(value, Progress):
                on_partial(value)
            elif not lane.urgent:
                self._progressed(None, value)

        def ended(outcome: Outcome) -> None:
            if outcome.kind == "error":
                self.notify("That did not work", outcome.value)
            elif outcome.kind == "result" and key is not None:
                self._shared.put(key, outcome.value)
            on_end(outcome.value if outcome.kind == "result" else None)
            self._show_status()

        post = self.post if lane.urgent else self._post_in_turn
        lane.submit(
            *((jobs.run, job) if key is None else (jobs.run_kept, job, key)),
            self.store,
            self.spec,
            *arguments,
            on_progress=lambda value: post(progressed, value),
            on_end=lambda outcome: post(ended, outcome),
            key=(job, self.spec, arguments) if key is None else key,
        )
        if not lane.urgent:
            self._show_status()

    def cancel_side_job(self) -> None:
        """Stop the side job; its ``on_end`` gets None."""
        self._side.cancel()

    def offers(self) -> tuple[Offers, ...]:
        """Return the files that all screens offer for download."""
        return tuple(offer for panel in self.panels for offer in panel.offers())

    def advance(self) -> None:
        """Compute the first stale step of each track."""
        for track in self._tracks:
            self._advance(track)
        self._show_status()

    def _advance(self, track: Track) -> None:
        while (step := self.results.first_stale(self.spec, track.steps)) is not None:
            view = self._shared.get(self.spec.key(step))
            if view is None:
                break
            self._take(step, self.spec.key(step), view)
        if step is None:
            track.submitted = None
            return
        one = Submission(step, self.spec.key(step))
        if (track.submitted is not None and track.submitted.key == one.key) or self._waits(step):
            return
        track.submitted = one
        track.lane.submit(
            jobs.run_step,
            step,
            self.store,
            self.spec,
            on_progress=lambda value: self._post_in_turn(self._progressed, step, value, one.key),
            on_end=lambda outcome: self._post_in_turn(self._ended, track, one, outcome),
            key=one.key,
        )

    def _waits(self, step: Step) -> bool:
        """Whether a step is not computed because its screen, which computes only when shown, is hidden."""
        waiting = (panel for panel in self.panels if panel.only_when_shown and panel is not self.current)
        return any(panel.step == step for panel in waiting)

    def _ended(self, track: Track, one: Submission, outcome: Outcome) -> None:
        step, key, latest = one.step, one.key, one is track.submitted
        if latest:
            track.submitted = None
        if outcome.kind == "result":
            self._shared.put(key, outcome.value)
            self._take(step, key, outcome.value)
        elif outcome.kind == "error" or latest:
            sentence = CANCELLED if outcome.kind == "stopped" else plain(outcome.value)
            self.results.fail(step, key, sentence)
            if latest:
                self._fail(step, sentence)
        self.advance()

    def _fail(self, step: Step, sentence: str) -> None:
        if sentence != CANCELLED:
            self.notify(f"{step.capitalize()} failed", sentence)
        for panel in self.panels:
            panel.on_failure(step, sentence)

    def _take(self, step: Step, key: tuple[Any, ...], view: Any) -> None:
        self.results.put(step, key, view)
        for panel in self.panels:
            panel.on_view(step, view)
        if step == "surface" and key == self.spec.key(step):
            self._shared.on_surface(self.spec, view)

    def _progressed(self, step: Step | None, value: Any, key: tuple[Any, ...] = ()) -> None:
        if isinstance(value, Progress):
            self._header.progressed(value)
            return
        if step is not None:
            self.results.begin(step, key)
        for panel in self.panels:
            if panel.step == step:
                panel.on_partial(value)
        self.show_staleness()

    # The session's own part of the control panel.

    def _build_in_turn(self) -> None:
        with self._shared.turns.taken():
            self._build()

    def _build(self) -> None:
        titles = [panel.title for panel in self.panels]
        self._header = Header(self.gui, titles, partial(self.post, self.show), partial(self.post, self._act))
        self._folders: dict[str, viser.GuiFolderHandle] = {}
        for panel in self.panels:
            self.scene.add_frame(panel.drawn_below, show_axes=False, visible=False)
            self._folders[panel.title] = self.gui.add_folder(None, visible=panel is self.current)
            with self._folders[panel.title]:
                self.gui.add_html(screen_mark(panel.title))
                panel.build()
        self.show(self.current.title)
        self.palettes.begin(self._folders, self._header.tools)
        if isinstance(self.target, viser.ClientHandle):  # in a lecture, Lecture does this for each browser
            self.places.add(self.ui)
            self.palettes.add(self.ui, self.target)

    def show(self, title: str) -> None:
        """Show the step of that title."""
        self.current.on_hide()
        self.current = next(panel for panel in self.panels if panel.title == title)
        with self.target.atomic():
            for panel in self.panels:
                self._folders[panel.title].visible = panel is self.current
            for name in {panel.drawn_below for panel in self.panels}:
                frame = self.scene.get_handle_by_name(name)
                if frame is not None:
                    frame.visible = name == self.current.drawn_below
        self.current.on_show()
        self.frame_view(keep=True)
        self._pause_unseen()
        self.advance()

    def _pause_unseen(self) -> None:
        """Stop the steps that are computed only while their screen is shown; showing it starts them again."""
        for track in self._tracks:
            if track.running is not None and self._waits(track.running):
                track.submitted = None
                track.lane.stop()

    def frame_view(self, anew: bool = False, keep: bool = False) -> None:
        """Turn the view to what is shown; ``keep`` leaves it where the user has turned it."""
        self._framing.frame(anew, keep)

    def _act(self, action: str) -> None:
        for panel in self.panels:
            panel.on_action(action)
        if action == "Cancel":
            for lane in self._lanes:
                lane.cancel()
        elif action == "Retry":
            self.results.retry_failed()
            self.advance()
        elif action == "Reset":
            self.places.reset()
        else:
            self.ui.show_command(self.current.command)

    def show_staleness(self) -> None:
        """Dim the numbers and the picture if they belong to other settings than the current ones."""
        ahead = self.current.ahead
        old = self.results.shows_other(self.current.step or CHAIN[-1], self.spec)
        self._header.dim(numbers=old or ahead, picture=old and not ahead)

    def _show_status(self) -> None:
        """Update the stepper, the status line and the dimming."""
        self.show_staleness()
        running = [track.running for track in self._tracks if track.running is not None]
        statuses = {
            panel.title: self.results.status(panel.step, self.spec, running)
            for panel in self.panels
            if panel.step is not None
        }
        failures = [self.results.failure(step, self.spec) for step in STEPS]
        failure = next((sentence for sentence in failures if sentence), None)
        self._header.show(self.current.title, statuses, running, failure, self._side.busy)
        if not (running or failure or self._side.busy):
            self.palettes.rest()
            if self.views is not None:
                self.views.settle()

    def _guarded(self, function: Callable[..., None], *arguments: Any) -> None:
        if self._closed:
            return
        try:
            with self.target.atomic():
                function(*arguments)
                self.places.follow()
                self.palettes.follow(function not in (self._ended, self._progressed))
        except PacketMeshError as error:
            self.notify("That did not work", str(error))
        except OSError as error:
            self.notify("That did not work", file_trouble(error))
        except Exception as error:
            if self._closed:  # closed meanwhile: the pool and the folder may be gone
                return
            logger.exception("a session callback failed")
            self.notify("Something unexpected happened", f"{type(error).__name__}: {error}; reload the page")

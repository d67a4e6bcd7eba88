"""The folder of the rolling ball, and its dock."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Hashable

import numpy as np

from app.dock.dock import COUNT_NS, Dock
from app.drawing.cameras import turn
from app.drawing.clouds import clear
from app.drawing.colors import DELIVERED, LOSS, NEUTRAL
from app.drawing.timeline import Curve, CurvesLane
from app.screens.surface.draw_rolling import RollingDrawing
from app.screens.surface.labels import AFTER, BEFORE
from app.screens.surface.view import Which
from app.screens.surface.walk_view import Happening, WalkRequest, WalkView
from app.web.markup import Markdown
from app.window.panel import PanelSession
from app.window.ui import Ui
from packetmesh.errors import InputError
from pipeline.types import FloatArray

BELOW = "/surface/rolling"
CLOSE_UP, WHOLE = "close up, pivot by pivot", "the whole surface, fast"
WAYS = {CLOSE_UP: "close", WHOLE: "whole"}
CLOUDS: dict[str, Which] = {AFTER: "after", BEFORE: "before"}
TEXT = Markdown(
    """A ball of true size is put down on three points and turns about one edge after the other until it
touches the next point; every rest leaves a triangle. Green: the front, edges about which the ball has not
turned yet. Red: edges at which it found no point, the rims of holes. Darker triangles come from larger
balls."""
)
WAITING = Markdown("Rolling; the bar at the top shows the progress.")
NO_WALK = Markdown("No ball to watch: the computation was stopped or failed.")
HAPPENED: dict[Happening, str] = {
    "seed": "put down on three points",
    "join": "joined a new point",
    "glue": "closed with a point of the front",
    "end": "no edge is left to turn about",
}
SPEEDS = {True: 2.0, False: 10.0}
"""Initial steps per second, of a close-up and of the whole."""
FASTEST_ARC = 6.0
"""Steps per second above which the ball jumps from rest to rest."""
SAMPLES = 200
"""Most steps at which the edges of the front are counted for its curve."""
AWAY = 1.8
"""Distance of the camera from a close-up, over the close-up's reach."""


class RollingFolder:
    """Requests walks of the ball, and plays the one that was computed."""

    def __init__(self, ui: Ui, on_request: Callable[[WalkRequest | None], None]) -> None:
        """Add the folder; ``on_request`` is called with the walk to compute, None when it is closed."""
        self._ui, self._on_request = ui, on_request
        self._view: WalkView | None = None
        self._drawing: RollingDrawing | None = None
        self._drawn = 0
        self._waiting = self._here = False
        self._requested_step: int | None = None
        """Step from the address, kept until the walk is computed."""
        with ui.gui.add_folder("Watch the ball roll", expand_by_default=False):
            ui.gui.add_markdown(TEXT)
            self._add_choices(ui)
            self._status = ui.gui.add_markdown(Markdown(""))
        self._dock = Dock(ui, self._moved, lambda lane, item: None)

    def _add_choices(self, ui: Ui) -> None:
        self._way = ui.gui.add_dropdown(
            "Watch", (CLOSE_UP, WHOLE), hint="A patch of the cloud in slow motion, or all its points."
        )
        self._cloud = ui.gui.add_dropdown("Cloud", tuple(CLOUDS), hint="Points over which the ball rolls.")
        for handle in (self._way, self._cloud):
            ui.when_changed(handle, self._chose)
        actions = {"Roll": self._request, "Close": self._close}
        ui.buttons("Ball", actions, "Roll the chosen balls; Close shows the surface again.")

    @property
    def showing(self) -> bool:
        """Whether a walk is drawn, so that the surfaces are hidden."""
        return self._drawing is not None

    @property
    def focus(self) -> tuple[FloatArray, FloatArray] | None:
        """(3,) centre of a close-up and (3,) camera position for it, world frame; None without one."""
        if self._view is None or not self._view.request.close_up:
            return None
        view = self._view
        return view.center_m, view.center_m + AWAY * view.reach_m * view.outward

    def watch(self, close_up: bool) -> None:
        """Request a walk."""
        self._way.value = CLOSE_UP if close_up else WHOLE
        self._request()

    def place(self) -> str:
        """Return ``close-after-120`` for the address: kind, cloud and step; empty without a walk."""
        if self._requested_step is None and self._view is None:
            return ""
        step = self._dock.rest_ns // COUNT_NS if self._requested_step is None else self._requested_step
        return f"{WAYS[self._way.value]}-{CLOUDS[self._cloud.value]}-{step}"

    def take(self, place: str) -> None:
        """Show the walk in an address as soon as there are points; an empty text closes the walk.

        Raises:
            InputError: there is no such walk.
        """
        if not place:
            self._requested_step = None
            self._close()
            return
        found = re.fullmatch(r"(\w+)-(\w+)-(\d{1,9})", place)
        ways, clouds = ({value: name for name, value in names.items()} for names in (WAYS, CLOUDS))
        if found is None or found[1] not in ways or found[2] not in clouds:
            raise InputError(f"The address has ball={place[:30]}; try for example close-after-120")
        self._way.value, self._cloud.value = ways[found[1]], clouds[found[2]]
        self._requested_step = int(found[3])
        self._request()

    def resume(self) -> None:
        """Request the walk in the address, if it is not shown yet, because a surface has been computed."""
        if self._requested_step is not None:
            self._request()

    def load(self, view: WalkView | None) -> None:
        """Play a walk from its start, or show the address's step; None if the job was stopped or failed."""
        self.forget()
        if view is None:
            self._status.content = NO_WALK
            return
        self._drawn += 1
        with self._ui.atomic():
            self._view = view
            self._way.value = CLOSE_UP if view.request.close_up else WHOLE
            self._cloud.value = next(name for name, which in CLOUDS.items() if which == view.request.which)
            self._drawing = RollingDrawing(self._ui.scene, f"{BELOW}/walk{self._drawn}", view)
            run_s = view.steps / SPEEDS[view.request.close_up]
            stops_ns = COUNT_NS * np.arange(view.steps + 1)
            self._dock.load(0, COUNT_NS * view.steps, stops_ns, [front_lane(view)], "step", run_s)
            self._dock.show(self._here)
        if self._requested_step is not None:
            self._dock.seek(COUNT_NS * self._requested_step)
        elif self._here:
            self._dock.play()
        self._requested_step = None

    def forget(self) -> None:
        """Remove the walk, whose cloud or radii are no longer the screen's."""
        self._waiting = False
        self._dock.pause()
        with self._ui.atomic():
            if self._drawing is not None:
                clear(self._ui.scene, BELOW)
            self._view = self._drawing = None
            self._status.content = Markdown("")
            self._dock.show(False)

    def visit(self, here: bool) -> None:
        """Show or hide the dock, as the screen is shown or hidden."""
        self._here = here
        self._dock.show(here and self.showing)

    def _close(self) -> None:
        self._on_request(None)
        self.forget()

    def _chose(self) -> None:
        """Apply another choice at once if a walk is shown or awaited."""
        if self.showing or self._waiting:
            self._request()

    def _request(self) -> None:
        self._waiting = True
        self._status.content = WAITING
        self._on_request(WalkRequest(CLOUDS[self._cloud.value], self._way.value == CLOSE_UP))

    def _moved(self, now_ns: int) -> None:
        if self._view is None or self._drawing is None:
            return
        done, place = divmod(now_ns * self._view.places // COUNT_NS, self._view.places)
        self._drawing.show(done, 0 if self._dock.speed > FASTEST_ARC else place)
        line = status_line(self._view, done)
        if line != self._status.content:
            self._status.content = line


def front_lane(view: WalkView) -> CurvesLane:
    """Return a lane with the numbers of triangles, front edges and rim edges, each on a scale of its own.

    The edges are counted after at most ``SAMPLES`` evenly spaced steps.
    """
    steps = np.unique(np.linspace(0, view.steps, min(view.steps, SAMPLES) + 1).astype(int))
    open_edges = [view.open_edges(int(done)) for done in steps]
    counts = {
        ("triangles", NEUTRAL): np.array([view.count(int(done)) for done in steps], float),
        ("front edges", DELIVERED): np.array([len(front) for front, _ in open_edges], float),
        ("rim edges", LOSS): np.array([len(dead) for _, dead in open_edges], float),
    }
    curves = [
        Curve(name, "", color, COUNT_NS * steps, values, 0.0, max(1.0, 1.05 * float(values.max())))
        for (name, color), values in counts.items()
    ]
    return CurvesLane("Front", curves, veil=1.0)


def status_line(view: WalkView, done: int) -> Markdown:
    """Return a line about the walk after ``done`` steps."""
    front, dead = view.open_edges(done)
    ball = int(view.step_radius[max(done - 1, 0)])
    radius = f"ball {1000.0 * view.radii_m[ball]:.1f} mm"
    if len(view.radii_m) > 1:
        radius += f" ({ball + 1} of {len(view.radii_m)})"
    words = [
        Markdown("**Step {:,} of {:,}**").format(done, view.steps),
        f"{view.count(done):,} triangles",
        f"front {len(front):,} edges",
        f"{len(dead):,} rim edges",
        radius,
    ]
    if done and view.happenings:
        words.append(Markdown("**{}**").format(HAPPENED[view.happenings[done - 1]]))
    return Markdown(" · ").join(words)


class Walks:
    """The folder of the rolling ball, with its jobs and its close-up."""

    def __init__(self, session: PanelSession, on_change: Callable[[], None]) -> None:
        """Add the folder; ``on_change`` is called when a walk is shown or removed."""
        self._session, self._on_change = session, on_change
        self.folder = RollingFolder(session.ui, self._watch)

    def close(self) -> None:
        """Remove the walk, and restore the view after a close-up."""
        near = self.folder.focus is not None
        self.folder.forget()
        if near:
            self._session.frame_view(anew=True)

    def look(self) -> bool:
        """Turn the view to a close-up's patch; False if there is none."""
        focus = self.folder.focus
        if focus is not None:
            for client in self._session.clients():
                turn(client, *focus)
        return focus is not None

    def _watch(self, request: WalkRequest | None) -> None:
        session = self._session
        if request is None:
            session.cancel_side_job()
            self.close()
            self._on_change()
        elif session.results.view("fuse") is not None:
            ended = functools.partial(self._walked, session.spec.key("surface"))
            session.side_job("surface.walk_job:walk_job", request, on_end=ended)

    def _walked(self, key: tuple[Hashable, ...], view: WalkView | None) -> None:
        if key == self._session.spec.key("surface"):
            self.folder.load(view)
            self._on_change()
            self._session.frame_view(anew=True)

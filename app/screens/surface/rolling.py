"""The folder in which the rolling ball is watched: what rolls where, and the player."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import viser

from app.drawing.clouds import clear
from app.player import Ticker, Timeline
from app.screens.surface.draw_rolling import RollingDrawing
from app.screens.surface.labels import AFTER, BEFORE
from app.screens.surface.walk_view import Happening, WalkRequest, WalkView, Which
from pipeline.types import FloatArray

BELOW = "/surface/rolling"
CLOSE_UP, WHOLE = "close up, pivot by pivot", "the whole surface, fast"
CLOUDS: dict[str, Which] = {AFTER: "after", BEFORE: "before"}
ROLL, CLOSE = "Roll", "Close"
TEXT = """A ball of true size is put down on three points and turns about one edge after the other until it
touches the next point; every rest leaves a triangle. Green: the front, edges it has yet to turn about. Red:
edges at which it found nothing, the rims of holes. Darker triangles are those of larger balls."""
WAITING = "Rolling; the bar at the top shows how far."
HAPPENED: dict[Happening, str] = {
    "seed": "put down on three points",
    "join": "joined a new point",
    "glue": "closed with a point of the front",
    "end": "no edge is left to turn about",
}
FRAME_S = 0.05
SPEEDS = {True: 2.0, False: 8.0}
"""Steps a second at first, of a close-up and of the whole."""
FASTEST_ARC = 6.0
"""With more steps a second the ball jumps from rest to rest."""
AWAY = 1.8
"""How far to stand from a close-up, over its reach."""


class RollingFolder:
    """Asks for walks, and plays the one that came."""

    def __init__(
        self,
        gui: viser.GuiApi,
        scene: viser.SceneApi,
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        atomic: Callable[[], AbstractContextManager[None]],
        on_request: Callable[[WalkRequest | None], None],
    ) -> None:
        """Add the folder.

        Args:
            gui: where to add it.
            scene: where to draw, below ``BELOW``.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            atomic: groups what is sent to the browser.
            on_request: called with the walk that is wanted, or None when it is closed.
        """
        self._scene, self._post, self._changed, self._atomic = scene, post, changed, atomic
        self._on_request = on_request
        self._view: WalkView | None = None
        self._drawing: RollingDrawing | None = None
        self._drawn = 0
        self._waiting = False
        self._timeline = Timeline(self._moved)
        self._ticker = Ticker(lambda: post(self._tick), FRAME_S)
        with gui.add_folder("Watch the ball roll", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._add_choices(gui)
            self._add_player(gui)
            self._status = gui.add_markdown("")
        self._arrange()

    def _add_choices(self, gui: viser.GuiApi) -> None:
        self._way = gui.add_dropdown(
            "Watch", (CLOSE_UP, WHOLE), hint="A patch of the cloud in slow motion, or all its points."
        )
        self._cloud = gui.add_dropdown("Cloud", tuple(CLOUDS), hint="Over which points the ball rolls.")
        for handle in (self._way, self._cloud):
            self._changed(handle, self._chose)
        keys = gui.add_button_group(
            "Ball",
            (ROLL, CLOSE),
            hint="Roll the chosen balls; Close shows the surface again.",
        )
        keys.on_click(lambda event: self._post(self._press, event.target.value))

    def _add_player(self, gui: viser.GuiApi) -> None:
        timeline = self._timeline
        self._keys = gui.add_button_group(
            "Player", ("Play", "Pause", "Step back", "Step"), hint="Step through the walk."
        )
        actions = {
            "Play": timeline.play,
            "Pause": timeline.pause,
            "Step back": lambda: self._step(-1),
            "Step": lambda: self._step(1),
        }
        self._keys.on_click(lambda event: self._post(self._act, actions[event.target.value]))
        self._scrub = gui.add_slider("Step", 0, 1, 1, 0, hint="Drag to any step of the walk.")
        self._changed(self._scrub, lambda: timeline.seek(int(self._scrub.value) * self._places))
        self._speed = gui.add_slider(
            "Speed (1/s)",
            0.5,
            60.0,
            0.5,
            SPEEDS[True],
            hint=f"Steps a second; up to {FASTEST_ARC:.0f} the ball of a close-up is seen turning.",
        )
        self._changed(self._speed, self._hurry)
        self._loop = gui.add_checkbox("Loop", False, hint="Begin anew at the end.")
        self._changed(self._loop, lambda: setattr(timeline, "loop", self._loop.value))

    @property
    def showing(self) -> bool:
        """Whether a walk is drawn, so that the surfaces had better be hidden."""
        return self._drawing is not None

    @property
    def focus(self) -> tuple[FloatArray, FloatArray] | None:
        """(3,) centre of a close-up and (3,) where to stand to see it, world frame."""
        if self._view is None or not self._view.request.close_up:
            return None
        view = self._view
        return view.center_m, view.center_m + AWAY * view.reach_m * view.outward

    def watch(self, close_up: bool) -> None:
        """Ask for a walk, as a person would."""
        self._way.value = CLOSE_UP if close_up else WHOLE
        self._request()

    def load(self, view: WalkView | None) -> None:
        """Play a walk from its start; None did not come."""
        self.forget()
        if view is None:
            self._status.content = "Stopped."
            return
        self._drawn += 1
        with self._atomic():
            self._view = view
            self._way.value = CLOSE_UP if view.request.close_up else WHOLE
            self._cloud.value = next(name for name, which in CLOUDS.items() if which == view.request.which)
            self._drawing = RollingDrawing(self._scene, f"{BELOW}/walk{self._drawn}", view)
            self._scrub.max = view.steps
            self._speed.value = SPEEDS[view.request.close_up]
            self._hurry()
            self._arrange()
            self._timeline.reset(view.steps * self._places + 1)
        self._act(self._timeline.play)

    def forget(self) -> None:
        """Take the walk away; its cloud or radii are no longer those of the screen."""
        self._waiting = False
        self._ticker.run(False)
        self._timeline.reset(0)
        with self._atomic():
            if self._drawing is not None:
                clear(self._scene, BELOW)
            self._view = self._drawing = None
            self._status.content = ""
            self._arrange()

    def close(self) -> None:
        """End the player's thread."""
        self._ticker.close()

    @property
    def _places(self) -> int:
        """Places of the timeline in one step."""
        return self._view.places if self._view is not None else 1

    def _arrange(self) -> None:
        for handle in (self._keys, self._scrub, self._speed, self._loop):
            handle.visible = self._view is not None

    def _press(self, button: str) -> None:
        if button == ROLL:
            self._request()
        else:
            self._on_request(None)
            self.forget()

    def _chose(self) -> None:
        """Another choice takes effect at once while somebody watches, or waits."""
        if self.showing or self._waiting:
            self._request()

    def _request(self) -> None:
        self._waiting = True
        self._status.content = WAITING
        self._on_request(WalkRequest(CLOUDS[self._cloud.value], self._way.value == CLOSE_UP, None))

    def _act(self, action: Callable[[], None]) -> None:
        action()
        self._ticker.run(self._timeline.playing)

    def _step(self, count: int) -> None:
        """To the next rest of the ball, or back to the one before."""
        rest = self._timeline.position // self._places
        if count < 0 and self._timeline.position % self._places:
            rest += 1
        self._timeline.step((rest + count) * self._places - self._timeline.position)

    def _hurry(self) -> None:
        self._timeline.speed = self._speed.value * self._places

    def _tick(self) -> None:
        self._timeline.tick()
        self._ticker.run(self._timeline.playing)

    def _moved(self, position: int) -> None:
        if self._view is None or self._drawing is None:
            return
        done, place = divmod(position, self._places)
        if self._speed.value > FASTEST_ARC:
            place = 0
        with self._atomic():
            self._drawing.show(done, place)
            if done != self._scrub.value:
                self._scrub.value = done
            self._show_line(status_line(self._view, done))

    def _show_line(self, sentence: str) -> None:
        if sentence != self._status.content:
            self._status.content = sentence


def status_line(view: WalkView, done: int) -> str:
    """The line under the player after ``done`` steps."""
    front, dead = view.open_edges(done)
    ball = int(view.step_radius[max(done - 1, 0)])
    radius = f"ball {1000.0 * view.radii_m[ball]:.1f} mm"
    if len(view.radii_m) > 1:
        radius += f" ({ball + 1} of {len(view.radii_m)})"
    words = [
        f"**Step {done:,} of {view.steps:,}**",
        f"{view.count(done):,} triangles",
        f"front {len(front):,} edges",
        f"{len(dead):,} found nothing",
        radius,
    ]
    if done and view.happenings:
        words.append(f"**{HAPPENED[view.happenings[done - 1]]}**")
    return " · ".join(words)

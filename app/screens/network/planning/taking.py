"""The button *Take it*: a ghost becomes a camera of a demo room, and shows what it really adds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import viser

from app.compute.state import Spec
from app.screens.network.planning.labels import (
    NO_TRUTH,
    NOT_TAKEN,
    OTHER_SENSOR,
    RENDERED,
    TAKING,
)
from app.screens.network.planning.numbers import kept_sentence
from app.screens.network.planning.view import Pose, TakenView
from app.web.markup import Markdown
from app.window.panel import PanelSession
from pipeline.sources import Demo, Source
from pipeline.spec import key


class Taking:
    """Adds the chosen ghost to a demo room."""

    def __init__(self, session: PanelSession, on_change: Callable[[], None]) -> None:
        """Add button and sentence to the current container; ``on_change`` is called for an added camera."""
        self._session, self._on_change = session, on_change
        self.taken: TakenView | None = None
        """The camera to which the sentence belongs; None if there is none."""
        self._rooms: dict[Source, tuple[str, int]] = {}
        """By the rigs that were made here: their demo room, and how many cameras were added to it."""
        self._surface = key(session.spec, "truth")
        """The surface to which the sentence belongs."""
        self._awaited = False
        """Whether a camera is being added."""
        self._pose: Pose | None = None
        self._sensor = ""
        gui = session.ui.gui
        self._button = gui.add_button(
            "Take it",
            icon=viser.Icon.CAMERA_PLUS,
            hint="Renders this demo room from the ghost, adds the camera to the rig, and reconstructs.",
            visible=False,
        )
        self._button.on_click(lambda _: session.ui.post(self._take))
        self._text = gui.add_markdown(Markdown(""))

    def on_spec(self, spec: Spec) -> None:
        """Remove the sentence on a camera when the surface is another one."""
        if key(spec, "truth") != self._surface:
            self._surface, self._text.content, self.taken = key(spec, "truth"), Markdown(""), None

    def offer(self, pose: Pose | None, sensor: str) -> None:
        """Offer a ghost with this sensor, if it can be rendered; None offers none."""
        self._pose, self._sensor = pose, sensor
        known = self._room is not None
        able = known and sensor in RENDERED
        self._button.visible = pose is not None and able and not self._awaited
        if pose is not None and not able:
            self._text.content = OTHER_SENSOR if known else NO_TRUTH
        elif self._text.content in (OTHER_SENSOR, NO_TRUTH):
            self._text.content = Markdown("")

    @property
    def _room(self) -> tuple[str, int] | None:
        """Demo room of the present rig, and how many cameras were added; None if its truth is not known."""
        source = self._session.spec.source
        return (source.name, 0) if isinstance(source, Demo) else self._rooms.get(source)

    def _take(self) -> None:
        """Render the ghost's image, reconstruct with it, and show what it added."""
        session, room = self._session, self._room
        if room is None or self._pose is None:
            return
        spec, (demo, added) = session.spec, room
        self._text.content, self._button.visible, self._awaited = TAKING, False, True
        folder = session.new_folder() / f"{demo}-with-{added + 1}-more"

        def came(taken: TakenView | None) -> None:
            self._awaited = False
            if key(session.spec, "truth") != key(spec, "truth"):
                return
            if taken is None:
                self.offer(self._pose, self._sensor)
                self._text.content = NOT_TAKEN
                return
            self._rooms[taken.source] = demo, added + 1
            larger = replace(session.spec, source=taken.source)
            self._surface, self.taken = key(larger, "truth"), taken
            session.want(larger)
            self._text.content = kept_sentence(taken)
            self._on_change()

        job = "network.planning.take_job:take_job"
        session.side_job(job, demo, self._sensor, self._pose, str(folder), on_end=came)

"""The button *What would close this?*: a ghost of the camera that would measure most of the chosen hole."""

from __future__ import annotations

import numpy as np
import viser

from app.drawing.ghosts import Ghosts
from app.drawing.quantities import STANDS_ON
from app.screens.surface.view import ClosingView, Which
from app.web.markup import Markdown
from app.window.panel import PanelSession
from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

JOB = "surface.closing_job:closing_job"
LOOKING = Markdown("Judging up to 500 free places …")
STALE = Markdown("The surface is being computed again; press the button once it is shown.")
LEAST_NAMED = 0.005
"""Least share of a hole on dark surface that the sentence names."""
NO_ANSWER = Markdown("There is no result: the computation was replaced or failed. Press the button again.")


class HoleClosing:
    """Asks for a camera that would close the chosen hole, and shows it."""

    def __init__(self, session: PanelSession, below: str) -> None:
        """Add button and text to the current container; the ghost is drawn below the scene node ``below``."""
        self._session = session
        self._hole: tuple[Which, int] | None = None
        self._rim = False
        self._offset_m: FloatArray = np.zeros(3)
        self._ghosts = Ghosts(session.ui.scene, below)
        gui = session.ui.gui
        self._button = gui.add_button(
            "What would close this?",
            icon=viser.Icon.CAMERA_PLUS,
            hint="Judges free places for one more camera like the present ones by how much of this hole it "
            "would measure.",
            visible=False,
        )
        self._button.on_click(lambda _: session.ui.post(self._ask))
        self._text = gui.add_markdown(Markdown(""))

    def offer(
        self, hole: tuple[Which, int] | None, rim: bool = False, offset_m: FloatArray | None = None
    ) -> None:
        """Offer the button for another hole; None if none is chosen.

        Args:
            hole: surface and index of the hole.
            rim: whether it is a rim, where the surface ends.
            offset_m: (3,) offset of its surface in the scene.
        """
        self._hole, self._rim = hole, rim
        self._offset_m = np.zeros(3) if offset_m is None else offset_m
        self._ghosts.clear()
        self._text.content, self._button.visible = Markdown(""), hole is not None

    def _ask(self) -> None:
        session, hole = self._session, self._hole
        if hole is None:
            return
        if not session.results.fresh("surface", session.spec):
            self._text.content = STALE
            return
        self._text.content = LOOKING
        session.quick_job(JOB, *hole, on_end=self._came)

    def _came(self, answer: ClosingView | None) -> None:
        """Show the camera, unless another hole has been chosen meanwhile."""
        if answer is None:
            self._text.content = NO_ANSWER if self._hole is not None else Markdown("")
            return
        if (answer.which, answer.index) != self._hole:
            return
        self._text.content = closing_sentence(answer, self._rim)
        camera = answer.camera
        if camera is not None:
            pose = rigid(np.eye(3), self._offset_m) @ camera.T_world_camera
            points_m = (camera.points_m + self._offset_m).astype(np.float32)
            self._ghosts.draw([pose], camera.fov_rad, camera.aspect, points_m, camera.dark)
            self._ghosts.show_newly([camera.chance])


def closing_sentence(answer: ClosingView, rim: bool) -> Markdown:
    """Return markdown: where the camera would stand, and how much of the hole it would measure."""
    camera = answer.camera
    if camera is None:
        return Markdown("**No camera would close it**: {}.").format(answer.why_none.rstrip("."))
    what = "what is just beyond this rim" if rim else "this hole"
    if camera.dark_share >= LEAST_NAMED:
        what += (
            f", {100.0 * camera.dark_share:.0f} points of that on a dark surface that may stay without depth"
        )
    return Markdown(
        "**A camera like the present ones would measure about {:.0f} % of {}** ({}, {:.2f} m high; {:.0f} % "
        "of its image is shared with a present camera): the pink ghost, the best of the judged places. The "
        "share is an estimate from the known surface, without an interval. A camera helps where depth is "
        "missing; where the cause above is a gap or normals, points are there already."
    ).format(
        100.0 * camera.share,
        what,
        STANDS_ON[camera.where],
        camera.height_m,
        100.0 * camera.overlap_share,
    )

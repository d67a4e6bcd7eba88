"""Requests for the shown camera's verdict and, after it, for pictures of the shown view's depth error."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import TYPE_CHECKING

from app.compute.records import Picture
from app.screens.calibrate.view import CameraView, DepthErrorView, TrustRequest, TrustView

if TYPE_CHECKING:
    from app.window.panel import PanelSession


class Answers:
    """The newest verdict and pictures of the depth error; the depth job starts after the verdict.

    Each is kept with the key of the calibration that it is about, and counts only for that calibration.
    """

    def __init__(
        self,
        session: PanelSession,
        on_trust: Callable[[TrustView | None], None],
        on_depth: Callable[[], None],
    ) -> None:
        """Start without requests.

        Args:
            session: runs the jobs.
            on_trust: called with a new verdict, or None if its job failed or was stopped.
            on_depth: called when the depth job has ended.
        """
        self._session, self._on_trust, self._on_depth = session, on_trust, on_depth
        self._trust: tuple[Hashable, TrustView] | None = None
        self._off: tuple[Hashable, DepthErrorView] | None = None
        self._requested_trust: tuple[Hashable, ...] = ()
        self._requested_depth: tuple[Hashable, ...] = ()
        self._judging = False

    @property
    def _shown(self) -> Hashable:
        """Key of the calibration that is shown."""
        return self._session.results.shown_key("calibrate")

    def trust_in(self, camera: CameraView) -> TrustView | None:
        """Return the newest verdict if it is about this camera of the shown calibration, else None."""
        key, trust = self._trust or (None, None)
        return trust if trust and (key, trust.request.camera) == (self._shown, camera.name) else None

    def pictures_of(self, camera: CameraView, view: str) -> dict[str, Picture]:
        """Return the computed maps of a camera and depth errors of a view, by ``labels.PictureName``."""
        trust, (key, off) = self.trust_in(camera), self._off or (None, None)
        pictures = {} if trust is None else dict(trust.pictures)
        if off and (key, off.camera, off.view) == (self._shown, camera.name, view):
            pictures |= off.pictures
        return pictures

    def ask(self, request: TrustRequest, view: str, depth: bool) -> None:
        """Request the verdict, and after it the depth pictures, unless requested before.

        Nothing is requested while a verdict is computed (``on_trust`` has to ask again), or while the shown
        calibration is not that of the current settings, which the jobs use.

        Args:
            request: the verdict to compute.
            view: the view that is shown.
            depth: whether its depth pictures are needed.
        """
        key = self._session.spec.key("calibrate")
        if self._judging or self._shown != key:
            return
        trust, off = (key, request), (key, request.camera, view)
        if self._requested_trust != trust:
            self._requested_trust, self._judging = trust, True
            ended = partial(self._judged, trust)
            self._session.quick_job("calibrate.trust_job:trust_job", request, on_end=ended)
        elif depth and self._trust is not None and self._requested_depth != off:
            self._requested_depth = off
            job = "calibrate.depth_job:depth_job"
            self._session.quick_job(job, request.camera, view, on_end=partial(self._compared, off))

    def _judged(self, requested: tuple[Hashable, ...], view: TrustView | None) -> None:
        self._judging, self._trust = False, None if view is None else (requested[0], view)
        self._on_trust(view)
        if view is None and self._requested_trust == requested:
            self._requested_trust = ()  # after the call, which must not repeat what has just failed

    def _compared(self, requested: tuple[Hashable, ...], view: DepthErrorView | None) -> None:
        self._off = None if view is None else (requested[0], view)
        self._on_depth()
        if view is None and self._requested_depth == requested:
            self._requested_depth = ()

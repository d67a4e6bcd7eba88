"""Requests for the shown camera's verdict and, after it, for pictures of the shown view's depth error."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

from app.compute.records import Picture
from app.screens.calibrate.view import CameraView, DepthErrorView, TrustRequest, TrustView

if TYPE_CHECKING:
    from app.window.panel import PanelSession


class Answers:
    """The newest verdict and pictures of the depth error; the depth job starts after the verdict."""

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
        self._trust: TrustView | None = None
        self._off: DepthErrorView | None = None
        self._requested_trust: tuple[Hashable, ...] = ()
        self._requested_depth: tuple[Hashable, ...] = ()
        self._judging = False

    def trust_in(self, camera: CameraView) -> TrustView | None:
        """Return the newest verdict if it is about a camera of this name, else None.

        The camera's views or lens may have changed since.
        """
        return self._trust if self._trust is not None and self._trust.request.camera == camera.name else None

    def pictures_of(self, camera: CameraView, view: str) -> dict[str, Picture]:
        """Return the computed maps of a camera and depth errors of a view, by ``labels.PictureName``."""
        trust, off = self.trust_in(camera), self._off
        pictures = {} if trust is None else dict(trust.pictures)
        if off is not None and (off.camera, off.view) == (camera.name, view):
            pictures |= off.pictures
        return pictures

    def ask(self, request: TrustRequest, view: str, depth: bool) -> None:
        """Request the verdict, and after it the depth pictures, unless requested before.

        While a verdict is computed, nothing is requested: ``on_trust`` has to ask again.

        Args:
            request: the verdict to compute.
            view: the view that is shown.
            depth: whether its depth pictures are needed.
        """
        if self._judging:
            return
        key = self._session.spec.key("calibrate")
        if self._requested_trust != (key, request):
            self._requested_trust, self._judging = (key, request), True
            self._session.quick_job("calibrate.trust_job:trust_job", request, on_end=self._judged)
        elif depth and self._requested_depth != (key, request.camera, view):
            self._requested_depth = (key, request.camera, view)
            job = "calibrate.depth_job:depth_job"
            self._session.quick_job(job, request.camera, view, on_end=self._compared)

    def _judged(self, view: TrustView | None) -> None:
        self._judging, self._trust = False, view
        self._on_trust(view)

    def _compared(self, view: DepthErrorView | None) -> None:
        self._off = view
        self._on_depth()

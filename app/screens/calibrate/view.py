"""What the Calibrate screen gets of a rig's cameras."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class Photograph:
    """One picture of the board, and what was found in it."""

    name: str
    """The same in several cameras for the same moment."""
    jpeg: bytes
    """Thinned for the panel."""
    zoom: float
    """Pixels of the thinned picture in one of the photograph."""
    points_px: FloatArray
    """(N, 2) of the board's points; empty if it was not found."""
    blobs_px: FloatArray
    """(B, 2) what looked like a circle, where the board was not found."""
    reason: str
    """Why it was not found, in a sentence."""

    @property
    def found(self) -> bool:
        """Whether the board was found."""
        return len(self.points_px) > 0


@dataclass(frozen=True, slots=True)
class CameraView:
    """One camera, from its photographs."""

    name: str
    size_px: tuple[int, int]
    photographs: tuple[Photograph, ...]
    calibration: Calibration | None
    """None if the views do not determine it."""
    reason: str
    """Why they do not, in a sentence."""
    unseen: tuple[FittedView, ...]
    """Every view by a lens that has not seen it: those held out in turn, and those that were dropped."""
    dropped: tuple[str, ...]
    """Names of the views that are left out."""

    def fitted(self, name: str) -> FittedView | None:
        """A view as the lens explains it, which may have been dropped; None without board or lens."""
        if self.calibration is None:
            return None
        placed = [*self.calibration.views, *(view for view in self.unseen if view.name in self.dropped)]
        return next((view for view in placed if view.name == name), None)

    def unseen_rms_px(self, name: str) -> float | None:
        """Error of a view by a lens that has not seen it."""
        return next((view.rms_px for view in self.unseen if view.name == name), None)


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """All cameras of which there are photographs; while they are computed, those that are done."""

    board: Board
    cameras: tuple[CameraView, ...]

    def camera(self, name: str) -> CameraView | None:
        """The camera of that name, or the first."""
        return next((one for one in self.cameras if one.name == name), next(iter(self.cameras), None))

"""Results of the Calibrate screen: photographs, cameras, depth biases, the rig and its verdicts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from app.compute.records import Picture
from app.drawing.depth_bias_plots import BiasCurve
from pipeline.calibration.board import Board
from pipeline.calibration.correlation import Correlations
from pipeline.calibration.diagnosis import RadialCurve, RadialResiduals
from pipeline.calibration.estimate import Calibration, FittedView
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class Photograph:
    """One photograph of the board, and the points found in it."""

    name: str
    """Name of the moment, equal in several cameras."""
    jpeg: bytes
    """The photograph, thinned for the panel."""
    zoom: float
    """Pixels of the thinned picture per pixel of the photograph."""
    points_px: FloatArray
    """(N, 2) the board's points; empty if it was not found."""
    blobs_px: FloatArray
    """(B, 2) circle-like blobs, if the board was not found."""
    reason: str
    """Reason why the board was not found, in a sentence."""

    @property
    def found(self) -> bool:
        """Whether the board was found."""
        return len(self.points_px) > 0


@dataclass(frozen=True, slots=True)
class WarpView:
    """The board's own shape, estimated from the views of one camera."""

    off_plane_m: FloatArray
    """(R, C) heights of its points over their best-fitting plane, metres."""
    used: bool
    """Whether the camera was estimated with this shape, because it predicts held-out views better."""
    rms_px: float
    """RMS of held-out views with this shape."""
    flat_rms_px: float
    """RMS of held-out views with a flat board."""

    @property
    def bend_m(self) -> float:
        """Height difference between the lowest and the highest point."""
        return float(np.ptp(self.off_plane_m))


@dataclass(frozen=True, slots=True)
class CameraView:
    """One camera, from its photographs."""

    name: str
    size_px: tuple[int, int]
    """Width and height."""
    photographs: tuple[Photograph, ...]
    calibration: Calibration | None = None
    """None if the views do not determine it."""
    reason: str = ""
    """Reason why they do not, in a sentence."""
    unseen: tuple[FittedView, ...] = ()
    """Views by a lens estimated without them: those held out in turn, and the dropped ones."""
    dropped: tuple[str, ...] = ()
    """Names of the views that are left out."""
    truth: dict[str, float] = field(default_factory=dict)
    """True parameters by name; empty for real cameras."""
    warp: WarpView | None = None
    """None unless it was estimated."""

    def fitted(self, name: str) -> FittedView | None:
        """Return a view, dropped or not, as the lens explains it; None without board or lens."""
        if self.calibration is None:
            return None
        placed = [*self.calibration.views, *(view for view in self.unseen if view.name in self.dropped)]
        return next((view for view in placed if view.name == name), None)

    def unseen_rms_px(self, name: str) -> float | None:
        """Return the RMS error of a view by a lens estimated without it, px; None if there is none."""
        return next((view.rms_px for view in self.unseen if view.name == name), None)


@dataclass(frozen=True, slots=True)
class BiasView:
    """The bias of a camera's depth sensor, measured against the board."""

    terms: tuple[str, ...]
    """Terms that held-out views justify."""
    rows: tuple[tuple[str, float, float, float, str], ...]
    """For each of their numbers: name, value, ends of its 95 % interval and unit."""
    rms_before_m: float
    """Root mean square of measured depth minus the board's plane; ``rms_after_m``: of corrected depth."""
    rms_after_m: float
    curve: BiasCurve
    note: str
    """Terms that the views cannot distinguish; empty if they can."""


@dataclass(frozen=True, slots=True)
class PlacedCamera:
    """A camera's pose in a rig, and its uncertainty."""

    name: str
    T_first_camera: FloatArray
    """(4, 4) pose in the frame of the first camera."""
    moments: int
    """Moments at which it and the first camera see the board; for the first, all of its own."""
    rotation_sd_deg: float = 0.0
    """Standard error of the rotation; ``position_sd_m``: of the position. Both are 0 for the first."""
    position_sd_m: float = 0.0
    held_out_rotation_deg: float | None = None
    """Largest change of its rotation when a part of the moments is left out; ``held_out_position_m``: of its
    position. None if no part can be left out."""
    held_out_position_m: float | None = None


@dataclass(frozen=True, slots=True)
class RigView:
    """Cameras and boards in the frame of the first camera."""

    cameras: tuple[PlacedCamera, ...]
    T_first_board: dict[str, FloatArray]
    """(4, 4) pose by moment."""
    rms_px: float
    held_out_rms_px: float | None
    """RMS in moments that were not used for the poses."""


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """All photographed cameras; while they are computed, those done so far."""

    board: Board
    cameras: tuple[CameraView, ...] = ()
    rig: RigView | str | None = None
    """All cameras together, or the reason why not; None for one camera, and before it is computed."""
    depth: dict[str, BiasView | str] = field(default_factory=dict)
    """By camera: the bias of its depth, or why it is unknown; only those computed so far."""

    def camera(self, name: str) -> CameraView | None:
        """Return the camera of this name; None if there is none."""
        return next((one for one in self.cameras if one.name == name), None)


@dataclass(frozen=True, slots=True)
class TrustRequest:
    """The range and the accuracy for which a camera is judged."""

    camera: str
    range_m: float
    accuracy_m: float
    """Largest allowed error of a point across the ray."""


@dataclass(frozen=True, slots=True)
class TrustView:
    """The verdict on a camera."""

    request: TrustRequest
    passed: bool
    failed: bool
    """False also if the views do not decide."""
    lines: tuple[str, ...]
    """The verdict in a sentence, and advice in some more."""
    outliers: tuple[str, ...]
    """Views that stand out, the worst first."""
    pictures: dict[str, Picture]
    """Maps over the image, of the size of the thinned photographs."""
    bends: RadialCurve
    left: RadialResiduals
    uncertainty_m: float
    """95 % error of a point from noise, root mean square over the image."""
    difference_m: float | None
    """Root mean square difference of two halves of the views; None with too few views."""
    halves: tuple[float, float] | None
    """That difference over the one expected from noise, and the ratio exceeded in 5 of 100 cases."""
    together: Correlations
    """Correlations of the parameters' errors."""


@dataclass(frozen=True, slots=True)
class DepthErrorView:
    """One view's depth compared with the board's plane."""

    camera: str
    view: str
    pictures: dict[str, Picture]
    """Depth errors by "off-before" (measured) and "off-after" (corrected, if the bias is known)."""

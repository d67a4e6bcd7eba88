"""What the Calibrate screen gets of a rig's cameras."""

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
class WarpView:
    """The board's own shape, as the views of one camera have it."""

    off_plane_m: FloatArray
    """(R, C) of its points, above or below the plane that lies best in them."""
    used: bool
    """Whether the camera was estimated with it: it is where that predicts held-out views better."""
    rms_px: float
    """Of held-out views, with it."""
    flat_rms_px: float
    """With a flat board."""

    @property
    def bend_m(self) -> float:
        """From the deepest point to the highest."""
        return float(np.ptp(self.off_plane_m))


@dataclass(frozen=True, slots=True)
class CameraView:
    """One camera, from its photographs."""

    name: str
    size_px: tuple[int, int]
    photographs: tuple[Photograph, ...]
    calibration: Calibration | None = None
    """None if the views do not determine it."""
    reason: str = ""
    """Why they do not, in a sentence."""
    unseen: tuple[FittedView, ...] = ()
    """Every view by a lens that has not seen it: those held out in turn, and those that were dropped."""
    dropped: tuple[str, ...] = ()
    """Names of the views that are left out."""
    truth: dict[str, float] = field(default_factory=dict)
    """Parameters as they truly are, by name; empty for real cameras."""
    warp: WarpView | None = None
    """None unless it was asked for."""

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
class BiasView:
    """What the board says of a camera's depth sensor."""

    terms: tuple[str, ...]
    """Those that held-out views justify."""
    rows: tuple[tuple[str, float, float, float, str], ...]
    """Of each number of theirs: its name, value, ends of its 95 % interval and unit."""
    rms_before_m: float
    rms_after_m: float
    curve: BiasCurve
    note: str
    """What the views cannot tell apart; empty if they can."""


@dataclass(frozen=True, slots=True)
class PlacedCamera:
    """Where a camera of a rig stands, and how sure that is."""

    name: str
    T_first_camera: FloatArray
    """(4, 4) in the frame of the first camera."""
    moments: int
    """At which it sees the board together with the first; of the first, all of its own."""
    rotation_sd_deg: float = 0.0
    position_sd_m: float = 0.0
    held_out_rotation_deg: float | None = None
    """The most by which its pose changes when a part of the moments is left out; None if none was."""
    held_out_position_m: float | None = None


@dataclass(frozen=True, slots=True)
class RigView:
    """Cameras and boards in the frame of the first camera."""

    cameras: tuple[PlacedCamera, ...]
    T_first_board: dict[str, FloatArray]
    """(4, 4) by moment."""
    rms_px: float
    held_out_rms_px: float | None
    """In moments that had no part in the poses."""


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """All cameras of which there are photographs; while they are computed, those that are done."""

    board: Board
    cameras: tuple[CameraView, ...] = ()
    rig: RigView | str | None = None
    """All of them together, or why that cannot be; None for one camera, and while it is to come."""
    depth: dict[str, BiasView | str] = field(default_factory=dict)
    """By camera: the bias of its depth, or why it is not known; without those that are still to come."""

    def camera(self, name: str) -> CameraView | None:
        """The camera of that name, or the first."""
        return next((one for one in self.cameras if one.name == name), next(iter(self.cameras), None))


@dataclass(frozen=True, slots=True)
class TrustRequest:
    """How far a camera is to be trusted at a range."""

    camera: str
    range_m: float
    accuracy_m: float
    """Within which a point must be placed, across the ray."""


@dataclass(frozen=True, slots=True)
class TrustView:
    """The answer."""

    request: TrustRequest
    passed: bool
    lines: tuple[str, ...]
    """The verdict in a sentence, and what to do, in some more."""
    outliers: tuple[str, ...]
    """Views that stand out, the worst first."""
    pictures: dict[str, Picture]
    """Of the size of the thinned photographs: what is known of each pixel."""
    bends: RadialCurve
    left: RadialResiduals
    uncertainty_m: float
    """Within which noise leaves a point 95 times in 100, root mean square over the image."""
    difference_m: float | None
    """Between two halves of the views, likewise; None with too few of them."""
    halves: tuple[float, float] | None
    """That difference over what noise lets one expect, and how much that is at most in 95 of 100 cases."""
    together: Correlations
    """How the errors of the parameters go together."""


@dataclass(frozen=True, slots=True)
class DepthErrorView:
    """One view's depth beside the board's plane."""

    camera: str
    view: str
    pictures: dict[str, Picture]
    """As measured and corrected."""

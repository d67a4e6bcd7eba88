"""Records that stages pass to each other: frozen, plain arrays, units in the names.

Conventions: metres, seconds, radians; OpenCV camera axes (x right, y down, z forward); pixel
centres at integers; ``T_a_b`` is the (4, 4) matrix that maps coordinates in frame b to frame a;
unknown depth is NaN.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from packetmesh.notebook import ShownInNotebooks
from pipeline.quality import SurfaceQuality

FloatArray = NDArray[np.floating]
IntArray = NDArray[np.integer]
BoolArray = NDArray[np.bool_]
ByteArray = NDArray[np.uint8]
AnyPath = str | os.PathLike[str]


class PointSource(IntEnum):
    """Origin of a fused point."""

    SENSOR = 0
    INFERRED = 1


@dataclass(frozen=True, slots=True)
class CameraIntrinsics:
    """A camera and its lens, in OpenCV's direction from a point to its pixel (SPEC 1.1).

    ``kernels.geometry`` maps points to pixels and pixels to rays for every lens.
    """

    matrix: FloatArray
    """(3, 3) camera matrix, pixels, zero skew."""
    distortion: FloatArray
    """Dimensionless: (5,) k1, k2, p1, p2, k3 (Brown and Conrady); (8,) also k4, k5, k6 (rational); (12,) also
    s1 to s4 (thin prism); (14,) also two angles of a tilted sensor, rad. Of a fisheye (4,) k1 to k4."""
    width_px: int
    height_px: int
    fisheye: bool = False
    """Whether the lens is that of ``cv2.fisheye``: equidistant, four coefficients (Kannala, Brandt 2006)."""

    @property
    def fx_px(self) -> float:
        return float(self.matrix[0, 0])

    @property
    def fy_px(self) -> float:
        return float(self.matrix[1, 1])

    @property
    def cx_px(self) -> float:
        return float(self.matrix[0, 2])

    @property
    def cy_px(self) -> float:
        return float(self.matrix[1, 2])

    @staticmethod
    def pinhole(
        fx_px: float, fy_px: float, cx_px: float, cy_px: float, width_px: int, height_px: int
    ) -> CameraIntrinsics:
        """Return an undistorted camera."""
        matrix = np.array([[fx_px, 0.0, cx_px], [0.0, fy_px, cy_px], [0.0, 0.0, 1.0]])
        return CameraIntrinsics(matrix, np.zeros(5), width_px, height_px)


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depth along the optical axis (z, not ray length) for every pixel."""

    z_m: FloatArray
    """(H, W) float32, metres; NaN where unknown."""
    kind: Literal["metric", "relative"] = "metric"

    @property
    def valid(self) -> BoolArray:
        """(H, W) True where the depth is known."""
        return np.isfinite(self.z_m)

    @property
    def coverage(self) -> float:
        """Share of pixels with known depth, 0 to 1."""
        return float(self.valid.mean())


@dataclass(frozen=True, slots=True)
class DepthNoise:
    """Standard deviation of a depth sensor's measurements: max(s0, s1 z^p) / cos(angle)^q (SPEC 1.5)."""

    s0_m: float
    s1_m: float
    """Standard deviation at a depth of 1 m."""
    p: float
    q: float

    def sd_m(self, z_m: FloatArray, cosine: FloatArray | float = 1.0) -> FloatArray:
        """Return the standard deviation at depth ``z_m`` on surfaces with this cosine of incidence."""
        along_m = np.maximum(self.s0_m, self.s1_m * np.asarray(z_m, float) ** self.p)
        return along_m / np.asarray(cosine, float) ** self.q


@dataclass(frozen=True, slots=True)
class Averaging:
    """Average of a recording's depth images, of a camera that stands (SPEC 10.4)."""

    sd_m: FloatArray
    """(H, W) standard deviation of the averaged depth; NaN where it is unknown."""
    frames: int
    """Number of depth images that were averaged."""
    available: int
    """Number that could be averaged: all frames of the recording, at most ``MOST_AVERAGED``."""
    moving_share: float
    """Share of the pixels that moved, which have no depth."""
    flickering_share: float
    """Share of the pixels that some of the images measured, but less than a quarter of them."""

    @property
    def median_sd_m(self) -> float:
        """Median standard deviation of the averaged depth."""
        return float(np.nanmedian(self.sd_m))


@dataclass(frozen=True, slots=True)
class RgbdFrame:
    """One registered colour and depth image of one camera node."""

    name: str
    rgb: ByteArray
    """(H, W, 3) RGB."""
    depth: DepthMap
    """(H, W), on the same pixel grid as ``rgb``."""
    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4) pose as given with the images; registration corrects it."""
    rgb_known: BoolArray | None = None
    """(H, W) mask of the pixels of ``rgb`` that arrived over a network; None means all."""
    coarse: DepthMap | None = None
    """(H, W) coarse depth where ``depth`` is unknown; it is treated as a guess, like inferred depth."""
    noise: DepthNoise | None = None
    """Noise of ``depth`` from its sensor's calibration; None means that of a Kinect."""
    pose_known: bool = True
    """False if the pose is unknown, so that registration must find it without a start."""
    notes: tuple[str, ...] = ()
    """Doubts about the images, one sentence each, with what to try."""
    averaging: Averaging | None = None
    """How ``depth`` was averaged; None for a single image."""
    scale_sd: float | None = None
    """Relative standard error that the calibration of lens and depth leaves in lengths; None if unknown."""


@dataclass(frozen=True, slots=True)
class RigTruth:
    """Ground truth of a rendered scene."""

    vertices_m: FloatArray
    triangles: IntArray
    """(V, 3) vertices in the world frame, and (F, 3) rows of them."""
    T_world_camera: tuple[FloatArray, ...]
    """True pose of every node."""
    depth: tuple[DepthMap, ...]
    """True, hole-free depth of every node, on the pixels of its true camera."""
    intrinsics: tuple[CameraIntrinsics, ...]
    """True camera of every node."""


MAX_NODES = 200
"""Largest number of nodes in a rig."""


@dataclass(frozen=True, slots=True)
class Rig(ShownInNotebooks):
    """One to ``MAX_NODES`` camera nodes that look at the same place; a single RGB-D pair is a rig of one."""

    name: str
    frames: tuple[RgbdFrame, ...]
    truth: RigTruth | None = None
    walk: Walk | None = None
    """The recording of which the nodes are keyframes, at their final poses; None for any other rig."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Doubts about the recording and the images of its nodes, one sentence each."""
        of_recording = () if self.walk is None else self.walk.notes
        return of_recording + tuple(f"{frame.name}: {note}" for frame in self.frames for note in frame.notes)


@dataclass(frozen=True, slots=True)
class PointCloud(ShownInNotebooks):
    """Points with optional columns, each None or with N rows."""

    points_m: FloatArray
    """(N, 3) float64."""
    colors: ByteArray | None = None
    """(N, 3) RGB."""
    normals: FloatArray | None = None
    """(N, 3) unit vectors towards the observing camera."""
    pixels: IntArray | None = None
    """(N, 2) pixel (u, v) from which each point was back-projected."""
    sigma_m: FloatArray | None = None
    """(N,) standard deviation of the depth."""
    source: ByteArray | None = None
    """(N,) ``PointSource`` of each point."""

    def __len__(self) -> int:
        return len(self.points_m)

    def select(self, rows: BoolArray | IntArray) -> PointCloud:
        """Return the points at ``rows``: an (N,) mask or indices."""
        places = np.flatnonzero(rows) if rows.dtype == bool else rows
        columns: dict[str, Any] = {}
        for column in fields(self):
            values = getattr(self, column.name)
            columns[column.name] = None if values is None else values.take(places, axis=0)
        return PointCloud(**columns)

    @staticmethod
    def concatenate(clouds: Sequence[PointCloud]) -> PointCloud:
        """Join clouds in order; keeps the columns that all of them have."""
        columns: dict[str, Any] = {}
        for column in fields(PointCloud):
            parts = [getattr(cloud, column.name) for cloud in clouds]
            columns[column.name] = None if any(part is None for part in parts) else np.concatenate(parts)
        return PointCloud(**columns)

    def transformed(self, T_target_source: FloatArray) -> PointCloud:
        """Return the points after a (4, 4) rigid or similarity transform."""
        linear, translation = T_target_source[:3, :3], T_target_source[:3, 3]
        scale = np.cbrt(np.linalg.det(linear))
        return replace(
            self,
            points_m=self.points_m @ linear.T + translation,
            normals=None if self.normals is None else self.normals @ (linear / scale).T,
            sigma_m=None if self.sigma_m is None else self.sigma_m * scale,
        )


@dataclass(frozen=True, slots=True)
class Link:
    """A registration of two keyframes of a recording, ``source`` and ``target`` by their frame numbers."""

    source: int
    target: int
    T_target_source: FloatArray
    """(4, 4) pose of the source's depth camera in the target's."""
    information: FloatArray
    """(6, 6) inverse covariance of the pose's error, a motion of the source: turn in rad, then shift in m."""
    overlap_share: float
    """Share of the source's points that the target's image can judge."""
    agreeing_share: float
    """Share of the judged points whose depths agree; the smaller of source to target and back."""
    loop: bool = False
    """Whether it closes a loop; else tracking made it."""
    used: bool = True
    """False for a registration that contradicts the others."""

    @property
    def pair(self) -> tuple[int, int]:
        """Source and target."""
        return self.source, self.target


@dataclass(frozen=True, slots=True)
class Walk:
    """A recording after tracking: where its camera was at each frame, and the surface that it measured."""

    times_s: FloatArray
    T_world_camera: tuple[FloatArray | None, ...]
    """Pose of the colour camera at each frame; None where the camera was lost."""
    keyframes: tuple[int, ...]
    links: tuple[Link, ...]
    map: PointCloud
    """Measured points of all frames, with normals and ``sigma_m``, in the world frame."""
    voxel_m: float
    first_frames: IntArray
    """(N,) number of the frame that first measured each point of the map."""
    T_world_tracked: tuple[FloatArray | None, ...]
    """Pose of the colour camera by tracking alone; equal to ``T_world_camera`` at the first keyframe."""
    notes: tuple[str, ...] = ()
    """Assumptions and doubts, one sentence each."""
    resumed_s: float = 0.0
    """Time that interrupted runs had spent on the tracking that this one continued."""
    without_depth: tuple[int, ...] = ()
    """Frames with no depth, or too little to be tracked."""
    apart: tuple[int, ...] = ()
    """Frames without a pose of parts of the recording that were tracked, but not joined to the map."""
    disturbed: tuple[int, ...] = ()
    """Frames with a pose in which something moved: they agree little with the frames before them."""
    state: Path | None = None
    """File with the tracking, from which another run of the recording goes on; ``checkpoint.Checkpoint``
    deletes it. None if none was written, as for short recordings."""


@dataclass(frozen=True, slots=True)
class RegistrationStep:
    """One iteration of any registration method, complete enough to play back or plot."""

    index: int
    """0 for the first matching, made at the start pose."""
    T_target_source: FloatArray
    """(4, 4) pose after this step's update."""
    pairs: IntArray
    """(M, 2) source index, target index, matched at the pose before the update."""
    weights: FloatArray
    """(M,) weight of each pair, summing to one."""
    distances_m: FloatArray
    """(M,) distance of each pair before the update."""
    sigma_m: float
    """Scale of the weight function; NaN for methods without one."""
    gate_m: float
    """Distance beyond which pairs were rejected; infinite for methods without a gate."""
    objective: float
    """Weighted mean square that the update minimised, after the update, in square metres."""
    rmse_m: float
    """Root of the weighted mean squared point distance of the pairs, before the update."""
    mean_distance_m: float
    """Weighted mean point distance of the pairs, before the update (the thesis's error, eq. 3.17)."""
    effective_pairs: float
    """(sum w)^2 / sum w^2."""
    entropy_nat: float
    """Entropy -sum p log p of the matching, in nats; NaN for methods without p."""
    rotation_step_rad: float
    translation_step_m: float


@dataclass(frozen=True, slots=True)
class RegistrationResult(ShownInNotebooks):
    """Final transform and all steps of a registration."""

    T_target_source: FloatArray
    """(4, 4) maps the source cloud onto the target cloud."""
    steps: tuple[RegistrationStep, ...]
    converged: bool
    stop_reason: str
    """``converged``, ``stalled``, ``max_iterations`` or ``degenerate: <why>``."""


@dataclass(frozen=True, slots=True)
class Surface(ShownInNotebooks):
    """A triangle mesh, grown from a point cloud or read from a file."""

    vertices_m: FloatArray
    triangles: IntArray
    """(V, 3) vertices, and (F, 3) int32 rows of them, counter-clockwise seen from outside."""
    colors: ByteArray | None = None
    """(V, 3) RGB."""
    radii_m: tuple[float, ...] = ()
    """Radii of the balls that made it, ascending; empty for a surface made by another method."""
    normals: FloatArray | None = None
    """(V, 3) normals of the points from which the vertices come."""
    source: ByteArray | None = None
    """(V,) ``PointSource`` of those points."""
    rows: IntArray | None = None
    """(V,) int32 rows of those points in the cloud over which the ball rolled; None for other methods."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceResult(Surface):
    """A mesh with its measures."""

    quality: SurfaceQuality

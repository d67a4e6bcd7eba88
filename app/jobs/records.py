"""What the app shows of each stage: pictures, thinned clouds and numbers, small enough to send."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.config import Direction, Method, Metric
from pipeline.types import ByteArray, FloatArray, IntArray, SurfaceQuality


@dataclass(frozen=True, slots=True)
class Sample:
    """A cloud thinned for the screen."""

    points_m: FloatArray
    """(N, 3) float32."""
    colors: ByteArray | None
    """(N, 3) RGB."""
    total: int
    """Points of the cloud it was taken from."""


@dataclass(frozen=True, slots=True)
class Picture:
    """An image for the panel."""

    rgb: ByteArray
    """(H, W, 3)."""
    caption: str


@dataclass(frozen=True, slots=True)
class SceneNode:
    """What one camera node delivers."""

    name: str
    color: Picture
    depth: Picture
    sensor: Sample
    """Camera frame."""
    T_world_camera: FloatArray
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    coverage: float
    """Share of pixels with sensor depth."""
    nearest_m: float
    farthest_m: float


@dataclass(frozen=True, slots=True)
class SceneView:
    """A rig as it was loaded."""

    title: str
    nodes: tuple[SceneNode, ...]
    has_truth: bool


@dataclass(frozen=True, slots=True)
class DepthNode:
    """One node's depth, sensed and inferred."""

    name: str
    sensor_picture: Picture
    inferred_picture: Picture
    difference_picture: Picture
    sensor: Sample
    inferred: Sample
    outliers: Sample
    fused: Sample
    """The sensor's points and those inferred points that fusion lets in."""
    filled: Sample
    """Only the inferred points among the fused ones."""
    alignment_mode: str
    coefficients: dict[str, float]
    residual_rms_m: float
    inlier_share: float
    truth_error_m: float | None
    """Median absolute depth error of the filled pixels, where the truth is known."""
    provider: str
    inference_s: float | None
    """Time of the network on this node's image; None if it had run before."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """All nodes after the depth stage."""

    nodes: tuple[DepthNode, ...]


@dataclass(frozen=True, slots=True)
class RegistrationRow:
    """How one node was placed beside another."""

    source: str
    target: str
    method: str
    iterations: int
    stop_reason: str
    rmse_m: float
    """Of the last matching; NaN if there was none."""
    error_before_m: float | None
    """RMS distance of the source's points from where they truly are, at the believed pose."""
    error_after_m: float | None


@dataclass(frozen=True, slots=True)
class FuseView:
    """Where the nodes stand after registration."""

    believed: tuple[FloatArray, ...]
    """T_world_camera before."""
    registered: tuple[FloatArray, ...]
    """T_world_camera after."""
    rows: tuple[RegistrationRow, ...]


@dataclass(frozen=True, slots=True)
class Race:
    """What is to be compared."""

    source: int = 1
    """Index of the node that moves."""
    target: int = 0
    rivals: tuple[tuple[Method, Metric], ...] = (("icp", "point"), ("ceicp-a", "plane"))
    direction: Direction = "q2p"
    rotation_deg: float = 0.0
    """Disturbance of the believed pose about the source cloud's centre."""
    translation_cm: float = 0.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class RaceStep:
    """What a player shows of one iteration."""

    T_target_source: FloatArray
    """Pose at which the pairs were matched, before the update of this iteration."""
    source_points_m: FloatArray
    """(M, 3) float32, source frame."""
    target_points_m: FloatArray
    """(M, 3) float32, target frame."""
    weights: FloatArray
    """(M,) relative to the largest."""
    rmse_m: float
    point_error_m: float | None
    """Against the truth, at the same pose."""


@dataclass(frozen=True, slots=True)
class RaceLane:
    """One method's way from the start pose to its end."""

    label: str
    steps: tuple[RaceStep, ...]
    """The last step is the end pose, without pairs."""
    stop_reason: str
    iterations: int
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class RaceView:
    """Two methods from the same start."""

    source_name: str
    target_name: str
    source: Sample
    """Source camera frame."""
    target: Sample
    """Target camera frame."""
    T_world_target: FloatArray
    lanes: tuple[RaceLane, ...]


@dataclass(frozen=True, slots=True)
class MeshView:
    """A surface as the browser gets it."""

    glb: bytes
    quality: SurfaceQuality
    rims_m: FloatArray
    """(E, 2, 3) float32 segments of all edges with one triangle only."""
    vertices: int
    triangles: int
    truth: dict[str, float] | None
    """Comparison with the ground truth, where there is one."""


@dataclass(frozen=True, slots=True)
class SpacingView:
    """How far apart the points are that the ball rolls over."""

    r_F_m: float
    sigma_D_m: float
    edges_m: FloatArray
    """(B + 1,) bins of the nearest-neighbour distance."""
    counts: IntArray
    """(B,)."""
    points_before: int
    points_after: int


@dataclass(frozen=True, slots=True)
class SurfaceView:
    """The surfaces before and after fusion; while they are computed, only what is there so far."""

    spacing: SpacingView
    radii_m: tuple[float, ...]
    after: MeshView
    before: MeshView | None
    elapsed_s: float
    """From the clouds to the surface after fusion."""


def sample(
    points_m: FloatArray, colors: ByteArray | None, most: int, rng: np.random.Generator | None = None
) -> Sample:
    """At most ``most`` points of a cloud, drawn evenly without replacement."""
    total = len(points_m)
    if total > most:
        rng = rng or np.random.default_rng(0)
        rows = np.sort(rng.choice(total, most, replace=False))
        points_m, colors = points_m[rows], None if colors is None else colors[rows]
    return Sample(points_m.astype(np.float32), colors, total)

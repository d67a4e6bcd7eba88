"""What the app shows of each stage: pictures, thinned clouds and numbers, small enough to send."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from pipeline.config import Direction, Method, Metric
from pipeline.types import ByteArray, FloatArray, IntArray, SurfaceQuality

Coloring = Literal["color", "source", "distance", "normal"]
"""What the colours of a surface mean."""
RaceMode = Literal["nodes", "inferred"]
"""nodes: one node's sensor cloud onto another's; inferred: a node's inferred cloud onto its sensor cloud."""
Rival: TypeAlias = tuple[Method, Metric]
Vector: TypeAlias = tuple[float, float, float]


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
class ColorBar:
    """What the colours of a picture mean."""

    stops: tuple[tuple[int, int, int], ...]
    """RGB at equal steps from the first label to the last."""
    labels: tuple[str, ...]
    """With units, at equal steps along the bar."""


@dataclass(frozen=True, slots=True)
class Picture:
    """An image for the panel."""

    rgb: ByteArray
    """(H, W, 3)."""
    caption: str
    bar: ColorBar | None = None
    """None for a photograph."""


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
class ResidualView:
    """Aligned minus sensor depth over the pixels where both are known."""

    edges_m: FloatArray
    """(B + 1,) bins, symmetric about zero."""
    counts: IntArray
    """(B,) pixels; the outer bins also hold those beyond them."""
    median_m: float
    """This and the RMS: NaN if no pixel is shared."""
    rms_m: float


@dataclass(frozen=True, slots=True)
class JudgedView:
    """What is believed of the aligned depth; shares of its pixels where the sensor is blind."""

    kept_share: float
    """This and the two below: NaN if the sensor is blind nowhere."""
    flying_share: float
    out_of_reach_share: float


@dataclass(frozen=True, slots=True)
class DepthNode:
    """One node's depth, sensed and inferred."""

    name: str
    pictures: dict[str, Picture]
    """By ``app.screens.depth.view.PictureName``, all of one size."""
    sensor: Sample
    inferred: Sample
    outliers: Sample
    fused: Sample
    """The sensor's points and those inferred points that fusion lets in."""
    filled: Sample
    """Only the inferred points among the fused ones."""
    inferred_confidence: ByteArray
    """(N, 3) RGB of the points of ``inferred`` by their confidence."""
    filled_confidence: ByteArray
    """(N, 3) RGB of the points of ``filled`` by theirs."""
    alignment_mode: str
    disparity: bool
    """Whether the network gives 1/depth."""
    coefficients: dict[str, float]
    residuals: ResidualView
    inlier_share: float
    judged: JudgedView
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
    loop_error_m: float
    """How far it is from what the other registrations say about these two nodes; NaN where nothing."""
    used: bool
    """False if it degenerated or contradicts the other registrations."""


@dataclass(frozen=True, slots=True)
class FuseView:
    """Where the nodes stand after registration."""

    believed: tuple[FloatArray, ...]
    """T_world_camera before."""
    registered: tuple[FloatArray, ...]
    """T_world_camera after."""
    rows: tuple[RegistrationRow, ...]


@dataclass(frozen=True, slots=True)
class Start:
    """How far from aligned a cloud starts: turned about its centre, then shifted, along the target's axes."""

    turn_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector."""
    shift_cm: Vector = (0.0, 0.0, 0.0)

    @staticmethod
    def towards(turn_deg: float, shift_cm: float, seed: int) -> Start:
        """So far in directions that the seed draws; rounded as the panel shows it."""
        directions = np.random.default_rng(seed).normal(size=(2, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        turn, shift = (directions * [[turn_deg], [shift_cm]]).round(2).tolist()
        return Start(tuple(turn), tuple(shift))


@dataclass(frozen=True, slots=True)
class Race:
    """What is to be compared: who moves onto whom, from where, and with what done to the moving cloud."""

    mode: RaceMode = "nodes"
    source: int = 1
    """Index of the node that moves, or whose inferred cloud moves."""
    target: int = 0
    """Index of the node that stays; a node's inferred cloud moves onto its own sensor cloud."""
    rivals: tuple[Rival, ...] = (("icp", "point"), ("ceicp-a", "plane"))
    direction: Direction = "q2p"
    start: Start = Start()
    noise_m: float = 0.0
    """This and the shares below: see ``pipeline.registration.degradation.Degradation``."""
    outlier_share: float = 0.0
    hole_share: float = 0.0
    crop_share: float = 0.0
    depth_bias: float = 0.0
    seed: int = 0
    """Of what is done to the moving cloud."""


@dataclass(frozen=True, slots=True)
class PairHistogram:
    """The pairs of one matching by their distance."""

    counts: IntArray
    """(B,) kept pairs in each bin; the last bin also holds those beyond it."""
    weights: FloatArray
    """(B,) mean weight of a pair in each bin over the largest of them; NaN in empty bins."""
    sigma_m: float
    """Scale of the kernel f; NaN for methods without one."""


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
    time_s: float
    """From the start of the method, its preparation included, until it reached this pose."""
    rmse_m: float
    entropy_nat: float
    """NaN for methods without one."""
    point_error_m: float | None
    """Against the truth, at the same pose."""
    histogram: PairHistogram


@dataclass(frozen=True, slots=True)
class RaceLane:
    """One method's way from the start pose to its end."""

    label: str
    kernel: bool
    """Whether its weights come from the Gaussian kernel f of the pair distance."""
    steps: tuple[RaceStep, ...]
    """The last step is the end pose, without pairs and with the numbers of the last matching."""
    stop_reason: str
    iterations: int
    elapsed_s: float
    average_hausdorff_m: float
    """Between the moved source and the target, at the end."""
    effective_pairs: float
    """Of the last matching."""


@dataclass(frozen=True, slots=True)
class RaceView:
    """Up to four methods from the same start."""

    source_name: str
    target_name: str
    source: Sample
    """Source camera frame."""
    target: Sample
    """Target camera frame."""
    T_world_target: FloatArray
    center_m: FloatArray
    """(3,) centre of the aligned source in the target's frame; the start turns about it."""
    edges_m: FloatArray
    """(B + 1,) bins of all histograms."""
    lanes: tuple[RaceLane, ...]

    @property
    def has_truth(self) -> bool:
        """Whether the distance from the truth is known."""
        return self.lanes[0].steps[0].point_error_m is not None


@dataclass(frozen=True, slots=True)
class CaptureView:
    """From which starts the methods of a race arrive."""

    labels: tuple[str, ...]
    errors_m: FloatArray
    """(lanes, rotations, translations) distance from the truth at the end."""


CAPTURE_TURNS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0)
CAPTURE_SHIFTS_M = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Start errors of a capture-range map (SPEC 4.7)."""
SUCCESS_M = 0.02
"""A registration that ends closer to the truth than this has succeeded (SPEC 4.7)."""


Which = Literal["after", "before"]
"""Fusion."""
Shown = Literal["after", "before", "poisson", "alpha"]
"""A surface that can be drawn: the ball's, or a baseline's."""


@dataclass(frozen=True, slots=True)
class MeshView:
    """A surface as the browser gets it."""

    glb: bytes
    quality: SurfaceQuality
    rims_glb: bytes
    """All edges with one triangle only, as lines; empty without any."""
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


QUICK_POINTS = 20_000
"""Of a quick look, where the browser draws fast enough."""


@dataclass(frozen=True, slots=True)
class PaintRequest:
    """Surfaces to draw in certain colours; with a radius, a quick look while the ball is being chosen."""

    which: tuple[Which, ...]
    coloring: Coloring
    radius_m: float | None = None
    """None takes the surfaces of the settings as they are."""
    most_points: int = QUICK_POINTS
    """A larger cloud is thinned to about so many for a quick look."""


@dataclass(frozen=True, slots=True)
class PaintedMesh:
    """One surface to draw."""

    glb: bytes
    rims_glb: bytes
    vertices: int
    triangles: int


@dataclass(frozen=True, slots=True)
class PaintedView:
    """The answer to a ``PaintRequest``."""

    request: PaintRequest
    meshes: dict[Which, PaintedMesh]
    points: int
    """That the ball rolled over, of the cloud after fusion or, if that is not shown, before."""
    all_points: int
    """Of the whole cloud."""
    roll_s: float
    """The ball alone."""


SCREEN_POINTS = 60_000
"""Points of all nodes together that are sent to the screen for one kind of cloud."""


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

"""What the Fuse screen gets of the nodes' places, of a race and of its capture range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from app.compute.records import Sample
from pipeline.config import Direction, Method, Metric
from pipeline.types import ByteArray, FloatArray, IntArray

RaceMode = Literal["nodes", "inferred"]
"""nodes: one node's sensor cloud onto another's; inferred: a node's inferred cloud onto its sensor cloud."""

Reference: TypeAlias = Literal["truth", "pixels", "cloud"]
"""From what a race measures how far off it is: where the points truly are; where the pixels are that they
were inferred at, which needs no truth; or, where neither is known, the nearest points of the other cloud."""

Rival: TypeAlias = tuple[Method, Metric]

Vector: TypeAlias = tuple[float, float, float]


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
    """False if it degenerated or contradicts the other registrations or what both measured."""


@dataclass(frozen=True, slots=True)
class FuseView:
    """Where the nodes stand after registration."""

    believed: tuple[FloatArray, ...]
    """T_world_camera before."""
    registered: tuple[FloatArray, ...]
    """T_world_camera after."""
    rows: tuple[RegistrationRow, ...]
    agreement_share: float
    """Of what two placed cameras both measured, the share within 2 %; NaN where no two did."""
    sentences: tuple[str, ...]
    """What is to be said of nodes that found no place, or one that little speaks for."""


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
    rivals: tuple[Rival, ...] = (("icp", "point"), ("ceicp-a", "point"))
    """By default two that differ in their weights only, not in their metric."""
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
    """RMS distance of the points from where they belong, at the same pose; None if no place is known."""
    gap_m: float
    """Median distance of the drawn points from the nearest of the target; NaN where their place is known."""
    shades: ByteArray
    """(N,) distance of each drawn point from where it belongs, or from the nearest point of the target where
    that is not known: 0 to 255 for none to ``MOST_DISTANCE_M`` and beyond."""
    lens: ByteArray
    """(M, 3) column, row and shade of the points in the magnified corner, placed as in ``LensView``."""
    histogram: PairHistogram

    @property
    def off_m(self) -> float:
        """How far off it is: from where it belongs, or else from the other cloud."""
        return self.gap_m if self.point_error_m is None else self.point_error_m


@dataclass(frozen=True, slots=True)
class RaceLane:
    """One method's way from the start pose to its end."""

    rival: Rival
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
class LensView:
    """A corner that is shown magnified."""

    center_m: FloatArray
    """(3,) target frame."""
    window_m: float
    """Width and height of what is seen."""
    target: ByteArray
    """(K, 2) column and row of the target's points, 0 to 255 across the window."""


@dataclass(frozen=True, slots=True)
class RaceView:
    """Up to four methods from the same start."""

    source: Sample
    """Source camera frame."""
    target: Sample
    """Target camera frame."""
    T_world_target: FloatArray
    center_m: FloatArray
    """(3,) centre of the aligned source in the target's frame; the start turns about it."""
    edges_m: FloatArray
    """(B + 1,) bins of all histograms."""
    lens: LensView | None
    """None where the clouds share no corner."""
    reference: Reference
    lanes: tuple[RaceLane, ...]


@dataclass(frozen=True, slots=True)
class CaptureView:
    """From which starts the methods of a race arrive."""

    labels: tuple[str, ...]
    errors_m: FloatArray
    """(lanes, rotations, translations) distance from where the cloud belongs, at the end."""


CAPTURE_TURNS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0)

CAPTURE_SHIFTS_M = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Start errors of a capture-range map (SPEC 4.7)."""

OFF_DIGITS = 2
"""Behind the point of a distance in centimetres: tenths of a millimetre, wherever it stands."""

SUCCESS_M = 0.02
"""A registration that ends closer to where it belongs than this has succeeded (SPEC 4.7)."""

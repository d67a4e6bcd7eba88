"""Results for the Fuse screen: the nodes' poses, a race and its capture range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from app.compute.records import Sample
from pipeline.config import Direction, Method, Metric
from pipeline.types import ByteArray, FloatArray, IntArray

RaceMode = Literal["nodes", "inferred", "corridor", "square", "mirrored"]
"""nodes: one node's sensor cloud onto another's; inferred: a node's inferred cloud onto its sensor cloud;
otherwise two scans of a synthetic room (``rooms.py``)."""

OF_NODES: tuple[RaceMode, ...] = ("nodes", "inferred")
"""The modes that race a scene's nodes."""

Reference: TypeAlias = Literal["truth", "pixels", "walk", "cloud"]
"""Reference of a race's errors: the points' true positions; the measured points of their own pixels, which
need no ground truth; the poses that a recording's whole walk gives; or, if all are unknown, the nearest
points of the other cloud."""

Rival: TypeAlias = tuple[Method, Metric]

Vector: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RegistrationRow:
    """The registration of one node to another."""

    source: str
    target: str
    method: str
    iterations: int
    stop_reason: str
    rmse_m: float
    """RMSE of the last matching; NaN if there was none."""
    error_before_m: float | None
    """RMS distance of the source's points from their true positions, at the believed pose; None without
    ground truth."""
    error_after_m: float | None
    loop_error_m: float
    """RMS distance of the points from where the other registrations put them; NaN if these imply no pose."""
    used: bool
    """False if it degenerated or contradicts the other registrations or the common measurements."""


@dataclass(frozen=True, slots=True)
class FuseView:
    """The nodes' poses after registration."""

    believed: tuple[FloatArray, ...]
    """T_world_camera before registration."""
    registered: tuple[FloatArray, ...]
    """T_world_camera after registration."""
    rows: tuple[RegistrationRow, ...]
    agreement_share: float
    """Share of the depths measured by two placed cameras that agree within 2 %; NaN if there are none."""
    sentences: tuple[str, ...]
    """Sentences on nodes that found no pose or have an uncertain one."""


@dataclass(frozen=True, slots=True)
class Start:
    """A start error: a rotation about the source's centre, then a shift, along the target's axes."""

    turn_deg: Vector = (0.0, 0.0, 0.0)
    """Rotation vector."""
    shift_cm: Vector = (0.0, 0.0, 0.0)

    @staticmethod
    def towards(turn_deg: float, shift_cm: float, seed: int) -> Start:
        """Return a start of this size in random directions; rounded as the panel shows it."""
        directions = np.random.default_rng(seed).normal(size=(2, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        turn, shift = (directions * [[turn_deg], [shift_cm]]).round(2).tolist()
        return Start(tuple(turn), tuple(shift))


@dataclass(frozen=True, slots=True)
class Race:
    """The settings of a race: the two clouds, the methods, the start and the source's degradation."""

    mode: RaceMode = "nodes"
    source: int = 1
    """Index of the source node, which moves, or whose inferred cloud moves."""
    target: int = 0
    """Index of the target node, which stays; an inferred cloud's target is its own sensor cloud."""
    rivals: tuple[Rival, ...] = (("icp", "point"), ("ceicp-a", "point"))
    """By default two methods that differ in their weights only, not in their metric."""
    direction: Direction = "q2p"
    start: Start = Start()
    noise_m: float = 0.0
    """This and the shares below: see ``pipeline.registration.degradation.Degradation``."""
    outlier_share: float = 0.0
    hole_share: float = 0.0
    crop_share: float = 0.0
    depth_bias: float = 0.0
    seed: int = 0
    """Seed of the degradation."""

    @property
    def degrades_room(self) -> bool:
        """Whether it degrades a scan of a synthetic room, which is not possible: the scanner stood inside."""
        worse = (self.noise_m, self.outlier_share, self.hole_share, self.crop_share, self.depth_bias)
        return self.mode not in OF_NODES and any(worse)


REACH_M = 0.5
"""Largest distance to the nearest target point; a point that is farther away gets this distance."""


@dataclass(frozen=True, slots=True)
class PairHistogram:
    """The pairs of one matching by their distance."""

    counts: IntArray
    """(B,) kept pairs in each bin; the last bin also holds those beyond it."""
    weights: FloatArray
    """(B,) mean weight of a pair in each bin over the largest of them; NaN in empty bins."""
    sigma_m: float
    """Scale of the weight function, for f its standard deviation; NaN for methods without one."""


@dataclass(frozen=True, slots=True)
class RaceStep:
    """One iteration as a player shows it."""

    T_target_source: FloatArray
    """(4, 4) pose at which the pairs were matched, before this iteration's update."""
    source_points_m: FloatArray
    """(M, 3) float32, source frame."""
    target_points_m: FloatArray
    """(M, 3) float32, target frame."""
    weights: FloatArray
    """(M,) weights of the pairs, divided by the largest of all weights."""
    time_s: float
    """Run time of the method, its preparation included, until it reached this pose."""
    rmse_m: float
    entropy_nat: float
    """Entropy; NaN for methods without one."""
    point_error_m: float | None
    """RMS distance of the points from their reference positions at this pose; None if these are unknown."""
    gap_m: float
    """Median distance of the drawn points from the nearest target point, at most ``REACH_M``; NaN if an error
    is known."""
    shades: ByteArray
    """(N,) each drawn point's distance from its reference position or, if unknown, the target's nearest
    point: 0 to 255 for zero to ``MOST_DISTANCE_M`` and beyond."""
    lens: ByteArray
    """(M, 3) column, row and shade of the points in the magnified corner (``LensView``); M = 0 if none."""
    histogram: PairHistogram

    @property
    def off_m(self) -> float:
        """Error: distance from the reference position, or else from the other cloud."""
        return self.gap_m if self.point_error_m is None else self.point_error_m

    @property
    def out_of_reach(self) -> bool:
        """Whether the error is known only to be at least ``REACH_M``."""
        return self.point_error_m is None and self.gap_m >= REACH_M


@dataclass(frozen=True, slots=True)
class RaceLane:
    """One method's steps from the start pose to its end."""

    rival: Rival
    label: str
    kernel: bool
    """Whether a pair weighs -p log p, with p from the Gaussian kernel f of its distance."""
    steps: tuple[RaceStep, ...]
    """The steps; the last is the end pose, without pairs and with the numbers of the last matching."""
    stop_reason: str
    iterations: int
    elapsed_s: float
    average_hausdorff_m: float
    """Average Hausdorff distance between the moved source and the target, at the end."""
    effective_pairs: float
    """Effective number of pairs in the last matching."""
    verdict: Literal["sure", "doubtful", "none"]
    """Whether to believe the end pose, judged without the truth (SPEC 4.12)."""
    reasons: tuple[str, ...]
    """Why it is not sure; empty if it is."""

    @property
    def offs_cm(self) -> FloatArray:
        """(K,) error of every step, centimetres; NaN if it is out of reach or unknown."""
        return np.array([np.nan if step.out_of_reach else 100.0 * step.off_m for step in self.steps])

    @property
    def verdict_text(self) -> str:
        """The verdict with its reasons."""
        return f"{self.verdict}: {'; '.join(self.reasons)}" if self.reasons else self.verdict


@dataclass(frozen=True, slots=True)
class LensView:
    """A corner that is shown magnified."""

    center_m: FloatArray
    """(3,) middle of the corner in the target frame."""
    window_m: float
    """Width and height of the view."""
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
    """(4, 4) pose of the target."""
    center_m: FloatArray
    """(3,) centre of the aligned source in the target's frame; the start turns about it."""
    edges_m: FloatArray
    """(B + 1,) edges of the bins of all histograms."""
    lens: LensView | None
    """The magnified corner; None if the clouds share no corner."""
    reference: Reference
    lanes: tuple[RaceLane, ...]


@dataclass(frozen=True, slots=True)
class CaptureView:
    """The capture range: the final errors of a race's methods by their start."""

    labels: tuple[str, ...]
    errors_m: FloatArray
    """(lanes, rotations, translations) final distance from the reference position."""


CAPTURE_TURNS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0)

CAPTURE_SHIFTS_M = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Start errors of a capture-range map (SPEC 4.7)."""

OFF_DIGITS = 2
"""Decimals of a distance in centimetres: tenths of a millimetre everywhere."""

SUCCESS_M = 0.02
"""A registration that ends closer to the reference position than this has succeeded (SPEC 4.7)."""

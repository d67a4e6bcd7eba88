"""Results as the app shows them: pictures, thinned clouds and numbers, small enough to send to a browser."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from pipeline.quality import SurfaceQuality
from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Sample:
    """A point cloud thinned for display."""

    points_m: FloatArray
    """(N, 3) float32."""
    colors: ByteArray | None
    """(N, 3) RGB."""
    total: int
    """Number of points in the full cloud."""
    spacing: float | None = field(default=None, kw_only=True)
    """Distance between neighbours over their depth, for the points of a grid of pixels; else None."""


@dataclass(frozen=True, slots=True)
class ColorBar:
    """The colour scale of a picture."""

    stops: tuple[tuple[int, int, int], ...]
    """RGB at equal steps from the first label to the last."""
    labels: tuple[str, ...]
    """Labels with units, at equal steps along the bar."""


@dataclass(frozen=True, slots=True)
class Picture:
    """An image for the panel."""

    rgb: ByteArray
    """(H, W, 3)."""
    caption: str
    bar: ColorBar | None = None
    """The colour scale; None for a photograph."""


@dataclass(frozen=True, slots=True)
class SceneNode:
    """The images, cloud and camera of one node."""

    name: str
    color: Picture
    depth: Picture
    sensor: Sample
    """Sensor points in the camera frame."""
    T_world_camera: FloatArray
    """(4, 4) pose of the camera."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    coverage: float
    """Share of pixels with sensor depth."""
    nearest_m: float
    farthest_m: float


@dataclass(frozen=True, slots=True)
class AveragedView:
    """Depth of cameras at rest, averaged over the frames of their recordings."""

    frames: int
    """Number of frames that were averaged; for several cameras the largest."""
    available: int
    """Number of frames that could be averaged; for several cameras the largest."""
    unmeasured_share: float
    """Share of the pixels without depth."""
    moving_share: float
    """Share of the pixels that moved, which have no depth."""
    flickering_share: float
    """Share of the pixels that few of the frames measured."""
    median_sd_m: float
    """Median standard deviation of the depth."""


@dataclass(frozen=True, slots=True)
class Stage:
    """The viewpoint for a scene, and the place for a second scene next to it."""

    viewpoint_m: FloatArray
    """(3,), as all vectors here; world frame."""
    middle_m: FloatArray
    """Look-at point."""
    right: FloatArray
    """Horizontal unit vector to the right of the picture."""
    width_m: float
    """Extent of the scene along ``right``."""
    top_m: FloatArray
    """Position of a label above the scene."""


@dataclass(frozen=True, slots=True)
class SceneView:
    """A loaded rig."""

    title: str
    nodes: tuple[SceneNode, ...]
    has_truth: bool
    notes: tuple[str, ...]
    """Doubts about the images of the rig, one sentence each."""
    stage: Stage
    """The viewpoint from which to look at it."""
    has_walk: bool = False
    """Whether its nodes are keyframes of a recording."""
    averaged: AveragedView | None = None
    """Average of the frames, if its cameras are at rest; None for single images."""


@dataclass(frozen=True, slots=True)
class ResidualView:
    """Aligned minus sensor depth over the pixels where both are known."""

    edges_m: FloatArray
    """(B + 1,) bin edges, symmetric about zero."""
    counts: IntArray
    """(B,) pixel counts; the outer bins also count the values outside the range."""
    median_m: float
    """Median residual. It and the RMS are NaN if no pixel is shared."""
    rms_m: float


@dataclass(frozen=True, slots=True)
class JudgedView:
    """Confidence in the aligned depth: shares of the pixels where the sensor has no depth."""

    kept_share: float
    """Share of pixels that are kept. It and the two shares below are NaN if the sensor has no holes."""
    flying_share: float
    out_of_reach_share: float


@dataclass(frozen=True, slots=True)
class DepthNode:
    """Sensor depth and inferred depth of one node; points are in the camera frame."""

    name: str
    T_world_camera: FloatArray
    """(4, 4) pose that the rig gives the camera."""
    pictures: dict[str, Picture]
    """Pictures by ``app.screens.depth.view.PictureName``, all of one size."""
    sensor: Sample
    inferred: Sample
    outliers: Sample
    fused: Sample
    """The sensor's points and the inferred points that fusion accepts."""
    filled: Sample
    """The inferred points among the fused ones."""
    inferred_confidence: ByteArray
    """(N, 3) RGB: confidence colours of the points of ``inferred``."""
    filled_confidence: ByteArray
    """(N, 3) RGB: confidence colours of the points of ``filled``."""
    alignment_mode: str
    disparity: bool
    """Whether the network predicts 1/depth."""
    coefficients: dict[str, float]
    residuals: ResidualView
    inlier_share: float
    judged: JudgedView
    truth_error_m: float | None
    """Median absolute depth error of the filled pixels, metres; None without ground truth."""
    network: str
    """File of the depth network, whose input is the colour image only."""
    completion: str
    """File of the network that fills holes from colour and depth; empty if the depth network fills them."""
    provider: str
    """The execution provider that ran the depth network."""
    inference_s: float | None
    """Run time of the depth network on this node's image; None if its output was already stored."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """The depth stage's result for all nodes."""

    nodes: tuple[DepthNode, ...]


Shown = Literal["after", "before", "poisson", "alpha"]
"""A surface that can be drawn: the ball pivoting mesh, or a baseline's."""


@dataclass(frozen=True, slots=True)
class MeshView:
    """A surface as it is sent to the browser."""

    glb: bytes
    quality: SurfaceQuality
    rims_glb: bytes
    """All boundary edges (those with one triangle) as lines; empty if there are none."""
    vertices: int
    triangles: int
    truth: dict[str, float] | None
    """Comparison with the ground truth; None without ground truth."""


SCREEN_POINTS = 60_000
"""Most points of one kind of cloud, over all nodes, that are sent to a browser."""
SENSOR_POINTS = 250_000
"""Most points of all sensors together that are sent to a browser."""


def sample(
    points_m: FloatArray, colors: ByteArray | None, most: int, rng: np.random.Generator | None = None
) -> Sample:
    """Return at most ``most`` of a cloud's (N, 3) points, drawn uniformly without replacement.

    Args:
        points_m: the points, metres.
        colors: (N, 3) RGB; None without colours.
        most: largest number of points.
        rng: random numbers; None draws the same points each time.
    """
    total = len(points_m)
    if total > most:
        rows = drawn_rows(total, most, rng)
        points_m, colors = points_m[rows], None if colors is None else colors[rows]
    return Sample(points_m.astype(np.float32), colors, total)


def drawn_rows(total: int, most: int, rng: np.random.Generator | None = None) -> IntArray:
    """Return the (N,) ascending rows that ``sample`` keeps of a cloud of ``total`` points."""
    if total <= most:
        return np.arange(total)
    return np.sort((rng or np.random.default_rng(0)).choice(total, most, replace=False))


def grid_step(total: int) -> int:
    """Return the step in columns and rows at which about ``SENSOR_POINTS`` of the pixels remain, or fewer."""
    return max(1, math.ceil(math.sqrt(total / SENSOR_POINTS)))


def on_grid(pixels: IntArray, step: int) -> BoolArray:
    """Return (N,) whether (N, 2) pixels are on the grid with this step."""
    found: BoolArray = (pixels % step == 0).all(axis=1)
    return found

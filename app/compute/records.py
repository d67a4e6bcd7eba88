"""What the app shows of each stage: pictures, thinned clouds and numbers, small enough to send."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

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
    notes: tuple[str, ...]
    """What is doubtful about its images, a sentence each."""


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
    network: str
    """File of the depth network, which sees the colours alone."""
    completion: str
    """File of the network that fills the holes from colours and depth; empty where the other one does."""
    provider: str
    """The execution provider that ran the depth network."""
    inference_s: float | None
    """Time of that network on this node's image; None if it had run before."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """All nodes after the depth stage."""

    nodes: tuple[DepthNode, ...]


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

"""Evidence for and against a pose of two clouds: points on the other's surface, and points in its free space.

A mean over all points of both clouds rewards overlap: half a room slid onto the other half fits "better" than
at its place. Here only those points count that the other cloud can judge, and their number is reported
separately.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import apply
from pipeline.registration.finding.surface import Judgement, Surface
from pipeline.registration.observability import open_motions, stiffness, weakest_motion
from pipeline.types import FloatArray

CLEARLY, CLEARLY_MORE = 2.0, 0.005
"""A pose is clearly better if the other's ``against_share`` exceeds this multiple of its own plus this."""
POINTS_OF_PATCH = 50.0
"""Number of points that count as one observation, since neighbouring points err together."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of two clouds for and against a pose."""

    judged: tuple[int, int]
    """Numbers of points of the source and of the target that the other cloud can judge."""
    asked: tuple[int, int]
    """Numbers of points that were compared."""
    on: int
    """Judged points of both that lie on the other's surface, within the noise."""
    through: int
    """Judged points of both that lie where the other's camera saw through; 0 without a viewpoint."""
    refutable: bool
    """Whether a viewpoint is known, so that free space could refute the pose."""
    one_side_share: float
    """Share of the points on the surface that have both clouds' middles on one side of it; small for two
    rooms back to back, which see one wall from opposite sides. 1 with a viewpoint: free space decides."""
    height_ratio: float
    """Root mean square distance of the points on the surface from its tangent planes, over the noise;
    infinite without points."""
    stiffness: float
    """How well the points on the surface hold their least held motion (``observability.stiffness``)."""
    open_motions: str
    """Motions that they leave open, in words; empty if none."""
    color_correlation: float
    """Correlation of the colours of these points with those of their nearest points in the other cloud, -1 to
    1; NaN without colours, without points and if all have one colour."""

    @property
    def overlap_share(self) -> float:
        """Larger one of the two clouds' shares of judged points: 1 if one cloud is a part of the other."""
        return max(judged / max(1, asked) for judged, asked in zip(self.judged, self.asked, strict=True))

    @property
    def on_share(self) -> float:
        """Share of the judged points that lie on the other's surface, within the noise; 0 without any."""
        return self.on / max(1, sum(self.judged))

    @property
    def against_share(self) -> float:
        """Share of the judged points that speak against the pose; 1 without any."""
        return 1.0 - self.on_share

    def clearly_better(self, other: Evidence) -> bool:
        """Return whether clearly less speaks against this pose than against another one."""
        return CLEARLY * self.against_share + CLEARLY_MORE < other.against_share

    @property
    def score(self) -> float:
        """Lower bound of the share on the surface, by which poses are ranked: few judged points prove little.

        It is Wilson's, one standard error wide; ``POINTS_OF_PATCH`` points are one observation.
        """
        count = max(1.0, sum(self.judged) / POINTS_OF_PATCH)
        share, square = self.on_share, 1.0 / count
        width = math.sqrt((share * (1.0 - share) + 0.25 * square) / count)
        return (share + 0.5 * square - width) / (1.0 + square)

    @property
    def through_share(self) -> float:
        """Share of the judged points in the other's free space."""
        return self.through / max(1, sum(self.judged))


@dataclass(frozen=True, slots=True)
class Judge:
    """Collects the evidence of two clouds at any pose; the clouds are prepared once."""

    source: Surface
    target: Surface

    def __call__(self, T_target_source: FloatArray) -> Evidence:
        """Return the evidence at a (4, 4) pose, rigid or with a scale."""
        there, back = self._judgements(T_target_source)
        heights = np.concatenate([there.heights[there.on], back.heights[back.on]])
        places_m, normals = self._overlap(there, back, T_target_source)
        return Evidence(
            judged=(int(there.judged.sum()), int(back.judged.sum())),
            asked=(len(there.judged), len(back.judged)),
            on=len(heights),
            through=int(there.through.sum() + back.through.sum()),
            refutable=self._refutable,
            one_side_share=self._one_side_share(places_m, normals, T_target_source),
            height_ratio=float(np.sqrt(np.mean(heights**2))) if len(heights) else float("inf"),
            stiffness=stiffness(places_m, normals),
            open_motions=open_motions(places_m, normals) if len(heights) else "any motion",
            color_correlation=self._color_correlation(there, back),
        )

    def both_sides(self, T_target_source: FloatArray, length_m: float) -> tuple[FloatArray, FloatArray]:
        """Return both (4, 4) poses ``length_m`` from a pose along the motion that the surfaces hold least."""
        surface = self._overlap(*self._judgements(T_target_source), T_target_source)
        ahead, behind = (weakest_motion(*surface, way_m) for way_m in (length_m, -length_m))
        return ahead @ T_target_source, behind @ T_target_source

    def _judgements(self, T: FloatArray) -> tuple[Judgement, Judgement]:
        """Return the target's judgement of the source's points, and the source's of the target's."""
        return self.target.judge(self.source, T), self.source.judge(self.target, np.linalg.inv(T))

    def _overlap(self, there: Judgement, back: Judgement, T: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places and unit normals, in the target frame, of the points on the other's surface."""
        moving, fixed = self.source.asked[there.on], self.target.asked[back.on]
        turned = self.source.normals[moving] @ T[:3, :3].T
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        places_m = apply(T, self.source.points_m[moving]), self.target.points_m[fixed]
        return np.concatenate(places_m), np.concatenate([turned, self.target.normals[fixed]])

    def _one_side_share(self, places_m: FloatArray, normals: FloatArray, T: FloatArray) -> float:
        """Return the share of (N, 3) places, with their normals, that have both middles on one side."""
        if self._refutable or not len(places_m):
            return 1.0
        middles_m = apply(T, self.source.middle_m[None])[0], self.target.middle_m
        sides = [np.einsum("ni,ni->n", middle_m - places_m, normals) > 0.0 for middle_m in middles_m]
        return float(np.mean(sides[0] == sides[1]))

    @property
    def _refutable(self) -> bool:
        return self.source.view is not None or self.target.view is not None

    def _color_correlation(self, there: Judgement, back: Judgement) -> float:
        """Return the correlation of the colours of points on the other's surface and of their nearest."""
        if self.source.colors is None or self.target.colors is None:
            return float("nan")
        moving = [self.source.colors[self.source.asked[there.on]], self.source.colors[back.nearest[back.on]]]
        fixed = [self.target.colors[there.nearest[there.on]], self.target.colors[self.target.asked[back.on]]]
        a, b = np.concatenate(moving), np.concatenate(fixed)
        if not len(a):
            return float("nan")
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        size = np.sqrt(np.sum(a**2) * np.sum(b**2))
        return float(np.sum(a * b) / size) if size > 0.0 else float("nan")

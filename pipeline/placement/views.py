"""Surfaces and colour features of nodes, for the search for their poses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache

from pipeline.acquisition import back_project
from pipeline.registration.colour import LiftedFeatures, lifted_features, match_score
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.starts import Start, by_colour, by_surfaces
from pipeline.registration.finding.surface import Surface
from pipeline.types import FloatArray, PointCloud, RgbdFrame

KEPT_SURFACES = 32
"""Number of surfaces kept for further pairs, those used last; each takes 8 MB, and 0.14 s to prepare."""


class Views:
    """Surfaces and colour features of the nodes, prepared at first use.

    The surfaces are those of the depth as it was measured. The error of averaged depth is larger than the
    noise between neighbouring points, which the verdict takes for the error.
    """

    def __init__(self, frames: Sequence[RgbdFrame], seed: int) -> None:
        """Keep the frames; nothing is computed yet."""
        self._frames, self._seed = frames, seed
        self.surface = lru_cache(KEPT_SURFACES)(self._surface)
        self.features = lru_cache(None)(self._features)

    def _surface(self, node: int) -> Surface:
        frame = self._frames[node]
        return Surface(back_project(frame), self._seed, from_camera=True, name=frame.name)

    def _features(self, node: int) -> LiftedFeatures:
        return lifted_features(self._frames[node])

    def judge(self, source: int, target: int) -> Judge:
        """Return the judge of relative poses of two nodes.

        Raises:
            InputError: one has fewer than three points with depth.
        """
        return Judge(self.surface(source), self.surface(target))

    def cloud(self, node: int) -> PointCloud:
        """Return the points of a node's surface, with their normals."""
        surface = self.surface(node)
        return PointCloud(surface.points_m, normals=surface.normals)

    def likeness(self, one: int, other: int) -> float:
        """Return about how many features two nodes' colour images have in common."""
        return match_score(self.features(one), self.features(other))

    def by_colour(self, source: int, target: int) -> Start:
        """Return the start that two nodes' colour images give."""
        return by_colour(self.features(source), self.features(target))

    def by_surfaces(self, source: int, target: int) -> Start:
        """Return the starts that features of two nodes' surfaces give."""

        def poses() -> Iterable[FloatArray]:
            return by_surfaces(self.cloud(source), self.cloud(target), from_cameras=True).poses()

        return Start("surfaces", poses)

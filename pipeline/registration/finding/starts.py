"""Ways to find start poses, and the gates that suit them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from packetmesh.errors import ReconstructionError
from pipeline.registration.colour import LiftedFeatures, colour_start
from pipeline.registration.finding.candidates import QUICK_POINTS
from pipeline.registration.global_start import (
    START_VOXELS,
    default_voxel_m,
    global_starts,
    sampled_starts,
    without_viewpoint,
)
from pipeline.registration.neighbourhood import median_spacing_m
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud

Way = Literal["given", "colour", "surfaces"]
"""Where a start pose comes from: the user, features of the colour images, features of the surfaces."""

GIVEN_VOXELS = (1.25, 2.5, 5.0, 10.0, 20.0)
"""Gates from a given start, in fiftieths of the target's extent: 0.15 to 2.4 m in a room of 6 m."""
FOUND_VOXELS = (1.25, 2.5)
"""Gates from a start that was found."""
FEATURE_VOXELS = (START_VOXELS, 1.0)
"""Voxel sizes for features of the surfaces, in the same unit: the coarse one is the fastest."""
SEEDS = (0, 1, 2)
"""Seeds of random samples."""
LEAST_GATE_OF_SPACING = 6.0
"""Least gate, in median spacings of the registered target points."""


@dataclass(frozen=True, slots=True)
class Start:
    """A way to find start poses."""

    way: Way
    poses: Callable[[], Iterable[FloatArray]]
    """Finds (4, 4) start poses T_target_source; raises ReconstructionError if there are none."""


def by_surfaces(source: PointCloud, target: PointCloud, from_cameras: bool = False) -> Start:
    """Return start poses from features of the surfaces (FPFH), coarse ones first.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        from_cameras: whether both are known to be seen from their origins. Then the features' consensus is
            enough; else random samples follow, and come first where a cloud was clearly not seen from there.
    """

    def poses() -> Iterator[FloatArray]:
        unit_m = default_voxel_m(target)
        agreed = [partial(global_starts, source, target, voxels * unit_m) for voxels in FEATURE_VOXELS]
        if from_cameras:
            return _all(agreed)
        sampled = partial(sampled_starts, source, target, START_VOXELS * unit_m, SEEDS)
        bare = without_viewpoint(source, target)
        return _all([sampled, *agreed] if bare else [*agreed, sampled])

    return Start("surfaces", poses)


def _all(ways: Sequence[Callable[[], Iterable[FloatArray]]]) -> Iterator[FloatArray]:
    """Yield the poses of all ways; if none finds a pose, the error of the last failed way is raised."""
    found, reason = 0, None
    for way in ways:
        try:
            for T_start in way():
                yield T_start
                found += 1
        except ReconstructionError as error:
            reason = error
    if reason is not None and not found:
        raise reason


def by_colour(source: LiftedFeatures, target: LiftedFeatures) -> Start:
    """Return the start pose on which features of the colour images agree."""

    def poses() -> Iterable[FloatArray]:
        found = colour_start(source, target)
        if found.T_target_source is None:
            raise ReconstructionError(found.why_none)
        yield found.T_target_source

    return Start("colour", poses)


def default_gates_m(target: PointCloud, way: Way, seed: int = 0) -> list[float]:
    """Return gates for a target, metres, ascending: upper limits of the error of start poses of this way."""
    few = draw(target, QUICK_POINTS, seed, "target").points_m
    least_m = LEAST_GATE_OF_SPACING * median_spacing_m(few)
    shares = GIVEN_VOXELS if way == "given" else FOUND_VOXELS
    return sorted({max(least_m, share * default_voxel_m(target)) for share in shares})

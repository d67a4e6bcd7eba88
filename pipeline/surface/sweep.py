"""Sweep of the ball radius: the same cloud is meshed separately with each of several balls."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Sequence

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.rays import Camera
from pipeline.surface.findings import SweepPoint
from pipeline.surface.holes import open_area_m2
from pipeline.surface.pivoting import compile_all, roll
from pipeline.surface.quality import no_hit_ray_share
from pipeline.surface.truth import Yardstick, compare_with_truth, yardstick_of
from pipeline.types import PointCloud, RigTruth

STEPS = 12
NARROWEST, WIDEST = 0.5, 6.0
"""Smallest and largest radius of a sweep, in mean nearest-neighbour distances r_F."""


def sweep_radii_m(r_F_m: float, others_m: Iterable[float] = ()) -> tuple[float, ...]:
    """Return twelve radii from r_F / 2 to 6 r_F in equal ratios, and given others, ascending.

    Raises:
        InputError: r_F is not positive.
    """
    if not (np.isfinite(r_F_m) and r_F_m > 0.0):
        raise InputError(f"The point spacing r_F is {r_F_m} m, so no ball fits it; check the cloud")
    steps_m = np.geomspace(NARROWEST * r_F_m, WIDEST * r_F_m, STEPS)
    return tuple(np.unique([*steps_m, *others_m]).tolist())


def iterate_sweep(
    cloud: PointCloud, radii_m: Sequence[float], cameras: Sequence[Camera] = (), truth: RigTruth | None = None
) -> Generator[SweepPoint]:
    """Mesh the cloud with each ball separately; yields the measures of each surface.

    Args:
        cloud: points with normals towards the outside.
        radii_m: ball radii, in the order of the results.
        cameras: cameras whose rays are traced; with a truth, one for each of its cameras, in their order.
        truth: true surface for comparison.

    Raises:
        InputError: fewer than three points, no normals, a radius that is not positive, or a truth
            without cameras.
    """
    if truth is not None and not cameras:
        raise InputError("The truth is placed by the cameras and there are none; give the rig's cameras")
    compile_all()  # so that the first ball's time does not include it
    yardstick = None if truth is None else yardstick_of(truth)
    for radius_m in radii_m:
        yield _sweep_point(cloud, float(radius_m), cameras, truth, yardstick)


def _sweep_point(
    cloud: PointCloud,
    radius_m: float,
    cameras: Sequence[Camera],
    truth: RigTruth | None,
    yardstick: Yardstick | None,
) -> SweepPoint:
    started = time.perf_counter()
    triangles = roll(cloud.points_m, cloud.normals, (radius_m,)).triangles
    elapsed_s = time.perf_counter() - started
    measures = {"accuracy_1cm": float("nan"), "f_score_5cm": float("nan")}
    if truth is not None and len(triangles):
        measures = compare_with_truth(cloud.points_m, triangles, truth, cameras, yardstick)
    return SweepPoint(
        radius_m=radius_m,
        triangles=len(triangles),
        unused_share=1.0 - len(np.unique(triangles)) / len(cloud),
        hole_area_m2=open_area_m2(cloud.points_m, triangles),
        no_hit_ray_share=no_hit_ray_share(cloud.points_m, triangles, cameras),
        accuracy_1cm=measures["accuracy_1cm"],
        f_score_5cm=measures["f_score_5cm"],
        elapsed_s=elapsed_s,
    )

"""Surface reconstruction from a cloud by ball pivoting (Bernardini et al. 1999, SPEC 5)."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np

from packetmesh.errors import ReconstructionError
from packetmesh.progress import drain
from pipeline.kernels.rays import Camera
from pipeline.surface.pivoting import ALL_AT_ONCE, BallPivotStep, iterate_roll
from pipeline.surface.quality import measured
from pipeline.surface.radii import spacing
from pipeline.types import PointCloud, Surface, SurfaceResult


def iterate_ball(
    cloud: PointCloud, radii_m: Sequence[float], batch: int = 2000
) -> Generator[BallPivotStep, None, Surface]:
    """Roll balls over an oriented cloud, the smallest first, in steps of ``batch`` triangles.

    Args:
        cloud: (N, 3) points with unit normals towards the outside, metres.
        radii_m: ball radii.
        batch: most new triangles per step.

    Yields:
        The new triangles as rows of ``cloud``, the ball's centres, and the front.

    Returns:
        The surface, whose vertices are the points of the cloud that a triangle uses; closing the
        generator earlier cancels.

    Raises:
        InputError: fewer than three points, no normals, or a radius that is not positive.
        ReconstructionError: no ball makes a triangle.

    >>> import numpy as np, packetmesh as pm
    >>> xyz_m = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> cloud = pm.PointCloud(xyz_m, normals=np.tile([0.0, 0.0, 1.0], (25, 1)))
    >>> [len(step.triangles) for step in pm.iterate_ball(cloud, [1.0], batch=12)]
    [12, 12, 8]
    """
    radii_m = tuple(sorted({float(radius_m) for radius_m in radii_m}))
    rolled = yield from iterate_roll(cloud.points_m, cloud.normals, radii_m, batch)
    if not len(rolled.triangles):
        raise ReconstructionError(_why_nothing(cloud, radii_m[-1]))
    used = np.bincount(rolled.triangles.reshape(-1), minlength=len(cloud)) > 0
    kept, triangles = cloud.select(used), (np.cumsum(used, dtype=np.int32) - 1)[rolled.triangles]
    return Surface(
        vertices_m=kept.points_m,
        triangles=triangles,
        colors=kept.colors,
        radii_m=radii_m,
        normals=kept.normals,
        source=kept.source,
        rows=np.flatnonzero(used).astype(np.int32),
    )


def roll_ball(cloud: PointCloud, radii_m: Sequence[float]) -> Surface:
    """Roll balls over an oriented cloud, the smallest first; returns the result of ``iterate_ball``.

    Args:
        cloud: (N, 3) points with unit normals towards the outside, metres.
        radii_m: ball radii.

    Raises:
        InputError, ReconstructionError: as for ``iterate_ball``.

    >>> import numpy as np, packetmesh as pm
    >>> xyz_m = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> cloud = pm.PointCloud(xyz_m, normals=np.tile([0.0, 0.0, 1.0], (25, 1)))
    >>> pm.roll_ball(cloud, [1.0]).triangles.shape
    (32, 3)
    """
    return drain(iterate_ball(cloud, radii_m, batch=ALL_AT_ONCE))


def reconstruct_surface(
    cloud: PointCloud, radii_m: Sequence[float], cameras: Sequence[Camera] = ()
) -> SurfaceResult:
    """Reconstruct a surface with ``roll_ball`` and measure its quality.

    Args:
        cloud: points with normals towards the outside.
        radii_m: ball radii.
        cameras: cameras whose rays measure the share without a surface; this is NaN without cameras.

    Raises:
        InputError, ReconstructionError: as for ``iterate_ball``.
    """
    return measured(roll_ball(cloud, radii_m), cameras, len(cloud))


def roll_or_nothing(cloud: PointCloud, radii_m: Sequence[float]) -> Surface:
    """Run ``roll_ball``; returns an empty surface if no ball makes a triangle.

    Raises:
        InputError: as for ``roll_ball``.
    """
    try:
        return roll_ball(cloud, radii_m)
    except ReconstructionError:
        return Surface(np.empty((0, 3)), np.empty((0, 3), np.int32), None, tuple(radii_m))


def _why_nothing(cloud: PointCloud, radius_m: float) -> str:
    r_F_m, sigma_D_m = spacing(cloud.points_m)
    if radius_m < r_F_m / 2:
        return (
            f"The ball radius {radius_m:.4g} m is smaller than half the point spacing {r_F_m:.4g} m, so it "
            f"falls through; try at least {r_F_m:.4g} m"
        )
    return (
        f"No ball of radius {radius_m:.4g} m rests on three points whose normals agree; try a radius of "
        f"{max(r_F_m + sigma_D_m, 2 * radius_m):.4g} m"
    )

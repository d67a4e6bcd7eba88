"""A surface from a cloud by ball pivoting (Bernardini et al. 1999, SPEC 5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.rays import Camera
from pipeline.surface.pivoting import roll
from pipeline.surface.quality import measured
from pipeline.surface.radii import spacing
from pipeline.types import PointCloud, Surface, SurfaceResult


def reconstruct_surface(
    cloud: PointCloud, radii_m: Sequence[float], cameras: Sequence[Camera] = ()
) -> SurfaceResult:
    """``roll_over`` and measure what came out.

    Args:
        cloud: points with normals towards the outside.
        radii_m: ball radii.
        cameras: whose rays measure the share without a surface; NaN without any.

    Raises:
        InputError, ReconstructionError: see ``roll_over``.
    """
    return measured(roll_over(cloud, radii_m), cameras, len(cloud))


def roll_over(cloud: PointCloud, radii_m: Sequence[float]) -> Surface:
    """Roll balls over an oriented cloud, the smallest first; its points become the vertices.

    Args:
        cloud: points with normals towards the outside.
        radii_m: ball radii.

    Raises:
        InputError: fewer than three points, no normals, or a radius that is not positive.
        ReconstructionError: the balls fall through everywhere.
    """
    radii_m = tuple(sorted({float(radius_m) for radius_m in radii_m}))
    triangles = roll(cloud.points_m, cloud.normals, radii_m).triangles
    if not len(triangles):
        raise ReconstructionError(_why_nothing(cloud, radii_m[-1]))
    used = np.bincount(triangles.reshape(-1), minlength=len(cloud)) > 0
    kept, triangles = cloud.select(used), (np.cumsum(used, dtype=np.int32) - 1)[triangles]
    return Surface(
        vertices_m=kept.points_m,
        triangles=triangles,
        colors=kept.colors,
        radii_m=radii_m,
        normals=kept.normals,
        source=kept.source,
    )


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

"""Meshing of a point cloud file into a surface file, the work of `packetmesh mesh`."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Generator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.config import SurfaceConfig
from pipeline.io.cloud_precision import too_coarse
from pipeline.io.clouds import read_cloud
from pipeline.io.meshes import check_place, mesh_suffix, write_mesh
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.cloud_checks import (
    LEAST_POINTS,
    check_resolution,
    check_shape,
    check_unit,
    doubtful_unit,
    in_metres,
    middle_reach_m,
    usable_points,
    warn_of_rounding,
    width_of,
)
from pipeline.surface.given_normals import DOUBTFUL_SHARE, agreement, opposite_text
from pipeline.surface.normals import oriented_normals, turned_outwards, turned_to_viewpoint
from pipeline.surface.radii import radii, spacing
from pipeline.surface.smooth import smooth
from pipeline.surface.surrounding import surrounding_radii
from pipeline.surface.voxel import voxel_average, voxel_for_count
from pipeline.types import FloatArray, PointCloud, SurfaceResult

_log = logging.getLogger(__name__)

_FAR_M = 1e5
"""Clouds whose middle is farther from the origin are moved to it for the computation."""

GIVEN = "given"
GIVEN_TURNED = "given, turned to the viewpoint"
GIVEN_AGREEING = "given, turned to agree among neighbours and outwards"
ESTIMATED_VIEWPOINT = "estimated, turned to the viewpoint"
ESTIMATED_OUTWARDS = "estimated, consistent among neighbours and outwards"


@dataclass(frozen=True, slots=True)
class MeshOptions:
    """Options for meshing a cloud.

    Raises:
        InputError: an invalid radius, viewpoint or unit, or a count that is too small.
    """

    radii_m: tuple[float, ...] | None = None
    """Ball radii; None takes them from the points (``chosen_radii``)."""
    viewpoint_m: tuple[float, float, float] | None = None
    """Point that the normals face; None keeps given normals, or estimates normals that point outwards."""
    max_points: int | None = None
    """Thin the cloud to about this many points first; None keeps all."""
    smoothing_passes: int = 0
    metres_per_unit: float | None = None
    """Unit of the cloud's coordinates in metres, 0.001 for millimetres; None is the unit that the
    file names (``read_cloud``), or else metres."""
    estimate_normals: bool = False
    """Whether given normals are ignored and estimated from the points."""
    columns: str | None = None
    """Columns of a table of points, as in ``read_cloud``."""

    def __post_init__(self) -> None:
        for radius_m in self.radii_m or ():
            if not (math.isfinite(radius_m) and radius_m > 0.0):
                raise InputError(
                    f"A ball radius is {radius_m} m; try about one to four times the point spacing, or auto"
                )
        if self.viewpoint_m is not None and not np.isfinite(self.viewpoint_m).all():
            raise InputError(f"The viewpoint is {list(self.viewpoint_m)} m; try three finite numbers X Y Z")
        if self.max_points is not None and self.max_points < LEAST_POINTS:
            raise InputError(f"At most {self.max_points} points make no surface; try at least {LEAST_POINTS}")
        if self.smoothing_passes < 0:
            raise InputError(f"There cannot be {self.smoothing_passes} smoothing passes; try 0 or more")
        if self.metres_per_unit is not None:
            check_unit(self.metres_per_unit)


@dataclass(frozen=True, slots=True)
class MeshedCloud:
    """The surface of a cloud, and facts about the cloud."""

    surface: SurfaceResult
    points: int
    """Number of points that the ball rolled over."""
    normals: str
    """Origin of the points' normals: one of the texts ``GIVEN`` to ``ESTIMATED_OUTWARDS``."""
    width_m: float
    """Width of the cloud, without its outermost points."""
    doubt: str | None
    """Reason why the cloud's unit may not be the metre, or None."""


def iterate_mesh_file(
    path: Path, out: Path, options: MeshOptions
) -> Generator[Progress, None, dict[str, Any]]:
    """Read a cloud, roll the ball over it, write the mesh.

    Args:
        path: file of a type that ``read_cloud`` reads.
        out: file of a type that ``write_mesh`` writes; it is written completely or not at all.
        options: how the cloud is read and meshed.

    Returns:
        The quality report.

    Raises:
        InputError: a file, points or options that cannot be used.
        ReconstructionError: no ball makes a triangle.
    """
    started = time.perf_counter()
    suffix = mesh_suffix(out)
    yield Progress(f"reading {path}", 0.0)
    cloud = read_cloud(path, options.columns, header_unit=options.metres_per_unit is None)
    check_place(out, cloud.points_m * (options.metres_per_unit or 1.0))
    meshed = yield from iterate_mesh_cloud(cloud, options)
    if suffix == ".stl" and meshed.surface.colors is not None:
        _log.warning("STL has no place for the colours; a .ply, .obj or .glb keeps them")
    yield Progress(f"writing {out}", 0.95)
    write_mesh(out, meshed.surface)
    files = {"input": str(path), "out": str(out)}
    return files | mesh_report(meshed) | {"elapsed_s": time.perf_counter() - started}


def iterate_mesh_cloud(cloud: PointCloud, options: MeshOptions) -> Generator[Progress, None, MeshedCloud]:
    """Reconstruct the surface of a cloud with or without normals.

    Raises:
        InputError: points that make no surface, or a ball larger than the cloud.
        ReconstructionError: no ball makes a triangle.
    """
    yield Progress("looking for repeated points", 0.05)
    metres_per_unit = options.metres_per_unit or 1.0
    if options.estimate_normals:
        cloud = replace(cloud, normals=None)
    cloud = in_metres(usable_points(cloud), metres_per_unit)
    far = too_coarse(cloud.points_m) or middle_reach_m(cloud.points_m) > _FAR_M
    offset_m = (
        np.rint(np.median(cloud.points_m, axis=0)) if far else np.zeros(3)
    )  # sums of squares lose digits far away
    viewpoint_m = None if options.viewpoint_m is None else np.array(options.viewpoint_m) - offset_m
    if far:
        cloud = replace(cloud, points_m=cloud.points_m - offset_m)
    width_m = width_of(cloud)
    doubt = doubtful_unit(width_m, metres_per_unit)
    if doubt is not None:
        _log.warning(doubt)
    if options.max_points is not None and len(cloud) > options.max_points:
        yield Progress(f"thinning {len(cloud)} points", 0.1)
        cloud = voxel_average(cloud, voxel_for_count(cloud.points_m, options.max_points))
        check_shape(cloud.points_m)
    yield Progress(f"normals of {len(cloud)} points", 0.15)
    cloud, normals = with_normals(cloud, viewpoint_m)
    yield Progress(f"the normals are {normals}", 0.35)
    if options.smoothing_passes:
        yield Progress(f"smoothing {len(cloud)} points", 0.4)
        cloud = smooth(cloud, options.smoothing_passes)
    yield Progress("spacing of the points", 0.5)
    radii_m = chosen_radii(cloud, options.radii_m)
    if not far:
        check_resolution(cloud.points_m, radii_m[0])
    else:
        warn_of_rounding(cloud.points_m + offset_m, radii_m[0])
    sizes = ", ".join(f"{1000.0 * radius_m:.4g}" for radius_m in radii_m)
    yield Progress(f"rolling balls of {sizes} mm over {len(cloud)} points", 0.55)
    surface = reconstruct_surface(cloud, radii_m)
    if normals == GIVEN and surface.quality.components > 1:
        _log.warning(
            "The surface has %d pieces; if they belong together, the given normals may point to different "
            "sides: try --estimate-normals",
            surface.quality.components,
        )
    if far:
        surface = replace(surface, vertices_m=surface.vertices_m + offset_m)
    return MeshedCloud(surface, len(cloud), normals, width_m, doubt)


def mesh_report(meshed: MeshedCloud) -> dict[str, Any]:
    """Return the measures of a mesh; its genus is None unless it is closed and in one piece."""
    surface, quality = meshed.surface, meshed.surface.quality
    euler = len(surface.vertices_m) - len(edges_and_faces(surface.triangles)[0]) + len(surface.triangles)
    closed = quality.boundary_loops == 0 and quality.non_manifold_edges == 0 and quality.components == 1
    measures = asdict(quality)
    shares = "no_hit_ray_share", "within_2pct_share", "within_5pct_share", "guessed_ray_share"
    for of_cameras in (*shares, "gaps"):
        del measures[of_cameras]  # a cloud from a file has none
    return {
        "points": meshed.points,
        "width_m": meshed.width_m,
        "unit_doubt": meshed.doubt,
        "normals": meshed.normals,
        "radii_m": surface.radii_m,
        "vertices": len(surface.vertices_m),
        "triangles": len(surface.triangles),
        **measures,
        "euler": euler,
        "genus": (2 - euler) // 2 if closed else None,
    }


def with_normals(cloud: PointCloud, viewpoint_m: FloatArray | None) -> tuple[PointCloud, str]:
    """Return the cloud with unit normals, and the origin of the normals.

    Given normals whose axes do not fit the surface are estimated instead. Others are turned to the viewpoint.
    Without one they stay, unless so many neighbours point against each other that the signs cannot be used:
    then they are turned to agree, and outwards.
    """
    if cloud.normals is not None and not (found := agreement(cloud.points_m, cloud.normals)).axes_fit:
        _log.warning("The normals of the file are not perpendicular to the surface; they are estimated")
        cloud = replace(cloud, normals=None)
    if cloud.normals is None:
        cloud = oriented_normals(cloud, viewpoint_m)
        return cloud, ESTIMATED_OUTWARDS if viewpoint_m is None else ESTIMATED_VIEWPOINT
    if viewpoint_m is not None:
        return turned_to_viewpoint(cloud, viewpoint_m), GIVEN_TURNED
    if not found.signs_fit:
        _log.warning(
            "%s; they are turned to agree and outwards; --viewpoint X Y Z turns them to a camera, and "
            "--estimate-normals estimates them",
            opposite_text(found),
        )
        return turned_outwards(cloud), GIVEN_AGREEING
    if found.opposite_share > DOUBTFUL_SHARE:
        _log.warning(
            "%s, and the surface may be torn there; try --viewpoint X Y Z with the place of the camera, or "
            "--estimate-normals",
            opposite_text(found),
        )
    return cloud, GIVEN


def chosen_radii(cloud: PointCloud, radii_m: tuple[float, ...] | None) -> tuple[float, ...]:
    """Choose the ball radii, ascending and no larger than the cloud.

    Without given radii they are the distances within which a point's neighbours surround it; for a cloud
    whose points are not surrounded, the rule r_F + {0, 1, 2, 4} sigma_D.

    Raises:
        InputError: a given radius larger than the cloud.
    """
    points_m = cloud.points_m
    extent_m = float(np.linalg.norm(np.ptp(points_m, axis=0)))
    assert cloud.normals is not None
    surrounding_m = surrounding_radii(points_m, cloud.normals)
    if radii_m is None:
        by_rule_m = surrounding_m or radii(SurfaceConfig("thesis+"), *spacing(points_m))
        return tuple(radius_m for radius_m in by_rule_m if radius_m <= extent_m)
    if max(radii_m) > extent_m:
        fits_m = surrounding_m[-1] if surrounding_m else spacing(points_m)[0]
        raise InputError(
            f"The ball radius {max(radii_m):.4g} m is larger than the cloud, which is {extent_m:.4g} m "
            f"across; try about {min(fits_m, extent_m):.3g} m"
        )
    return tuple(sorted(radii_m))

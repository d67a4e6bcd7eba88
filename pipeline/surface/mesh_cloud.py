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
from pipeline.kernels.point_sets import distinct_rows
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.given_normals import (
    DOUBTFUL_SHARE,
    MOST_UNKNOWN_SHARE,
    agreement,
    known_normals,
    opposite_text,
)
from pipeline.surface.normals import oriented_normals, turned_outwards, turned_to_viewpoint
from pipeline.surface.radii import radii, spacing
from pipeline.surface.smooth import smooth
from pipeline.surface.surrounding import surrounding_radii
from pipeline.surface.voxel import voxel_average, voxel_for_count
from pipeline.types import FloatArray, PointCloud, SurfaceResult

_log = logging.getLogger(__name__)

LEAST_POINTS = 3
USUAL_M = 0.05, 50.0
"""Usual range of widths: from objects to houses."""
OUTER_PERCENT = 1.0
"""Per cent of the points on either side that do not count for a cloud's width, because of outliers."""
LARGEST_M, SMALLEST_M = 1e9, 1e-12
"""Largest allowed coordinate, and the extent below which a cloud counts as one point."""
_FAR_M = 1e5
"""Clouds whose middle is farther from the origin are moved to it for the computation."""
_COARSE = 0.1
"""Coordinates in steps above this share of the smallest ball make a rough surface."""
_LINE = 1e-6
"""A cloud is a line if it is thinner than this share of its length."""

GIVEN = "given"
GIVEN_TURNED = "given, turned to the viewpoint"
GIVEN_AGREEING = "given, turned to agree among neighbours and outwards"
ESTIMATED_VIEWPOINT = "estimated, turned to the viewpoint"
ESTIMATED_OUTWARDS = "estimated, consistent among neighbours and outwards"


@dataclass(frozen=True, slots=True)
class MeshOptions:
    """Options for meshing a cloud.

    Raises:
        InputError: an invalid radius or viewpoint, or counts that are too small.
    """

    radii_m: tuple[float, ...] | None = None
    """Ball radii; None takes them from the points (``chosen_radii``)."""
    viewpoint_m: tuple[float, float, float] | None = None
    """Point that the normals face; None keeps given normals, or estimates normals that point outwards."""
    max_points: int | None = None
    """Thin the cloud to about this many points first."""
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
    """Origin of the points' normals: ``GIVEN``, ``GIVEN_TURNED``, ``ESTIMATED_...``."""
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
    far = too_coarse(cloud.points_m) or _reach_m(cloud.points_m) > _FAR_M
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
        _check_shape(cloud.points_m)
    yield Progress(f"normals of {len(cloud)} points", 0.15)
    cloud, normals = with_normals(cloud, viewpoint_m)
    yield Progress(f"the normals are {normals}", 0.35)
    if options.smoothing_passes:
        yield Progress(f"smoothing {len(cloud)} points", 0.4)
        cloud = smooth(cloud, options.smoothing_passes)
    yield Progress("spacing of the points", 0.5)
    radii_m = chosen_radii(cloud, options.radii_m)
    if not far:
        _check_resolution(cloud.points_m, radii_m[0])
    else:
        _warn_of_rounding(cloud.points_m + offset_m, radii_m[0])
    sizes = ", ".join(f"{1000.0 * radius_m:.4g}" for radius_m in radii_m)
    yield Progress(f"rolling balls of {sizes} mm over {len(cloud)} points", 0.55)
    surface = reconstruct_surface(cloud, radii_m)
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


def usable_points(cloud: PointCloud) -> PointCloud:
    """Return the distinct points in their order, without those whose normal is unknown (unless many are).

    Raises:
        InputError: fewer than three points, or all of them coincident or collinear.
    """
    first = distinct_rows(cloud.points_m)
    if len(first) < len(cloud):
        _log.warning("%d repeated points are left out", len(cloud) - len(first))
        cloud = cloud.select(first)
    cloud = _known_normals(cloud)
    _check_shape(cloud.points_m)
    return cloud


def check_unit(metres_per_unit: float) -> None:
    """Check the length of a unit.

    Raises:
        InputError: the length is not finite or not positive.
    """
    if not (math.isfinite(metres_per_unit) and metres_per_unit > 0.0):
        raise InputError(f"There cannot be {metres_per_unit:g} metres in a unit; try 0.001 for millimetres")


def in_metres(cloud: PointCloud, metres_per_unit: float) -> PointCloud:
    """Convert a cloud to metres.

    Raises:
        InputError: the unit's length is not finite or not positive.
    """
    check_unit(metres_per_unit)
    if metres_per_unit == 1.0:
        return cloud
    return replace(cloud, points_m=metres_per_unit * cloud.points_m)


def width_of(cloud: PointCloud) -> float:
    """Return the longest side of the box around the points, without ``OUTER_PERCENT`` at each end."""
    low_m, high_m = np.percentile(cloud.points_m, [OUTER_PERCENT, 100.0 - OUTER_PERCENT], axis=0)
    return float((high_m - low_m).max())


def doubtful_unit(width_m: float, metres_per_unit: float) -> str | None:
    """Return a warning for a cloud that is larger than a house or too small for a depth camera, or None."""
    if USUAL_M[0] <= width_m <= USUAL_M[1]:
        return None
    if width_m > USUAL_M[1]:
        advice = f"if its numbers are millimetres, try --metres-per-unit {0.001 * metres_per_unit:.3g}"
    else:
        advice = "if it is wider in truth, say so with --metres-per-unit"
    return f"The cloud is {width_m:.3g} m wide; {advice}"


def with_normals(cloud: PointCloud, viewpoint_m: FloatArray | None) -> tuple[PointCloud, str]:
    """Return the cloud with unit normals, and the origin of the normals.

    Given normals are turned to the viewpoint. Without one they stay, unless so many neighbours disagree that
    their signs say nothing: then they are turned to agree, or estimated if even their axes disagree.
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


def _known_normals(cloud: PointCloud) -> PointCloud:
    """Normalise the normals; leave out points without one, or all normals if many points have none."""
    if cloud.normals is None:
        return cloud
    known = known_normals(cloud.normals)
    if not known.any():
        _log.warning("All normals of the file are zero or not finite; they are estimated from the points")
        return replace(cloud, normals=None)
    unknown = int((~known).sum())
    if unknown > MOST_UNKNOWN_SHARE * len(cloud):
        _log.warning(
            "%d of %d normals of the file are zero or not finite; all are estimated from the points",
            unknown,
            len(cloud),
        )
        return replace(cloud, normals=None)
    if unknown:
        _log.warning(
            "%d points are left out: their normals are zero or not finite; --estimate-normals keeps them",
            unknown,
        )
        cloud = cloud.select(known)
    assert cloud.normals is not None
    return replace(cloud, normals=cloud.normals / np.linalg.norm(cloud.normals, axis=1, keepdims=True))


def _check_shape(points_m: FloatArray) -> None:
    reach_m, extent_m = float(np.abs(points_m).max()), float(np.ptp(points_m, axis=0).max())
    if reach_m > LARGEST_M:
        raise InputError(
            f"A point of the cloud has a coordinate of {reach_m:.3g} m; check its file and its units"
        )
    if extent_m < SMALLEST_M:
        raise InputError("All points of the cloud are in one place; check its file")
    if len(points_m) < LEAST_POINTS:
        raise InputError(
            f"The cloud has {len(points_m)} distinct points; a surface needs at least {LEAST_POINTS}, "
            "so check its file"
        )
    centered = (points_m - points_m.mean(axis=0)) / extent_m
    widths = np.sqrt(np.maximum(np.linalg.eigvalsh(centered.T @ centered), 0.0))
    if widths[1] <= _LINE * widths[2]:
        raise InputError(
            f"The {len(points_m)} points of the cloud lie on one line; a surface needs points beside it"
        )


def _reach_m(points_m: FloatArray) -> float:
    """Return the largest coordinate, by magnitude, of the middle of the points."""
    return float(np.abs(np.median(points_m, axis=0)).max())


def _check_resolution(points_m: FloatArray, radius_m: float) -> None:
    """Refuse points so far from the origin that the 32-bit floats of a mesh file are too coarse."""
    step_m = float(np.spacing(np.float32(_reach_m(points_m))))
    if step_m > _COARSE * radius_m:
        raise InputError(
            f"The cloud reaches {_reach_m(points_m):.4g} m from the origin, where the numbers of a mesh file "
            f"are {step_m:.2g} m apart; try to move it nearer to the origin"
        )


def _warn_of_rounding(points_m: FloatArray, radius_m: float) -> None:
    """Log that the positions of a far cloud were rounded to 32-bit numbers, if balls see their steps."""
    reach_m = _reach_m(points_m)
    step_m = float(np.spacing(np.float32(reach_m)))
    if step_m <= _COARSE * radius_m or too_coarse(points_m):
        return
    axis = int(np.abs(np.median(points_m, axis=0)).argmax())
    steps_m = np.diff(np.unique(points_m[:, axis]))
    if len(steps_m) and steps_m.min() < 1.5 * step_m:  # a grid of heights has larger steps
        _log.warning(
            "The cloud is %.4g m from the origin, where 32-bit numbers are %.2g m apart, and its positions "
            "are rounded to them; try to export it with 64-bit numbers, or nearer to the origin",
            reach_m,
            step_m,
        )

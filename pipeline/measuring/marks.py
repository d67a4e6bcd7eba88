"""Points that a person marks on a surface, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.lookup import Spot, lookup_of
from pipeline.measuring.near import spot_near
from pipeline.measuring.planes import Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import FloatArray

Snap = Literal["surface", "vertex", "edge", "plane"]
BRIDGE_COSINE = 0.5
"""Cosine of a triangle's normal and its corners' below which it bridges two surfaces."""
RAGGED_COSINE = 0.87
"""Cosine of the corners' normals below which a triangle bridges a crease."""
OTHER_FACE_COSINE = 0.8
"""Cosine of two normals below which they are of different planes that meet at an edge."""
EDGE_SPACINGS = 5.0
"""An edge is looked for within this many spacings."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A point on a surface, chosen by a person."""

    point_m: FloatArray
    """(3,) world frame."""
    covariance_m2: FloatArray
    """(3, 3) of the point's own noise and of the choice, without pose and scale; of a guessed point the
    choice alone."""
    normal: FloatArray
    """(3,) unit, towards the observer."""
    snapped: Snap
    node: int
    """Node that measured it; -1 if several or unknown."""
    guessed: bool
    ray: FloatArray | None = None
    """(3,) unit direction from the camera to the point."""
    range_m: float = float("nan")
    confidence: float = float("nan")
    """Distance of that camera, and confidence of a guess."""


def mark(surface: MeasuredSurface, point_m: FloatArray, snap: Snap = "surface") -> Mark:
    """Return the point of a surface that is nearest to a given point.

    How far the given point was from there counts as standard deviation in that direction.

    Args:
        surface: the surface.
        point_m: (3,) world frame.
        snap: ``vertex`` moves it to the nearest vertex, ``edge`` to the nearest crease of two planes,
            ``plane`` onto the plane that fits there.

    Raises:
        InputError: nothing of the surface is near the point, or there is no edge or plane.
    """
    spot = spot_near(surface, point_m)
    found = _snapped(surface, spot, snap, None)
    if snap in ("edge", "plane"):
        return found
    shift_m = np.asarray(point_m, float) - spot.point_m
    return replace(found, covariance_m2=found.covariance_m2 + np.outer(shift_m, shift_m))


def mark_on_ray(
    surface: MeasuredSurface, origin_m: FloatArray, direction: FloatArray, snap: Snap = "surface"
) -> Mark:
    """Return the first point of a surface that a click's ray meets; arguments as for ``mark``.

    Raises:
        InputError: the ray misses the surface, or there is no edge or plane.
    """
    direction = np.asarray(direction, float)
    spot = lookup_of(surface).first_on(np.asarray(origin_m, float), direction)
    if spot is None:
        raise InputError("There is no surface under the pointer; click on the surface")
    return _snapped(surface, spot, snap, direction / np.linalg.norm(direction))


def _snapped(surface: MeasuredSurface, spot: Spot, snap: Snap, ray: FloatArray | None) -> Mark:
    """Return the mark at a place; ``ray`` (3,) is the direction in which a person looks at it, if known."""
    if snap == "vertex":
        row = spot.corners[[int(np.argmax(spot.shares))]]
        return replace(_on_surface(surface, Spot(surface.vertices_m[row[0]], row, np.ones(1))), snapped=snap)
    own = _on_surface(surface, spot)
    if snap == "plane":
        return _on_plane(own, plane_at(surface, spot.point_m), ray)
    return _on_edge(surface, own) if snap == "edge" else own


def _on_surface(surface: MeasuredSurface, spot: Spot) -> Mark:
    """Return the mark at a place as it is.

    The choice adds half a spacing in the surface's plane where the surface itself is ragged: at its rim and
    where a triangle bridges a crease. On a triangle between two surfaces it adds half of its depth.
    """
    rows, shares = spot.corners, spot.shares
    normal = _unit(shares @ surface.normals[rows], surface.normals[rows[0]])
    ray = _unit(shares @ surface.rays[rows], normal)
    guessed = bool(np.sum(surface.guessed[rows]) > 0.5 * len(rows))
    covariance_m2: FloatArray = np.zeros((3, 3))
    if not guessed:
        covariance_m2 = float(shares @ surface.sigma_m[rows] ** 2) * np.outer(ray, ray)
    lookup = lookup_of(surface)
    bent = float(np.min(surface.normals[rows] @ surface.normals[rows].T)) < RAGGED_COSINE
    if len(rows) == 3 and (bent or np.sum(lookup.rim[rows]) >= 2):
        in_plane = np.eye(3) - np.outer(normal, normal)
        covariance_m2 = covariance_m2 + (0.5 * lookup.spacing_m) ** 2 * in_plane
    if len(rows) == 3:
        corners_m = surface.vertices_m[rows]
        facing = _unit(np.cross(corners_m[1] - corners_m[0], corners_m[2] - corners_m[0]), normal)
        if abs(float(facing @ normal)) < BRIDGE_COSINE:
            covariance_m2 = covariance_m2 + (0.5 * float(np.ptp(corners_m @ ray))) ** 2 * np.outer(ray, ray)
    nodes = surface.nodes[rows]
    confidence = range_m = float("nan")
    if surface.ranges_m is not None:
        range_m = float(shares @ surface.ranges_m[rows])
    if guessed and surface.confidence is not None and np.isfinite(surface.confidence[rows]).any():
        confidence = float(np.nanmean(surface.confidence[rows]))
    return Mark(
        spot.point_m,
        covariance_m2,
        normal,
        "surface",
        int(nodes[0]) if np.all(nodes == nodes[0]) else -1,
        guessed,
        ray,
        range_m,
        confidence,
    )


def _on_plane(own: Mark, plane: Plane, ray: FloatArray | None) -> Mark:
    """Move a mark onto a plane, along the ray of a click or else along the normal."""
    along = plane.normal if ray is None or abs(ray @ plane.normal) < 0.1 else ray
    height_m = float((plane.point_m - own.point_m) @ plane.normal) / float(along @ plane.normal)
    point_m = own.point_m + height_m * along
    shift = along / float(along @ plane.normal)
    covariance_m2 = plane.offset_variance_m2(point_m) * np.outer(shift, shift)
    return replace(
        own,
        point_m=point_m,
        covariance_m2=covariance_m2,
        normal=plane.normal,
        snapped="plane",
        node=plane.node,
    )


def _on_edge(surface: MeasuredSurface, own: Mark) -> Mark:
    """Move a mark to the nearest point of the line in which the planes on both sides of a crease meet."""
    lookup = lookup_of(surface)
    count = min(200, len(surface.vertices_m))
    near = lookup.tree.nearest(own.point_m[None], count)[1][0]
    away_m = np.linalg.norm(surface.vertices_m[near] - own.point_m, axis=1)
    reach_m = EDGE_SPACINGS * lookup.spacing_m
    planes: list[Plane] = []
    for row in near[away_m <= reach_m]:
        if all(surface.normals[row] @ plane.normal < OTHER_FACE_COSINE for plane in planes):
            try:
                plane = plane_at(surface, surface.vertices_m[row])
            except InputError:
                continue
            if all(plane.normal @ other.normal < OTHER_FACE_COSINE for other in planes):
                planes.append(plane)
        if len(planes) == 2:
            break
    none = InputError("No edge is near the marked point; try a point closer to where two flat parts meet")
    if len(planes) < 2:
        raise none
    line = np.cross(planes[0].normal, planes[1].normal)
    line /= np.linalg.norm(line)
    across = np.stack([planes[0].normal, planes[1].normal, line])
    heights_m = [plane.normal @ plane.point_m for plane in planes]
    point_m = np.linalg.solve(across, [*heights_m, line @ own.point_m])
    if np.linalg.norm(point_m - own.point_m) > reach_m:
        raise none
    variances = [*(plane.offset_variance_m2(point_m) for plane in planes), 0.0]
    back = np.linalg.inv(across)
    node = planes[0].node if planes[0].node == planes[1].node else -1
    return replace(
        own,
        point_m=point_m,
        covariance_m2=back @ np.diag(variances) @ back.T,
        normal=_unit(planes[0].normal + planes[1].normal, own.normal),
        snapped="edge",
        node=node,
        guessed=planes[0].guessed or planes[1].guessed,
    )


def _unit(vector: FloatArray, fallback: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else fallback

"""Width, depth and height of a box: of three faces, or of a thing that stands on a plane."""

from __future__ import annotations

from itertools import product

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.guesses import UNKNOWN_RANGE_M, relative_half
from pipeline.measuring.lookup import lookup_of
from pipeline.measuring.near import spot_near
from pipeline.measuring.planes import Plane, guess_of, plane_at, rectangle
from pipeline.measuring.propagation import Z95
from pipeline.measuring.supports import ABOVE_M, Footprint, levels_below, support_of, unknown_height
from pipeline.measuring.surface import MeasuredSurface
from pipeline.measuring.values import Measure, Value
from pipeline.surface.boundary import connected_parts
from pipeline.types import BoolArray, FloatArray, IntArray

SQUARE_DEG = 20.0
"""Faces of a box are square to each other within this angle."""
EXTENT = (1.0, 99.0)
"""Percentiles of the vertices between which a thing extends (SPEC 7)."""
GROOVE_DEG = 25.0
"""Angle between converging normals from which two things touch there."""
LARGEST_SHARE = 0.5
"""Largest share of the surface's vertices that one thing may have."""


def box_of_planes(surface: MeasuredSurface, planes: tuple[Plane, Plane, Plane]) -> Measure:
    """Return width, depth and height of the box of which three faces are given, all seen from outside it or,
    as the walls of a room, from inside.

    Each length is from a face to the last vertices of the other two. These end about half a spacing before
    the true edge, so half a spacing is added to the length, and is also its standard deviation. The
    covariance of the nodes' poses is left out.

    Raises:
        InputError: the planes are not square to each other, or not all seen from the same side of a box.
    """
    normals = np.stack([plane.normal for plane in planes])
    cosines = np.abs((normals @ normals.T)[np.triu_indices(3, 1)])
    if cosines.max() > np.sin(np.radians(SQUARE_DEG)):
        least = np.degrees(np.arccos(cosines.max()))
        raise InputError(
            f"Two of the three planes are {least:.0f} degrees apart, and faces of a box are square; "
            "mark three faces that meet at one corner"
        )
    left, _, right = np.linalg.svd(normals)
    inward = -left @ right
    corner_m = np.linalg.solve(normals, [plane.normal @ plane.point_m for plane in planes])
    deep_m = [
        [(surface.vertices_m[other.rows] - corner_m) @ axis for other in planes if other is not plane]
        for plane, axis in zip(planes, inward, strict=True)
    ]
    outside = {bool(np.median(one_m) > 0.0) for pair in deep_m for one_m in pair}
    if len(outside) == 2:
        raise InputError(
            "The three planes are no faces of one box: some are seen from outside it, others from inside; "
            "mark three sides of a thing, or two walls and the floor of a room"
        )
    side = 1.0 if outside == {True} else -1.0
    ragged_m = 0.5 * lookup_of(surface).spacing_m
    lengths_m = (
        np.array([np.percentile(side * np.concatenate(pair), EXTENT[1]) for pair in deep_m]) + ragged_m
    )
    sds_m = np.array([np.hypot(np.sqrt(plane.covariance[0, 0]), ragged_m) for plane in planes])
    guesses_m = np.array([_guess_half_m(plane.range_m, plane.confidence) * plane.guessed for plane in planes])
    return _box(surface, corner_m, side * inward, lengths_m, sds_m, guesses_m)


def box_of_part(surface: MeasuredSurface, point_m: FloatArray) -> Measure:
    """Return width, depth and height of a thing that stands on a plane, marked by one point on it.

    The plane is a level one that is seen along two sides of the footprint or more (``support_of``). Of a
    thing that is marked on its flat top, the footprint is the smallest rectangle around the top; of another,
    around the vertices above the plane that are connected with the point without crossing a groove
    (``GROOVE_DEG``). Things that touch it without a groove count as one with it.

    Raises:
        InputError: nothing stands there, or what it stands on is not seen.
    """
    spot = spot_near(surface, point_m)
    where = "({:.3g}, {:.3g}, {:.3g})".format(*spot.point_m)
    seed = int(spot.corners[np.argmax(spot.shares)])
    top = _top(surface, spot.point_m)
    rows, plane = _standing(surface, top, seed, where)
    points_m = surface.vertices_m[rows] - plane.point_m
    flat_m = points_m @ plane.axes.T
    turned, low_m, high_m = rectangle(flat_m, EXTENT)
    ragged_m = 0.5 * lookup_of(surface).spacing_m
    height_m = float(np.percentile(points_m @ plane.normal, EXTENT[1]))
    axes = np.stack([*(turned @ plane.axes), plane.normal])
    origin_m = plane.point_m + (low_m - ragged_m) @ axes[:2]
    lengths_m = np.append(high_m - low_m + 2.0 * ragged_m, height_m)
    foot_m = origin_m + 0.5 * lengths_m[:2] @ axes[:2]
    top_m = float(np.median(surface.sigma_m[rows]))
    sds_m = np.array([np.sqrt(2.0) * ragged_m] * 2 + [np.sqrt(plane.offset_variance_m2(foot_m) + top_m**2)])
    own_m = _guess_half_m(*guess_of(surface, rows)) * bool(np.mean(surface.guessed[rows]) > 0.5)
    below_m = _guess_half_m(plane.range_m, plane.confidence) * plane.guessed
    guesses_m = np.array([own_m, own_m, np.hypot(own_m, below_m)])
    return _box(surface, origin_m, axes, lengths_m, sds_m, guesses_m)


def _guess_half_m(range_m: float, confidence: float) -> float:
    """Return the half width of a guessed side's 95 % interval, metres, as if the side faced its camera."""
    return relative_half(confidence) * (range_m if np.isfinite(range_m) else UNKNOWN_RANGE_M)


def _standing(surface: MeasuredSurface, top: Plane | None, seed: int, where: str) -> tuple[IntArray, Plane]:
    """Return the vertices of a thing's top, or of the whole of it, and the plane that it stands on.

    Raises:
        InputError: nothing stands there, or what it stands on is not seen.
    """
    if top is not None:
        footprint = _footprint(surface, top.rows)
        planes = levels_below(surface, footprint, float(np.median(surface.vertices_m[top.rows, 2])))
        return top.rows, support_of(surface, footprint, planes, where)
    planes = levels_below(surface, _footprint(surface, np.array([seed])), float(surface.vertices_m[seed, 2]))
    trouble: InputError | None = None
    for plane in planes:
        try:
            rows = _part(surface, seed, plane, where)
            if support_of(surface, _footprint(surface, rows), planes, where) is plane:
                return rows, plane
        except InputError as error:
            trouble = error
    raise trouble or unknown_height(where)


def _footprint(surface: MeasuredSurface, rows: IntArray) -> Footprint:
    return Footprint(*rectangle(surface.vertices_m[rows, :2], EXTENT))


def _top(surface: MeasuredSurface, point_m: FloatArray) -> Plane | None:
    """Return the flat top of a thing; None if no level plane is at the point."""
    try:
        top = plane_at(surface, point_m)
    except InputError:
        return None
    return top if float(top.normal[2]) > np.cos(np.radians(SQUARE_DEG)) else None


def _part(surface: MeasuredSurface, seed: int, plane: Plane, where: str) -> IntArray:
    """Return the vertices above a plane that are connected with a vertex."""
    least_m = max(ABOVE_M, 3.0 * plane.rms_m)
    above = (surface.vertices_m - plane.point_m) @ plane.normal > least_m
    if not above[seed]:
        raise InputError(
            f"The point {where} m is not above the plane that it stands on; mark a point higher up"
        )
    edges = lookup_of(surface).edges
    edges = edges[above[edges].all(axis=1)]
    labels = connected_parts(edges[~_hollow(surface, edges)], len(above))
    rows = np.flatnonzero(above & (labels == labels[seed]))
    if len(rows) > LARGEST_SHARE * len(above):
        raise InputError(
            f"What the point {where} m marks is connected with most of the surface; mark three of its "
            "faces instead"
        )
    if len(rows) < 4:
        raise InputError(f"Nothing stands at the point {where} m; mark a point on a thing")
    return rows


def _hollow(surface: MeasuredSurface, edges: IntArray) -> BoolArray:
    """Return (E,) True for edges in a groove, where two things touch: the normals at their ends converge."""
    (a, b), (n, m) = surface.vertices_m[edges].swapaxes(0, 1), surface.normals[edges].swapaxes(0, 1)
    converge = np.sum((b - a) * (m - n), axis=1) < 0.0
    return converge & (np.sum(n * m, axis=1) < np.cos(np.radians(GROOVE_DEG)))


def _box(
    surface: MeasuredSurface,
    corner_m: FloatArray,
    axes: FloatArray,
    lengths_m: FloatArray,
    sds_m: FloatArray,
    guesses_m: FloatArray,
) -> Measure:
    """Return the measure of a box from a corner along three (3, 3) axes; the steepest is its height.

    Args:
        surface: the surface.
        corner_m: (3,) corner.
        axes: (3, 3) unit axes as rows.
        lengths_m: (3,) lengths along them.
        sds_m: (3,) their standard deviations, without the scale's.
        guesses_m: (3,) half of the 95 % interval that a guess adds; 0 for a measured length.
    """
    halves_m = np.hypot(Z95 * np.hypot(sds_m, lengths_m * surface.scale_sd), guesses_m)
    upright = int(np.argmax(np.abs(axes[:, 2])))
    level = sorted((k for k in range(3) if k != upright), key=lambda k: -lengths_m[k])
    names = ("width", "depth", "height")
    values = tuple(
        Value(
            name,
            float(lengths_m[k]),
            "m",
            (max(0.0, float(lengths_m[k] - halves_m[k])), float(lengths_m[k] + halves_m[k])),
            bool(guesses_m[k] > 0.0),
        )
        for name, k in zip(names, (*level, upright), strict=True)
    )
    corners_m = [corner_m + (np.array(some) * lengths_m) @ axes for some in product((0.0, 1.0), repeat=3)]
    return Measure("box", values, np.stack(corners_m))

"""Diagnosis of a hole: its cause, found by rolling balls again around it with one change after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError
from pipeline.kernels.point_sets import distinct_rows
from pipeline.kernels.rays import first_hits, triangle_scene
from pipeline.surface.fill import skin_points_m
from pipeline.surface.findings import Explanation, Reason
from pipeline.surface.holes import Hole, beyond_m, half_edges, is_closed
from pipeline.surface.pivoting import Rolled, Roller, roll
from pipeline.surface.ray_parts import Known, View, known_there
from pipeline.types import BoolArray, FloatArray, IntArray, PointCloud, PointSource, SurfaceResult

MOST = 0.5
"""A cause must hold for more than this share of a hole."""
GROWTH = 1.25
"""Ratio of the radii of two consecutively tried balls."""
WIDE = 10.0
"""Without views, a gap of this many point spacings counts as unmeasured."""
_MOST_POINTS = 4000
"""Most points that are used for one explanation, so that it takes a fraction of a second."""
_BALLS_AROUND = 4.0
"""Balls up to this many times the largest so far, or twice the hole, are tried."""
_PLACES = 8
"""Number of edges of a large rim that are examined as a sample."""
_WHOLE = 6.0
"""A rim up to this many ball radii around its centre is examined completely."""
_SAMPLES = 200
"""Number of points that are drawn in a hole."""


@dataclass(frozen=True, slots=True)
class _Place:
    """The cloud around a hole, or around some edges of a long rim, and samples of the open region."""

    points_m: FloatArray
    """(n, 3) points of the cloud."""
    normals: FloatArray
    """(n, 3) their normals."""
    agreed: FloatArray
    """(n, 3) consistent normals for all points: the mean normal at the loop, or at the nearest edge."""
    edges: IntArray
    """(E, 2) rows of the loop's edges, in the direction of their triangles."""
    ends: bool
    """True for a rim, where the surface ends and a ball must roll on over the edges."""
    samples_m: FloatArray
    """(S, 3) points in the hole, or just beyond each edge of a rim."""
    directions: FloatArray
    """(S, 3) outward direction at each sample."""
    height_m: float
    """Bound on the distance of any surface that closes the hole from the triangulation of least area."""
    spacing_m: float
    """Median distance of nearest points."""
    widest_gap_m: float
    """Diameter of the largest circle around a sample without a point of the cloud."""
    largest_m: float
    """Largest ball whose emptiness can be decided from these points."""


@dataclass(frozen=True, slots=True)
class _Findings:
    """Results of the repeated rolling and of the cameras' views."""

    known: Known
    layered: float
    """Share of the hole that triangles already cover from above or below."""
    gained: float
    """Share that the same balls close with consistent normals, but not with the actual ones."""
    radius_m: float | None
    """Smallest ball that closes the hole."""
    most_radius_m: float | None
    """Smallest ball that closes more than nine tenths but not all of it."""
    most: float
    """Share that the largest ball closes."""


def explain_hole(
    hole: Hole, surface: SurfaceResult, cloud: PointCloud, views: Sequence[View] = ()
) -> Explanation:
    """Find the cause of a hole by rolling balls again over the points around it.

    The causes are tested in this order. **outside view**: no camera sees most of the hole's inside, or
    cameras look past a rim onto a farther surface. **normals**: the same balls close most of it with
    consistent normals, but not with the actual ones. **no points**: most of its pixels have no depth
    that the surface uses; without views, the hole is ten point spacings wide, or a rim that no ball
    crosses. **gap**: all other cases.

    A ball closes a hole if every edge of its loop gets its second triangle, and no new triangle of the
    patch there has an edge with one face. It closes a rim if more than half of the examined edges (all,
    or eight of a large rim) get their second triangle. Islands are explained like rims.

    Args:
        hole: a hole of ``surface``.
        surface: surface made by balls, the smallest first.
        cloud: cloud over which those balls rolled.
        views: known pixels of the cameras; without views, the points alone decide.

    Raises:
        InputError: no ball made the surface, the cloud has no normals, the hole's vertices are not points of
            the cloud, or a view's mask does not have its camera's image size.
    """
    if not surface.radii_m or cloud.normals is None:
        raise InputError(
            "This hole cannot be explained by rolling again: the surface has no ball radius or the cloud no "
            "normals; take a surface that a ball made"
        )
    place = _place(hole, surface, cloud)
    found = _findings(place, surface, views)
    reason = _reason(place, surface, found)
    sentence, remedy = _sentences(reason, place, surface, found)
    if hole.island:
        island = "This loop runs around a piece of surface that touches the rest only at single points."
        sentence = f"{island} {sentence}"
    known = found.known
    shares = known.sensor_share, known.inferred_share, known.unknown_share
    return Explanation(reason, sentence, remedy, found.radius_m, *shares)


def _findings(place: _Place, surface: SurfaceResult, views: Sequence[View]) -> _Findings:
    closed = _closed(roll(place.points_m, place.normals, surface.radii_m), place)
    agreed = _closed(roll(place.points_m, place.agreed, surface.radii_m), place)
    known = known_there(place.samples_m, surface, views, 2.0 * surface.radii_m[-1])
    return _Findings(
        known, float(closed.mean()), float(np.mean(agreed & ~closed)), *_grow(place, surface.radii_m)
    )


def _reason(place: _Place, surface: SurfaceResult, found: _Findings) -> Reason:
    known = found.known
    if known.outside_share + known.hidden_share > MOST or (place.ends and known.past_share > MOST):
        return "outside view"
    if found.gained > MOST:
        return "normals"
    if np.isfinite(known.sensor_share):
        inferred = known.inferred_share if _has_inferred(surface) else 0.0
        unmeasured = known.sensor_share + inferred <= MOST
    elif place.ends:
        unmeasured = found.radius_m is None
    else:
        unmeasured = place.widest_gap_m >= WIDE * place.spacing_m
    return "no points" if unmeasured else "gap"


def _has_inferred(surface: SurfaceResult) -> bool:
    return surface.source is not None and bool(np.any(surface.source == PointSource.INFERRED))


def _place(hole: Hole, surface: SurfaceResult, cloud: PointCloud) -> _Place:
    """Select the points of the cloud around a hole."""
    ends = hole.rim or hole.island
    loop_m = surface.vertices_m[hole.loop]
    edges = np.stack([hole.loop, np.roll(hole.loop, -1)], axis=1)
    centers_m, radius_m = hole.center_m[None], float(np.linalg.norm(loop_m - hole.center_m, axis=1).max())
    if ends and radius_m > _WHOLE * surface.radii_m[-1]:
        edges = edges[np.unique(np.linspace(0, len(edges), _PLACES, endpoint=False).astype(int))]
        a, b = surface.vertices_m[edges].swapaxes(0, 1)
        centers_m, radius_m = 0.5 * (a + b), 0.5 * float(np.linalg.norm(b - a, axis=1).max())
    rows, nearest, reach_m = _cut(cloud.points_m, centers_m, radius_m, surface.radii_m[-1])
    points_m, normals = cloud.points_m[rows], np.asarray(cloud.normals)[rows]
    tree = cKDTree(points_m)
    local = _rows_of(tree, _points_m(surface, edges, cloud).reshape(-1, 3)).reshape(-1, 2)
    by_ball = half_edges(roll(points_m, normals, surface.radii_m).triangles, local) >= 0
    if by_ball.any():  # others are the new edges of closed notches
        edges, local = edges[by_ball], local[by_ball]
    owner = cKDTree(centers_m).query(surface.vertices_m[edges].mean(axis=1))[1]
    directions = _means(normals[local[:, 0]] + normals[local[:, 1]], owner, len(centers_m))
    if ends:
        samples_m = beyond_m(surface.vertices_m, surface.triangles, edges, surface.radii_m[-1])
    else:
        samples_m = skin_points_m(loop_m, _SAMPLES)
    return _Place(
        points_m=points_m,
        normals=normals,
        agreed=directions[nearest],
        edges=local,
        ends=ends,
        samples_m=samples_m,
        directions=directions[owner] if ends else np.broadcast_to(directions[0], samples_m.shape),
        height_m=0.5 * hole.length_m / np.pi,
        spacing_m=float(np.median(tree.query(points_m, k=2)[0][:, 1])),
        widest_gap_m=2.0 * float(tree.query(samples_m)[0].max()),
        largest_m=0.5 * (reach_m - radius_m),
    )


def _cut(
    points_m: FloatArray, centers_m: FloatArray, radius_m: float, ball_m: float
) -> tuple[IntArray, IntArray, float]:
    """Return rows of distinct points near the centres, the nearest centre of each, and the cut distance."""
    distances_m, nearest = cKDTree(centers_m).query(points_m)
    wanted_m = radius_m + 2.0 * max(_BALLS_AROUND * ball_m, 2.0 * radius_m)
    last = min(_MOST_POINTS, len(points_m)) - 1
    reach_m = max(
        min(wanted_m, float(np.partition(distances_m, last)[last])), radius_m + 2.0 * GROWTH * ball_m
    )
    rows = np.flatnonzero(distances_m <= reach_m)
    rows = rows[distinct_rows(points_m[rows])]
    return rows, nearest[rows], reach_m


def _points_m(surface: SurfaceResult, edges: IntArray, cloud: PointCloud) -> FloatArray:
    """Return (E, 2, 3) the points of the cloud from which the ends of edges come.

    Vertices at rims have moved (``rims.even_rims``); if most vertices have, the cloud is another one.
    """
    rows = surface.rows
    if rows is None or rows.max(initial=0) >= len(cloud):
        return surface.vertices_m[edges]
    unmoved = np.all(cloud.points_m[rows] == surface.vertices_m, axis=1)
    return (cloud.points_m[rows] if unmoved.mean() > MOST else surface.vertices_m)[edges]


def _rows_of(tree: cKDTree, places_m: FloatArray) -> IntArray:
    """Return (M,) rows of the points that are exactly at (M, 3) positions."""
    distance_m, rows = tree.query(places_m)
    if np.any(distance_m > 0.0):
        raise InputError(
            f"A corner of the hole is {distance_m.max():.3g} m from the nearest point of the cloud; "
            "take the cloud that the ball rolled over"
        )
    return rows


def _means(vectors: FloatArray, owner: IntArray, count: int) -> FloatArray:
    """Return (count, 3) mean direction of the (M, 3) vectors of each owner."""
    sums = np.stack([np.bincount(owner, weights=part, minlength=count) for part in vectors.T], axis=1)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)


def _grow(place: _Place, radii_m: Sequence[float]) -> tuple[float | None, float | None, float]:
    """Roll larger and larger balls until one closes the hole.

    It must close it after all smaller balls that were tried, and also directly after the given balls.

    Returns:
        The radius that closes it, or None; the first radius that closes nine tenths, or None; the share that
        the last ball closes.
    """

    def closes(rolled: Rolled) -> bool:
        if place.ends:
            return float(_closed(rolled, place).mean()) > MOST
        return is_closed(rolled.triangles, rolled.radius_index >= len(radii_m), place.edges)

    roller = Roller(place.points_m, place.normals)
    for radius_m in radii_m:
        rolled = roller.roll(radius_m)
    most_radius_m = None
    radius_m = GROWTH * radii_m[-1]
    while radius_m <= place.largest_m:
        rolled = roller.roll(radius_m)
        if closes(rolled) and closes(roll(place.points_m, place.normals, (*radii_m, radius_m))):
            return radius_m, None, 1.0
        if most_radius_m is None and _closed(rolled, place).mean() > 0.9:
            most_radius_m = radius_m
        radius_m *= GROWTH
    return None, most_radius_m, float(_closed(rolled, place).mean())


def _closed(rolled: Rolled, place: _Place) -> BoolArray:
    """Return (E,) True for a rim's edges with two triangles, or (S,) True for a hole's covered samples.

    A triangle covers a sample that is below or above it, if it faces outwards like the loop.
    """
    if place.ends:
        return half_edges(rolled.triangles, place.edges[:, ::-1]) >= 0
    a, b, c = place.points_m[rolled.triangles].swapaxes(0, 1)
    facing = np.cross(b - a, c - a) @ place.directions[0] > 0.0
    scene = triangle_scene(place.points_m, rolled.triangles[facing])
    above_m = place.samples_m + place.height_m * place.directions
    return first_hits(scene, above_m, -place.directions) <= 2.0 * place.height_m


def _sentences(reason: Reason, place: _Place, surface: SurfaceResult, found: _Findings) -> tuple[str, str]:
    """Return the sentence with the cause, and the one or two sentences with the remedy."""
    if reason == "outside view":
        return _unseen_sentences(place, found.known)
    if reason == "normals":
        return (
            "Points are there, but their normals contradict each other: if they agreed, balls of up to "
            f"{_length(surface.radii_m[-1])} would close {found.gained:.0%} more of "
            f"{'this rim' if place.ends else 'the hole'}.",
            "Take more smoothing passes, which make neighbouring normals agree.",
        )
    if reason == "no points":
        return _unmeasured_sentences(place, surface, found)
    return _gap_sentences(place, surface.radii_m[-1], found)


def _length(length_m: float) -> str:
    """Format a length in centimetres or millimetres."""
    if length_m >= 0.1:
        return f"{100 * length_m:.0f} cm"
    return f"{1000 * length_m:.0f} mm" if length_m >= 0.01 else f"{1000 * length_m:.1f} mm"


def _unseen_sentences(place: _Place, known: Known) -> tuple[str, str]:
    if known.outside_share + known.hidden_share <= MOST:
        return (
            f"Beyond {known.past_share:.0%} of this rim a camera sees something farther away: the surface "
            "turns to a side that no camera looks at.",
            "Add a camera that looks at it from the other side, or move one there.",
        )
    return (
        f"{known.outside_share:.0%} of {'what is beyond this rim' if place.ends else 'the hole'} is in no "
        f"camera's image, and {known.hidden_share:.0%} is hidden behind the surface in all of them.",
        "Add a camera that sees this place, or move one until it does.",
    )


def _unmeasured_sentences(place: _Place, surface: SurfaceResult, found: _Findings) -> tuple[str, str]:
    known = found.known
    if np.isfinite(known.sensor_share):
        sentence = (
            f"Of the pixels {'beyond this rim' if place.ends else 'of the hole'}, the sensor measured "
            f"{known.sensor_share:.0%}; for {known.inferred_share:.0%} only the network inferred a depth, "
            f"and {known.unknown_share:.0%} have no depth at all."
        )
    elif place.ends:
        sentence = (
            f"The cloud ends here: beyond {1.0 - found.most:.0%} of the rim's edges, no ball of up to "
            f"{_length(place.largest_m)} finds points to roll on to."
        )
    else:
        sentence = (
            f"A gap of {_length(place.widest_gap_m)} contains no point "
            f"({place.widest_gap_m / place.spacing_m:.0f} times the point spacing of "
            f"{_length(place.spacing_m)}): nothing was measured here."
        )
    if known.inferred_share > known.unknown_share and not _has_inferred(surface):
        remedy = "Fuse the sensor's depth with the network's, which knows more here."
    else:
        remedy = "Add a view from another place."
    return sentence, f"{remedy} {_ball_sentence(place, found)}"


def _gap_sentences(place: _Place, ball_m: float, found: _Findings) -> tuple[str, str]:
    ball, width = f"the largest ball so far, {_length(ball_m)} in radius,", _length(2.0 * ball_m)
    if place.ends:
        there = "Points go on" if found.radius_m is not None else "A depth is known"
        return f"{there} beyond this rim, but {ball} does not reach them.", _ball_sentence(place, found)
    gap = f"The widest gap in the hole is {_length(place.widest_gap_m)}"
    remedy = _ball_sentence(place, found)
    if place.widest_gap_m > 2.0 * ball_m:
        sentence = f"{gap}, and {ball} falls through all that are wider than {width}."
    elif found.layered > MOST and found.radius_m is None:
        sentence = f"{gap}, but triangles lie over or under {found.layered:.0%} of it: there are two layers."
        remedy = "Take more smoothing passes or fewer points, so that the layers become one."
    else:
        sentence = (
            f"{gap}, less than the {width} of {ball}, but somewhere along the loop the ball finds no three "
            "points to rest on."
        )
    if found.known.past_share > MOST:
        sentence += f" A camera looks through {found.known.past_share:.0%} of it: it may be a true opening."
    return sentence, remedy


def _ball_sentence(place: _Place, found: _Findings) -> str:
    """Return the sentence about the effect of larger balls."""
    if found.radius_m is not None:
        does = "goes on beyond most of this rim" if place.ends else "closes it"
        return f"A ball of {_length(found.radius_m)} radius {does}, at the price of smaller details."
    tried = _length(place.largest_m)
    if place.ends:
        return f"No ball of up to {tried} goes on beyond half of this rim."
    if found.most_radius_m is not None:
        return (
            f"A ball of {_length(found.most_radius_m)} radius covers most of it, but none of up to {tried} "
            "closes it completely; fill the remaining hole."
        )
    return (
        f"No ball of up to {tried} closed it, at best {found.most:.0%}; take more points, or fill the hole."
    )

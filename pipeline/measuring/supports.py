"""Search for the level plane that a thing stands on, by what is seen around the thing's footprint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.lookup import lookup_of
from pipeline.measuring.planes import Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import BoolArray, FloatArray, IntArray

LEVEL_DEG = 25.0
"""Largest angle between a supporting plane's normal and the vertical."""
BESIDE_M = 0.6
"""Largest horizontal distance from a footprint at which a supporting plane is looked for."""
ABOVE_M = 0.015
"""Least height of a part over its plane; lower, they cannot be told apart."""
TRIED = 4
"""Heights at which a supporting plane is looked for, and places at each."""
PIECES = 6
"""Equal pieces of each side of a footprint."""
ALONG = 3
"""Pieces of a side next to which a level has to be the nearest one, so that it continues along the side."""
CLEAR = 2.0
"""Ratio of the pieces next to the support to those next to a second level that continues along ``SIDES``."""
ABOUT = 2.0
"""Vertices whose distances differ by less than this, in spacings, are about as near."""
SIDES = 2
"""Sides of a footprint along which the supporting plane has to continue."""
NONE, SEVERAL = "No level plane continues", "Planes of different heights continue"


@dataclass(frozen=True, slots=True)
class Footprint:
    """A rectangle in the horizontal plane."""

    axes: FloatArray
    """(2, 2) unit axes of its sides as rows."""
    low_m: FloatArray
    """(2,) least coordinates along the axes."""
    high_m: FloatArray
    """(2,) greatest coordinates along the axes."""

    def beyond_m(self, points_m: FloatArray) -> FloatArray:
        """Return (N, 2, 2) signed distances of (N, 3) points outwards: of both axes, the low side first."""
        flat_m = points_m[:, :2] @ self.axes.T
        return np.stack([self.low_m - flat_m, flat_m - self.high_m], axis=2)


def levels_below(surface: MeasuredSurface, footprint: Footprint, top_m: float) -> list[Plane]:
    """Return the level planes with most vertices around or under a footprint, below a height.

    Args:
        surface: the surface.
        footprint: rectangle of the thing, or of the one vertex of it that is known.
        top_m: height of the thing's top or of that vertex.
    """
    away_m = _away_m(surface, footprint)
    depth_m = top_m - surface.vertices_m[:, 2]
    rows = np.flatnonzero(_is_level(surface) & (away_m < BESIDE_M) & (depth_m > ABOVE_M))
    steps = np.round(depth_m[rows] / ABOVE_M).astype(int)
    numbers, counts = np.unique(steps, return_counts=True)
    found = list[Plane]()
    for number in numbers[np.argsort(-counts)][:TRIED]:
        some = rows[steps == number]
        known = any(np.median(np.abs(_heights_m(plane, surface, some))) < ABOVE_M for plane in found)
        if not known:
            some = some[np.argsort(away_m[some], kind="stable")]
            found += _first_level(surface, some[:: max(1, len(some) // TRIED)])
    return found


def support_of(surface: MeasuredSurface, footprint: Footprint, planes: list[Plane], where: str) -> Plane:
    """Return the plane that a thing stands on.

    Next to each piece of the footprint's sides counts the plane with the nearest vertices, or the highest of
    those about as near: the lower ones are below it. The support continues so along half of at least
    ``SIDES`` sides, which the seat of a chair at a table, or a box next to a thing, hardly does.

    Args:
        surface: the surface.
        footprint: rectangle of the thing.
        planes: level planes below its top (``levels_below``).
        where: the marked point as text.

    Raises:
        InputError: no plane continues along so many sides, or another one along half as many pieces.
    """
    planes = sorted(planes, key=lambda plane: -plane.point_m[2])
    gaps_m = np.stack([_gaps_m(surface, footprint, plane) for plane in planes] or [np.full((1, 1), np.inf)])
    nearest_m = gaps_m.min(axis=0)
    about = gaps_m <= nearest_m + ABOUT * lookup_of(surface).spacing_m
    nearest = np.where(np.isfinite(nearest_m), about.argmax(axis=0), -1)
    pieces = np.stack([np.sum(nearest == k, axis=1) for k in range(len(gaps_m))])
    standing = np.flatnonzero(np.sum(pieces >= ALONG, axis=1) >= SIDES)
    most = sorted(standing, key=lambda k: -int(pieces[k].sum()))
    if len(most) == 1 or (most and pieces[most[0]].sum() >= CLEAR * pieces[most[1]].sum()):
        return planes[int(most[0])]
    raise unknown_height(where, SEVERAL if most else NONE)


def unknown_height(where: str, why: str = NONE) -> InputError:
    """Return the error about a thing, marked at a point, whose support is not known."""
    return InputError(
        f"{why} around what the point {where} m marks, so its height is unknown; mark three faces of it "
        "instead"
    )


def _is_level(surface: MeasuredSurface) -> BoolArray:
    return surface.normals[:, 2] > np.cos(np.radians(LEVEL_DEG))


def _away_m(surface: MeasuredSurface, footprint: Footprint) -> FloatArray:
    """Return (V,) horizontal distances of the vertices from a footprint; 0 under or over it."""
    outside_m = footprint.beyond_m(surface.vertices_m).max(axis=2)
    return np.linalg.norm(np.maximum(outside_m, 0.0), axis=1)


def _heights_m(plane: Plane, surface: MeasuredSurface, rows: IntArray) -> FloatArray:
    return (surface.vertices_m[rows] - plane.point_m) @ plane.normal


def _first_level(surface: MeasuredSurface, rows: IntArray) -> Iterator[Plane]:
    """Yield the level plane of the first of some vertices that has one."""
    for row in rows:
        try:
            plane = plane_at(surface, surface.vertices_m[row])
        except InputError:
            continue
        if plane.normal[2] > np.cos(np.radians(LEVEL_DEG)):
            yield plane
            return


def _gaps_m(surface: MeasuredSurface, footprint: Footprint, plane: Plane) -> FloatArray:
    """Return (4, PIECES) distances from the pieces of a footprint's sides to the nearest vertex of a plane.

    A vertex is next to a piece if it is straight outwards from it, within ``BESIDE_M``; infinity without one.
    """
    rows = np.flatnonzero(_is_level(surface))
    rows = rows[np.abs(_heights_m(plane, surface, rows)) < ABOVE_M]
    beyond_m = footprint.beyond_m(surface.vertices_m[rows])
    sizes_m = np.maximum(footprint.high_m - footprint.low_m, 1e-9)
    gaps_m = np.full((4, PIECES), np.inf)
    for axis in range(2):
        other = 1 - axis
        piece = np.floor(-beyond_m[:, other, 0] / sizes_m[other] * PIECES).astype(int)
        for end in range(2):
            off_m = beyond_m[:, axis, end]
            near = (off_m > 0.0) & (off_m < BESIDE_M) & (piece >= 0) & (piece < PIECES)
            np.minimum.at(gaps_m[2 * axis + end], piece[near], off_m[near])
    return gaps_m

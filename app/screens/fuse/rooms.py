"""Three synthetic rooms in which a wrong registration fits: a corridor, a square room and a mirrored room.

Each is scanned from two places. A scan's frame is a camera's: x to the right along a wall, y down, z forward
along another wall. The scans are cut off at some height, so that one sees into the rooms.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.screens.fuse.view import RaceMode
from pipeline.kernels.geometry import apply, inverse, rigid
from pipeline.types import BoolArray, FloatArray, PointCloud

POINTS = 9000
"""Points of a scan, including those that furniture hides from the scanner."""
NOISE_M = 0.004
"""Standard deviation of a point's range."""
HEIGHT_M, SCANNER_M = 1.4, 1.1
"""Height at which the scans are cut off, and height of the scanners."""
RANGE_M = 4.0
"""Distance that a scanner sees to each side along the corridor, which is longer."""
PLACES_M = ((0.5, -0.1), (-0.4, 0.5))
"""x and y of the two scanners in a room: the source's and the target's."""
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from a scan's frame to the room's, whose z is up."""
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True)
class Scans:
    """Two scans of a room."""

    source: PointCloud
    target: PointCloud
    T_home: FloatArray
    """(4, 4) takes the source's points to their true places in the target's frame; for a mirrored source a
    reflection, which no rigid motion equals."""
    T_aligned: FloatArray
    """(4, 4) rigid pose T_target_source: the true one; for a mirrored source that which aligns the walls."""
    T_room_target: FloatArray
    """(4, 4) pose of the target's scanner in the room."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes, with the middle of its bottom at x, y and 0."""

    x_m: float
    y_m: float
    size_m: tuple[float, float, float]

    @property
    def low_m(self) -> FloatArray:
        """(3,) lowest corner."""
        return np.array([self.x_m - 0.5 * self.size_m[0], self.y_m - 0.5 * self.size_m[1], 0.0])

    def sides(self, axes: Sequence[int] = (0, 1)) -> list[tuple[FloatArray, FloatArray]]:
        """Return the (3,) lowest corner and (3,) extent of both sides perpendicular to each of the axes."""
        found = []
        for axis in axes:
            flat_m = np.where(np.arange(3) == axis, 0.0, self.size_m)
            found += [(self.low_m, flat_m), (self.low_m + self.size_m - flat_m, flat_m)]
        return found

    def floor(self) -> tuple[FloatArray, FloatArray]:
        """Return the (3,) lowest corner and the (3,) extent of the bottom."""
        return self.sides((2,))[0]

    def hides(self, eye_m: FloatArray, points_m: FloatArray) -> BoolArray:
        """Return for each of (N, 3) points whether the box is between it and the eye."""
        arms_m = points_m - eye_m
        with np.errstate(divide="ignore"):
            at = np.stack([self.low_m - eye_m, self.low_m + self.size_m - eye_m])[:, None] / arms_m
        enters, leaves = at.min(axis=0).max(axis=1), at.max(axis=0).min(axis=1)
        return np.asarray((enters < leaves) & (enters > 0.0) & (enters < 1.0 - 1e-9))


@functools.cache
def corridor() -> Scans:
    """Return two scans of a corridor, from places 2 m apart along it."""
    places_m, scans = ((1.0, 0.0), (-1.0, 0.0)), []
    for seed, place_m in enumerate(places_m):
        seen = Box(*place_m, (2.0 * RANGE_M, 2.0, HEIGHT_M))
        scans.append(_scan([*seen.sides((1,)), seen.floor()], [], place_m, seed))
    return _scans(scans, places_m)


@functools.cache
def square_room() -> Scans:
    """Return two scans of an empty room with four equal walls."""
    return _furnished(Box(0.0, 0.0, (3.6, 3.6, HEIGHT_M)), [])


@functools.cache
def mirrored_room() -> Scans:
    """Return two scans of a furnished room; the x coordinates of the source are negated."""
    bed, cupboard = Box(-1.15, 0.85, (2.0, 1.5, 0.5)), Box(1.9, -0.6, (0.5, 2.0, HEIGHT_M))
    desk = Box(-0.3, -1.3, (1.4, 0.7, 0.75))
    scans = _furnished(Box(0.0, 0.0, (4.3, 3.4, HEIGHT_M)), [bed, cupboard, desk])
    T_room_source = MIRROR @ scans.T_room_target @ scans.T_home @ MIRROR  # in the room's mirror image
    return Scans(
        source=PointCloud(apply(MIRROR, scans.source.points_m)),
        target=scans.target,
        T_home=scans.T_home @ MIRROR,
        T_aligned=inverse(scans.T_room_target) @ T_room_source,
        T_room_target=scans.T_room_target,
    )


def _furnished(room: Box, furniture: Sequence[Box]) -> Scans:
    """Return two scans of a room's floor and walls, and of its furniture's sides and tops."""
    faces = [*room.sides(), room.floor()]
    for one in furniture:
        faces += [*one.sides(), one.sides((2,))[1]]
    scans = [_scan(faces, furniture, place_m, seed) for seed, place_m in enumerate(PLACES_M)]
    return _scans(scans, PLACES_M)


def _scan(
    faces: Sequence[tuple[FloatArray, FloatArray]],
    furniture: Sequence[Box],
    place_m: tuple[float, float],
    seed: int,
) -> PointCloud:
    """Return uniform random points of the faces that are seen from a place, with noise along the rays."""
    rng = np.random.default_rng(seed)
    areas = np.array([np.prod(extent_m[extent_m > 0.0]) for _, extent_m in faces])
    counts = np.rint(POINTS * areas / areas.sum()).astype(int)
    points_m = np.concatenate(
        [low + rng.random((count, 3)) * extent for count, (low, extent) in zip(counts, faces, strict=True)]
    )
    eye_m = np.array([*place_m, SCANNER_M])
    hidden = [one.hides(eye_m, points_m) for one in furniture]
    arms_m = points_m[~np.any(hidden, axis=0)] - eye_m if furniture else points_m - eye_m
    ranges_m = np.linalg.norm(arms_m, axis=1, keepdims=True)
    noisy_m = arms_m * (1.0 + NOISE_M * rng.standard_normal(ranges_m.shape) / ranges_m)
    return PointCloud(noisy_m @ AXES)


def _scans(scans: Sequence[PointCloud], places_m: Sequence[tuple[float, float]]) -> Scans:
    T_room = [rigid(AXES, np.array([*place_m, SCANNER_M])) for place_m in places_m]
    T_true = inverse(T_room[1]) @ T_room[0]
    return Scans(scans[0], scans[1], T_true, T_true, T_room[1])


ROOMS: Mapping[RaceMode, Callable[[], Scans]] = {
    "corridor": corridor,
    "square": square_room,
    "mirrored": mirrored_room,
}
"""The rooms by the race's mode."""

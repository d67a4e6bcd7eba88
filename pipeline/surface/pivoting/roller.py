"""Our implementation of ball pivoting: arrays in, records out, in batches that can be shown and cancelled."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.kernels.point_sets import distinct_rows
from pipeline.surface.pivoting.front import FACES, HEAD, SETTLED, TAIL, grown, new_front
from pipeline.surface.pivoting.grid import build_grid
from pipeline.surface.pivoting.roll import advance, restart
from pipeline.surface.pivoting.seed import new_scratch
from pipeline.types import ByteArray, FloatArray, IntArray

ALL_AT_ONCE = 1 << 30
"""Batch size that is larger than any number of triangles."""
_JITTER = 1e-10
"""Points are moved by up to this share of the first radius, so that no four are exactly on one ball."""
_CELL = 2.0
"""Ratio of a grid cell's edge to the ball's radius."""
_MOST_RADII = 256


@dataclass(frozen=True, slots=True)
class Rolled:
    """The triangles of all balls."""

    triangles: IntArray
    """(F, 3) int32 point indices, anticlockwise from the outside."""
    radius_index: ByteArray
    """(F,) uint8 index of the radius that made each triangle."""
    ball_centers_m: FloatArray
    """(F, 3) centre of the ball that made each triangle."""


@dataclass(frozen=True, slots=True)
class BallPivotStep:
    """New triangles of one batch, and the current front."""

    triangles: IntArray
    """(k, 3) int32 triangles that are new since the previous batch."""
    ball_centers_m: FloatArray
    """(k, 3) centres of the balls that made them."""
    radius_m: float
    front_edges: IntArray
    """(e, 2) int32 point indices of the active edges, each with its triangle on the left."""
    progress: float
    """Progress from 0 to 1."""


class Roller:
    """Rolls balls of growing radius over an oriented cloud (Bernardini et al. 1999, SPEC 5).

    Memory is linear in the number of points. Points are moved by a fixed random amount, at most 1e-10 of
    the first radius, which decides consistently between the triangulations of points on one ball.
    Repeated points count once.

    Args:
        points_m: (N, 3) points.
        normals: (N, 3) normals towards the outside; points with a zero normal are not used.

    Raises:
        InputError: fewer than three points, no normals, or a point that is not finite.
    """

    def __init__(self, points_m: FloatArray, normals: FloatArray | None) -> None:
        if len(points_m) < 3:
            raise InputError(f"A surface needs at least 3 points, not {len(points_m)}; check the depth image")
        if normals is None or np.shape(normals) != np.shape(points_m):
            raise InputError("Ball pivoting needs a normal for each point; try to estimate them first")
        if not np.isfinite(points_m).all():
            raise InputError("A point of the cloud is not finite; remove such points first")
        points_m = np.asarray(points_m, dtype=np.float64)
        self._middle_m = np.median(points_m, axis=0)  # as origin, for numerical precision
        self._points_m = points_m - self._middle_m
        self._normals = np.ascontiguousarray(normals, dtype=np.float64)
        self._ids = distinct_rows(points_m)
        n = len(points_m)
        self._scratch = new_scratch(n)
        self._front = new_front(n)
        self._radii_m: list[float] = []

    @property
    def rolled(self) -> Rolled:
        """Copies of all triangles so far."""
        front, count = self._front, self._front.counts[FACES]
        return Rolled(
            front.triangles[:count].copy(),
            front.radius_index[:count].copy(),
            front.centers_m[:count] + self._middle_m,
        )

    @property
    def front_edges(self) -> IntArray:
        """(e, 2) int32 edges about which the current ball has yet to pivot."""
        front = self._front
        waiting = front.queue[front.counts[HEAD] : front.counts[TAIL]]
        waiting = waiting[front.twin[waiting] < 0]
        return np.stack([front.triangles.reshape(-1)[waiting], front.end[waiting]], axis=1)

    def roll(self, radius_m: float) -> Rolled:
        """Roll a ball that is larger than those before until it stops; returns all triangles so far.

        Raises:
            InputError: the radius is not positive or not larger, or it is one too many.
        """
        for _ in self.iterate(radius_m, ALL_AT_ONCE):
            pass
        return self.rolled

    def iterate(self, radius_m: float, batch: int) -> Generator[BallPivotStep]:
        """Roll like ``roll`` in steps of ``batch`` triangles; progress is that of this radius.

        If the generator is closed early, its triangles stay; a larger ball can continue from there.

        Raises:
            InputError: the radius is not positive, or not larger, or the batch is not positive.
        """
        radius_m = self._checked(radius_m, batch)
        self._radii_m.append(radius_m)
        if len(self._radii_m) == 1:
            jitter = np.random.default_rng(0).uniform(-1.0, 1.0, self._points_m.shape)
            self._points_m += _JITTER / np.sqrt(3.0) * radius_m * jitter
        grid = build_grid(self._points_m, self._ids, _CELL * radius_m)
        restart(self._points_m, grid, self._front, self._scratch, radius_m)
        done = False
        while not done:
            first = int(self._front.counts[FACES])
            while not done and (count := int(self._front.counts[FACES])) < first + batch:
                if count == len(self._front.triangles):
                    self._front = grown(self._front)
                done = advance(
                    self._points_m,
                    self._normals,
                    grid,
                    self._front,
                    self._scratch,
                    radius_m,
                    len(self._radii_m) - 1,
                    min(first + batch, len(self._front.triangles)),
                )
            yield self._batch(first, done)

    def _batch(self, first: int, done: bool) -> BallPivotStep:
        counts = self._front.counts
        return BallPivotStep(
            self._front.triangles[first : counts[FACES]].copy(),
            self._front.centers_m[first : counts[FACES]] + self._middle_m,
            self._radii_m[-1],
            self.front_edges,
            1.0 if done else min(float(counts[SETTLED] / len(self._ids)), 1.0),
        )

    def _checked(self, radius_m: float, batch: int) -> float:
        _check_radius(radius_m)
        if self._radii_m and not radius_m > self._radii_m[-1]:
            raise InputError(
                f"The next ball radius is {radius_m:.4g} m after {self._radii_m[-1]:.4g} m; take a larger one"
            )
        if len(self._radii_m) == _MOST_RADII:
            raise InputError(f"There are more than {_MOST_RADII} ball radii; take fewer")
        if batch < 1:
            raise InputError(f"A batch has {batch} triangles; take at least 1")
        return float(radius_m)


def iterate_roll(
    points_m: FloatArray, normals: FloatArray | None, radii_m: Sequence[float], batch: int
) -> Generator[BallPivotStep, None, Rolled]:
    """Roll balls over an oriented cloud, the smallest first, in steps of ``batch`` triangles.

    Args:
        points_m: (N, 3) points.
        normals: (N, 3) normals towards the outside.
        radii_m: ball radii, ascending.
        batch: most new triangles per step.

    Returns:
        The triangles of all balls; closing the generator earlier cancels.

    Raises:
        InputError: see ``Roller``; or there is no radius, one is not positive, or they do not ascend.
    """
    radii_m = tuple(radii_m)
    if not radii_m:
        raise InputError("There is no ball radius; try about one to four times the point spacing")
    for radius_m in radii_m:
        _check_radius(radius_m)
    roller = Roller(points_m, normals)
    for index, radius_m in enumerate(radii_m):
        for step in roller.iterate(radius_m, batch):
            progress = (index + step.progress) / len(radii_m)
            yield replace(step, progress=progress)
    return roller.rolled


def roll(points_m: FloatArray, normals: FloatArray | None, radii_m: Sequence[float]) -> Rolled:
    """Roll balls over an oriented cloud; returns the result of ``iterate_roll``."""
    return drain(iterate_roll(points_m, normals, radii_m, ALL_AT_ONCE))


def compile_all() -> None:
    """Compile all functions, which takes ten seconds once; the result is cached on disk."""
    corner_m = np.eye(3)
    roll(corner_m, np.full((3, 3), 0.6), [1.0, 2.0])


def _check_radius(radius_m: float) -> None:
    if not (np.isfinite(radius_m) and radius_m > 0.0):
        raise InputError(f"A ball radius is {radius_m} m; try about one to four times the point spacing")

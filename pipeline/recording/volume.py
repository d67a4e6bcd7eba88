"""A truncated signed distance volume of sparse voxel blocks, weighted by the depth sensor's noise law.

Curless and Levoy, "A volumetric method for building complex models from range images" (SIGGRAPH 1996), SPEC
10.3. Voxel (i, j, k) is centred at (i, j, k) times its edge in the world frame. Blocks of 8 x 8 x 8 voxels
near surfaces are found through a hash table.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pipeline.importing.depth_views import DepthView
from pipeline.kernels.geometry import inverse, rigid
from pipeline.kernels.kdtree import compiled
from pipeline.types import DepthNoise, FloatArray, IntArray, PointCloud

LEAST_VOXEL_M = 0.002
VOXEL_OF_NOISE = 2.0
"""Smallest edge of a voxel, and its ratio to the median noise (SPEC 10.3)."""
LARGEST_SD = 2.5
"""Largest standard deviation, in voxels, of a measurement that is used; a point's own is at most 1."""
TRUNCATION_VOXELS = 5.0
LEAST_SD = 0.01
"""Smallest standard deviation of a measurement or a point, in voxels."""
LEAST_Q = 1.0
"""Least exponent of the cosine in the noise: a ray that grazes an object soon leaves it, and voxels behind it
seem to be inside. Of a sphere seen from six sides 95 % of the points are then within .1 voxels, not .4."""
FARTHEST_M, _TABLE = 64.0, 1 << 16
"""Farther measurements are ignored; intervals of the tables of weights, of 1 mm or 1/65,536 of cos^2."""
STEEPEST = 4.0
"""Largest change of distance between neighbours, in voxels; it is larger at the edges of near objects."""
_SIDE, _VOXELS, _PADDED = 8, 512, 11
"""Side and size of a block; side with the voxels for its crossings and slopes: 1 before, 2 after."""
_MOST = 65535
"""Largest number of observations and of an image."""
_FIRST_BLOCKS, _RANGE, _NEAR_PX, _ONE = 1024, 1 << 20, 3, np.float32(1.0)
"""Room for blocks at first; bound of their coordinates, 21 bits each; pixels for the slope of the depth."""


def voxel_for(noise_m: float, pixel_m: float) -> float:
    """Return the edge of the voxels, metres, for depth of this median noise and distance of pixels."""
    return max(LEAST_VOXEL_M, VOXEL_OF_NOISE * noise_m, pixel_m)


class _Blocks(NamedTuple):
    """Storage of B blocks, of which the first are in use, and the hash table that finds them."""

    table: IntArray
    """(2 B,) index of the block in each place of the hash table; -1 where the place is free."""
    keys: IntArray
    """(B,) packed coordinates; they ascend with x, then y, then z."""
    stamps: IntArray
    """(B,) last frame that touched each block."""
    means: FloatArray
    """(B, 512, 2) float32 mean signed distance, in truncations, positive in front of the surface; and weight,
    the sum of (voxel / standard deviation)^2."""
    seen: IntArray
    """(B, 512) uint16 number of observations; it stops at its maximum."""
    first: IntArray
    """(B, 512) uint16 number of the image that observed a voxel first; it stops at its maximum."""


class Volume:
    """The weighted mean of all depth images that are integrated into it."""

    def __init__(self, voxel_m: float, truncation_m: float | None = None) -> None:
        """Make an empty volume; distances are truncated at ``truncation_m``, or else at five voxels."""
        self.voxel_m = float(voxel_m)
        self.truncation_m = TRUNCATION_VOXELS * self.voxel_m if truncation_m is None else float(truncation_m)
        self.blocks = 0
        """Number of blocks in use."""
        self._stamp = 0
        table, keys, stamps = (np.full(count * _FIRST_BLOCKS, -1) for count in (2, 1, 1))
        means = np.zeros((_FIRST_BLOCKS, _VOXELS, 2), np.float32)
        seen = np.zeros((_FIRST_BLOCKS, _VOXELS), np.uint16)
        self._images = 0
        self._store = _Blocks(table, keys, stamps, means, seen, np.zeros_like(seen))

    def integrate(self, view: DepthView, T_world_camera: FloatArray) -> None:
        """Average a depth image into the voxels of all blocks near its surface.

        A voxel takes the depth of the nearest pixel; its distance is along the optical axis, as is the noise.
        The weight is 1 / sd^2 at the angle of incidence, times the view's own; depth is ignored whose sd at
        normal incidence exceeds ``LARGEST_SD`` voxels.

        Args:
            view: a depth image with its camera and noise.
            T_world_camera: (4, 4) pose of that camera.
        """
        z_m = np.pad(view.depth.z_m.astype(np.float32), _NEAR_PX, constant_values=np.nan)
        matrix = np.asarray(view.camera.matrix, dtype=np.float64)
        pixels, far_m = _weigh(z_m, matrix, *_weights(view.noise, self.voxel_m), self.voxel_m)
        if view.weight is not None:
            pixels[..., 1] *= view.weight
        to_pixels = rigid(matrix, np.zeros(3)) @ inverse(T_world_camera)
        to_pixels[:, :3] *= self.voxel_m
        step = int(np.clip(2.0 * self.voxel_m * view.camera.fx_px / max(far_m, self.voxel_m), 1, 4))
        to_voxels = np.linalg.inv(to_pixels) @ np.diag([step, step, 1.0, 1.0])
        offsets = 1 + math.ceil(0.5 * self.truncation_m / self.voxel_m)  # half a block apart
        offsets_m = np.linspace(-self.truncation_m, self.truncation_m, offsets)
        while True:
            self._stamp += 1
            frame = pixels[::step, ::step], to_voxels, offsets_m, self._stamp
            self.blocks, touched = _touch(*frame, self._store, self.blocks)
            if self.blocks < len(self._store.keys):
                break
            self._store = _grown(self._store)
        _update(touched, self._store, pixels, to_pixels, self.truncation_m, min(self._images, _MOST))
        self._images += 1

    def dated_points(self, least_observations: int = 2) -> tuple[PointCloud, IntArray]:
        """Find where the distance crosses zero between neighbours along x, y or z; ordered by voxel.

        The unit normals are towards the observing cameras (the gradient of the distance), and ``sigma_m`` is
        1 / sqrt(sum of 1 / sd^2), at least ``LEAST_SD`` voxels.

        Returns:
            The N points, and (N,) the number of the integrated image, from 0, by which both voxels of a point
            had been observed.
        """
        order = np.argsort(self._store.keys[: self.blocks])
        steepest = STEEPEST * self.voxel_m / self.truncation_m
        found = _crossings(order, self._store, least_observations, steepest)
        found = found[found[:, 6] >= 1.0]
        sigma_m = self.voxel_m * np.maximum(LEAST_SD, 1.0 / np.sqrt(found[:, 6]))
        points = PointCloud(found[:, :3] * self.voxel_m, normals=found[:, 3:6].copy(), sigma_m=sigma_m)
        return points, found[:, 7].astype(np.int64)


def _grown(store: _Blocks) -> _Blocks:
    """Return the storage with room for twice as many blocks."""
    parts = [np.concatenate([part, np.zeros_like(part)]) for part in store[1:]]
    grown = _Blocks(np.full(2 * len(store.table), -1), *parts)
    _enter(grown, len(store.keys))
    return grown


@lru_cache(maxsize=8)
def _weights(noise: DepthNoise, voxel_m: float) -> tuple[FloatArray, FloatArray]:
    """Return two tables: weights (voxel / sd)^2 by depth, 0 where the sd exceeds ``LARGEST_SD`` voxels, and
    the factor of the weight by the squared cosine of incidence.
    """
    shares = np.linspace(0.0, 1.0, _TABLE + 1)
    sd = np.maximum(noise.sd_m(np.maximum(shares * FARTHEST_M, 1e-3)) / voxel_m, LEAST_SD)
    weights = np.where(sd <= LARGEST_SD, 1.0 / sd**2, 0.0)
    return weights.astype(np.float32), (shares ** max(noise.q, LEAST_Q)).astype(np.float32)


@compiled
def _weigh(
    z_m: FloatArray, matrix: FloatArray, by_depth: FloatArray, by_cosine: FloatArray, voxel_m: float
) -> tuple[FloatArray, float]:
    """Return (H, W, 2) depth and weight, 0 where the depth is ignored, and the largest depth that is not.

    The cosine of incidence follows from the slopes a = fx dz/du and b = fy dz/dv: the normal is (-a, -b,
    z + a x + b y), and its product with the ray (x, y, 1) is z. ``z_m`` has a margin of 3 pixels of NaN.
    """
    m = _NEAR_PX
    height, width = z_m.shape[0] - 2 * m, z_m.shape[1] - 2 * m
    pixels = np.empty((height, width, 2), dtype=np.float32)
    far_m, entries, top = np.float32(0.0), np.float32(_TABLE / FARTHEST_M), np.float32(_TABLE)
    fx, fy = np.float32(matrix[0, 0] / m), np.float32(matrix[1, 1] / m)
    per_fx = np.float32(1.0 / matrix[0, 0])
    cx, variance = np.float32(matrix[0, 2]), np.float32(2.0 * voxel_m * voxel_m)
    for v in range(height):
        y = np.float32((v - matrix[1, 2]) / matrix[1, 1])
        for u in range(width):
            z, weight = z_m[v + m, u + m], np.float32(0.0)
            if z > 0.0 and z < np.float32(FARTHEST_M):
                weight = by_depth[np.uint32(z * entries + np.float32(0.5))]
            if weight > 0.0:
                x, noise = (np.float32(u) - cx) * per_fx, np.divide(variance, weight)
                a = fx * _change(z_m[v + m, u], z, z_m[v + m, u + 2 * m], noise)
                b = fy * _change(z_m[v, u + m], z, z_m[v + 2 * m, u + m], noise)
                c = z + a * x + b * y
                squared = np.divide(z * z, (a * a + b * b + c * c) * (_ONE + x * x + y * y))
                weight *= by_cosine[np.uint32(min(squared, _ONE) * top)]
                far_m = max(far_m, z)
            pixels[v, u, 0], pixels[v, u, 1] = z, weight
    return pixels, float(far_m)


@compiled
def _change(before: float, here: float, after: float, noise: float) -> float:
    """Return the smaller of the changes of depth to two pixels, less noise of this variance; 0 if unknown."""
    back, ahead = here - before, after - here
    change = back if abs(back) < abs(ahead) or ahead != ahead else ahead
    squared = change * change - noise
    return math.copysign(math.sqrt(squared), change) if squared > 0.0 else 0.0 * here


@compiled
def _touch(
    pixels: FloatArray, to_voxels: FloatArray, offsets_m: FloatArray, stamp: int, store: _Blocks, count: int
) -> tuple[int, IntArray]:
    """Make the blocks at all offsets from the depth of each pixel.

    Returns the number of blocks and the (M,) blocks of this frame, none if the storage is full.
    """
    touched, many = np.empty(len(store.keys), dtype=np.int64), 0
    last, a = np.full(len(offsets_m), -1), to_voxels
    for v in range(pixels.shape[0]):
        for u in range(pixels.shape[1]):
            if pixels[v, u, 1] == 0.0:
                continue
            x = a[0, 0] * u + a[0, 1] * v + a[0, 2]
            y = a[1, 0] * u + a[1, 1] * v + a[1, 2]
            z = a[2, 0] * u + a[2, 1] * v + a[2, 2]
            for k in range(len(offsets_m)):
                depth_m = pixels[v, u, 0] + offsets_m[k]
                key = _key(a[0, 3] + x * depth_m, a[1, 3] + y * depth_m, a[2, 3] + z * depth_m)
                if key == last[k] or key < 0:
                    continue
                last[k] = key
                place = _find(store, key)
                if store.table[place] < 0:
                    store.table[place], store.keys[count] = count, key
                    count += 1
                    if count == len(store.keys):
                        return count, touched[:0]
                block = store.table[place]
                if store.stamps[block] != stamp:
                    store.stamps[block], touched[many] = stamp, block
                    many += 1
    return count, touched[:many]


@compiled
def _key(x: float, y: float, z: float) -> int:
    """Return the packed coordinates of the block at a place in units of voxels; -1 out of range."""
    x, y, z = (x + 0.5) / _SIDE, (y + 0.5) / _SIDE, (z + 0.5) / _SIDE
    if not (abs(x) < _RANGE and abs(y) < _RANGE and abs(z) < _RANGE):
        return -1
    return ((math.floor(x) + _RANGE) << 42) | ((math.floor(y) + _RANGE) << 21) | (math.floor(z) + _RANGE)


@compiled
def _corner(key: int) -> tuple[int, int, int]:
    """Return the coordinates of a block's first voxel, in voxels."""
    x, y, z = key >> 42, (key >> 21) & (2 * _RANGE - 1), key & (2 * _RANGE - 1)
    return _SIDE * (x - _RANGE), _SIDE * (y - _RANGE), _SIDE * (z - _RANGE)


@compiled
def _find(store: _Blocks, key: int) -> int:
    """Return the place of a key in the hash table, or a free place (Knuth's multiplicative hashing)."""
    mixed = (np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(32)
    place = np.int64(mixed) & (len(store.table) - 1)
    while store.table[place] >= 0 and store.keys[store.table[place]] != key:
        place = (place + 1) & (len(store.table) - 1)
    return int(place)


@compiled
def _enter(store: _Blocks, count: int) -> None:
    """Enter the first ``count`` blocks into the empty hash table."""
    for block in range(count):
        store.table[_find(store, store.keys[block])] = block


@compiled
def _update(
    touched: IntArray,
    store: _Blocks,
    pixels: FloatArray,
    to_pixels: FloatArray,
    truncation_m: float,
    image: int,
) -> None:
    """Average image number ``image`` into the voxels of its blocks, except behind the truncation."""
    flat, scale = pixels.reshape(-1, 2), np.float32(1.0 / truncation_m)
    at, z_m = np.empty(_VOXELS, dtype=np.int32), np.empty(_VOXELS, dtype=np.float32)
    for block in touched:
        _project(_corner(store.keys[block]), to_pixels, pixels.shape[1], pixels.shape[0], at, z_m)
        means, seen, first = store.means[block], store.seen[block], store.first[block]
        for voxel in range(_VOXELS):
            if at[voxel] < 0:
                continue
            weight, ahead = flat[at[voxel], 1], (flat[at[voxel], 0] - z_m[voxel]) * scale
            if weight > 0.0 and ahead >= -_ONE:
                means[voxel, 1] += weight
                means[voxel, 0] += (min(ahead, _ONE) - means[voxel, 0]) * np.divide(weight, means[voxel, 1])
                if seen[voxel] == 0:
                    first[voxel] = image
                seen[voxel] += seen[voxel] < _MOST


@compiled
def _project(
    corner: tuple[int, int, int],
    to_pixels: FloatArray,
    width: int,
    height: int,
    at: IntArray,
    z_m: FloatArray,
) -> None:
    """Write the (512,) pixel index, -1 outside the image, and depth of a block's voxels.

    The loop has no branches and its divisions no checks, so that it compiles to vector instructions.
    """
    columns, wide, high, half = np.int32(width), np.float32(width), np.float32(height), np.float32(0.5)
    steps, first = to_pixels[:3, :3].astype(np.float32), np.empty(3, dtype=np.float32)
    for row in range(3):
        p = to_pixels[row]
        first[row] = p[0] * corner[0] + p[1] * corner[1] + p[2] * corner[2] + p[3]
    for voxel in range(_VOXELS):
        i, j, k = np.float32(voxel >> 6), np.float32((voxel >> 3) & 7), np.float32(voxel & 7)
        z = first[2] + i * steps[2, 0] + j * steps[2, 1] + k * steps[2, 2]
        near = np.divide(_ONE, z)
        u = (first[0] + i * steps[0, 0] + j * steps[0, 1] + k * steps[0, 2]) * near + half
        v = (first[1] + i * steps[1, 0] + j * steps[1, 1] + k * steps[1, 2]) * near + half
        inside = (z > 0.0) & (u >= 0.0) & (u < wide) & (v >= 0.0) & (v < high)
        at[voxel], z_m[voxel] = np.int32(v) * columns + np.int32(u) if inside else -1, z


@compiled
def _crossings(order: IntArray, store: _Blocks, least: int, steepest: float) -> FloatArray:
    """Return (N, 8) points, in voxels, normals, weights and first images at zero crossings, by block."""
    found, many = np.empty((6 * _VOXELS, 8)), 0
    means = np.empty((_PADDED**3, 3), dtype=np.float32)
    for block in order:
        corner = _corner(store.keys[block])
        _surround(corner, store, least, means)
        if many + 3 * _VOXELS >= len(found):
            found = np.concatenate((found, np.empty_like(found)))
        for voxel in range(_VOXELS):
            i, j, k = voxel >> 6, (voxel >> 3) & 7, voxel & 7
            here = ((i + 1) * _PADDED + j + 1) * _PADDED + k + 1
            for axis in range(3):
                row = found[many]
                share = _crossing(means, here, axis, steepest, row)
                if share >= 0.0:
                    row[0], row[1], row[2] = corner[0] + i, corner[1] + j, corner[2] + k
                    row[axis] += share
                    many += 1
    return found[:many]


@compiled
def _surround(corner: tuple[int, int, int], store: _Blocks, least: int, means: FloatArray) -> None:
    """Copy means and first images of the voxels -1 to 9 of a block along each axis, and of its neighbours.

    The distance is NaN where nothing was observed, the weight 0 where there are too few observations.
    """
    blocks = np.empty(27, dtype=np.int64)
    for near in range(27):
        i, j, k = near // 9 - 1, near // 3 % 3 - 1, near % 3 - 1
        key = _key(corner[0] + _SIDE * i, corner[1] + _SIDE * j, corner[2] + _SIDE * k)
        blocks[near] = store.table[_find(store, key)]
    for here in range(_PADDED**3):
        i, j, k = here // _PADDED**2 + 7, here // _PADDED % _PADDED + 7, here % _PADDED + 7
        block = blocks[9 * (i >> 3) + 3 * (j >> 3) + (k >> 3)]
        voxel = ((i & 7) << 6) | ((j & 7) << 3) | (k & 7)
        seen = store.seen[block, voxel] if block >= 0 else 0
        means[here, 0] = store.means[block, voxel, 0] if seen > 0 else np.nan
        means[here, 1] = store.means[block, voxel, 1] if seen > 0 and seen >= least else 0.0
        means[here, 2] = store.first[block, voxel] if seen > 0 else 0.0


@compiled
def _crossing(means: FloatArray, here: int, axis: int, steepest: float, row: FloatArray) -> float:
    """Return where the distance crosses zero between a voxel and the next along an axis, 0 to 1; -1 if not.

    Both must be closer than the truncation. ``row[3:]`` receives the normal, the weight and the first image.
    """
    steps = (_PADDED * _PADDED, _PADDED, 1)
    there = here + steps[axis]
    a, b = means[here, 0], means[there, 0]
    crosses = (a < 0.0) != (b < 0.0) and max(abs(a), abs(b)) < 1.0 and abs(a - b) <= steepest
    if not crosses or means[here, 1] == 0.0 or means[there, 1] == 0.0:
        return -1.0
    share = a / (a - b)
    for i in range(3):
        slope, next_slope = _slope(means, here, steps[i]), _slope(means, there, steps[i])
        row[3 + i] = (1.0 - share) * slope + share * next_slope
    if not row[3 + axis] * (b - a) > 0.0:  # the distance must grow along the normal
        return -1.0
    row[3:6] /= math.sqrt(row[3] ** 2 + row[4] ** 2 + row[5] ** 2)
    row[6] = (1.0 - share) * means[here, 1] + share * means[there, 1]
    row[7] = max(means[here, 2], means[there, 2])
    return share


@compiled
def _slope(means: FloatArray, here: int, step: int) -> float:
    """Return the change of distance to the next voxel along an axis, by the neighbours that are known."""
    before, after = means[here, 0] - means[here - step, 0], means[here + step, 0] - means[here, 0]
    if before != before or after != after:
        return before if before == before else after if after == after else 0.0
    return 0.5 * (before + after)

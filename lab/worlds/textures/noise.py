"""Lattice noise, coordinates on box faces and random numbers of cells: compiled base of the textures."""

from __future__ import annotations

import numba
import numpy as np

from pipeline.types import FloatArray

_LATTICE = np.random.default_rng(20210).random((32, 32, 32), dtype=np.float32)


@numba.njit(cache=True, nogil=True, inline="always")
def _value(lattice, x, y, z):  # type: ignore[no-untyped-def]
    fx, fy, fz = np.floor(x), np.floor(y), np.floor(z)
    i, j, k = np.int64(fx) & 31, np.int64(fy) & 31, np.int64(fz) & 31
    i1, j1, k1 = (i + 1) & 31, (j + 1) & 31, (k + 1) & 31
    a, b, c = x - fx, y - fy, z - fz
    a, b, c = a * a * (3.0 - 2.0 * a), b * b * (3.0 - 2.0 * b), c * c * (3.0 - 2.0 * c)
    p = lattice[i, j, k] + (lattice[i, j, k1] - lattice[i, j, k]) * c
    q = lattice[i, j1, k] + (lattice[i, j1, k1] - lattice[i, j1, k]) * c
    r = lattice[i1, j, k] + (lattice[i1, j, k1] - lattice[i1, j, k]) * c
    s = lattice[i1, j1, k] + (lattice[i1, j1, k1] - lattice[i1, j1, k]) * c
    p += (q - p) * b
    r += (s - r) * b
    return p + (r - p) * a


@numba.njit(cache=True, nogil=True)
def _fbm(lattice, points, frequency, offset, octaves, gain, out):  # type: ignore[no-untyped-def]
    total = np.float32(0.0)
    weight = np.float32(1.0)
    for _ in range(octaves):
        total += weight
        weight *= gain
    for n in range(len(points)):
        x = np.float32(points[n, 0] * frequency[0] + offset[0])
        y = np.float32(points[n, 1] * frequency[1] + offset[1])
        z = np.float32(points[n, 2] * frequency[2] + offset[2])
        value, weight = np.float32(0.0), np.float32(1.0)
        for _ in range(octaves):
            value += weight * _value(lattice, x, y, z)
            weight *= gain
            x, y, z = (
                np.float32(2.03) * y + np.float32(7.1),
                np.float32(2.03) * z + np.float32(3.7),
                np.float32(2.03) * x + np.float32(1.3),
            )
        out[n] = value / total


def fbm(
    points_m: FloatArray, scale_m: float | FloatArray, seed: int, octaves: int = 3, gain: float = 0.5
) -> FloatArray:
    """Return (N,) float32 fractal value noise, 0 to 1, mean one half, at (N, 3) positions.

    Args:
        points_m: (N, 3).
        scale_m: size of the largest blobs, in all directions or (3,) along each axis.
        seed: chooses the offset in one periodic lattice of noise.
        octaves: number of octaves; each is half the size of the one before.
        gain: strength of an octave relative to the one before.
    """
    out = np.empty(len(points_m), np.float32)
    frequency = (1.0 / np.broadcast_to(np.asarray(scale_m, np.float64), 3)).astype(np.float32)
    offset = np.random.default_rng(seed).uniform(0.0, 32.0, 3).astype(np.float32)
    _fbm(_LATTICE, points_m, frequency, offset, octaves, np.float32(gain), out)
    return out


@numba.njit(cache=True, nogil=True)
def face_uv(points, normals):  # type: ignore[no-untyped-def]
    """Return (N, 2) float32 coordinates on the box face that each normal points out of; v is up on walls."""
    out = np.empty((len(points), 2), np.float32)
    for n in range(len(points)):
        ax, ay, az = abs(normals[n, 0]), abs(normals[n, 1]), abs(normals[n, 2])
        if az >= ax and az >= ay:
            out[n, 0], out[n, 1] = points[n, 0], points[n, 1]
        elif ax >= ay:
            out[n, 0], out[n, 1] = points[n, 1], points[n, 2]
        else:
            out[n, 0], out[n, 1] = points[n, 0], points[n, 2]
    return out


@numba.njit(cache=True, nogil=True)
def cell_random(i, j, seed):  # type: ignore[no-untyped-def]
    """Return (N,) float32 uniform random numbers, 0 to 1, by hashing (N,) pairs of whole numbers."""
    out = np.empty(len(i), np.float32)
    for n in range(len(i)):
        h = np.uint32(np.int64(i[n])) * np.uint32(0x9E3779B1)
        h ^= np.uint32(np.int64(j[n])) * np.uint32(0x85EBCA77)
        h ^= np.uint32(seed) * np.uint32(0xC2B2AE3D)
        h = np.uint32((h ^ (h >> np.uint32(15))) * np.uint32(0x2C1B3C6D))
        h = np.uint32((h ^ (h >> np.uint32(12))) * np.uint32(0x297A2D39))
        h ^= h >> np.uint32(15)
        out[n] = np.float32(h & np.uint32(0xFFFFFF)) / np.float32(0x1000000)
    return out

"""Small places as points, and their views, for the tests of the search and its verdict."""

import numpy as np

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.types import PointCloud

NOISE_M = 0.003
T_TRUE = rigid(rotation_exp(np.radians(5.0) * np.array([0.6, -0.48, 0.64])), [0.06, -0.04, 0.05])


def room(seed: int, count: int = 5000, size_m=(4.0, 3.0, 2.5)) -> np.ndarray:
    """The six faces of a room and three unlike boxes in it, with noise; no two sides alike."""
    rng = np.random.default_rng(seed)
    boxes = [
        ((0.0, 0.0, 0.0), size_m),
        ((0.4, 0.5, 0.0), (0.9, 1.4, 0.7)),
        ((2.6, 0.0, 0.0), (0.5, 0.6, 1.9)),
    ]
    boxes.append(((2.2, 1.8, 0.0), (1.2, 0.7, 0.45)))
    points = [_faces(rng, np.array(corner), np.array(size)) for corner, size in boxes]
    together = np.concatenate(points)
    chosen = rng.choice(len(together), count, replace=False)
    return together[chosen] + rng.normal(scale=NOISE_M, size=(count, 3))


def _faces(rng: np.random.Generator, corner_m: np.ndarray, size_m: np.ndarray) -> np.ndarray:
    """Points on a box's faces, 400 per square metre."""
    faces = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        count = int(400 * size_m[others[0]] * size_m[others[1]])
        for end in (0.0, 1.0):
            points = rng.uniform(0.0, 1.0, (count, 3))
            points[:, axis] = end
            faces.append(corner_m + points * size_m)
    return np.concatenate(faces)


def pair(seed: int = 0, count: int = 5000) -> tuple[PointCloud, PointCloud]:
    """Two samplings of the room: the source is off by the inverse of ``T_TRUE``."""
    moving = apply(inverse(T_TRUE), room(2 * seed + 1, count))
    return PointCloud(moving), PointCloud(room(2 * seed + 2, count))


def scan(eye_m, seed: int, count: int = 12_000, size_m=(4.0, 3.0, 2.5)) -> PointCloud:
    """What a spherical scanner in an empty room with one box sees, in its own frame, with ranges' noise."""
    rng = np.random.default_rng(seed)
    rays = rng.normal(size=(count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    eye_m = np.asarray(eye_m, float)
    leave_m = np.where(rays > 0.0, np.asarray(size_m) - eye_m, -eye_m) / rays
    ranges_m = leave_m.min(axis=1)
    near, far = np.array([2.4, 0.4, 0.0]), np.array([3.2, 1.1, 1.4])
    enter = np.minimum((near - eye_m) / rays, (far - eye_m) / rays).max(axis=1)
    leave = np.maximum((near - eye_m) / rays, (far - eye_m) / rays).min(axis=1)
    ranges_m = np.where((enter < leave) & (enter > 0.0), np.minimum(ranges_m, enter), ranges_m)
    return PointCloud(rays * (ranges_m + rng.normal(scale=NOISE_M, size=count))[:, None])

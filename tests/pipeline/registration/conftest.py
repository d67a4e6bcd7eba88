"""Clouds small enough that any test may register them."""

import numpy as np
import pytest

from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.types import PointCloud


@pytest.fixture(scope="session")
def corner() -> PointCloud:
    """Floor, two walls and a ball in front of a camera at the origin; 1,500 points, 3 cm apart."""
    rng = np.random.default_rng(7)
    a, b = rng.uniform(0.0, 1.0, (2, 400))
    zero = np.zeros_like(a)
    faces = [np.stack(face, axis=1) for face in ((a, zero, b), (zero, a, b), (a, b, zero))]
    ball = rng.normal(size=(300, 3))
    ball = 0.25 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0.6, 0.5, 0.55]
    tilt = rotation_exp(np.array([0.6, -0.5, 0.3]))
    return PointCloud(np.concatenate([*faces, ball]) @ tilt.T + [0.0, 0.2, 1.5])


@pytest.fixture(scope="session")
def motion() -> np.ndarray:
    """A rigid motion of 3 degrees and 3 cm."""
    return rigid(rotation_exp(np.deg2rad(3.0) * np.array([2.0, -1.0, 2.0]) / 3.0), [0.02, -0.01, 0.02])


@pytest.fixture(scope="session")
def halves(corner) -> tuple[PointCloud, PointCloud, np.ndarray]:
    """Two overlapping random parts of the same place, and the motion of 3 cm and 2 degrees between them."""
    rows = np.random.default_rng(3).permutation(len(corner))
    T = rigid(rotation_exp(np.array([0.02, -0.03, 0.01])), [0.02, 0.01, -0.02])
    return corner.select(rows[:900]).transformed(inverse(T)), corner.select(rows[600:]), T

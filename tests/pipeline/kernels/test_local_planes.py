"""The planes through neighbourhoods are those of least squares, whatever the neighbourhood's shape."""

import numpy as np
import pytest

from pipeline.kernels.kdtree import KdTree
from pipeline.kernels.local_planes import patch_normals


@pytest.mark.parametrize(
    "widths", [(1, 1, 0), (3, 1, 0.01), (1, 1, 0.99), (1, 0.02, 0.01), (1, 0, 0), (0, 0, 0)]
)
def test_a_normal_is_the_direction_of_least_spread(widths):
    rng = np.random.default_rng(0)
    for _ in range(50):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        points_m = (rng.normal(size=(30, 3)) * widths) @ turn.T + rng.normal(size=3)
        normals = patch_normals(KdTree(points_m), len(points_m))
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
        spread = np.cov(points_m.T, bias=True)
        along = np.einsum("ni,ij,nj->n", normals, spread, normals)
        np.testing.assert_allclose(
            along, np.linalg.eigvalsh(spread)[0], atol=1e-13 * max(1.0, np.trace(spread))
        )

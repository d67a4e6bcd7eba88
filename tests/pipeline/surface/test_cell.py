"""The half box with which the search for a ball's centre begins."""

import numpy as np
import pytest

from pipeline.surface.pivoting import cell as cells


@pytest.mark.parametrize("seed", range(6))
def test_it_is_a_half_box_on_the_side_of_the_normal(seed):
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=3)
    normal[2] *= (-1.0) ** seed
    normal /= np.linalg.norm(normal)
    cell, reach_m = cells.new_cell(), cells._BOX_REACH * 0.02
    cells.begin(cell, *normal, 0.02)
    planes, corners_m = cell.planes[: cells.BOX], cell.at[: cell.counts[1], :3]
    np.testing.assert_allclose(planes[0::2, :3] @ planes[0::2, :3].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(planes[1::2, :3], -planes[0::2, :3], atol=1e-12)
    np.testing.assert_allclose(planes[4, :3], normal, atol=1e-12)
    expected_m = np.array([reach_m] * 5 + [0.0])
    np.testing.assert_allclose(planes[:, 3], expected_m, atol=1e-15)
    assert len(corners_m) == 8
    along_m = corners_m @ planes[::2, :3].T
    np.testing.assert_allclose(np.abs(along_m[:, :2]), reach_m)
    np.testing.assert_allclose(np.sort(along_m[:, 2]), [0.0] * 4 + [reach_m] * 4, atol=1e-12)
    assert len(np.unique(np.round(along_m / reach_m), axis=0)) == 8
    np.testing.assert_allclose(cell.at[:8, 3], np.square(corners_m).sum(axis=1))

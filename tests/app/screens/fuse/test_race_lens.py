"""The corner that a race magnifies."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.screens.fuse.lens import WINDOW_M, Distances, lens_of
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp

CORNER_M = np.array([0.3, 0.1, 2.0])
T_TRUE = rigid(rotation_exp(np.array([0.2, -0.1, 0.1])), np.array([0.5, 0.2, 0.1]))


def walls(second=True):
    """Two walls that meet at an upright edge before a camera at the origin, or one; 6 mm apart."""
    along, up = np.meshgrid(np.arange(0.0, 1.0, 0.006), np.arange(-0.5, 0.5, 0.006))
    along, up = along.ravel(), up.ravel()
    left = np.stack([-along, up, -0.6 * along], axis=1)
    right = np.stack([along, up, -0.6 * along], axis=1)
    return CORNER_M + (np.concatenate([left, right]) if second else left)


def lens(target_m, source_m=None):
    source_m = apply(inverse(T_TRUE), target_m) if source_m is None else source_m
    return lens_of(source_m, target_m, T_TRUE, Distances(source_m, T_TRUE, cKDTree(target_m)))


def test_it_looks_along_the_edge_at_a_place_on_it():
    found = lens(walls())
    off_m = found.view.center_m - CORNER_M
    assert np.linalg.norm(off_m[[0, 2]]) < 0.03
    np.testing.assert_allclose(np.abs(found.axes[2]), [0.0, 1.0, 0.0], atol=0.05)
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)
    assert found.axes[2] @ found.view.center_m <= 0.0


def test_at_its_true_place_the_moving_cloud_lies_on_the_other_and_has_no_colour():
    found = lens(walls())
    seen = found.at(T_TRUE)
    assert seen[:, 2].max() == 0
    away = cKDTree(found.view.target).query(seen[:, :2].astype(float))[0]
    assert np.percentile(away, 95) < 8


def test_a_shift_across_the_edge_is_seen_as_long_as_it_is():
    found = lens(walls())
    shift_m = 0.05 * found.axes[0]
    seen = found.at(rigid(np.eye(3), shift_m) @ T_TRUE)
    assert seen[:, 2].min() >= 126
    there = found.view.target + np.array([0.05 / WINDOW_M * 255.0, 0.0])
    there = there[there[:, 0] <= 255]
    assert np.percentile(cKDTree(seen[:, :2].astype(float)).query(there)[0], 90) < 10


def test_a_cloud_that_is_far_off_is_out_of_sight():
    assert len(lens(walls()).at(rigid(np.eye(3), np.array([0.0, 0.0, 3.0])) @ T_TRUE)) == 0


def test_a_single_wall_has_no_edge_and_neither_do_clouds_that_do_not_overlap():
    assert lens(walls(second=False)) is None
    far_m = apply(inverse(T_TRUE), walls() + np.array([0.0, 0.0, 5.0]))
    assert lens(walls(), far_m) is None


def test_a_handful_of_points_has_no_edge():
    assert lens(walls()[:10]) is None

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.kernels.geometry import rotation_exp
from pipeline.registration.neighbourhood import (
    FEW_POINTS,
    SHARED_NEIGHBOURS,
    SHARING,
    Normals,
    local_spacing_m,
    median_spacing_m,
    pca_normals,
)
from pipeline.registration.sample import drawn_rows


def test_normals_of_a_sphere_point_along_its_radius_towards_the_camera():
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions + np.array([0.0, 0.0, 5.0])
    normals = pca_normals(points)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    assert np.median(np.abs(np.sum(normals * directions, axis=1))) > 0.999
    assert (np.sum(normals * points, axis=1) <= 0).all()


def test_normals_of_a_plane_are_exact():
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-1, 1, (100, 2)), np.full(100, 2.0)])
    np.testing.assert_allclose(pca_normals(points), np.tile([0.0, 0.0, -1.0], (100, 1)), atol=1e-9)


def test_spacing_of_a_grid():
    grid = np.stack(np.meshgrid(np.arange(10), np.arange(10), [0.0]), axis=-1).reshape(-1, 3) * 0.02
    assert median_spacing_m(grid) == pytest.approx(0.02)
    assert np.median(local_spacing_m(grid)) == pytest.approx(0.02)
    assert local_spacing_m(grid[:1]).tolist() == [0.0]


def test_normals_are_the_thinnest_axes_of_patches():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1.0, 1.0, (2, 3000))
    points = np.stack([x, y, 3.0 + 0.3 * np.sin(3.0 * x) * y + rng.normal(0.0, 0.01, 3000)], axis=1)
    _, near = cKDTree(points).query(points, k=20)
    arms = points[near] - points[near].mean(axis=1, keepdims=True)
    thinnest = np.linalg.eigh(np.einsum("nki,nkj->nij", arms, arms))[1][:, :, 0]
    normals = pca_normals(points)
    np.testing.assert_allclose(np.abs(np.sum(normals * thinnest, axis=1)), 1.0, atol=1e-9)
    assert (np.sum(normals * points, axis=1) <= 0.0).all()


def test_shared_normals_are_those_of_the_nearest_drawn_point():
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (8000, 3)) * [1.0, 1.0, 0.05] + [0.0, 0.0, 3.0]
    shared, drawn = Normals(points).all, drawn_rows(points, 8000 // SHARING)
    _, near = cKDTree(points).query(points[drawn], k=SHARED_NEIGHBOURS)
    for row in range(0, 8000, 200):
        givers = np.where(
            (near == row).any(axis=1), np.linalg.norm(points[drawn] - points[row], axis=1), np.inf
        )
        if np.isfinite(givers.min()):
            patch = points[near[givers.argmin()]]
            thinnest = np.linalg.eigh(np.cov(patch.T))[1][:, 0]
            assert abs(shared[row] @ thinnest) == pytest.approx(1.0, abs=1e-9)
    assert len(np.unique(np.abs(shared).round(9), axis=0)) < 1500
    assert (np.sum(shared * points, axis=1) <= 0.0).all()


def test_a_point_far_from_all_others_has_a_normal_of_its_own():
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (8000, 3)) * [1.0, 1.0, 0.05] + [0.0, 0.0, 3.0]
    for far in range(8000, 8012):
        points = np.vstack([points, [far, 0.0, 0.0]])
    np.testing.assert_allclose(np.linalg.norm(Normals(points).all, axis=1), 1.0, atol=1e-9)


def test_shared_normals_do_not_depend_on_the_order_of_the_points():
    points = np.random.default_rng(6).normal(size=(8000, 3)) * [1.0, 0.7, 0.1] + [0.0, 0.0, 4.0]
    order = np.random.default_rng(7).permutation(8000)
    np.testing.assert_allclose(Normals(points[order]).all, Normals(points).all[order], atol=1e-9)


def test_shared_normals_turn_with_the_points():
    points = np.random.default_rng(6).normal(size=(8000, 3)) * [1.0, 0.7, 0.1] + [0.0, 0.0, 4.0]
    R = rotation_exp(np.array([0.3, -0.8, 0.5]))
    turned = np.abs(np.sum(Normals(points @ R.T).all * (Normals(points).all @ R.T), axis=1))
    assert np.mean(turned > 1.0 - 1e-6) > 0.99


def test_in_a_small_cloud_each_point_has_a_plane_of_its_own():
    points = np.random.default_rng(6).normal(size=(FEW_POINTS, 3)) * [1.0, 0.7, 0.1] + [0.0, 0.0, 4.0]
    np.testing.assert_array_equal(Normals(points).all, pca_normals(points))


def test_the_spacing_of_many_points_is_that_of_some_of_them():
    points = np.random.default_rng(8).uniform(0.0, 1.0, (40_000, 3))
    exact = np.median(cKDTree(points).query(points, k=2)[0][:, 1])
    assert median_spacing_m(points) == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize("width", [1e-6, 1.0, 1e6])
def test_normals_do_not_depend_on_the_unit(width):
    points = np.random.default_rng(4).normal(size=(50, 3)) * [1.0, 0.7, 0.2] + [0.0, 0.0, 4.0]
    np.testing.assert_allclose(pca_normals(width * points), pca_normals(points), atol=1e-7)


def test_points_on_a_line_or_in_one_place_have_some_unit_normal():
    line = np.zeros((30, 3))
    line[:, 0] = np.arange(30.0)
    for points in (line, np.ones((30, 3))):
        np.testing.assert_allclose(np.linalg.norm(pca_normals(points), axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
@pytest.mark.parametrize("bad", [slice(0, None), slice(0, None, 3)])
def test_given_normals_that_are_unknown_are_computed_and_others_kept(value, bad):
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-1, 1, (300, 2)), np.full(300, 2.0)])
    known = np.tile([0.0, 0.0, 3.0], (300, 1))  # away from the camera, and of length 3
    known[bad] = value
    expected = np.tile([0.0, 0.0, 1.0], (300, 1))
    expected[bad] = [0.0, 0.0, -1.0]
    np.testing.assert_allclose(Normals(points, known).all, expected, atol=1e-9)
    np.testing.assert_allclose(pca_normals(points, known), expected, atol=1e-9)

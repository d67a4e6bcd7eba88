import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.registration.neighbourhood import Normals, local_spacing_m, median_spacing_m, pca_normals


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


def test_normals_are_the_thinnest_axes_of_patches_and_found_once_asked_for():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1.0, 1.0, (2, 3000))
    points = np.stack([x, y, 3.0 + 0.3 * np.sin(3.0 * x) * y + rng.normal(0.0, 0.01, 3000)], axis=1)
    _, near = cKDTree(points).query(points, k=20)
    arms = points[near] - points[near].mean(axis=1, keepdims=True)
    thinnest = np.linalg.eigh(np.einsum("nki,nkj->nij", arms, arms))[1][:, :, 0]
    few = Normals(points)
    rows = np.array([7, 7, 2999, 0])
    for normals, at in ((pca_normals(points), np.arange(3000)), (few.at(rows), rows)):
        np.testing.assert_allclose(np.abs(np.sum(normals[at] * thinnest[at], axis=1)), 1.0, atol=1e-9)
        assert (np.sum(normals[at] * points[at], axis=1) <= 0.0).all()


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
    np.testing.assert_allclose(Normals(points, known).at(np.arange(300)), expected, atol=1e-9)

import numpy as np
import pytest

from pipeline.registration.neighbourhood import local_spacing_m, median_spacing_m, pca_normals


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

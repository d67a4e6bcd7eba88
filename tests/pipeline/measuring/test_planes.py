"""Planes: their fit has the covariance of least squares, and what is no plane is none."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.measuring.planes import correlated_neighbours, fitted, plane_at
from tests.pipeline.measuring.scenes import box_on_table, joined, measured, sheet
from tests.pipeline.surface.shapes import sphere

NOISE_M = 0.004


def noisy_sheet(seed, noise_m=NOISE_M):
    vertices_m, triangles, normals = sheet(24, 16, 0.05, (-0.6, -0.4, 2.0))
    vertices_m[:, 2] += np.random.default_rng(seed).normal(0.0, noise_m, len(vertices_m))
    return vertices_m, triangles, normals


def test_the_covariance_of_a_noisy_plane_is_that_of_least_squares():
    mesh = noisy_sheet(1)
    plane = fitted(measured(mesh, NOISE_M), np.arange(len(mesh[0])))
    away_m = mesh[0] - mesh[0].mean(axis=0)
    offset_m = NOISE_M / np.sqrt(len(away_m))
    tilts = np.sort(NOISE_M / np.sqrt(np.sum(away_m[:, :2] ** 2, axis=0)))
    found = np.sqrt(np.diag(plane.covariance))
    assert found[0] == pytest.approx(offset_m, rel=0.2)
    assert np.sort(found[1:]) == pytest.approx(tilts, rel=0.2)
    assert plane.normal[2] > 0.999
    assert plane.rms_m == pytest.approx(NOISE_M, rel=0.1)


def test_offset_and_tilts_err_as_the_covariance_says():
    scores = []
    for seed in range(150):
        mesh = noisy_sheet(seed)
        plane = fitted(measured(mesh, NOISE_M), np.arange(len(mesh[0])))
        height_m = (plane.point_m - [0.0, 0.0, 2.0]) @ [0.0, 0.0, 1.0]
        errors = np.array([height_m, *(plane.axes @ [0.0, 0.0, 1.0])])
        scores.append(errors / np.sqrt(np.diag(plane.covariance)))
    assert np.std(scores, axis=0) == pytest.approx(1.0, abs=0.2)
    assert np.mean(np.abs(scores) <= 1.96) == pytest.approx(0.95, abs=0.04)


def test_the_height_of_a_plane_is_least_sure_at_its_ends():
    mesh = noisy_sheet(2)
    plane = fitted(measured(mesh), np.arange(len(mesh[0])))
    middle, end, beyond = (
        plane.offset_variance_m2(plane.point_m + x_m * np.eye(3)[0]) for x_m in (0.0, 0.6, 6.0)
    )
    assert middle < end < beyond
    assert beyond == pytest.approx(plane.covariance[0, 0] + 36.0 * plane.covariance[2, 2], rel=0.2)


def test_neighbours_that_err_together_count_as_fewer():
    vertices_m, _, _ = sheet(40, 40, 0.05)
    rng = np.random.default_rng(3)
    alone = rng.normal(size=41 * 41)
    blocks = np.kron(rng.normal(size=(7, 7)), np.ones((6, 6)))[:41, :41].ravel()
    assert correlated_neighbours(vertices_m[:, :2], alone, 0.05) == pytest.approx(1.0, abs=0.3)
    assert 20.0 < correlated_neighbours(vertices_m[:, :2], blocks, 0.05) < 60.0


def test_a_plane_grows_to_its_edges_and_not_around_them():
    surface = measured(box_on_table())
    top = plane_at(surface, np.array([0.12, 0.08, 0.15]))
    assert top.normal == pytest.approx([0.0, 0.0, 1.0])
    assert len(top.rows) == 31 * 21
    side = plane_at(surface, np.array([0.0, 0.1, 0.07]))
    assert side.normal == pytest.approx([-1.0, 0.0, 0.0])
    assert np.ptp(surface.vertices_m[side.rows], axis=0) == pytest.approx([0.0, 0.2, 0.15])


def test_parallel_sheets_that_do_not_touch_are_two_planes():
    low, high = sheet(20, 20, 0.01), sheet(20, 20, 0.01, (0.0, 0.0, 0.002))
    plane = plane_at(measured(joined(low, high), 0.0005), np.array([0.1, 0.1, 0.0]))
    assert len(plane.rows) == 21 * 21
    assert plane.point_m[2] == pytest.approx(0.0, abs=1e-9)


def test_a_small_ball_has_no_plane():
    cloud = sphere(300, 0.05)
    surface = measured((cloud.points_m, np.empty((0, 3), int), cloud.normals))
    with pytest.raises(InputError, match=r"no plane at .*try a point in the middle of a flat part"):
        plane_at(surface, np.array([0.0, 0.0, 0.05]))


def test_a_place_far_from_everything_is_told_with_the_nearest_one():
    surface = measured(sheet(10, 10, 0.05))
    with pytest.raises(
        InputError, match=r"near the point \(0.25, 0.25, 3\); .*3 m away, is 0.250,0.250,0.000"
    ):
        plane_at(surface, np.array([0.25, 0.25, 3.0]))
    with pytest.raises(InputError, match="three numbers"):
        plane_at(surface, np.array([0.25, np.nan, 3.0]))


def test_a_rounded_border_does_not_tilt_the_plane():
    """One side of the sheet bends by 4 mm at its last row of vertices, as smoothing bends it at a crease."""
    vertices_m, triangles, normals = sheet(12, 12, 0.01)
    bent_m = vertices_m.copy()
    bent_m[:, 2] -= 0.004 * (vertices_m[:, 0] > vertices_m[:, 0].max() - 0.005)
    surface = measured((bent_m, triangles, normals), 0.002)
    plane = plane_at(surface, np.array([0.05, 0.05, 0.0]))
    assert len(plane.rows) == len(vertices_m)
    assert plane.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert np.degrees(np.arccos(fitted(surface, plane.rows).normal[2])) > 0.5


@pytest.mark.parametrize("columns", [4, 5, 6])
def test_a_narrow_part_is_fitted_whole(columns):
    """Without its border it would be a line of vertices, around which a plane turns freely."""
    vertices_m, triangles, normals = sheet(columns, 30, 0.01)
    rough_m = vertices_m + np.random.default_rng(4).normal(0.0, 0.0003, vertices_m.shape)
    plane = plane_at(measured((rough_m, triangles, normals), 0.001), np.array([0.02, 0.15, 0.0]))
    assert plane.normal == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert np.degrees(np.sqrt(np.diag(plane.covariance)[1:].max())) < 1.0

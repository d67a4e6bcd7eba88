"""Thinning: known averages, one grid for all, and the wanted count."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.surface.voxel import in_cubes_of, voxel_average, voxel_for_count
from pipeline.types import PointCloud, PointSource

SENSOR, INFERRED = PointSource.SENSOR, PointSource.INFERRED


def test_the_average_of_a_known_set():
    cloud = PointCloud(
        points_m=np.array([[1.25, 0.5, 0.5], [0.25, 0.5, 0.5], [0.75, 0.5, 0.0], [-0.25, 0.5, 0.5]]),
        colors=np.array([[9, 9, 9], [10, 20, 30], [20, 40, 61], [255, 0, 1]], np.uint8),
        normals=np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1]], float),
        pixels=np.zeros((4, 2), int),
        sigma_m=np.array([0.5, 0.1, 0.3, 0.7]),
        source=np.array([SENSOR, SENSOR, INFERRED, INFERRED], np.uint8),
    )
    thin = voxel_average(cloud, 1.0)
    np.testing.assert_allclose(thin.points_m, [[-0.25, 0.5, 0.5], [0.5, 0.5, 0.25], [1.25, 0.5, 0.5]])
    np.testing.assert_array_equal(thin.colors, [[255, 0, 1], [15, 30, 46], [9, 9, 9]])
    np.testing.assert_allclose(thin.normals, [[0, 0, -1], [0.5**0.5, 0.5**0.5, 0], [0, 0, 1]])
    np.testing.assert_allclose(thin.sigma_m, [0.7, 0.2, 0.5])
    np.testing.assert_array_equal(thin.source, [INFERRED, SENSOR, SENSOR])
    assert thin.pixels is None


@pytest.mark.parametrize(
    ("labels", "majority"), [((0, 1, 1), INFERRED), ((0, 0, 1), SENSOR), ((1, 0), SENSOR)]
)
def test_the_majority_labels_a_mean(labels, majority):
    cloud = PointCloud(np.full((len(labels), 3), 0.5), source=np.array(labels, np.uint8))
    assert voxel_average(cloud, 1.0).source.tolist() == [majority]


def test_normals_that_cancel_out_leave_the_first():
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    cloud = PointCloud(np.array([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2]]), normals=normals)
    np.testing.assert_array_equal(voxel_average(cloud, 1.0).normals, normals[:1])


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    points_m = np.random.default_rng(2).normal(size=(5000, 3))
    return PointCloud(points_m, normals=points_m / np.linalg.norm(points_m, axis=1, keepdims=True))


def test_thinning_keeps_one_point_a_voxel_inside_it(cloud):
    thin = voxel_average(cloud, 0.3)
    cubes = np.floor(thin.points_m / 0.3)
    assert len(np.unique(cubes, axis=0)) == len(thin)
    occupied = np.unique(np.floor(cloud.points_m / 0.3), axis=0)
    np.testing.assert_array_equal(np.unique(cubes, axis=0), occupied)
    np.testing.assert_allclose(np.linalg.norm(thin.normals, axis=1), 1.0)


def test_part_of_a_cloud_is_thinned_on_the_same_grid(cloud):
    """Cubes that the rest does not touch give the same means with and without the rest."""
    whole, part = voxel_average(cloud, 0.3), voxel_average(cloud.select(cloud.points_m[:, 0] > 0.6), 0.3)
    inner = whole.points_m[whole.points_m[:, 0] > 0.6]
    np.testing.assert_allclose(part.points_m, inner)


def test_the_order_of_the_points_does_not_matter(cloud):
    shuffled = cloud.select(np.random.default_rng(0).permutation(len(cloud)))
    np.testing.assert_allclose(
        voxel_average(shuffled, 0.3).points_m, voxel_average(cloud, 0.3).points_m, atol=1e-12
    )


def test_thinning_twice_is_thinning_once(cloud):
    once = voxel_average(cloud, 0.3)
    np.testing.assert_array_equal(voxel_average(once, 0.3).points_m, once.points_m)


@pytest.mark.parametrize("count", [50, 500, 3000])
def test_the_voxel_for_a_count_gives_about_that_count(cloud, count):
    assert len(voxel_average(cloud, voxel_for_count(cloud.points_m, count))) == pytest.approx(count, rel=0.05)


def test_a_small_enough_cloud_is_not_thinned(cloud):
    assert len(voxel_average(cloud, voxel_for_count(cloud.points_m, 5000))) == 5000


def test_an_empty_cloud_stays_empty():
    assert len(voxel_average(PointCloud(np.empty((0, 3)), np.empty((0, 3), np.uint8)), 0.1)) == 0


@pytest.mark.parametrize(
    ("use", "says"),
    [
        (lambda cloud: voxel_average(cloud, 0.0), "voxel size is 0.0 m"),
        (lambda cloud: voxel_average(cloud, float("nan")), "voxel size is nan m"),
        (lambda cloud: voxel_average(cloud, 1e-12), "too small for this cloud"),
        (lambda cloud: voxel_for_count(np.zeros((9, 3)), 5), "9 points in one place"),
        (lambda cloud: voxel_for_count(np.zeros((0, 3)), 5), "0 points in one place"),
    ],
)
def test_bad_input_gets_its_sentence(cloud, use, says):
    with pytest.raises(InputError, match=says):
        use(cloud)


def test_cubes_are_shared_by_points_of_two_clouds():
    points_m = np.array([[0.1, 0.1, 0.1], [1.1, 0.1, -0.1]])
    others_m = np.array([[0.9, 0.9, 0.9], [1.1, 0.1, 0.1], [1.9, 0.9, -0.9], [-0.1, 0.1, 0.1]])
    assert in_cubes_of(points_m, others_m, 1.0).tolist() == [True, False, True, False]
    assert in_cubes_of(points_m[:0], others_m, 1.0).tolist() == [False] * 4
    assert not len(in_cubes_of(points_m, others_m[:0], 1.0))


def test_no_finer_voxel_than_the_least():
    points_m = np.random.default_rng(0).random((20_000, 3)) * (1.0, 1.0, 0.0)
    voxel_m = voxel_for_count(points_m, 2000)
    assert voxel_for_count(points_m, 2000, 2.0 * voxel_m) == 2.0 * voxel_m
    assert voxel_for_count(points_m, 2000, 0.5 * voxel_m) == pytest.approx(voxel_m, rel=0.02)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_nowhere_have_no_voxel(value):
    points_m = np.random.default_rng(0).random((20, 3))
    points_m[7, 1] = value
    with pytest.raises(InputError):
        voxel_average(PointCloud(points_m), 0.1)

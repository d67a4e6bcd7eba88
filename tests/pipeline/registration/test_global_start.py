"""A start pose from nothing, and how near CEICP-A comes from there."""

import numpy as np
import pytest

from lab.worlds import box_room
from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.registration import global_start as starts
from pipeline.registration import iterate_registration, point_error_m, register
from pipeline.registration.finding.viewpoint import range_image
from pipeline.registration.global_start import global_start, global_starts
from pipeline.registration.neighbourhood import pca_normals
from pipeline.types import PointCloud
from tests.pipeline.registration.finding.places import scan
from tests.pipeline.registration.rooms import seen_by

FAR = rigid(rotation_exp(np.radians(70.0) * np.array([0.36, 0.48, 0.8])), [1.0, -0.9, 0.67])
"""70 degrees and 1.5 m."""
GLOBAL = RegistrationConfig(start="global")


@pytest.fixture(scope="module", params=[0, 3])
def pair(request) -> tuple[PointCloud, PointCloud, np.ndarray]:
    """Two views of a room, the source far from where it belongs, and the motion that brings it there."""
    scene = box_room(request.param)
    target, source = seen_by(scene, noise_m=0.003)
    T_true = inverse(scene.cameras[0]) @ scene.cameras[1] @ FAR
    return source.transformed(inverse(FAR)), target, T_true


def test_ceicp_a_comes_within_two_centimetres_from_a_global_start(pair):
    source, target, T_true = pair
    assert point_error_m(np.eye(4), T_true, source.points_m) > 1.0
    result = register(source, target, GLOBAL)
    assert result.converged
    assert point_error_m(result.T_target_source, T_true, source.points_m) < 0.02
    first = next(iterate_registration(source, target, GLOBAL))
    np.testing.assert_array_equal(first.T_target_source, result.steps[0].T_target_source)


def test_a_given_start_is_left_alone(pair):
    source, target, T_true = pair
    given = register(source, target, RegistrationConfig(), T_true)
    assert point_error_m(given.T_target_source, T_true, source.points_m) < 0.02
    assert given.steps[0].rotation_step_rad < np.radians(1.0)


def test_the_same_clouds_give_the_same_bits(pair):
    source, target, _ = pair
    first, second = (global_start(source, target) for _ in range(2))
    assert first.tobytes() == second.tobytes()


def with_normals(points_m: np.ndarray, sign: float):
    """The thinned cloud and its features, with estimated normals or their opposites as the given ones."""
    normals = sign * pca_normals(points_m)
    return starts._with_features(PointCloud(points_m, normals=normals), 0.2)


def test_given_normals_of_a_view_are_turned_to_its_camera():
    points_m = scan((1.0, 1.2, 1.3), 0).points_m
    (facing, features), (_, others) = with_normals(points_m, 1.0), with_normals(points_m, -1.0)
    np.testing.assert_array_equal(others.data, features.data)
    assert np.mean(np.einsum("ni,ni->n", facing.points, facing.normals) < 0.0) > 0.999


def test_given_normals_keep_their_signs_where_no_camera_stood_at_the_origin():
    points_m = np.add(scan((1.0, 1.2, 1.3), 0).points_m, [3.0, -4.0, 2.0])
    assert range_image(points_m) is None
    np.testing.assert_array_equal(
        np.negative(with_normals(points_m, -1.0)[0].normals), with_normals(points_m, 1.0)[0].normals
    )


def test_clouds_that_have_nothing_in_common_are_refused(pair):
    _, target, _ = pair
    rng = np.random.default_rng(0)
    with pytest.raises(ReconstructionError, match="hardly overlap or have no features"):
        global_starts(PointCloud(rng.uniform(0.0, 40.0, (3000, 3))), target, 0.1)


def test_too_coarse_a_voxel_is_refused(pair):
    source, target, _ = pair
    with pytest.raises(ReconstructionError, match="Too few points remain at 100 m"):
        global_starts(source, target, 100.0)


def test_features_are_paired_with_the_most_alike_in_any_number_of_blocks(monkeypatch):
    rng = np.random.default_rng(0)
    moving, fixed = (rng.normal(size=(count, 33)).astype(np.float32) for count in (230, 170))
    apart = np.linalg.norm(moving[:, None] - fixed, axis=2)
    mutual = [(i, j) for i, j in enumerate(apart.argmin(axis=1)) if apart[:, j].argmin() == i]
    for rows in (1000, 100, 7):
        monkeypatch.setattr(starts, "ROWS", rows)
        found = list(zip(*starts._mutual_nearest(moving, fixed), strict=True))
        assert found == sorted(mutual, key=lambda pair: apart[pair])
    monkeypatch.setattr(starts, "MOST_PAIRS", 5)
    assert list(zip(*starts._mutual_nearest(moving, fixed), strict=True)) == found[:5]


def test_a_sparse_cloud_gets_larger_voxels():
    plane_m = np.random.default_rng(0).uniform(0.0, 1.0, (1000, 3)) * [1.0, 1.0, 0.0]
    assert starts._filled_voxel_m(PointCloud(plane_m), 0.2) == 0.2
    assert starts._filled_voxel_m(PointCloud(plane_m), 0.01) == pytest.approx(0.02, rel=0.05)

"""Rigid motions and the pinhole camera."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.kernels import geometry
from pipeline.types import CameraIntrinsics, PointCloud

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)
DISTORTED = CameraIntrinsics(
    np.array([[529.7, 0, 312.6], [0, 529.6, 257.1], [0, 0, 1.0]]),
    np.array([0.18, -0.32, 1e-3, -2e-3, 0.01]),
    640,
    480,
)


@given(vectors, vectors, vectors)
def test_inverse_undoes_a_motion(omega_rad, translation_m, point_m):
    T = geometry.rigid(geometry.rotation_exp(omega_rad), translation_m)
    back = geometry.apply(geometry.inverse(T), geometry.apply(T, point_m[None]))
    np.testing.assert_allclose(back[0], point_m, atol=1e-12)


@given(vectors)
def test_rotation_angle_is_the_length_of_its_axis_vector_modulo_the_circle(omega_rad):
    turns = np.linalg.norm(omega_rad) % (2 * np.pi)
    expected = min(turns, 2 * np.pi - turns)
    assert abs(geometry.rotation_angle_rad(geometry.rotation_exp(omega_rad)) - expected) < 1e-7


def test_every_pixel_of_a_distorted_camera_projects_back_to_itself():
    rays = geometry.pixel_rays(DISTORTED)
    u, v = np.meshgrid(np.arange(640), np.arange(480))
    uv = geometry.project(DISTORTED, rays.reshape(-1, 3) * 2.5)
    np.testing.assert_allclose(uv, np.stack([u, v], axis=-1).reshape(-1, 2), atol=1e-9)


def test_the_rays_of_a_camera_are_its_own_whoever_asked_before_and_nobody_changes_them():
    straight = replace(DISTORTED, distortion=np.zeros(5))
    first, other = geometry.pixel_rays(DISTORTED), geometry.pixel_rays(straight)
    corner = geometry.undistorted_rays(DISTORTED, [[639.0, 479.0]])
    np.testing.assert_array_equal(first[-1, -1], corner[0])
    assert not np.allclose(first, other, atol=1e-3)
    np.testing.assert_array_equal(geometry.pixel_rays(replace(DISTORTED)), first)
    with pytest.raises(ValueError, match="read-only"):
        first[0, 0] = 0.0


def test_a_camera_that_looks_at_a_point_sees_it_in_its_centre_and_upright():
    camera = CameraIntrinsics.pinhole(500, 500, 319.5, 239.5, 640, 480)
    T_camera_world = geometry.inverse(geometry.look_at((3.0, -2.0, 1.5), (0.5, 1.0, 0.7)))
    uv = geometry.project(
        camera, geometry.apply(T_camera_world, np.array([[0.5, 1.0, 0.7], [0.5, 1.0, 0.9]]))
    )
    np.testing.assert_allclose(uv[0], (319.5, 239.5), atol=1e-9)
    assert uv[1, 1] < uv[0, 1]


def test_transforming_a_cloud_by_a_similarity_scales_what_has_a_length_and_turns_what_has_a_direction():
    rotation = geometry.rotation_exp([0.0, 0.0, np.pi / 2])
    T = geometry.rigid(2.0 * rotation, [1.0, 0.0, 0.0])
    cloud = PointCloud(np.array([[1.0, 0, 0]]), normals=np.array([[1.0, 0, 0]]), sigma_m=np.array([0.5]))
    moved = cloud.transformed(T)
    np.testing.assert_allclose(moved.points_m, [[1.0, 2.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(moved.normals, [[0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(moved.sigma_m, [1.0])


def test_concatenation_keeps_only_the_columns_that_all_clouds_have():
    full = PointCloud(np.zeros((2, 3)), normals=np.ones((2, 3)), sigma_m=np.ones(2))
    joined = PointCloud.concatenate([full, PointCloud(np.ones((1, 3)), sigma_m=np.zeros(1))])
    assert len(joined) == 3
    assert joined.normals is None
    np.testing.assert_array_equal(joined.sigma_m, [1, 1, 0])


def test_the_camera_of_a_resized_image_sees_each_direction_at_the_same_place_of_it():
    """Pixel 0 of 640 extends from -0.5 to 0.5, and so does that of 320: u' + 0.5 = (u + 0.5) / 2."""
    fisheye = replace(DISTORTED, distortion=np.array([0.1, -0.02, 0.0, 0.0]), fisheye=True)
    points_m = np.random.default_rng(0).uniform((-0.5, -0.4, 1.0), (0.5, 0.4, 2.0), (50, 3))
    for camera in (DISTORTED, fisheye):
        half = geometry.scaled_to(camera, 320, 240)
        assert half is not None
        assert (half.width_px, half.height_px, half.fisheye) == (320, 240, camera.fisheye)
        expected = (geometry.project(camera, points_m) + 0.5) / 2.0 - 0.5
        np.testing.assert_allclose(geometry.project(half, points_m), expected, atol=1e-9)
        np.testing.assert_array_equal(half.matrix, geometry.scaled(camera, 0.5).matrix)


@pytest.mark.parametrize(
    ("size_px", "fits"),
    [((640, 480), True), ((1280, 960), True), ((100, 75), True), ((101, 76), True), ((848, 480), False)],
)
def test_an_image_of_other_proportions_is_of_another_camera(size_px, fits):
    assert (geometry.scaled_to(DISTORTED, *size_px) is not None) == fits


def test_rounding_errors_of_a_rotation_go_and_its_position_stays():
    T = geometry.rigid(geometry.rotation_exp(np.array([0.3, -0.2, 0.9])), np.array([1.0, 2.0, 3.0]))
    spoilt = T.copy()
    spoilt[:3, :3] += 1e-6 * np.arange(9.0).reshape(3, 3)
    found = geometry.orthonormal(spoilt)
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(found, T, atol=2e-5)
    np.testing.assert_array_equal(found[:, 3], T[:, 3])


@pytest.mark.parametrize(
    ("target", "pan_deg", "tilt_deg"),
    [((1, 0, 0), 0, 0), ((0, 1, 0), 90, 0), ((-1, 0, 1), 180, 45), ((0, -1, -1), 270, -45)],
)
def test_pan_is_counter_clockwise_from_x_and_tilt_is_up(target, pan_deg, tilt_deg):
    assert geometry.aim_deg(geometry.look_at((0, 0, 0), target)) == pytest.approx((pan_deg, tilt_deg))


@pytest.mark.parametrize(("pan_deg", "tilt_deg"), [(0.0, 0.0), (135.0, -30.0), (270.0, 60.0)])
def test_a_camera_that_is_aimed_has_that_pan_and_tilt_and_stands_level(pan_deg, tilt_deg):
    T = geometry.aimed((1.0, 2.0, 3.0), pan_deg, tilt_deg)
    assert geometry.aim_deg(T) == pytest.approx((pan_deg, tilt_deg))
    assert np.allclose(T[:3, 3], (1.0, 2.0, 3.0))
    assert T[2, 0] == pytest.approx(0.0), "the image's rows are level"
    assert T[2, 1] < 0.0, "the image's columns run down"


def test_a_camera_that_would_look_straight_down_still_has_its_pan():
    assert geometry.aim_deg(geometry.aimed((0.0, 0.0, 0.0), 90.0, -90.0)) == pytest.approx((90.0, -89.0))

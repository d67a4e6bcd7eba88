"""Depth of a camera of its own, carried into the colour image, against rays through a known scene."""

import cv2
import numpy as np
import pytest

from pipeline.io.depth_to_color import register_depth
from pipeline.kernels.geometry import inverse, pixel_rays, rigid, rotation_exp
from pipeline.kernels.rays import Camera, hit_depths
from pipeline.types import CameraIntrinsics, DepthMap
from tests.pipeline.lenses import camera

DEPTH = CameraIntrinsics(
    np.array([[183.0, 0.0, 128.0], [0.0, 183.0, 106.0], [0.0, 0.0, 1.0]]),
    np.array([0.09, -0.27, 0.0, 0.0, 0.09]),
    256,
    212,
)
COLOR = CameraIntrinsics(
    np.array([[530.0, 0.0, 480.0], [0.0, 530.0, 270.0], [0.0, 0.0, 1.0]]),
    np.array([0.05, -0.05, 0.001, 0.0, 0.0]),
    960,
    540,
)
T_COLOR_DEPTH = rigid(rotation_exp(np.radians([1.0, -2.0, 3.0])), np.array([0.052, 0.002, -0.004]))
EDGE_PX = 13


def rectangle(center_m, right_m, down_m):
    center_m, right_m, down_m = (np.array(one, float) for one in (center_m, right_m, down_m))
    corners = [center_m + x * right_m + y * down_m for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array(corners)


WALL = rectangle((0, 0, 2.5), (6, 0, 2), (0, 6, 1))
BOX = rectangle((0.05, 0, 1.5), (0.2, 0, 0.05), (0, 0.15, 0))
VERTICES_M = np.concatenate([WALL, BOX])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])


def seen(camera: CameraIntrinsics, T_world_camera) -> DepthMap:
    return next(iter(hit_depths(VERTICES_M, TRIANGLES, [Camera(camera, T_world_camera)])))


@pytest.fixture(scope="module")
def truth():
    return seen(COLOR, inverse(T_COLOR_DEPTH)).z_m


@pytest.fixture(scope="module")
def away_from_edges(truth):
    jump_m = cv2.morphologyEx(truth.astype(np.float32), cv2.MORPH_GRADIENT, np.ones((EDGE_PX, EDGE_PX)))
    return jump_m < 0.1


def test_a_finer_colour_image_sees_the_scene_without_holes_where_it_is(truth, away_from_edges):
    found = register_depth(seen(DEPTH, np.eye(4)), DEPTH, COLOR, T_COLOR_DEPTH)
    judged = away_from_edges & found.valid
    assert np.abs(found.z_m - truth)[judged].max() < 2e-4
    closed = cv2.morphologyEx(found.valid.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9))) > 0
    assert not (closed & ~found.valid & away_from_edges).any()


def test_noise_opens_few_cracks_and_adds_no_bias(truth, away_from_edges):
    noise_m = np.random.default_rng(0).normal(0.0, 0.003, (DEPTH.height_px, DEPTH.width_px))
    sensed = DepthMap((seen(DEPTH, np.eye(4)).z_m + noise_m).astype(np.float32))
    found = register_depth(sensed, DEPTH, COLOR, T_COLOR_DEPTH)
    error_m = (found.z_m - truth)[away_from_edges & found.valid]
    assert abs(error_m.mean()) < 2e-4
    assert error_m.std() < 1.2 * 0.003
    closed = cv2.morphologyEx(found.valid.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9))) > 0
    assert (closed & ~found.valid & away_from_edges).mean() < 1e-4


def test_what_is_near_hides_what_is_behind_and_beyond_it_nothing_was_measured(truth):
    found = register_depth(seen(DEPTH, np.eye(4)), DEPTH, COLOR, T_COLOR_DEPTH)
    box = truth < 1.7
    inner = cv2.erode(box.astype(np.uint8), np.ones((9, 9))) > 0
    np.testing.assert_allclose(found.z_m[inner], truth[inner], atol=2e-4)
    around = cv2.dilate(box.astype(np.uint8), np.ones((31, 31))) > 0
    wall_m = float(np.median(truth[around & (truth > 1.7)]))
    shadow_px = COLOR.fx_px * T_COLOR_DEPTH[0, 3] * (1.0 / 1.5 - 1.0 / wall_m)
    hidden = np.isnan(found.z_m) & around
    assert hidden.sum() == pytest.approx(shadow_px * 2.0 * 0.15 / 1.5 * COLOR.fy_px, rel=0.2)


def test_opencvs_registration_leaves_a_grid_of_holes_and_agrees_where_it_has_values(away_from_edges):
    straight = CameraIntrinsics(DEPTH.matrix, np.zeros(5), DEPTH.width_px, DEPTH.height_px)
    sensed = seen(straight, np.eye(4))
    theirs = cv2.registerDepth(
        DEPTH.matrix,
        COLOR.matrix,
        COLOR.distortion,
        T_COLOR_DEPTH,
        np.where(sensed.valid, sensed.z_m, 0.0).astype(np.float32),
        (COLOR.width_px, COLOR.height_px),
    )
    ours = register_depth(sensed, straight, COLOR, T_COLOR_DEPTH)
    both = ours.valid & (theirs > 0.0) & away_from_edges
    assert (theirs > 0.0).mean() < 0.2 < 0.6 < ours.coverage
    assert np.median(np.abs(theirs - ours.z_m)[both]) < 0.003


def test_the_same_camera_at_the_same_place_sees_what_it_has_seen():
    z_m = np.random.default_rng(1).uniform(0.4, 4.0, (DEPTH.height_px, DEPTH.width_px)).astype(np.float32)
    z_m[50:60, 40:80] = np.nan
    found = register_depth(DepthMap(z_m), DEPTH, DEPTH, np.eye(4)).z_m
    np.testing.assert_allclose(found, z_m, atol=1e-5)


def test_points_behind_the_camera_or_far_beside_it_are_not_seen():
    """The lens's polynomial folds directions far outside back into the image."""
    fold = CameraIntrinsics(
        np.array([[530.0, 0, 320], [0, 530.0, 180], [0, 0, 1]]), -0.2 * np.eye(5)[0], 640, 360
    )
    beside = rigid(rotation_exp(np.radians([0.0, 64.5, 0.0])), np.zeros(3))
    z_m = np.full((DEPTH.height_px, DEPTH.width_px), np.nan, np.float32)
    z_m[100:112, 122:134] = 1.0
    folded, _ = cv2.projectPoints(beside[:3, 2][None], np.zeros(3), np.zeros(3), fold.matrix, fold.distortion)
    assert 0 < folded[0, 0, 0] < 640  # which is why it must be kept out
    assert not register_depth(DepthMap(z_m), DEPTH, fold, beside).valid.any()
    behind = rigid(rotation_exp(np.array([0.0, np.pi, 0.0])), np.zeros(3))
    assert not register_depth(DepthMap(z_m), DEPTH, COLOR, behind).valid.any()
    assert register_depth(DepthMap(z_m), DEPTH, COLOR, np.eye(4)).valid.any()


@pytest.mark.parametrize("kind", ["rational", "fisheye"])
def test_depth_of_one_lens_lands_on_the_pixels_of_another(kind):
    """A tilted plane through the depth camera's lens, seen by a colour camera 5 cm to its right."""
    lens, color = camera(kind), camera("fisheye" if kind == "rational" else "rational")
    normal = np.array([0.1, -0.2, 1.0])
    z_m = 1.5 / (pixel_rays(lens) @ normal)
    z_m[(z_m < 0.0) | (z_m > 4.0)] = np.nan
    T_color_depth = rigid(np.eye(3), np.array([-0.05, 0.0, 0.0]))
    found = register_depth(DepthMap(z_m.astype(np.float32)), lens, color, T_color_depth)
    expected = (1.5 + 0.05 * -normal[0]) / (pixel_rays(color) @ normal)
    assert found.coverage > 0.5
    seen = found.valid & (np.abs(pixel_rays(color)[..., :2]).max(axis=-1) < 0.8)
    assert seen.sum() > 5000
    np.testing.assert_allclose(found.z_m[seen], expected[seen], atol=0.002)


def test_a_colour_camera_whose_corners_have_no_rays_sees_the_depth():
    """A fisheye that sees 90 degrees at 100 pixels from the middle of its image."""
    focal_px = 100.0 / (0.5 * np.pi)
    matrix = np.array([[focal_px, 0.0, 159.5], [0.0, focal_px, 119.5], [0.0, 0.0, 1.0]])
    color = CameraIntrinsics(matrix, np.zeros(4), 320, 240, fisheye=True)
    found = register_depth(DepthMap(np.full((240, 320), 1.5, np.float32)), camera("brown"), color, np.eye(4))
    assert found.valid[100:140, 140:180].all()
    np.testing.assert_allclose(found.z_m[found.valid], 1.5, atol=1e-5)

"""Start poses from colour, in rooms whose walls and motions are known."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, project, rigid, rotation_angle_rad, rotation_exp
from pipeline.registration.colour import colour_start, lifted_features, match_score
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise
from tests.pipeline.registration.textured import CAMERA, seen, textures, with_tag

TARGET = rigid(np.eye(3), np.array([0.0, 0.0, -1.0]))
SOURCE = rigid(rotation_exp(np.array([0.1, 0.45, 0.05])), np.array([0.35, -0.1, -0.8]))
"""Poses T_world_camera: 27 degrees and 41 cm apart."""
T_TRUE = inverse(TARGET) @ SOURCE


@pytest.fixture(scope="module")
def walls():
    return textures(1)


@pytest.fixture(scope="module")
def frames(walls):
    return seen(walls, SOURCE, name="left"), seen(walls, TARGET, name="right")


@pytest.fixture(scope="module")
def features(frames):
    return tuple(lifted_features(frame) for frame in frames)


def _off(T, T_true=T_TRUE) -> tuple[float, float]:
    """Rotation error, degrees, and distance of the cameras, metres."""
    apart = inverse(T_true) @ T
    return np.degrees(rotation_angle_rad(apart[:3, :3])), float(np.linalg.norm(apart[:3, 3]))


def test_the_motion_between_two_views_is_found(features):
    start = colour_start(*features)
    angle_deg, apart_m = _off(start.T_target_source)
    assert angle_deg < 0.3
    assert apart_m < 0.01
    assert start.inliers > 50
    assert start.rival_votes < 0.2 * start.votes
    assert start.why_none == ""


def test_the_other_way_round_is_the_inverse(features):
    there, back = colour_start(*features), colour_start(*features[::-1])
    angle_deg, apart_m = _off(inverse(back.T_target_source), there.T_target_source)
    assert angle_deg < 0.1
    assert apart_m < 0.005


def test_the_same_frame_twice_is_the_identity(features):
    start = colour_start(features[0], features[0])
    np.testing.assert_allclose(start.T_target_source, np.eye(4), atol=1e-9)
    assert start.inliers == start.matches > 100
    assert start.rival_votes == 0.0


def test_the_same_images_give_the_same_bits(frames, features):
    again = colour_start(*(lifted_features(frame) for frame in frames))
    assert again.T_target_source.tobytes() == colour_start(*features).T_target_source.tobytes()


def test_positions_are_on_the_walls_with_the_deviation_of_depth_and_pixel(walls):
    noise = DepthNoise(s0_m=0.003, s1_m=0.004, p=1.0, q=0.0)
    frame = replace(seen(walls, TARGET), noise=noise)
    found = lifted_features(frame)
    pixels = project(CAMERA, found.points_m)
    column, row = np.rint(pixels).astype(int).T
    np.testing.assert_allclose(found.points_m[:, 2], frame.depth.z_m[row, column], rtol=0.02)
    z_m = found.points_m[:, 2]
    np.testing.assert_allclose(found.sigma_m, np.sqrt((0.004 * z_m) ** 2 + (z_m / 260.0) ** 2))


def test_a_bent_lens_is_taken_into_account(walls):
    bent = CameraIntrinsics(CAMERA.matrix, np.array([-0.3, 0.1, 0.0, 0.0, 0.0]), 320, 240)
    views = [seen(walls, T, bent) for T in (SOURCE, TARGET)]
    start = colour_start(*(lifted_features(view) for view in views))
    angle_deg, apart_m = _off(start.T_target_source)
    assert angle_deg < 0.3
    assert apart_m < 0.01
    as_pinhole = colour_start(*(lifted_features(replace(view, intrinsics=CAMERA)) for view in views))
    assert _off(as_pinhole.T_target_source)[1] > 3.0 * apart_m


def test_a_mirrored_view_has_no_pose(frames, features):
    mirrored = replace(
        frames[1],
        rgb=frames[1].rgb[:, ::-1].copy(),
        depth=DepthMap(frames[1].depth.z_m[:, ::-1].copy()),
    )
    start = colour_start(features[0], lifted_features(mirrored))
    assert start.T_target_source is None
    assert "agree on one pose" in start.why_none


def test_another_room_has_no_pose_and_fewer_matches(features):
    other = lifted_features(seen(textures(2), TARGET, name="other room"))
    assert colour_start(features[0], other).T_target_source is None
    assert match_score(features[0], other) < 0.2 * match_score(*features)


def test_features_at_depth_edges_and_without_depth_are_left_out(frames):
    z_m = frames[1].depth.z_m.copy()
    z_m[:, :100] = np.nan
    z_m[:, 200:] *= 0.7
    found = lifted_features(replace(frames[1], depth=DepthMap(z_m)))
    columns = project(CAMERA, found.points_m)[:, 0]
    assert columns.min() > 99.0
    assert not np.any(np.abs(columns - 199.5) < 1.0)
    assert np.sum(columns > 203.0) > 20


def test_pixels_that_did_not_arrive_show_nothing(frames):
    known = np.zeros((240, 320), bool)
    known[:, 160:] = True
    found = lifted_features(replace(frames[1], rgb_known=known))
    assert len(found.points_m) > 20
    assert project(CAMERA, found.points_m)[:, 0].min() > 159.0


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda f: replace(f, rgb=np.full_like(f.rgb, 127)), "left has no features"),
        (lambda f: replace(f, depth=DepthMap(np.full_like(f.depth.z_m, np.nan))), "fewer than 3"),
        (lambda f: replace(f, depth=DepthMap(f.depth.z_m, "relative")), "left is relative"),
        (lambda f: replace(f, rgb=f.rgb[:120, :160]), "320 x 240, its colour image 160 x 120"),
        (lambda f: replace(f, intrinsics=replace(CAMERA, width_px=640)), "its camera 640 x 240"),
    ],
)
def test_a_frame_that_cannot_be_used_is_explained(frames, features, change, why):
    start = colour_start(lifted_features(change(frames[0])), features[1])
    assert start.T_target_source is None
    assert why in start.why_none
    assert start.why_none.endswith(".")
    assert start.why_none.count(". ") == 0


def test_one_tag_on_blank_walls_is_enough():
    blank = [np.full((500, 500), 170.0, np.float32)] * 6
    blank[2] = with_tag(blank[2], 7, (240, 240), side_px=48)
    start = colour_start(*(lifted_features(seen(blank, T)) for T in (SOURCE, TARGET)))
    angle_deg, apart_m = _off(start.T_target_source)
    assert angle_deg < 10.0
    assert apart_m < 0.3


def test_the_same_tag_at_two_places_does_not_mislead():
    """Each view shows only one of them, and not the same."""
    textured = textures(3, contrast=0.7)
    textured[2] = with_tag(with_tag(textured[2], 7, (130, 240)), 7, (390, 240))
    source, target = (seen(textured, T) for T in (SOURCE, TARGET))
    hidden = target.rgb.copy()
    hidden[:, 220:] = cv2.blur(hidden[:, 220:], (9, 9))
    found = lifted_features(source), lifted_features(replace(target, rgb=hidden))
    assert apply(T_TRUE, found[0].tag_points_m)[:, 0].min() > 1.0
    assert found[1].tag_points_m[:, 0].max() < -0.5
    np.testing.assert_array_equal(found[0].tag_keys, found[1].tag_keys)
    angle_deg, apart_m = _off(colour_start(*found).T_target_source)
    assert angle_deg < 1.5
    assert apart_m < 0.05


def test_the_true_pose_brings_tag_corners_together(walls):
    tagged = list(walls)
    tagged[2] = with_tag(tagged[2], 23, (260, 220))
    source, target = (lifted_features(seen(tagged, T)) for T in (SOURCE, TARGET))
    np.testing.assert_array_equal(source.tag_keys, [92, 93, 94, 95])
    np.testing.assert_array_equal(source.tag_keys, target.tag_keys)
    np.testing.assert_allclose(apply(T_TRUE, source.tag_points_m), target.tag_points_m, atol=0.01)

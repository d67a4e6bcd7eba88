"""Depth images as organised clouds: planes and walls known in closed form, and motions of a rendered room."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, inverse, look_at, pixel_rays, project, rigid, rotation_exp
from pipeline.registration import point_error_m, register
from pipeline.registration.ceicp import GATE_IN_SIGMAS
from pipeline.registration.organised import (
    ARM,
    SIGMA_OF_SPACING,
    WIDEST,
    OrganisedCloud,
    OrganisedMatcher,
    organised,
    register_organised,
    shared_shares,
)
from pipeline.types import CameraIntrinsics, DepthMap
from tests.pipeline.recording.rendered import CAMERA, MIDDLE_M, errors, in_the_living_room, moved

KINECT = CameraIntrinsics.pinhole(525.0, 530.0, 322.0, 236.0, 640, 480)
HALF = CameraIntrinsics.pinhole(210.0, 200.0, 125.0, 91.0, 250, 187)
"""Squares of two pixels; an odd row is left over."""
CONFIG = RegistrationConfig("ceicp-a", "plane", gate_m=0.15)
NORMAL = np.array([0.48, -0.36, 0.8])


def plane(camera: CameraIntrinsics, normal: np.ndarray, offset_m: float) -> np.ndarray:
    """(H, W) depth of the plane normal . p = offset."""
    return (offset_m / (pixel_rays(camera) @ normal)).astype(np.float32)


def wall(*columns_m: tuple[int, float]) -> OrganisedCloud:
    """A wall across the optical axis in parts: each of so many columns and at so many metres."""
    row_m = np.concatenate([np.full(count, z_m, np.float32) for count, z_m in columns_m])
    return organised(DepthMap(np.tile(row_m, (120, 1))), CAMERA)


@pytest.mark.parametrize("camera", [CAMERA, HALF, KINECT], ids=["1 px", "2 px", "4 px"])
def test_a_tilted_plane_gives_points_on_it_and_its_normal_towards_the_camera(camera):
    cloud = organised(DepthMap(plane(camera, NORMAL, 1.2)), camera)
    height, width = cloud.z_m.shape
    assert (width, height) == (cloud.camera.width_px, cloud.camera.height_px)
    assert len(cloud) == (width - 2 * ARM) * (height - 2 * ARM)
    np.testing.assert_allclose(cloud.points_m @ NORMAL, 1.2, atol=1e-6)
    np.testing.assert_allclose(cloud.normals, np.tile(-NORMAL, (len(cloud), 1)), atol=2e-5)


@pytest.mark.parametrize("camera", [CAMERA, HALF, KINECT], ids=["1 px", "2 px", "4 px"])
def test_every_point_projects_into_its_own_square(camera):
    """Also where a third of the pixels are unknown, so that the mean pixel is not the square's middle."""
    z_m = plane(camera, NORMAL, 1.2)
    if camera is not CAMERA:
        z_m[np.random.default_rng(1).random(z_m.shape) < 0.3] = np.nan
    cloud = organised(DepthMap(z_m), camera)
    v, u = np.nonzero(cloud.rows >= 0)
    np.testing.assert_array_equal(cloud.rows[v, u], np.arange(len(cloud)))
    np.testing.assert_array_equal(np.rint(project(cloud.camera, cloud.points_m)), np.stack([u, v], axis=1))
    np.testing.assert_allclose(cloud.points_m @ NORMAL, 1.2, atol=1e-6)
    np.testing.assert_allclose(cloud.z_m[v, u], cloud.points_m[:, 2], rtol=1e-12)
    assert len(cloud) > 5_000


def test_the_squares_of_a_kinect_are_those_of_its_camera_in_a_quarter_of_the_size():
    cloud = organised(DepthMap(np.full((480, 640), 2.0, np.float32)), KINECT)
    expected = CameraIntrinsics.pinhole(131.25, 132.5, 322.5 / 4 - 0.5, 236.5 / 4 - 0.5, 160, 120)
    np.testing.assert_allclose(cloud.camera.matrix, expected.matrix)
    assert (cloud.camera.width_px, cloud.camera.height_px) == (160, 120)
    assert cloud.spacing_m == pytest.approx(2.0 / 131.25)


@pytest.mark.parametrize(("near_m", "far_m"), [(1.0, 2.0), (1.5, 1.65)])
@pytest.mark.parametrize("axis", [0, 1])
def test_no_normal_crosses_a_step(near_m, far_m, axis):
    """Normals reach ``ARM`` squares: so far from the step, and everywhere else, they are exact."""
    z_m = np.full((120, 160), far_m, np.float32)
    z_m[(slice(50), slice(None))[:: 1 - 2 * axis]] = near_m
    cloud = organised(DepthMap(z_m), CAMERA)
    np.testing.assert_allclose(cloud.normals, np.tile([0.0, 0.0, -1.0], (len(cloud), 1)), atol=1e-9)
    known = np.zeros((120, 160), bool)
    known[ARM:-ARM, ARM:-ARM] = True
    known[(slice(50 - ARM, 50 + ARM), slice(None))[:: 1 - 2 * axis]] = False
    np.testing.assert_array_equal(cloud.rows >= 0, known)
    np.testing.assert_allclose(cloud.z_m, z_m, rtol=1e-7)


@pytest.mark.parametrize(("column", "expected_m"), [(321, np.nan), (322, 1.0), (323, 1.0)])
def test_a_square_on_a_step_has_the_near_depth_or_none_but_no_mean(column, expected_m):
    z_m = np.full((480, 640), 2.0, np.float32)
    z_m[:, :column] = 1.0
    cloud = organised(DepthMap(z_m), KINECT)
    np.testing.assert_allclose(cloud.z_m[:, 80], expected_m, rtol=1e-12)
    np.testing.assert_allclose(cloud.z_m[:, 79], 1.0, rtol=1e-12)
    np.testing.assert_allclose(cloud.z_m[:, 81], 2.0, rtol=1e-12)


@pytest.mark.parametrize("unknown", [np.nan, 0.0, -1.0, np.inf])
def test_a_hole_has_no_row_and_its_surroundings_have_depth_without_normals(unknown):
    z_m = plane(CAMERA, NORMAL, 1.2)
    z_m[60, 80] = unknown
    cloud = organised(DepthMap(z_m), CAMERA)
    missing = np.ones((120, 160), bool)
    missing[ARM:-ARM, ARM:-ARM] = False
    for across, down in ((0, 0), (ARM, 0), (-ARM, 0), (0, ARM), (0, -ARM)):
        missing[60 + down, 80 + across] = True
    np.testing.assert_array_equal(cloud.rows == -1, missing)
    np.testing.assert_array_equal(np.argwhere(np.isnan(cloud.z_m)), [[60, 80]])
    known = np.isfinite(cloud.z_m)
    np.testing.assert_allclose(cloud.z_m[known], z_m[known], rtol=1e-6)


def test_the_mean_of_sixteen_pixels_has_a_quarter_of_their_noise():
    z_m = plane(KINECT, np.array([0.0, 0.0, 1.0]), 2.0)
    noisy_m = z_m + 0.002 * np.random.default_rng(5).standard_normal(z_m.shape)
    cloud = organised(DepthMap(noisy_m.astype(np.float32)), KINECT)
    away_m = cloud.points_m[:, 2] - 2.0
    assert away_m.std() == pytest.approx(0.0005, rel=0.05)
    assert abs(away_m.mean()) < 3e-5


def test_an_image_without_depth_has_no_points():
    cloud = organised(DepthMap(np.full((120, 160), np.nan, np.float32)), CAMERA)
    assert len(cloud) == 0
    assert (cloud.rows == -1).all()
    assert np.isnan(cloud.z_m).all()
    full = wall((160, 2.0))
    assert shared_shares(cloud, full, np.eye(4), 0.03) == (0.0, 0.0)
    assert shared_shares(full, cloud, np.eye(4), 0.03) == (0.0, 0.0)


@pytest.mark.parametrize(("shift", "judged"), [(0, 116), (20, 118), (-30, 86), (150, 8), (-118, 0)])
def test_the_shared_share_of_a_wall_that_leaves_the_image(shift, judged):
    """The source's points are in columns 2 to 157, and the target knows columns 42 to 159."""
    source, target = wall((160, 2.0)), wall((42, np.nan), (118, 2.0))
    T = rigid(np.eye(3), np.array([shift * 2.0 / CAMERA.fx_px, 0.0, 0.0]))
    expected = judged / 156, float(judged > 0)
    assert shared_shares(source, target, T, 0.03) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("axis", "angle_deg", "share"),
    [([0, 0, 1], 90.0, 120 / 156), ([0, 0, 1], 180.0, 1.0), ([0, 1, 0], 180.0, 0.0), ([0, 1, 0], 90.0, 0.0)],
)
def test_the_shared_share_of_a_wall_when_the_camera_turns(axis, angle_deg, share):
    """On its side, the image keeps the 120 of 156 columns that fit into its height."""
    one = wall((160, 2.0))
    assert shared_shares(one, one, moved(axis, angle_deg, [0, 0, 0]), 0.03)[0] == pytest.approx(share)


def test_what_is_hidden_is_not_judged_and_what_is_in_front_disagrees():
    """In the target's four parts the wall at 2 m is hidden, 1 m in front, in place, and 5 % behind."""
    source, target = wall((160, 2.0)), wall((40, 1.0), (40, 3.0), (40, 2.0), (40, 2.0 / 1.05))
    judged = 158 - 40
    assert shared_shares(source, target, np.eye(4), 0.03) == pytest.approx((judged / 156, 40 / judged))
    assert shared_shares(source, target, np.eye(4), 0.06) == pytest.approx((judged / 156, 78 / judged))
    strict = shared_shares(source, target, np.eye(4), 0.01)
    assert strict == pytest.approx((80 / 156, 40 / 80))


def _two_views(T_target_source: np.ndarray, eye_m=(1.0, 1.5, 1.5)) -> tuple[OrganisedCloud, OrganisedCloud]:
    """Source and target of a known motion in the living room."""
    T = look_at(eye_m, MIDDLE_M)
    room = in_the_living_room([T @ T_target_source, T])
    source, target = (organised(room.view(k).depth, CAMERA) for k in range(2))
    return source, target


MOTIONS = [
    moved([1, 0, 0], 1.0, [0.1, 0.0, 0.0]),
    moved([0, 1, 0], 5.0, [0.0, 0.02, 0.0]),
    moved([0, 0, 1], 3.0, [0.0, 0.0, -0.08]),
    moved([1, -2, 1], 4.0, [-0.03, 0.04, 0.03]),
    moved([-1, 1, 2], 2.0, [0.05, -0.05, 0.04]),
]


@pytest.mark.parametrize("T", MOTIONS)
@pytest.mark.parametrize("eye_m", [(1.0, 1.5, 1.5), (1.2, 3.3, 1.6)])
def test_known_motions_are_recovered(T, eye_m):
    source, target = _two_views(T, eye_m)
    result = register_organised(source, target, CONFIG, np.eye(4))
    shift_m, turn_deg = errors([np.eye(4), result.T_target_source], [np.eye(4), T])
    assert result.converged
    assert shift_m[1] < 0.001
    assert turn_deg[1] < 0.03
    assert result.steps[-1].sigma_m == pytest.approx(SIGMA_OF_SPACING * target.spacing_m)
    assert shared_shares(source, target, result.T_target_source, 0.03)[1] > 0.97


@pytest.mark.parametrize("T", MOTIONS[2:])
def test_the_answer_is_that_of_a_registration_with_a_search_tree(T):
    source, target = _two_views(T)
    own = register_organised(source, target, CONFIG, np.eye(4)).T_target_source
    config = replace(CONFIG, sigma_min_m=SIGMA_OF_SPACING * target.spacing_m)
    other = register(source.cloud, target.cloud, config, np.eye(4)).T_target_source
    assert point_error_m(own, other, source.points_m) < 0.002


def test_the_way_back_is_the_inverse():
    source, target = _two_views(MOTIONS[3])
    there = register_organised(source, target, CONFIG, np.eye(4)).T_target_source
    back = register_organised(target, source, CONFIG, np.eye(4)).T_target_source
    assert point_error_m(inverse(back), there, source.points_m) < 0.001


def test_a_room_of_twice_the_size_has_twice_the_motion():
    """With twice the gate; numbers of metres appear nowhere else."""
    clouds = _two_views(MOTIONS[3])
    large = [replace(one, points_m=2.0 * one.points_m, z_m=2.0 * one.z_m) for one in clouds]
    T = register_organised(*clouds, CONFIG, np.eye(4)).T_target_source
    twice = register_organised(*large, replace(CONFIG, gate_m=0.3), np.eye(4)).T_target_source
    np.testing.assert_allclose(twice[:3, :3], T[:3, :3], atol=1e-9)
    np.testing.assert_allclose(twice[:3, 3], 2.0 * T[:3, 3], atol=1e-9)


@pytest.mark.parametrize("quarters", [1, 2])
def test_two_images_on_their_side_have_the_motion_turned(quarters):
    """Both cameras turned about their optical axes."""
    T = MOTIONS[3]
    clouds = _two_views(T)
    upright = register_organised(*clouds, CONFIG, np.eye(4)).T_target_source
    shape = (160, 120) if quarters == 1 else (120, 160)
    camera = CameraIntrinsics.pinhole(131.25, 131.25, (shape[1] - 1) / 2, (shape[0] - 1) / 2, *shape[::-1])
    fallen = [
        organised(DepthMap(np.rot90(one.z_m, quarters).astype(np.float32).copy()), camera) for one in clouds
    ]
    turn = moved([0, 0, 1], -90.0 * quarters, [0, 0, 0])
    own = inverse(turn) @ register_organised(*fallen, CONFIG, np.eye(4)).T_target_source @ turn
    assert point_error_m(own, upright, clouds[0].points_m) < 3e-4


def test_the_start_pose_does_not_matter_nearby():
    T = MOTIONS[3]
    source, target = _two_views(T)
    answers = [
        register_organised(source, target, CONFIG, start @ T).T_target_source
        for start in (np.eye(4), moved([1, 1, 0], 2.0, [0.02, 0.03, 0.0]))
    ]
    assert point_error_m(*answers, source.points_m) < 1e-4


@pytest.mark.parametrize("shift_m", [[0.0, 0.0, -20.0], [0.0, 0.0, 20.0], [20.0, 0.0, 0.0]])
def test_views_that_do_not_meet_are_refused(shift_m):
    """Behind the camera, behind all walls, and beside the image."""
    source, target = _two_views(np.eye(4))
    with pytest.raises(ReconstructionError, match="No pair of points is within the gate"):
        register_organised(source, target, CONFIG, rigid(np.eye(3), np.array(shift_m)))


def test_three_points_are_too_few_and_leave_the_start_pose():
    source = wall((160, 2.0))
    z_m = np.full((120, 160), np.nan, np.float32)
    z_m[60 - ARM : 61 + ARM, 80 - ARM : 83 + ARM] = 2.0
    target = organised(DepthMap(z_m), CAMERA)
    assert len(target) == 3
    start = moved([0, 0, 1], 1.0, [0.01, 0.0, 0.0])
    result = register_organised(target, source, CONFIG, start)
    assert not result.converged
    assert result.steps == ()
    assert result.stop_reason.startswith("degenerate")
    np.testing.assert_array_equal(result.T_target_source, start)


def _small_views() -> tuple[OrganisedCloud, OrganisedCloud]:
    """Two bent sheets in 40 x 30 pixels, with holes."""
    camera = CameraIntrinsics.pinhole(35.0, 34.0, 18.0, 15.0, 40, 30)
    x, y = np.moveaxis(pixel_rays(camera)[..., :2], -1, 0)
    clouds = []
    for seed in range(2):
        z_m = 1.5 + 0.2 * np.sin(3.0 * x + seed) * np.cos(2.0 * y)
        z_m[np.random.default_rng(seed).random(z_m.shape) < 0.03] = np.nan
        clouds.append(organised(DepthMap(z_m.astype(np.float32)), camera))
    return clouds[0], clouds[1]


@pytest.mark.parametrize("gate_m", [0.05, 0.2, 0.6, 3.0])
@pytest.mark.parametrize("seed", range(3))
def test_partners_are_the_nearest_of_the_squares_around(gate_m, seed):
    """As an exhaustive search in a window of the documented size finds them."""
    source, target = _small_views()
    omega, shift_m = min(0.15, 0.5 * gate_m) * np.random.default_rng(seed).uniform(-1.0, 1.0, (2, 3))
    T = rigid(rotation_exp(omega), shift_m)
    moved_m = apply(T, source.points_m)
    places = np.rint(project(target.camera, moved_m))
    squares = np.stack(np.nonzero(target.rows >= 0)[::-1], axis=1)
    reach = np.rint(gate_m / GATE_IN_SIGMAS * target.camera.fx_px / moved_m[:, 2]).clip(1, WIDEST)
    away = np.abs(places[:, None] - squares[None]).max(axis=2)
    gaps_m = np.linalg.norm(moved_m[:, None] - target.points_m[None], axis=2)
    gaps_m[away > reach[:, None]] = np.inf
    expected = {(i, j) for i, j in enumerate(gaps_m.argmin(axis=1).tolist()) if gaps_m[i, j] <= gate_m}
    found = OrganisedMatcher(source, target).match(T, gate_m=gate_m)
    assert set(zip(found.source_rows.tolist(), found.target_rows.tolist(), strict=True)) == expected
    assert len(found.source_rows) == len(expected) > 60
    np.testing.assert_allclose(found.moved_m, moved_m[found.source_rows], atol=1e-12)
    np.testing.assert_array_equal(found.target_m, target.points_m[found.target_rows])
    np.testing.assert_allclose(found.distances_m, gaps_m[found.source_rows, found.target_rows], atol=1e-12)
    halfway = source.normals[found.source_rows] @ T[:3, :3].T + target.normals[found.target_rows]
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    np.testing.assert_allclose(found.normals, halfway, atol=1e-9)


def test_most_partners_are_the_nearest_of_all_points():
    source, target = _two_views(MOTIONS[3])
    T = moved([0, 1, 0], 0.5, [0.01, 0.0, 0.005]) @ MOTIONS[3]
    found = OrganisedMatcher(source, target).match(T, gate_m=0.1)
    nearest_m, _ = cKDTree(target.points_m).query(found.moved_m)
    assert (found.distances_m >= nearest_m - 1e-12).all()
    assert np.mean(found.distances_m <= nearest_m + 1e-12) > 0.9


def test_a_share_of_the_points_lies_within_a_larger_share():
    source, target = _two_views(np.eye(4))
    matcher = OrganisedMatcher(source, target)
    shares = 0.01, 0.2, 1.0
    rows = [set(matcher.match(np.eye(4), source_share=share, gate_m=0.1).source_rows) for share in shares]
    assert [len(own) for own in rows] == [round(share * len(source)) for share in shares]
    assert rows[0] < rows[1] < rows[2]

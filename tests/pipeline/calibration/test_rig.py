"""Cameras are where they are, as surely as they say, whether or not all see the board together."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View
from pipeline.calibration.rig import Seen, calibrate_rig
from pipeline.geometry import inverse, rigid, rotation_angle_rad
from tests.pipeline.calibration.rigs import BOARD, session


def off(found, truth):
    """Degrees and metres."""
    apart = inverse(truth) @ found
    return np.degrees(rotation_angle_rad(apart[:3, :3])), np.linalg.norm(found[:3, 3] - truth[:3, 3])


def assert_near(found, given, degrees=0.1, metres=0.002):
    for name, T in found.T_first_camera.items():
        turned_deg, moved_m = off(T, given.T_first_camera[name])
        assert turned_deg < degrees, name
        assert moved_m < metres, name


def test_without_noise_every_pose_is_found_exactly():
    given = session(noise_px=0.0)
    found = calibrate_rig(given.known_lenses(), given.seen, BOARD)
    assert found.rms_px < 1e-6
    assert_near(found, given, 1e-6, 1e-8)
    for moment, T in zip(found.moments, found.adjusted.placement.T_first_board, strict=True):
        np.testing.assert_allclose(T, given.T_first_board[int(moment)], atol=1e-7)


@pytest.mark.parametrize(
    "case", [{"cameras": 2}, {"cameras": 3}, {"cameras": 5, "moments": 24, "apart_deg": 15.0}]
)
def test_noise_leaves_a_tenth_of_a_degree_and_two_millimetres(case):
    given = session(**case, noise_px=0.3)
    found = calibrate_rig(given.estimated_lenses(), given.seen, BOARD)
    assert_near(found, given)
    assert found.rms_px == pytest.approx(0.3 * np.sqrt(2.0), rel=0.1)


def test_cameras_that_share_no_moment_are_linked_by_the_one_between():
    given = session(cameras=3, moments=20, pairs_only=True)
    assert not given.seen["node_00"].keys() & given.seen["node_02"].keys()
    found = calibrate_rig(given.known_lenses(), given.seen, BOARD)
    assert_near(found, given)
    assert found.relative("node_02").moments == 0


def test_boards_without_a_mark_are_turned_as_the_other_cameras_have_them():
    marked, unmarked = session(cameras=3, seed=4), session(cameras=3, seed=4, marked=False)
    assert any(
        (one.view.points_px[0] != one.view.points_px[-1]).any() for one in unmarked.seen["node_00"].values()
    )
    found = calibrate_rig(unmarked.known_lenses(), unmarked.seen, BOARD)
    assert_near(found, unmarked)
    assert found.rms_px < 1.1 * calibrate_rig(marked.known_lenses(), marked.seen, BOARD).rms_px


def test_a_square_grid_may_lie_four_ways():
    board = Board("circles", 7, 7, 0.04)
    given = session(cameras=2, board=board)
    rng = np.random.default_rng(0)
    for views in given.seen.values():
        for moment, one in views.items():
            quarter = np.rot90(np.arange(49).reshape(7, 7), rng.integers(4)).ravel()
            view = View(moment, one.view.points_px[quarter], board.points_m)
            views[moment] = Seen(view, oriented=False)
    assert_near(calibrate_rig(given.known_lenses(), given.seen, board), given)


@pytest.mark.parametrize("lenses", ["known_lenses", "estimated_lenses"])
def test_standard_errors_say_how_far_poses_are_off(lenses):
    z = []
    for seed in range(40):
        given = session(cameras=3, moments=10, seed=seed, noise_px=0.3)
        found = calibrate_rig(getattr(given, lenses)(), given.seen, BOARD)
        for pose in found.pairs():
            T = pose.T_reference_camera
            truth = inverse(given.T_first_camera[pose.reference]) @ given.T_first_camera[pose.camera]
            turn = cv2.Rodrigues(T[:3, :3] @ truth[:3, :3].T)[0].ravel()
            error = np.concatenate([turn, T[:3, 3] - truth[:3, 3]])
            z.append(error / np.sqrt(np.diag(pose.covariance)))
            assert pose.baseline_sd_m <= pose.position_sd_m
    assert np.all((np.std(z, axis=0) > 0.7) & (np.std(z, axis=0) < 1.3))
    assert 0.85 < np.std(z) < 1.15


def test_held_out_moments_are_predicted_about_as_well_and_never_better():
    given = session(cameras=3, noise_px=0.3)
    found = calibrate_rig(given.estimated_lenses(), given.seen, BOARD, folds=2)
    assert found.rms_px < found.held_out.rms_px < 1.2 * found.rms_px
    assert len(found.held_out.residuals_px) == len(found.sightings)
    assert 0.0 < max(found.held_out.rotation_deg.values()) < 0.1
    assert 0.0 < max(found.held_out.position_m.values()) < 0.002


def test_a_camera_that_was_pushed_between_the_moments_is_told_by_those_held_out():
    """Poses that were right in the first half are wrong in the second."""
    given = session(cameras=2, noise_px=0.1)
    pushed = session(cameras=2, noise_px=0.1, apart_deg=25.5)
    for moment in list(given.seen["node_01"])[1::2]:
        if moment in pushed.seen["node_01"]:
            given.seen["node_01"][moment] = pushed.seen["node_01"][moment]
    found = calibrate_rig(given.known_lenses(), given.seen, BOARD, folds=2)
    assert found.held_out.rms_px > 1.0
    assert found.held_out.rotation_deg["node_01"] > 0.1


def test_too_few_moments_to_leave_any_out_are_not_held_out():
    given = session(cameras=2, moments=1)
    assert calibrate_rig(given.known_lenses(), given.seen, BOARD, folds=2).held_out is None


def test_opencv_finds_the_same_poses_where_boards_are_the_right_way_up():
    given = session(cameras=3, moments=16, noise_px=0.3, pairs_only=True)
    count = len(BOARD.points_m)
    nothing = np.full((count, 2), -1.0, np.float32)
    moments = [str(index) for index in range(len(given.T_first_board))]
    points_px = [
        [
            given.seen[name][m].view.points_px.astype(np.float32) if m in given.seen[name] else nothing
            for m in moments
        ]
        for name in given.cameras
    ]
    mask = np.array([[m in given.seen[name] for m in moments] for name in given.cameras], np.uint8)
    _, _, _, turns, moves, *_ = cv2.calibrateMultiviewExtended(
        [BOARD.points_m.astype(np.float32)] * len(moments),
        points_px,
        [(camera.width_px, camera.height_px) for camera in given.cameras.values()],
        mask,
        np.zeros(3, np.uint8),
        [camera.matrix.copy() for camera in given.cameras.values()],
        [camera.distortion.copy() for camera in given.cameras.values()],
        None,
        None,
        flagsForIntrinsics=np.full(3, cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_INTRINSIC, np.int32),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS,
    )
    found = calibrate_rig(given.known_lenses(), given.seen, BOARD)
    for name, turn, move in zip(given.cameras, turns, moves, strict=True):
        rotation = turn if np.shape(turn) == (3, 3) else cv2.Rodrigues(np.asarray(turn))[0]
        theirs = inverse(rigid(rotation, np.ravel(move)))
        turned_deg, moved_m = off(found.T_first_camera[name], theirs)
        assert turned_deg < 0.005
        assert moved_m < 2e-4


def test_cameras_that_never_see_the_board_together_are_named():
    given = session(cameras=3)
    given.seen["node_02"] = {f"later {moment}": one for moment, one in given.seen["node_02"].items()}
    with pytest.raises(
        InputError, match="node_02 never sees the board at a moment at which node_00 or node_01 does"
    ):
        calibrate_rig(given.known_lenses(), given.seen, BOARD)


def test_one_moment_without_a_mark_does_not_tell_which_way_up():
    given = session(cameras=2, moments=1, marked=False)
    with pytest.raises(ReconstructionError, match="node_00 and node_01 see the board together too rarely"):
        calibrate_rig(given.known_lenses(), given.seen, BOARD)


def test_one_camera_or_very_many_are_no_rig():
    given = session(cameras=2)
    with pytest.raises(InputError, match="1 cameras are given"):
        calibrate_rig({"node_00": given.known_lenses()["node_00"]}, given.seen, BOARD)

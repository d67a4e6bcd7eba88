"""Cameras are where they are, as surely as they say, whether or not all see the board together."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration import rig
from pipeline.calibration.board import Board
from pipeline.calibration.bundle import adjust
from pipeline.calibration.estimate import View
from pipeline.calibration.rig import Seen, calibrate_rig
from pipeline.kernels.geometry import apply, inverse, project, rigid, rotation_angle_rad, rotation_exp
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
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    assert found.rms_px < 1e-6
    assert_near(found, given, 1e-6, 1e-8)
    for moment, T in zip(found.moments, found.adjusted.bundle.T_first_board, strict=True):
        np.testing.assert_allclose(T, given.T_first_board[int(moment)], atol=1e-7)


@pytest.mark.parametrize(
    "case", [{"cameras": 2}, {"cameras": 3}, {"cameras": 5, "moments": 24, "apart_deg": 15.0}]
)
def test_noise_leaves_a_tenth_of_a_degree_and_two_millimetres(case):
    given = session(**case, noise_px=0.1)
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    assert_near(found, given)
    assert found.rms_px == pytest.approx(0.1 * np.sqrt(2.0), rel=0.1)


def test_cameras_that_share_no_moment_are_linked_by_the_one_between():
    given = session(cameras=3, moments=20, noise_px=0.1, pairs_only=True)
    assert not given.seen["node_00"].keys() & given.seen["node_02"].keys()
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    assert_near(found, given)
    assert found.relative("node_02").moments == 0


def test_boards_without_a_mark_are_turned_as_the_other_cameras_have_them():
    marked, unmarked = (session(seed=4, noise_px=0.1, marked=known) for known in (True, False))
    first_px = [one.view.points_px[0] for one in marked.seen["node_00"].values()]
    turned = [one.view.points_px[0] for one in unmarked.seen["node_00"].values()]
    assert 3 < np.sum(np.linalg.norm(np.subtract(first_px, turned), axis=1) > 100.0) < len(turned)
    found = calibrate_rig(unmarked.lenses(), unmarked.seen, BOARD)
    assert_near(found, unmarked)
    assert found.rms_px < 1.1 * calibrate_rig(marked.lenses(), marked.seen, BOARD).rms_px


def test_a_square_grid_may_lie_four_ways():
    board = Board("circles", 7, 7, 0.04)
    given = session(cameras=2, noise_px=0.1, board=board)
    rng = np.random.default_rng(0)
    for views in given.seen.values():
        for moment, one in views.items():
            quarter = np.rot90(np.arange(49).reshape(7, 7), rng.integers(4)).ravel()
            view = View(moment, one.view.points_px[quarter], board.points_m)
            views[moment] = Seen(view, oriented=False)
    assert_near(calibrate_rig(given.lenses(), given.seen, board), given)


def test_standard_errors_say_how_far_poses_and_lenses_are_off():
    z, z_lens = [], []
    for seed in range(24):
        given = session(cameras=3, moments=10, seed=seed, noise_px=0.3)
        found = calibrate_rig(given.lenses(), given.seen, BOARD)
        for pose in found.pairs():
            T = pose.T_reference_camera
            truth = inverse(given.T_first_camera[pose.reference]) @ given.T_first_camera[pose.camera]
            turn = cv2.Rodrigues(T[:3, :3] @ truth[:3, :3].T)[0].ravel()
            error = np.concatenate([turn, T[:3, 3] - truth[:3, 3]])
            z.append(error / np.sqrt(np.diag(pose.covariance)))
            assert pose.baseline_sd_m <= pose.position_sd_m
        for name, camera in given.cameras.items():
            lens = found.cameras[name]
            z_lens.append((lens.parameters["fx"] - camera.fx_px) / lens.standard_errors["fx"])
    assert np.all((np.std(z, axis=0) > 0.7) & (np.std(z, axis=0) < 1.3))
    assert 0.8 < np.std(z) < 1.2
    assert 0.7 < np.std(z_lens) < 1.3


def test_covariances_are_those_of_least_squares_with_their_degrees_of_freedom():
    """(J^T J)^-1 times the squares over observations less parameters, with J by differences."""
    given = session(cameras=2, moments=4, noise_px=0.3)
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    bundle = found.adjusted.bundle

    def off_px(step):
        return np.concatenate([one.ravel() for one in bundle.moved(step).residuals_px(found.sightings)])

    J = np.stack([(off_px(h) - off_px(-h)) / 2e-6 for h in 1e-6 * np.eye(sum(bundle.sizes))], axis=1)
    size, rest_px = np.linalg.norm(J, axis=0), off_px(np.zeros(J.shape[1]))
    variance_px2 = rest_px @ rest_px / (J.shape[0] - J.shape[1])
    spread = variance_px2 * np.linalg.inv((J / size).T @ (J / size)) / np.outer(size, size)
    expected = np.split(np.sqrt(np.diag(spread)), np.cumsum(bundle.sizes)[:-1])
    told = found.adjusted.camera_covariance, *found.adjusted.lens_covariances
    for covariance, sds in zip(told, (expected[0], *expected[2:]), strict=True):
        np.testing.assert_allclose(np.sqrt(np.diag(covariance)), sds, rtol=1e-4)


@pytest.mark.parametrize(("camera", "reference"), [("node_01", "node_00"), ("node_02", "node_01")])
def test_the_covariance_between_two_cameras_is_the_cameras_own_carried_over(camera, reference):
    """With the change of the relative pose by differences."""
    given = session(cameras=3, moments=4, noise_px=0.3)
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    bundle, names = found.adjusted.bundle, list(found.names)
    a, b = names.index(reference), names.index(camera)

    def pose(step):
        placed = bundle.moved(np.append(step, np.zeros(sum(bundle.sizes) - len(step)))).T_camera_first
        return placed[a] @ inverse(placed[b])

    def change(step):
        before, after = pose(-step), pose(step)
        turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec()
        return np.append(turn, after[:3, 3] - before[:3, 3]) / 2e-6

    J = np.stack([change(h) for h in 1e-6 * np.eye(bundle.sizes[0])], axis=1)
    expected = J @ found.adjusted.camera_covariance @ J.T
    told = found.relative(camera, reference).covariance
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(told / np.outer(size, size), expected / np.outer(size, size), atol=1e-5)


def test_a_rig_knows_its_lenses_better_than_each_camera_does_and_so_its_poses():
    alone_px, together_px, held_mm, free_mm = [], [], [], []
    for seed in range(6):
        given = session(cameras=2, moments=12, seed=seed, noise_px=0.3)
        lenses = given.lenses()
        found = calibrate_rig(lenses, given.seen, BOARD)
        for name, camera in given.cameras.items():
            alone_px.append(lenses[name].parameters["fx"] - camera.fx_px)
            together_px.append(found.cameras[name].parameters["fx"] - camera.fx_px)
        truth = given.T_first_camera["node_01"]
        held = opencv_poses(given, lenses)["node_01"]
        held_mm.append(1000.0 * off(held, truth)[1])
        free_mm.append(1000.0 * off(found.T_first_camera["node_01"], truth)[1])
    assert 2.0 * np.linalg.norm(free_mm) < np.linalg.norm(held_mm)
    assert 1.5 * np.linalg.norm(together_px) < np.linalg.norm(alone_px)


def test_held_out_moments_are_predicted_about_as_well_and_never_better():
    given = session(cameras=3, noise_px=0.1)
    found = calibrate_rig(given.lenses(), given.seen, BOARD, folds=2)
    assert found.rms_px < found.held_out.rms_px < 1.2 * found.rms_px
    for name, views in found.held_out.views.items():
        assert {view.name for view in views} == {view.name for view in found.cameras[name].views}
    assert 0.0 < max(found.held_out.rotation_deg.values()) < 0.1
    assert 0.0 < max(found.held_out.position_m.values()) < 0.003


def test_a_camera_that_was_pushed_between_the_moments_is_told_by_those_held_out():
    """Poses that were right in every other moment are wrong in the rest."""
    given = session(cameras=2, noise_px=0.1)
    pushed = given.T_first_camera["node_01"] @ rigid(rotation_exp(np.array([0.0, 0.005, 0.0])), np.zeros(3))
    for moment, T_first_board in enumerate(given.T_first_board[1::2]):
        points_m = apply(inverse(pushed) @ T_first_board, BOARD.points_m)
        pixels = project(given.cameras["node_01"], points_m)
        given.seen["node_01"][str(2 * moment + 1)] = Seen(View(str(moment), pixels, BOARD.points_m))
    found = calibrate_rig(given.lenses(), given.seen, BOARD, folds=2)
    assert found.held_out.rms_px > 0.5
    assert found.held_out.rotation_deg["node_01"] > 0.1


def test_too_few_moments_to_leave_any_out_are_not_held_out():
    given = session(cameras=2, moments=4)
    assert calibrate_rig(given.lenses(), given.seen, BOARD, folds=2).held_out is None


def test_moments_that_do_not_determine_the_cameras_without_a_fold_are_not_held_out(monkeypatch):
    given, calls = session(2, 8), []

    def once(*arguments):
        calls.append(arguments)
        if len(calls) > 1:
            raise np.linalg.LinAlgError
        return adjust(*arguments)

    monkeypatch.setattr(rig, "adjust", once)
    found = calibrate_rig(given.lenses(), given.seen, BOARD, folds=2)
    assert found.held_out is None
    assert_near(found, given, 0.3, 0.006)


def opencv_poses(given, lenses):
    """By ``calibrateMultiviewExtended``, which leaves the lenses as they are."""
    nothing = np.full((len(BOARD.points_m), 2), -1.0, np.float32)
    moments = [str(index) for index in range(len(given.T_first_board))]
    mask = np.array([[moment in seen for moment in moments] for seen in given.seen.values()], np.uint8)
    points_px = [
        [seen[moment].view.points_px.astype(np.float32) if moment in seen else nothing for moment in moments]
        for seen in given.seen.values()
    ]
    _, _, _, turns, moves, *_ = cv2.calibrateMultiviewExtended(
        [BOARD.points_m.astype(np.float32)] * len(moments),
        points_px,
        [lens.size_px for lens in lenses.values()],
        mask,
        np.zeros(len(lenses), np.uint8),
        [lens.matrix.copy() for lens in lenses.values()],
        [lens.distortion.copy() for lens in lenses.values()],
        None,
        None,
        flagsForIntrinsics=np.full(len(lenses), cv2.CALIB_USE_INTRINSIC_GUESS, np.int32),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS,
    )
    poses = {}
    for name, turn, move in zip(lenses, turns, moves, strict=True):
        rotation = turn if np.shape(turn) == (3, 3) else cv2.Rodrigues(np.asarray(turn))[0]
        poses[name] = inverse(rigid(rotation, np.ravel(move)))
    return poses


def test_opencv_finds_the_same_poses_for_the_same_lenses():
    given = session(cameras=3, moments=16, noise_px=0.3, pairs_only=True)
    found = calibrate_rig(given.lenses(), given.seen, BOARD)
    theirs = opencv_poses(given, found.cameras)
    for name, T in found.T_first_camera.items():
        turned_deg, moved_m = off(T, theirs[name])
        assert turned_deg < 0.001
        assert moved_m < 2e-5


def test_cameras_that_never_see_the_board_together_are_named():
    given = session(cameras=3)
    given.seen["node_02"] = {f"later {moment}": one for moment, one in given.seen["node_02"].items()}
    with pytest.raises(
        InputError, match="node_02 never sees the board at a moment at which node_00 or node_01 does"
    ):
        calibrate_rig(given.lenses(), given.seen, BOARD)


@pytest.mark.parametrize("marked", [True, False])
def test_images_that_are_not_of_the_same_moment_are_told(marked):
    given = session(cameras=2, marked=marked)
    lenses = given.lenses()
    moments, views = zip(*given.seen["node_01"].items(), strict=True)
    given.seen["node_01"] = dict(zip(moments, (*views[1:], views[0]), strict=True))
    with pytest.raises(ReconstructionError, match=r"do not fit together: .* show the same moment"):
        calibrate_rig(lenses, given.seen, BOARD)


def test_one_moment_without_a_mark_does_not_tell_which_way_up():
    given = session(cameras=2, marked=False)
    lenses = given.lenses()
    once = {name: dict([next(iter(views.items()))]) for name, views in given.seen.items()}
    with pytest.raises(ReconstructionError, match="node_00 and node_01 see the board together too rarely"):
        calibrate_rig(lenses, once, BOARD)


def test_one_camera_or_very_many_are_no_rig():
    given = session(cameras=2)
    with pytest.raises(InputError, match="and 1 are given"):
        calibrate_rig(dict(list(given.lenses().items())[:1]), given.seen, BOARD)

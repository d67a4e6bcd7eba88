"""The demo rig that nobody has calibrated, from the photographs of a board before its three cameras."""

import re

import numpy as np
import pytest

from lab.claims.calibration.photograph import photograph
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import drain
from pipeline.calibration import estimate
from pipeline.calibration.board import Board
from pipeline.calibration.rig_from_images import iterate_rig_calibration
from pipeline.calibration.rig_report import pose_like, rig_metrics, write_rig_folder
from pipeline.calibration.shots import board_beside, node_shots
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.images import write_color
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.poses import read_pose, write_pose
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import LEVEL_POSE, inverse, rigid, rotation_angle_rad, rotation_exp
from pipeline.types import CameraIntrinsics
from tests.paths import ASSETS
from tests.pipeline.calibration.views import CAMERA, poses

RIG = ASSETS / "scenes" / "uncalibrated"
SESSION = RIG / "board"


@pytest.fixture(scope="module")
def report():
    return drain(iterate_rig_calibration(node_shots([SESSION]), board_beside([SESSION]), folds=2))


def test_three_rendered_cameras_are_found_within_a_tenth_of_a_degree_and_two_millimetres(report):
    true = {name: read_pose(RIG / name / "true_pose.txt") for name in report.cameras}
    for pose in report.rig.pairs():
        truth = inverse(true[pose.reference]) @ true[pose.camera]
        apart = inverse(truth) @ pose.T_reference_camera
        assert np.degrees(rotation_angle_rad(apart[:3, :3])) < 0.02
        off_m = np.linalg.norm(pose.T_reference_camera[:3, 3] - truth[:3, 3])
        assert off_m < max(3.0 * pose.position_sd_m, 0.0003)


def test_their_lenses_are_those_that_took_the_photographs(report):
    for name, one in report.cameras.items():
        lens, found = read_intrinsics(RIG / name / "true_intrinsics.json"), one.calibration
        for key, true in zip(("fx", "fy", "cx", "cy"), lens.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], strict=True):
            assert abs(found.parameters[key] - true) < max(4.0 * found.standard_errors[key], 0.1)
        np.testing.assert_allclose(one.calibration.distortion[:2], lens.distortion[:2], atol=0.005)


def test_moments_that_were_held_out_are_predicted(report):
    metrics = rig_metrics(report)
    assert metrics["rms_px"] < metrics["held_out_rms_px"] < 1.5 * metrics["rms_px"] < 0.1
    for name, camera in metrics["cameras"].items():
        assert camera["held_out_rms_px"] < 0.1, name
        used = [view for view in camera["views"] if view["found"]]
        assert all(view["rms_px"] is not None and view["held_out_rms_px"] is not None for view in used)
    assert [(one["camera"], one["reference"]) for one in metrics["extrinsics"]] == [
        ("node_01", "node_00"),
        ("node_02", "node_00"),
        ("node_02", "node_01"),
    ]


def test_the_folder_is_laid_over_the_rig_in_its_own_world(report, tmp_path):
    write_rig_folder(report, tmp_path, pose_like(RIG, "node_00"))
    before, after = load_rig(RIG), load_rig(RIG, tmp_path)
    np.testing.assert_allclose(after.frames[0].T_world_camera, before.frames[0].T_world_camera, atol=1e-12)

    def off_m(rig):
        """Of the second node's place, seen from the first."""
        first, second = (frame.T_world_camera for frame in rig.frames[:2])
        truth = inverse(rig.truth.T_world_camera[0]) @ rig.truth.T_world_camera[1]
        return np.linalg.norm((inverse(first) @ second - truth)[:3, 3])

    assert off_m(after) < 0.0003 < 0.003 < off_m(before)
    np.testing.assert_array_equal(
        after.frames[1].intrinsics.matrix, report.cameras["node_01"].calibration.matrix
    )


def test_depth_is_corrected_by_the_same_boards(report, tmp_path):
    write_rig_folder(report, tmp_path, pose_like(RIG, "node_00"))
    assert all(one.depth is not None for one in report.cameras.values())

    def off_m(rig):
        return [
            abs(float(np.nanmedian(frame.depth.z_m - true.z_m)))
            for frame, true in zip(rig.frames, rig.truth.depth, strict=True)
        ]

    before_m, after_m = off_m(load_rig(RIG)), off_m(load_rig(RIG, tmp_path))
    assert max(before_m) > 0.02
    assert max(after_m) < 0.3 * max(before_m)


def test_a_calibration_of_more_cameras_is_not_mixed_with_a_new_one(report, tmp_path):
    write_pose(tmp_path / "node_07" / "pose.txt", LEVEL_POSE)
    (tmp_path / "metrics.json").touch()
    with pytest.raises(InputError, match="already holds the calibration of node_07"):
        write_rig_folder(report, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"node_07", "metrics.json"}


def test_without_a_rig_the_first_camera_stands_level(report, tmp_path):
    write_rig_folder(report, tmp_path)
    np.testing.assert_array_equal(read_pose(tmp_path / "node_00" / "pose.txt"), LEVEL_POSE)
    with pytest.raises(InputError, match=r"has no node_00/pose\.txt"):
        pose_like(tmp_path / "elsewhere", "node_00")


def test_what_is_wrong_with_one_camera_names_it(tmp_path):
    for name in ("node_00", "node_01"):
        for index in range(3):
            write_color(tmp_path / name / f"color_{index}.png", np.full((60, 80, 3), 200, np.uint8))
    board = board_beside([SESSION])
    with pytest.raises(InputError, match=r"^node_00: The board .* is found in 0 of 3 images"):
        drain(iterate_rig_calibration(node_shots([tmp_path]), board))
    write_color(tmp_path / "node_00" / "color_9.png", np.full((50, 80, 3), 200, np.uint8))
    with pytest.raises(InputError, match=r"^node_00: The images are not of one size"):
        drain(iterate_rig_calibration(node_shots([tmp_path]), board))
    with pytest.raises(InputError, match=r"^node_09/color_00\.jpg is none of the cameras' images"):
        drain(iterate_rig_calibration(node_shots([tmp_path]), board, without=["node_09/color_00.jpg"]))


def test_an_impossible_camera_names_its_worst_image_as_without_takes_it(tmp_path, monkeypatch):
    board = Board("chessboard", 5, 4, 0.05)
    for index, T in enumerate(poses(board, 3)):
        for node in ("node_00", "node_01"):
            write_color(tmp_path / node / f"color_{index}.png", np.dstack([photograph(board, T, CAMERA)] * 3))
    monkeypatch.setattr(estimate, "MOST_RMS_PX", 1e-6)
    with pytest.raises(ReconstructionError) as told:
        drain(iterate_rig_calibration(node_shots([tmp_path]), board))
    word = "/".join(
        re.fullmatch(r"(node_00): .* the worst image, (color_\d\.png) \(.*", str(told.value)).groups()
    )
    with pytest.raises(InputError, match="is found in 2 of 3 images, 1 left out"):
        drain(iterate_rig_calibration(node_shots([tmp_path]), board, without=[word]))


def test_a_separate_depth_camera_is_placed_beside_its_colour_camera(tmp_path):
    """A colour camera, and 4 cm to its left an infrared one of half the size."""
    board = Board("chessboard", 9, 6, 0.025)
    half = CameraIntrinsics.pinhole(300.0, 302.0, 159.0, 121.0, 320, 240)
    T_infrared_color = rigid(rotation_exp(np.array([0.0, 0.02, 0.0])), np.array([0.04, 0.0, 0.0]))
    node = tmp_path / "node_00"
    for index, T in enumerate(poses(board, 6)):
        T[:3, 3] *= 1.3
        for kind, picture in (
            ("color", photograph(board, T, CAMERA)),
            ("infrared", photograph(board, T_infrared_color @ T, half)),
        ):
            write_color(node / f"{kind}_{index:02d}.png", np.repeat(picture[..., None], 3, axis=2))
    report = drain(iterate_rig_calibration(node_shots([tmp_path]), board))
    assert list(report.cameras) == ["node_00", "node_00/infrared"]
    write_rig_folder(report, tmp_path / "cal")
    names = {path.name for path in (tmp_path / "cal" / "node_00").iterdir()}
    assert {"intrinsics.json", "depth_intrinsics.json", "extrinsics.json", "pose.txt"} <= names
    assert read_intrinsics(tmp_path / "cal/node_00/depth_intrinsics.json").fx_px == pytest.approx(
        300.0, rel=0.01
    )
    T = read_extrinsics(tmp_path / "cal/node_00/extrinsics.json") @ T_infrared_color
    assert np.degrees(rotation_angle_rad(T[:3, :3])) < 0.2
    assert np.linalg.norm(T[:3, 3]) < 0.002

"""Rendered board views: the board is where the truth says, in colour and, but for the bias, in depth."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from lab.worlds import __main__ as command
from lab.worlds.board_files import load_board_views, save_board_views
from lab.worlds.board_poses import propose_poses, sees
from lab.worlds.board_views import (
    BoardCamera,
    BoardImage,
    BoardViews,
    _window,
    is_partly_behind,
    render_board_views,
)
from lab.worlds.depth_bias import DepthBias
from lab.worlds.staging import arc
from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.estimate import View, calibrate
from pipeline.kernels.geometry import apply, inverse, look_at, pixel_rays, project, rigid, scaled
from pipeline.types import CameraIntrinsics, DepthMap

LENS = CameraIntrinsics(
    np.array([[541.0, 0.0, 326.0], [0.0, 538.0, 233.0], [0.0, 0.0, 1.0]]),
    np.array([0.06, -0.12, 0.0, 0.0, 0.0]),
    640,
    480,
)
BOARD = Board(spacing_m=0.05)
BIAS = DepthBias(-0.03, 0.99, 0.002, np.array([[0.0, 0.004], [0.003, 0.0]]))


@pytest.fixture(scope="module")
def views() -> BoardViews:
    """Six moments before two cameras, the second of which has a biased sensor."""
    poses = arc((0.0, 0.0, 0.9), 1.5, 1.3, (-100.0, -75.0))
    cameras = [BoardCamera(LENS, poses[0]), BoardCamera(LENS, poses[1], BIAS)]
    return render_board_views(BOARD, cameras, propose_poses(BOARD, cameras, 6, seed=3), seed=3)


def test_circles_are_found_where_the_lens_has_them(views: BoardViews) -> None:
    found = 0
    for moment, images in enumerate(views.images):
        for node, image in enumerate(images):
            if not sees(BOARD, views.cameras[node], views.T_world_board[moment]):
                continue
            detection = detect(image.rgb, BOARD)
            assert detection.found, (moment, node, detection.reason)
            wanted_px = project(LENS, apply(views.T_camera_board(moment, node), BOARD.points_m))
            off_px = np.linalg.norm(detection.points_px - wanted_px, axis=1)
            assert detection.oriented
            assert off_px.mean() < 0.15
            found += 1
    assert found >= 8


@pytest.mark.parametrize("pattern", ["chessboard", "charuco"])
def test_corners_are_found_too(pattern: str) -> None:
    board = Board(pattern, 8, 5, 0.05)
    camera = BoardCamera(LENS, look_at((0.0, -1.0, 0.0), (0.0, 0.0, 0.0)))
    T = camera.T_world_camera @ rigid(np.eye(3), np.array([0.05, 0.02, 0.9]))
    ((image,),) = render_board_views(board, [camera], [T], seed=1).images
    detection = detect(image.rgb, board)
    wanted_px = project(LENS, apply(inverse(camera.T_world_camera) @ T, board.points_m[detection.indices]))
    assert len(detection.points_px) >= 32
    assert np.abs(detection.points_px - wanted_px).mean() < 0.1


def test_calibration_recovers_the_lens() -> None:
    pose = look_at((0.0, -1.5, 1.2), (0.0, 0.0, 0.9))
    camera = BoardCamera(LENS, pose)
    views = render_board_views(BOARD, [camera], propose_poses(BOARD, [camera], 9, seed=5), seed=5)
    seen = [
        View(str(moment), found.points_px, BOARD.points_m)
        for moment, (image,) in enumerate(views.images)
        if (found := detect(image.rgb, BOARD)).found
    ]
    lens = calibrate(seen, (640, 480))
    assert len(seen) >= 8
    assert lens.rms_px < 0.1
    # Centres of circles are not the circles' centres; uncorrected that costs half a thousandth of the focal.
    assert lens.parameters["fx"] == pytest.approx(541.0, rel=1e-3)
    assert lens.parameters["fy"] == pytest.approx(538.0, rel=1e-3)
    assert lens.parameters["cx"] == pytest.approx(326.0, abs=0.3)
    assert lens.parameters["cy"] == pytest.approx(233.0, abs=0.3)
    assert lens.parameters["k1"] == pytest.approx(0.06, abs=0.01)


def _plane_m(views: BoardViews, moment: int, node: int) -> np.ndarray:
    """(H, W) true depth of the board's plane."""
    T = views.T_camera_board(moment, node)
    return (T[:3, 2] @ T[:3, 3]) / (pixel_rays(views.cameras[node].intrinsics) @ T[:3, 2])


def test_depth_on_the_board_is_its_plane_but_for_the_bias(views: BoardViews) -> None:
    judged = 0
    for moment in range(len(views.images)):
        for node, image in enumerate(views.images[moment]):
            if not sees(BOARD, views.cameras[node], views.T_world_board[moment]):
                continue
            corners_px = project(LENS, apply(views.T_camera_board(moment, node), BOARD.points_m))
            u, v = np.rint(corners_px).astype(int).T
            true_m = _plane_m(views, moment, node)[v, u]
            z_m = image.depth.z_m[v, u].astype(float)
            if node == 1:
                share = BIAS.share(image.depth.z_m.shape)[v, u]
                z_m = BIAS.a_m + BIAS.b * z_m + BIAS.c_per_m * z_m**2 + z_m * share
            error_m = (z_m - true_m)[np.isfinite(z_m)]
            assert len(error_m) > 50
            assert abs(np.median(error_m)) < 0.006  # a biased sensor is off by 2 to 5 cm here
            judged += 1
    assert judged >= 8


def test_bias_and_its_correction_are_each_others_inverse() -> None:
    true = DepthMap(np.linspace(0.5, 4.0, 48 * 64, dtype=np.float32).reshape(48, 64))
    z_m = BIAS.measured(true).z_m.astype(float)
    again_m = BIAS.a_m + (BIAS.b + BIAS.share((48, 64))) * z_m + BIAS.c_per_m * z_m**2
    np.testing.assert_allclose(again_m, true.z_m, atol=1e-6)
    assert abs(BIAS.share((48, 64)).mean()) < 1e-12
    np.testing.assert_array_equal(DepthBias().measured(true).z_m, true.z_m)


def test_a_board_behind_something_does_not_show() -> None:
    camera = BoardCamera(scaled(LENS, 0.25), look_at((0.0, -1.0, 1.0), (0.0, 0.0, 1.0)))
    T = camera.T_world_camera @ rigid(np.eye(3), np.array([0.0, 0.0, 0.9]))
    near = np.full((120, 160), 0.5)
    assert sees(BOARD, replace(camera, intrinsics=LENS), T)
    assert not sees(BOARD, camera, T)  # its circles are too small
    assert not sees(BOARD, replace(camera, intrinsics=LENS), T, np.kron(near, np.ones((4, 4))))
    turned = T @ rigid(np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    assert not sees(BOARD, replace(camera, intrinsics=LENS), turned)
    ((front,), (back,)) = render_board_views(BOARD, [camera], [T, turned], seed=0).images
    assert front.rgb[50:70, 70:90].std() > 2.0 * back.rgb[50:70, 70:90].std()


def test_the_same_seed_gives_the_same_views(tmp_path) -> None:
    camera = BoardCamera(scaled(LENS, 0.5), look_at((0.0, -1.0, 1.0), (0.0, 0.0, 1.0)), BIAS)
    board = Board("circles", 5, 4, 0.08)
    poses = propose_poses(board, [camera], 2, seed=1)
    first, again, other = (render_board_views(board, [camera], poses, seed) for seed in (1, 1, 2))
    for one, two, three in zip(first.images, again.images, other.images, strict=True):
        np.testing.assert_array_equal(one[0].rgb, two[0].rgb)
        np.testing.assert_array_equal(one[0].depth.z_m, two[0].depth.z_m)
        assert np.any(one[0].rgb != three[0].rgb)
    save_board_views(tmp_path, first)
    read = load_board_views(tmp_path)
    assert read.board == board
    np.testing.assert_array_equal(read.T_world_board, poses)
    np.testing.assert_array_equal(read.cameras[0].intrinsics.matrix, camera.intrinsics.matrix)
    np.testing.assert_array_equal(read.cameras[0].bias.waves, BIAS.waves)
    np.testing.assert_allclose(read.images[1][0].depth.z_m, first.images[1][0].depth.z_m, atol=0.000501)
    assert np.abs(read.images[1][0].rgb.astype(int) - first.images[1][0].rgb).mean() < 3.0


def _blank(board: Board, lens: CameraIntrinsics, nodes: int, moments: int) -> BoardViews:
    """Views of nothing, with depth everywhere."""
    shape = lens.height_px, lens.width_px
    image = BoardImage(np.zeros((*shape, 3), np.uint8), DepthMap(np.ones(shape, np.float32)))
    camera = BoardCamera(lens, np.eye(4))
    return BoardViews(board, (camera,) * nodes, (np.eye(4),) * moments, ((image,) * nodes,) * moments)


@pytest.mark.parametrize(
    "board",
    [Board("charuco", 8, 5, 0.05, "5X5_100"), Board("aprilgrid", 4, 3, 0.08, tag_spacing=0.25), BOARD],
)
def test_files_keep_the_markers_of_a_board_and_the_model_of_a_lens(tmp_path, board: Board) -> None:
    small = scaled(LENS, 0.05)
    for lens in (small, replace(small, distortion=np.array([0.1, 0.01, 0.0, 0.0]), fisheye=True)):
        save_board_views(tmp_path, _blank(board, lens, 1, 1))
        read = load_board_views(tmp_path)
        assert read.board == board
        assert read.cameras[0].intrinsics.fisheye == lens.fisheye
        np.testing.assert_array_equal(read.cameras[0].intrinsics.distortion, lens.distortion)


def test_images_of_an_earlier_rendering_are_deleted(tmp_path) -> None:
    lens = scaled(LENS, 0.05)
    for nodes, moments in ((2, 3), (1, 2)):
        save_board_views(tmp_path, _blank(BOARD, lens, nodes, moments))
    names = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob("node_*/*"))
    assert names == [
        f"node_00/{kind}" for kind in ("color_00.jpg", "color_01.jpg", "depth_00.png", "depth_01.png")
    ]
    assert not (tmp_path / "node_01").exists()


def test_a_truth_whose_cameras_have_no_names_is_refused(tmp_path) -> None:
    save_board_views(tmp_path, _blank(BOARD, scaled(LENS, 0.05), 1, 1))
    truth = json.loads((tmp_path / "truth.json").read_text())
    (tmp_path / "truth.json").write_text(json.dumps(truth | {"cameras": list(truth["cameras"].values())}))
    with pytest.raises(InputError, match="render them again"):
        load_board_views(tmp_path)


def test_an_unknown_demo_is_refused_in_one_sentence() -> None:
    with pytest.raises(SystemExit, match="no demo scene 'kitchen'; try one of living-room"):
        command.main(["kitchen"])


def test_a_lens_without_rays_at_the_corners_photographs_the_board() -> None:
    lens = replace(scaled(LENS, 0.25), distortion=np.array([-0.55, 0.1, 0.0, 0.0, 0.0]))
    camera = BoardCamera(lens, look_at((0.0, -1.0, 1.0), (0.0, 0.0, 1.0)))
    T = camera.T_world_camera @ rigid(np.eye(3), np.array([0.0, 0.0, 0.4]))
    ((image,),) = render_board_views(Board("circles", 5, 4, 0.08), [camera], [T], seed=0).images
    unseen = np.isnan(pixel_rays(lens)).any(axis=2)
    assert 0.1 < unseen.mean() < 0.3
    near = cv2.dilate(unseen.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert image.rgb[~near].min() > 20
    assert image.rgb[40:80, 60:100].std() > 40.0
    assert not image.depth.valid[unseen].any()


def test_no_proposed_board_is_partly_behind_a_camera() -> None:
    front = BoardCamera(LENS, look_at((0.0, -1.0, 1.0), (0.0, 0.0, 1.0)))
    aside = BoardCamera(LENS, look_at((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)))
    straddling = [
        [
            is_partly_behind(BOARD, inverse(aside.T_world_camera) @ T)
            for T in propose_poses(BOARD, cameras, 3, 0)
        ]
        for cameras in ([front], [front, aside])
    ]
    assert any(straddling[0])
    assert not any(straddling[1])


def test_proposals_are_seen_together_and_from_several_sides() -> None:
    cameras = [BoardCamera(LENS, T) for T in arc((0.0, 0.0, 0.9), 2.0, 1.4, (-115.0, -90.0, -65.0))]
    poses = propose_poses(BOARD, cameras, 12, seed=1)
    seen = np.array([[sees(BOARD, camera, T) for camera in cameras] for T in poses])
    assert seen.any(axis=1).all()
    assert (seen.sum(axis=0) >= 8).all()
    assert (seen[:, 0] & seen[:, 1]).sum() >= 4
    assert (seen[:, 1] & seen[:, 2]).sum() >= 4
    away_m = np.array([np.linalg.norm((inverse(cameras[1].T_world_camera) @ T)[:3, 3]) for T in poses])
    assert np.ptp(away_m[seen[:, 1]]) > 0.6


def test_no_place_for_a_board_is_said() -> None:
    camera = BoardCamera(scaled(LENS, 0.1), np.eye(4))
    with pytest.raises(InputError, match="Only 0 of 4 board poses"):
        propose_poses(BOARD, [camera], 4, seed=0)


def test_a_board_wider_than_the_range_of_the_lens_may_cover_the_whole_picture() -> None:
    """The lens has no image beyond 34°, and the sheet reaches farther on both sides."""
    lens = replace(LENS, distortion=np.array([-0.7, 0.0, 0.0, 0.0, 0.0]))
    board = Board("chessboard", 8, 5, 0.2)
    T = rigid(np.eye(3), np.array([0.0, 0.0, 0.9]))
    assert np.isnan(project(lens, apply(T, board.points_m))).any()
    assert _window(board, T, lens) == (slice(0, 480), slice(0, 640))

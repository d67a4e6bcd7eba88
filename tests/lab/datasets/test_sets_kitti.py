"""KITTI: lists of frames, improved ground truth, and laser points projected into the picture."""

import numpy as np
import pytest

from lab.datasets import open_set
from lab.datasets.kitti import judged
from packetmesh.errors import InputError
from tests.lab.datasets.setfiles import picture, write_rgb, write_units

WIDTH_PX, HEIGHT_PX = 124, 37
DAY = "2011_09_26"
DRIVE = f"{DAY}/{DAY}_drive_0002_sync"
OTHER = f"{DAY}/{DAY}_drive_0009_sync"
FOCAL_PX, CX_PX, CY_PX = 72.0, 61.0, 17.5
SHIFT = np.array([0.3, -0.02, 0.01])  # the fourth column of P_rect_02


def _add(root, drive, number, units=None, points_m=None, camera=2):
    write_rgb(root / drive / f"image_0{camera}/data/{number:010d}.png", picture(WIDTH_PX, HEIGHT_PX, number))
    if units is not None:
        below = f"proj_depth/groundtruth/image_0{camera}/{number:010d}.png"
        write_units(root / drive / below, units)
    if points_m is not None:
        file = root / drive / f"velodyne_points/data/{number:010d}.bin"
        file.parent.mkdir(parents=True, exist_ok=True)
        np.c_[points_m, np.ones(len(points_m))].astype("<f4").tofile(file)


def _calibrate(root):
    """The laser looks along x with z up and lies 0.27 m behind the camera, which is turned by 2 degrees."""
    cos, sin = np.cos(0.035), np.sin(0.035)
    R_rect = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    R, T = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.array([0.0, -0.08, -0.27])
    P = np.array([[FOCAL_PX, 0, CX_PX, 0], [0, FOCAL_PX, CY_PX, 0], [0, 0, 1, 0]])
    P[:, 3] = SHIFT
    rows = {"R_rect_00": R_rect, "P_rect_02": P, "P_rect_03": P}
    text = "".join(
        f"{key}: {' '.join(map(repr, map(float, value.ravel())))}\n" for key, value in rows.items()
    )
    (root / DAY / "calib_cam_to_cam.txt").write_text("calib_time: 09-Jan-2012 13:57:47\n" + text)
    text = f"R: {' '.join(map(str, R.ravel()))}\nT: {' '.join(map(str, T))}\n"
    (root / DAY / "calib_velo_to_cam.txt").write_text(text)
    return R, T, R_rect, P


def _units():
    units = np.random.default_rng(5).integers(500, 20000, (HEIGHT_PX, WIDTH_PX))
    units[:12] = 0
    return units


def test_the_improved_truth_is_read_and_only_the_crop_of_garg_is_judged(tmp_path):
    _add(tmp_path, DRIVE, 5, units=_units())
    (pair,) = open_set(f"kitti={tmp_path}")
    assert pair.picture == tmp_path / DRIVE / "image_02/data/0000000005.png"
    np.testing.assert_array_equal(pair.rgb, picture(WIDTH_PX, HEIGHT_PX, 5))
    np.testing.assert_allclose(pair.truth_m, np.where(_units() > 0, _units() / 256.0, np.nan), rtol=1e-6)
    rows, columns = np.nonzero(pair.judged)
    limits = (
        int(0.40810811 * 37),
        int(0.99189189 * 37) - 1,
        int(0.03594771 * 124),
        int(0.96405229 * 124) - 1,
    )
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == limits


def test_the_crop_of_garg_is_the_published_one_at_the_common_size():
    rows, columns = np.nonzero(judged((375, 1242)))
    assert (rows.min(), rows.max() + 1, columns.min(), columns.max() + 1) == (153, 371, 44, 1197)


def test_laser_points_land_where_the_calibration_puts_them(tmp_path):
    rng = np.random.default_rng(2)
    points_m = rng.uniform((4.0, -3.0, -1.0), (30.0, 3.0, 0.5), (300, 3)).astype(np.float32)
    behind_m = points_m[:40] * (-1.0, 1.0, 1.0)
    _add(tmp_path, DRIVE, 7, points_m=np.concatenate([points_m, behind_m]))
    R, T, R_rect, P = _calibrate(tmp_path)
    (pair,) = open_set(f"kitti={tmp_path}")
    expected_m = np.full((HEIGHT_PX, WIDTH_PX), np.inf)
    for point in points_m.astype(np.float64):
        u, v, z = P @ np.append(R_rect @ (R @ point + T), 1.0)
        column, row = round(u / z) - 1, round(v / z) - 1
        if 0 <= row < HEIGHT_PX and 0 <= column < WIDTH_PX:
            expected_m[row, column] = min(expected_m[row, column], z)
    expected_m[np.isinf(expected_m)] = np.nan
    assert np.isfinite(expected_m).sum() > 100
    np.testing.assert_allclose(pair.truth_m, expected_m, rtol=1e-6)


def test_the_nearer_of_two_points_on_one_pixel_wins(tmp_path):
    _add(tmp_path, DRIVE, 7, points_m=np.array([[20.0, 0.0, 0.0], [10.0, 0.0, 0.04], [30.0, 0.0, 0.0]]))
    _calibrate(tmp_path)
    (pair,) = open_set(f"kitti={tmp_path}")
    assert np.nanmin(pair.truth_m) == pytest.approx(10.0 - 0.27 + SHIFT[2], abs=0.02)


def test_eigens_list_chooses_the_frames(tmp_path, caplog):
    for number in (1, 2, 3):
        _add(tmp_path, DRIVE, number, units=_units())
    _add(tmp_path, OTHER, 4, units=_units(), camera=3)
    (tmp_path / "test_files.txt").write_text(f"{DRIVE} 0000000002 l\n{DRIVE} 0000000099 l\n\n{OTHER} 4 r\n")
    names = [f"{2:010d}.png", f"{4:010d}.png"]
    assert [pair.picture.name for pair in open_set(f"kitti={tmp_path}")] == names
    assert "1 of 3 listed pictures" in caplog.text
    (tmp_path / "test_files.txt").write_text(f"{DRIVE}/image_02/data/0000000003.png improved.png 721.5\n")
    assert [pair.picture.name for pair in open_set(f"kitti={tmp_path}")] == [f"{3:010d}.png"]


def test_the_depth_benchmarks_own_tree_is_found_and_laser_truth_is_not_mixed_in(tmp_path):
    _add(tmp_path, DRIVE, 1, points_m=np.array([[9.0, 0.0, 0.0]]))
    _add(tmp_path, DRIVE, 2, points_m=np.array([[9.0, 0.0, 0.0]]))
    _calibrate(tmp_path)
    assert len(list(open_set(f"kitti={tmp_path}"))) == 2
    truth = f"val/{DAY}_drive_0002_sync/proj_depth/groundtruth/image_02/0000000002.png"
    write_units(tmp_path / truth, _units())
    (pair,) = open_set(f"kitti={tmp_path}")
    assert pair.picture.name == "0000000002.png"
    assert np.nanmin(pair.truth_m) == _units()[_units() > 0].min() / 256.0


def test_bad_files_are_named(tmp_path):
    _add(tmp_path, DRIVE, 1, points_m=np.array([[9.0, 0.0, 0.0]]))
    with pytest.raises(InputError, match=r"calib_velo_to_cam\.txt does not exist"):
        next(open_set(f"kitti={tmp_path}"))
    _calibrate(tmp_path)
    cameras = tmp_path / DAY / "calib_cam_to_cam.txt"
    cameras.write_text(cameras.read_text().replace("P_rect_02: ", "P_rect_02: 1 "))
    with pytest.raises(InputError, match=r"calib_cam_to_cam\.txt has no P_rect_02 of \(3, 4\) numbers"):
        next(open_set(f"kitti={tmp_path}"))
    laser = tmp_path / DRIVE / "velodyne_points/data/0000000001.bin"
    laser.write_bytes(laser.read_bytes()[:-3])
    with pytest.raises(InputError, match=r"0000000001\.bin is truncated"):
        next(open_set(f"kitti={tmp_path}"))
    (tmp_path / "test_files.txt").write_text("what is this\n")
    with pytest.raises(
        InputError, match=r"test_files\.txt has the line 'what is this', which names no frame"
    ):
        open_set(f"kitti={tmp_path}")

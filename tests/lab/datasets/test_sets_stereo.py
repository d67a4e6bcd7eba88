"""Depth of other cameras: Middlebury's disparities, and the SR300's depth seen by its grey camera."""

import numpy as np
import pytest

from lab.datasets import open_set
from lab.datasets.netpbm import read_netpbm
from lab.datasets.sr300 import INVERSE_DISTORTION, METRES_PER_UNIT, rays, registered
from packetmesh.errors import InputError
from pipeline.types import CameraIntrinsics
from tests.lab.datasets.setfiles import cut, picture, write_rgb

DISPARITY = np.random.default_rng(0).uniform(20.0, 60.0, (6, 8)).astype(np.float32)
DISPARITY[0, 0] = np.inf
CALIBRATION = """cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]
cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]
doffs=131.111
baseline=193.001
width=8
"""


def _pfm(values, little_endian=True):
    height, width = values.shape
    header = f"Pf\n{width} {height}\n{-1 if little_endian else 1:.1f}\n".encode()
    return header + values[::-1].astype("<f4" if little_endian else ">f4").tobytes()


def _scene(folder):
    write_rgb(folder / "im0.png", picture())
    (folder / "disp0.pfm").write_bytes(_pfm(DISPARITY))
    (folder / "calib.txt").write_text(CALIBRATION)


@pytest.mark.parametrize("little_endian", [True, False])
def test_pfm_rows_run_from_the_bottom_in_both_byte_orders(tmp_path, little_endian):
    (tmp_path / "d.pfm").write_bytes(_pfm(DISPARITY, little_endian))
    np.testing.assert_array_equal(read_netpbm(tmp_path / "d.pfm"), DISPARITY)


def test_middlebury_depth_follows_from_focal_length_baseline_and_offset(tmp_path):
    _scene(tmp_path / "Motorcycle-perfect")
    (pair,) = open_set(f"middlebury={tmp_path}")
    np.testing.assert_array_equal(pair.rgb, picture())
    np.testing.assert_allclose(
        pair.truth_m.ravel()[1:], (3997.684 * 0.193001 / (DISPARITY + 131.111)).ravel()[1:], 1e-6
    )
    assert np.isnan(pair.truth_m[0, 0])
    np.testing.assert_array_equal(
        pair.camera.matrix, [[3997.684, 0.0, 1176.728], [0.0, 3997.684, 1011.728], [0.0, 0.0, 1.0]]
    )
    assert (pair.camera.width_px, pair.camera.height_px) == (8, 6)


@pytest.mark.parametrize("unknown", [np.nan, np.inf])
def test_the_motorcycle_of_scikit_image_has_its_own_calibration(tmp_path, unknown):
    write_rgb(tmp_path / "data/motorcycle_left.png", picture())
    disparity = np.where(np.isfinite(DISPARITY), DISPARITY, unknown)
    np.savez_compressed(tmp_path / "data/motorcycle_disp.npz", disparity)
    (pair,) = open_set(f"middlebury={tmp_path}")
    expected_m = 193.001 * 994.978 / (DISPARITY + 31.086) / 1000.0
    np.testing.assert_allclose(pair.truth_m, np.where(np.isfinite(DISPARITY), expected_m, np.nan), rtol=1e-6)
    cut(tmp_path / "data/motorcycle_disp.npz")
    with pytest.raises(InputError, match=r"motorcycle_disp\.npz are damaged"):
        next(open_set(f"middlebury={tmp_path}"))


def test_bad_middlebury_files_are_named(tmp_path):
    _scene(tmp_path)
    cut(tmp_path / "disp0.pfm")
    with pytest.raises(InputError, match=r"disp0\.pfm is truncated or too large for its 8 x 6 pixels"):
        next(open_set(f"middlebury={tmp_path}"))
    (tmp_path / "disp0.pfm").write_bytes(b"PF\n8 6\n-1.0\n")
    with pytest.raises(InputError, match=r"disp0\.pfm is no PGM of 8 bits and no PFM"):
        next(open_set(f"middlebury={tmp_path}"))
    for key, other in (("doffs", "offset"), ("1176.728; 0 3997.684 1011.728;", ";")):
        (tmp_path / "calib.txt").write_text(CALIBRATION.replace(key, other))
        with pytest.raises(InputError, match=r"calib\.txt has no cam0, baseline and doffs"):
            next(open_set(f"middlebury={tmp_path}"))


COLOR = CameraIntrinsics.pinhole(92.0, 92.0, 47.0, 36.0, 96, 72)
DEPTH = CameraIntrinsics.pinhole(71.0, 71.0, 47.0, 37.0, 96, 72)
UNITS = np.full((72, 96), 4000, np.uint16)
UNITS[20:50, 30:60] = 2400
UNITS[:, :4] = 0
UNITS[60, 50:60] = 31  # noise right before the lens, where the other camera already is behind it
T_DEPTH_COLOR = np.eye(4)
T_DEPTH_COLOR[:3, 3] = -0.0247, 0.0007, -0.0038


def _camera_xml(camera):
    keys = zip(("px", "py", "u0", "v0"), camera.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], strict=True)
    return "<conf><camera>" + "".join(f"<{key}>{value}</{key}>" for key, value in keys) + "</camera></conf>"


def _castel(root):
    folder = root / "castel"
    (folder / "castel").mkdir(parents=True)
    grey = picture(96, 72)[..., 0]
    (folder / "castel/image_0000.pgm").write_bytes(b"P5\n96 72\n255\n" + grey.tobytes())
    header = np.array([72, 96], "<u4").tobytes()
    (folder / "castel/depth_image_0000.bin").write_bytes(header + UNITS.astype("<u2").tobytes())
    (folder / "chateau.xml").write_text(_camera_xml(COLOR))
    (folder / "chateau_depth.xml").write_text(_camera_xml(DEPTH))
    np.savetxt(folder / "depth_M_color.txt", T_DEPTH_COLOR)
    return grey, folder


def test_sr300_depth_is_carried_into_the_grey_camera(tmp_path):
    grey, _ = _castel(tmp_path)
    (pair,) = open_set(f"sr300={tmp_path}")
    np.testing.assert_array_equal(pair.rgb, np.repeat(grey[..., None], 3, axis=2))
    known = np.isfinite(pair.truth_m)
    near_m, far_m = (units * METRES_PER_UNIT + 0.0038 for units in (2400, 4000))
    assert set(np.unique(pair.truth_m[known])) == {np.float32(near_m), np.float32(far_m)}
    rows, columns = np.nonzero(UNITS == 2400)
    points_m = rays(DEPTH, np.stack([columns, rows], 1)) * 2400 * METRES_PER_UNIT - T_DEPTH_COLOR[:3, 3]
    seen = points_m[:, :2] / points_m[:, 2:] * 92.0 + (47.0, 36.0)
    rows, columns = np.nonzero(pair.truth_m == np.float32(near_m))
    np.testing.assert_allclose((columns.min(), columns.max()), (seen[:, 0].min(), seen[:, 0].max()), atol=1.0)
    np.testing.assert_allclose((rows.min(), rows.max()), (seen[:, 1].min(), seen[:, 1].max()), atol=1.0)


def test_sr300_near_surfaces_have_no_gaps_and_hide_what_is_behind():
    z_m = np.where(UNITS > 0, UNITS * METRES_PER_UNIT, np.nan).astype(np.float32)
    truth_m = registered(z_m, DEPTH, COLOR, np.linalg.inv(T_DEPTH_COLOR))
    rows, columns = np.nonzero(truth_m < 0.4)
    box = truth_m[rows.min() + 1 : rows.max(), columns.min() + 1 : columns.max()]
    assert np.isfinite(box).mean() > 0.95
    assert np.nanmean(box < 0.4) > 0.95
    nothing = registered(np.full_like(z_m, np.nan), DEPTH, COLOR, np.eye(4))
    assert np.isnan(nothing).all()


def test_the_same_camera_at_the_same_place_sees_the_same_depth(monkeypatch):
    monkeypatch.setattr("lab.datasets.sr300.INVERSE_DISTORTION", (0.0,) * 5)
    z_m = np.random.default_rng(3).uniform(0.2, 0.6, (72, 96)).astype(np.float32)
    np.testing.assert_array_equal(registered(z_m, DEPTH, DEPTH, np.eye(4))[1:-1, 1:-1], z_m[1:-1, 1:-1])


def test_sr300_rays_follow_librealsense():
    k1, k2, p1, p2, k3 = INVERSE_DISTORTION
    x, y = 0.4, -0.3
    ray = rays(DEPTH, np.array([[47.0 + 71.0 * x, 37.0 + 71.0 * y]]))[0]
    f = 1 + k1 * 0.25 + k2 * 0.25**2 + k3 * 0.25**3
    expected = (
        x * f + 2 * p1 * x * y + p2 * (0.25 + 2 * x * x),
        y * f + 2 * p2 * x * y + p1 * (0.25 + 2 * y * y),
        1,
    )
    np.testing.assert_allclose(ray, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("file", "content", "sentence"),
    [
        ("castel/image_0000.pgm", b"P5\n96 72\n255\nshort", "image_0000.pgm is truncated"),
        ("castel/image_0000.pgm", b"P2\n96 72\n255\n", "image_0000.pgm is no PGM of 8 bits"),
        ("castel/depth_image_0000.bin", b"\x48\0\0\0\x60\0\0\0ab", "depth_image_0000.bin is truncated"),
        ("castel/depth_image_0000.bin", b"\x48", "depth_image_0000.bin is truncated"),
        ("chateau_depth.xml", b"<px>1</px>", "chateau_depth.xml has no px, py, u0 and v0"),
        ("depth_M_color.txt", b"1 0 0", "depth_M_color.txt are not a 4 x 4 matrix"),
    ],
)
def test_bad_sr300_files_are_named(tmp_path, file, content, sentence):
    _, folder = _castel(tmp_path)
    (folder / file).write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        next(open_set(f"sr300={tmp_path}"))

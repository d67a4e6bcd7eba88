"""Rational and fisheye cameras: written for other programs, read from their files, kept in a rig."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.camera_files import WRITERS, write_camera
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import pixel_rays, rigid
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig
from tests.pipeline.lenses import KIND, camera

MATRIX = np.array([[301.25, 0.0, 318.5], [0.0, 302.75, 243.125], [0.0, 0.0, 1.0]])
FISHEYE = CameraIntrinsics(MATRIX, np.array([-0.02, 0.01, -0.004, 0.001]), 640, 480, fisheye=True)
FITS = {
    "rational": {"camera.yaml", "camera_info.yaml", "cameras.txt"},
    "prism": {"camera.yaml", "camera_info.yaml"},
    "tilt": {"camera.yaml", "camera_info.yaml"},
    "fisheye": {"camera.yaml", "camera_info.yaml", "cameras.txt", "camchain.yaml"},
}


def same(one, other):
    np.testing.assert_allclose(one.matrix, other.matrix, rtol=1e-12)
    np.testing.assert_array_equal(one.distortion, other.distortion)
    assert (one.width_px, one.height_px, one.fisheye) == (other.width_px, other.height_px, other.fisheye)


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("lens", FITS)
def test_a_camera_comes_back_or_its_file_cannot_hold_it(kind, lens, tmp_path):
    if kind in FITS[lens]:
        write_camera(tmp_path / kind, camera(lens), kind)
        same(read_intrinsics(tmp_path / kind), camera(lens))
    else:
        with pytest.raises(InputError, match="cannot hold"):
            write_camera(tmp_path / kind, camera(lens), kind)


@pytest.mark.parametrize("kind", KIND)
def test_the_node_s_own_file_is_exact(kind, tmp_path):
    write_intrinsics(tmp_path / "intrinsics.json", camera(kind))
    back = read_intrinsics(tmp_path / "intrinsics.json")
    np.testing.assert_array_equal(pixel_rays(back), pixel_rays(camera(kind)))
    assert back.fisheye == camera(kind).fisheye


def test_a_fisheye_without_coefficients_is_not_a_pinhole_camera(tmp_path):
    plain = replace(FISHEYE, distortion=np.zeros(4))
    write_intrinsics(tmp_path / "intrinsics.json", plain)
    same(read_intrinsics(tmp_path / "intrinsics.json"), plain)


def test_opencv_reads_its_own(tmp_path):
    write_camera(tmp_path / "camera.yaml", FISHEYE, "camera.yaml")
    file = cv2.FileStorage(str(tmp_path / "camera.yaml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), MATRIX)
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat().ravel(), FISHEYE.distortion)
    assert file.getNode("fisheye_model").real() == 1


def test_each_program_finds_its_own_name_of_the_lens(tmp_path):
    names = {
        "camera_info.yaml": "distortion_model: equidistant",
        "camchain.yaml": "distortion_model: equidistant",
        "cameras.txt": "1 OPENCV_FISHEYE 640 480 301.25 302.75 319.0 243.625 -0.02",
    }
    for kind, words in names.items():
        write_camera(tmp_path / kind, FISHEYE, kind)
        assert words in (tmp_path / kind).read_text()
    write_camera(tmp_path / "rational.yaml", camera("rational"), "camera_info.yaml")
    assert "distortion_model: rational_polynomial" in (tmp_path / "rational.yaml").read_text()
    write_camera(tmp_path / "rational.txt", camera("rational"), "cameras.txt")
    assert re.search(
        r"^1 FULL_OPENCV 320 240( \S+){12}$", (tmp_path / "rational.txt").read_text(), re.MULTILINE
    )


K9 = MATRIX.ravel().tolist()


def camera_info(model, d):
    return json.dumps({"width": 640, "height": 480, "K": K9, "distortion_model": model, "D": d})


@pytest.mark.parametrize("model", ["equidistant", "fisheye", "Kannala_Brandt4"])
def test_the_names_of_a_fisheye_in_ros(model, tmp_path):
    (tmp_path / "info.json").write_text(camera_info(model, FISHEYE.distortion.tolist()))
    same(read_intrinsics(tmp_path / "info.json"), FISHEYE)


def test_the_number_of_coefficients_tells_the_lens_and_zeros_at_the_end_do_not_count(tmp_path):
    file = tmp_path / "info.json"
    eight = list(camera("rational").distortion)
    for given, kept in ((eight, 8), ([*eight, *[0.0] * 6], 8), ([0.1, 0.2, 0, 0, 0, 0, 0, 0], 5), ([0.1], 5)):
        file.write_text(camera_info("rational_polynomial", given))
        found = read_intrinsics(file).distortion
        assert len(found) == kept
        np.testing.assert_array_equal(found, np.pad(given, (0, 14))[:kept])


@pytest.mark.parametrize(
    ("model", "d", "words"),
    [
        ("fov", [0.9], "the distortion model fov;"),
        ("equidistant", [0.1] * 5, "equidistant of 5"),
        ("rational_polynomial", [0.1] * 7, "rational_polynomial of 7"),
        ("", [0.1] * 6, "model of 6"),
    ],
)
def test_other_lenses_are_refused_with_those_that_are_known(model, d, words, tmp_path):
    (tmp_path / "info.json").write_text(camera_info(model, d))
    with pytest.raises(InputError, match=f"{words}.*rational_polynomial with 8, 12 or 14, or equidistant"):
        read_intrinsics(tmp_path / "info.json")


def test_kalibr_s_other_models_are_not_taken_for_radtan(tmp_path):
    write_camera(tmp_path / "camchain.yaml", FISHEYE, "camchain.yaml")
    text = (tmp_path / "camchain.yaml").read_text().replace("equidistant", "fov")
    (tmp_path / "camchain.yaml").write_text(text)
    with pytest.raises(InputError, match="the distortion model fov"):
        read_intrinsics(tmp_path / "camchain.yaml")


COLMAP_PAIR = (
    "1 OPENCV 640 480 500 500 320 240 0.1 -0.05 0.001 0.002\n"
    "2 OPENCV_FISHEYE 800 600 400 400 400 300 0.01 0.02 0.03 0.04\n"
)
KALIBR_PAIR = (
    "cam0:\n  intrinsics: [500.0, 500.0, 320.0, 240.0]\n  distortion_model: radtan\n"
    "  distortion_coeffs: [0.1, -0.05, 0.001, 0.002]\n  resolution: [640, 480]\n"
    "cam1:\n  intrinsics: [400.0, 400.0, 400.0, 300.0]\n  distortion_model: equidistant\n"
    "  distortion_coeffs: [0.01, 0.02, 0.03, 0.04]\n  resolution: [800, 600]\n"
)


@pytest.mark.parametrize("text", [COLMAP_PAIR, KALIBR_PAIR])
def test_each_camera_of_a_file_has_its_own_lens(text, tmp_path):
    (tmp_path / "cameras.txt").write_text(text)
    pinhole, fisheye = (read_intrinsics(tmp_path / "cameras.txt", size) for size in ((640, 480), (800, 600)))
    assert (pinhole.fisheye, fisheye.fisheye) == (False, True)
    np.testing.assert_array_equal(pinhole.distortion, [0.1, -0.05, 0.001, 0.002, 0.0])
    np.testing.assert_array_equal(fisheye.distortion, [0.01, 0.02, 0.03, 0.04])


def test_two_lenses_with_the_same_numbers_are_two_cameras(tmp_path):
    same_numbers = "640 480 500 500 320 240 0.1 -0.05 0.001 0.002"
    (tmp_path / "cameras.txt").write_text(f"1 OPENCV {same_numbers}\n2 OPENCV_FISHEYE {same_numbers}\n")
    with pytest.raises(InputError, match="has 2 cameras for images of 640 x 480 pixels"):
        read_intrinsics(tmp_path / "cameras.txt", (640, 480))


@pytest.mark.parametrize("kind", KIND)
def test_a_rig_keeps_its_lenses(kind, tmp_path):
    rgb, depth = np.zeros((240, 320, 3), np.uint8), DepthMap(np.ones((240, 320), np.float32))
    frame = RgbdFrame("node_00", rgb, depth, camera(kind), rigid(np.eye(3), np.zeros(3)))
    save_rig(tmp_path / "rig", Rig("rig", (frame,)))
    same(load_rig(tmp_path / "rig").frames[0].intrinsics, camera(kind))

"""Cameras go to the files of other programs and come back; OpenCV reads its own."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.camera_files import WRITERS, write_camera
from pipeline.io.intrinsics import read_intrinsics
from pipeline.types import CameraIntrinsics

MATRIX = np.array([[701.012, 0.0, 308.455], [0.0, 698.654, 246.843], [0.0, 0.0, 1.0]])
LENSES = {
    "none": [0.0, 0.0, 0.0, 0.0, 0.0],
    "thesis": [-0.2556, 0.1, 0.0, 0.0, 0.0],
    "tangential": [-0.2556, 0.1, 1e-3, -2e-3, 0.0],
    "brown": [-0.2556, 0.1, 1e-3, -2e-3, 0.03],
}


def camera(lens):
    return CameraIntrinsics(MATRIX, np.array(LENSES[lens]), 640, 480)


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("lens", LENSES)
def test_a_camera_comes_back_or_is_refused_with_what_to_do(kind, lens, tmp_path):
    given, path = camera(lens), tmp_path / kind
    if (kind == "open3d.json" and lens != "none") or (kind == "camchain.yaml" and lens == "brown"):
        with pytest.raises(InputError, match="cannot hold"):
            write_camera(path, given, kind)
        assert not path.exists()
        return
    write_camera(path, given, kind)
    back = read_intrinsics(path)
    np.testing.assert_allclose(back.matrix, given.matrix, rtol=1e-12)
    np.testing.assert_array_equal(back.distortion, given.distortion)
    assert (back.width_px, back.height_px) == (640, 480)


def test_opencv_reads_its_own_file(tmp_path):
    write_camera(tmp_path / "camera.yaml", camera("brown"), "camera.yaml")
    file = cv2.FileStorage(str(tmp_path / "camera.yaml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), MATRIX)
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat().ravel(), LENSES["brown"])
    assert file.getNode("image_width").real() == 640


def test_first_pixels_are_counted_as_each_program_does(tmp_path):
    for kind, offset in (("cameras.txt", 0.5), ("matlab.txt", 1.0)):
        write_camera(tmp_path / kind, camera("none"), kind)
        assert str(308.455 + offset) in (tmp_path / kind).read_text()


@pytest.mark.parametrize(
    ("text", "fx"),
    [
        ("1 PINHOLE 640 480 500 501 320.5 240.5\n", 500.0),
        ("# two\n1 OPENCV 640 480 500 501 320.5 240.5 0.1 0.2 0 0\n2 OPENCV 64 48 5 5 3 2 0 0 0 0\n", 500.0),
        (
            "cam0:\n  camera_model: pinhole\n  intrinsics: [500.0, 501.0, 320.0, 240.0]\n"
            "  resolution: [640, 480]\ncam1:\n  intrinsics: [7.0, 7.0, 3.0, 2.0]\n  resolution: [64, 48]\n",
            500.0,
        ),
        ("FocalLength = [500 501]\nPrincipalPoint = [321, 241]\nImageSize = [480 640]\n", 500.0),
    ],
)
def test_files_as_the_programs_write_them(text, fx, tmp_path):
    path = tmp_path / "camera.txt"
    path.write_text(text)
    back = read_intrinsics(path)
    assert (back.fx_px, back.fy_px, back.cx_px, back.cy_px) == (fx, 501.0, 320.0, 240.0)


@pytest.mark.parametrize(
    "text", ["1 OPENCV 640 480 500\n", "FocalLength: [a b]\nPrincipalPoint: [1 2]\nImageSize: [3 4]\n"]
)
def test_a_damaged_file_is_one_sentence(text, tmp_path):
    path = tmp_path / "camera.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=r"camera\.txt"):
        read_intrinsics(path)

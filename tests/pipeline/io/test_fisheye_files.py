"""Fisheye cameras in the files that know them, and refused where they would be taken for another lens."""

import re

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.fisheye_files import FISHEYE_WRITERS, write_fisheye
from pipeline.io.intrinsics import read_intrinsics

MATRIX = np.array([[301.25, 0.0, 318.5], [0.0, 302.75, 243.125], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.02, 0.01, -0.004, 0.001])


@pytest.mark.parametrize("kind", FISHEYE_WRITERS)
def test_all_numbers_are_in_the_file_and_it_is_not_taken_for_another_lens(kind, tmp_path):
    write_fisheye(tmp_path / kind, MATRIX, DISTORTION, (640, 480), kind)
    numbers = {float(word) for word in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", (tmp_path / kind).read_text())}
    half = 0.5 if kind == "cameras.txt" else 0.0
    assert {301.25, 302.75, 318.5 + half, 243.125 + half, 640.0, 480.0, *DISTORTION} <= numbers
    with pytest.raises(InputError, match="fisheye lens"):
        read_intrinsics(tmp_path / kind)


def test_opencv_reads_its_own(tmp_path):
    write_fisheye(tmp_path / "camera.yaml", MATRIX, DISTORTION, (640, 480), "camera.yaml")
    file = cv2.FileStorage(str(tmp_path / "camera.yaml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), MATRIX)
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat().ravel(), DISTORTION)
    assert file.getNode("fisheye_model").real() == 1


def test_each_program_finds_its_own_name_of_the_lens(tmp_path):
    names = {
        "camera_info.yaml": "distortion_model: equidistant",
        "camchain.yaml": "distortion_model: equidistant",
        "cameras.txt": "1 OPENCV_FISHEYE 640 480 301.25 302.75 319.0 243.625 -0.02",
    }
    for kind, words in names.items():
        write_fisheye(tmp_path / kind, MATRIX, DISTORTION, (640, 480), kind)
        assert words in (tmp_path / kind).read_text()

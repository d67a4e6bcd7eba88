"""One camera, written in every style that is read."""

import json

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.types import CameraIntrinsics

FX, FY, CX, CY = 529.741370000001, 529.57155, 312.57382, 257.05061
CAMERA = CameraIntrinsics(
    np.array([[FX, 0.0, CX], [0.0, FY, CY], [0.0, 0.0, 1.0]]),
    np.array([0.178893535, -0.323012074, 1e-4, -2e-5, 0.07]),
    640,
    480,
)
K = f"{FX}, 0.0, {CX}, 0.0, {FY}, {CY}, 0.0, 0.0, 1.0"
D = "0.178893535, -0.323012074, 0.0001, -2e-05, 0.07"
FLAT = {"width": 640, "height": 480, "fx": FX, "fy": FY, "cx": CX, "cy": CY}
BLOCK_LIST = "".join(f"\n- {number}" for number in K.split(", "))

STYLES = {
    "flat": json.dumps(FLAT | {"distortion": CAMERA.distortion.tolist(), "note": "x"}),
    "ros message": f'{{"width": 640, "height": 480, "K": [{K}], "D": [{D}], "distortion_model": ""}}',
    "ros 2 message": f'{{"width": 640, "height": 480, "k": [{K}], "d": [{D}]}}',
    "ros yaml": f"""image_width: 640
image_height: 480
camera_name: kinect
camera_matrix:
  rows: 3
  cols: 3
  data: [{K.replace("0.0, " + str(FY), "0.0," + chr(10) + "         " + str(FY))}]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [{D}]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
""",
    "rostopic echo": f"""header:
  seq: 1
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [{D}]
K:{BLOCK_LIST}
binning_x: 0
roi:
  x_offset: 0
  height: 0
  width: 0
""",
    "opencv yaml": f"""%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ {K} ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ {D} ]
""",
}


def assert_same(camera, expected):
    np.testing.assert_array_equal(camera.matrix, expected.matrix)
    np.testing.assert_array_equal(camera.distortion, expected.distortion)
    assert (camera.width_px, camera.height_px) == (expected.width_px, expected.height_px)


@pytest.mark.parametrize("style", STYLES)
def test_every_style_gives_the_same_camera_to_the_last_bit(tmp_path, style):
    (tmp_path / "camera").write_text(STYLES[style])
    assert_same(read_intrinsics(tmp_path / "camera"), CAMERA)


def test_open3d_style_is_column_major(tmp_path):
    values = {"width": 640, "height": 480, "intrinsic_matrix": [FX, 0.0, 0.0, 0.0, FY, 0.0, CX, CY, 1.0]}
    (tmp_path / "camera.json").write_text(json.dumps(values))
    expected = CameraIntrinsics.pinhole(FX, FY, CX, CY, 640, 480)
    assert_same(read_intrinsics(tmp_path / "camera.json"), expected)


def test_open3d_reads_the_style_as_we_do(tmp_path):
    from pipeline.kernels.open3d_runtime import o3d

    o3d.io.write_pinhole_camera_intrinsic(
        str(tmp_path / "camera.json"), o3d.camera.PinholeCameraIntrinsic(640, 480, FX, FY, CX, CY)
    )
    camera = read_intrinsics(tmp_path / "camera.json")
    np.testing.assert_allclose(camera.matrix, CameraIntrinsics.pinhole(FX, FY, CX, CY, 640, 480).matrix)


def test_what_is_written_is_read_to_the_last_bit(tmp_path):
    write_intrinsics(tmp_path / "camera.json", CAMERA)
    assert_same(read_intrinsics(tmp_path / "camera.json"), CAMERA)


def test_four_coefficients_leave_k3_zero(tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(FLAT | {"distortion": [0.1, -0.2, 0, 0]}))
    np.testing.assert_array_equal(read_intrinsics(tmp_path / "camera.json").distortion, [0.1, -0.2, 0, 0, 0])


@pytest.mark.parametrize(
    "text",
    [
        "500 0 319.5\n0 510 239.5\n0 0 1\n",
        "500,0,319.5,0,510,239.5,0,0,1",
        "500 0 319.5 0\n0 510 239.5 0\n0 0 1 0\n0 0 0 1",
    ],
)
def test_a_bare_matrix_is_of_the_images_it_comes_with(tmp_path, text):
    (tmp_path / "K.txt").write_text(text)
    camera = read_intrinsics(tmp_path / "K.txt", (640, 480))
    assert (camera.fx_px, camera.fy_px, camera.width_px, camera.height_px) == (500.0, 510.0, 640, 480)
    assert camera.matrix[:2, 2].tolist() == [319.5, 239.5]
    with pytest.raises(InputError, match="does not say for which size"):
        read_intrinsics(tmp_path / "K.txt")


@pytest.mark.parametrize("text", ["0 0 0\n0 0 0\n0 0 1", "500 0 320 0 500 240 0 0 2", "nan 0 1 0 1 1 0 0 1"])
def test_nine_numbers_that_are_no_camera_are_refused(tmp_path, text):
    (tmp_path / "K.txt").write_text(text)
    with pytest.raises(InputError, match="no camera matrix"):
        read_intrinsics(tmp_path / "K.txt", (640, 480))

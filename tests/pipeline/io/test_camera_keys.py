"""Names that other programs give to the parts of a camera, in JSON and YAML."""

import json

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.intrinsics import read_intrinsics

FX, FY, CX, CY = 500.0, 510.0, 320.5, 239.5
MATRIX = [[FX, 0.0, CX], [0.0, FY, CY], [0.0, 0.0, 1.0]]
LENS = [-0.2, 0.05, 1e-3, -5e-4, 0.01]
SIZE = {"width": 640, "height": 480}
FLAT = {"fx": FX, "fy": FY, "cx": CX, "cy": CY}
NAMED = dict(zip(("k1", "k2", "p1", "p2", "k3"), LENS, strict=True))
STYLES = {
    "named coefficients": FLAT | SIZE | NAMED,
    "a list of coeffs": FLAT | SIZE | {"coeffs": LENS, "model": "distortion.brown_conrady"},
    "RealSense SDK": {"fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "coeffs": LENS, "model": "Brown Conrady"}
    | SIZE,
    "OpenCV's sample in Python": {"camera_matrix": MATRIX, "dist_coeff": [LENS]} | SIZE,
    "dist_coeffs": {"K": MATRIX, "dist_coeffs": [[value] for value in LENS]} | SIZE,
    "a group of coefficients": FLAT | SIZE | {"distortion": NAMED},
    "w and h": FLAT | NAMED | {"w": 640, "h": 480},
    "nerfstudio": {"fl_x": FX, "fl_y": FY, "cx": CX + 0.5, "cy": CY + 0.5, "w": 640, "h": 480} | NAMED,
}


def of(tmp_path, values, size_px=(640, 480)):
    (tmp_path / "camera.json").write_text(json.dumps(values))
    return read_intrinsics(tmp_path / "camera.json", size_px)


@pytest.mark.parametrize("style", STYLES)
def test_every_name_of_a_part_gives_the_same_camera(tmp_path, style):
    camera = of(tmp_path, STYLES[style])
    np.testing.assert_array_equal(camera.matrix, MATRIX)
    np.testing.assert_array_equal(camera.distortion, LENS)
    assert (camera.width_px, camera.height_px) == (640, 480)


def test_coefficients_of_a_fisheye_are_in_its_order(tmp_path):
    named = {"k1": 0.1, "k2": 0.02, "k3": 3e-3, "k4": 4e-4, "camera_model": "OPENCV_FISHEYE"}
    camera = of(tmp_path, FLAT | SIZE | named)
    assert camera.fisheye
    np.testing.assert_array_equal(camera.distortion, [0.1, 0.02, 3e-3, 4e-4])


def test_negative_numbers_of_yaml_are_no_list(tmp_path):
    lines = [f"{name}: {value}" for name, value in (FLAT | SIZE | NAMED).items()]
    (tmp_path / "camera.yaml").write_text("\n".join(lines))
    np.testing.assert_array_equal(read_intrinsics(tmp_path / "camera.yaml").distortion, LENS)


def test_opencv_s_own_writer_with_the_name_of_its_tutorials(tmp_path):
    file = cv2.FileStorage(str(tmp_path / "camera.yml"), cv2.FILE_STORAGE_WRITE)
    file.write("camera_matrix", np.array(MATRIX))
    file.write("dist_coeffs", np.array([LENS]))
    file.release()
    camera = read_intrinsics(tmp_path / "camera.yml", (640, 480))
    np.testing.assert_array_equal(camera.matrix, MATRIX)
    np.testing.assert_array_equal(camera.distortion, LENS)


@pytest.mark.parametrize("key", ["distortionParams", "lens_coeff", "k_1"])
def test_a_lens_under_an_unknown_name_is_refused_until_it_is_renamed(tmp_path, key):
    """The remedy of the message; without coefficients, the name does not matter."""
    value = LENS[0] if key == "k_1" else LENS
    with pytest.raises(InputError, match=f"has {key}, which is not read .* try the name distortion"):
        of(tmp_path, FLAT | SIZE | {key: value})
    np.testing.assert_array_equal(of(tmp_path, FLAT | SIZE | {"distortion": LENS}).distortion, LENS)
    assert not of(tmp_path, FLAT | SIZE | {key: 0.0, "distance_m": 4.0}).distortion.any()


@pytest.mark.parametrize("size", [{"w": 1280, "h": 960}, {"image_size": [960, 1280]}, {"resolution": 1280}])
def test_a_camera_of_larger_images_is_not_taken_for_that_of_these(tmp_path, size):
    if "w" in size:
        assert of(tmp_path, FLAT | size).width_px == 1280
        return
    with pytest.raises(InputError, match="but the images have 640 x 480"):
        of(tmp_path, FLAT | size)
    assert of(tmp_path, FLAT | {"image_size": [480, 640]}).width_px == 640


def test_realsense_s_other_models_pass_without_coefficients_only(tmp_path):
    camera = {"fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "model": "distortion.inverse_brown_conrady"} | SIZE
    np.testing.assert_array_equal(of(tmp_path, camera | {"coeffs": [0.0] * 5}).distortion, np.zeros(5))
    with pytest.raises(InputError, match="inverse_brown_conrady"):
        of(tmp_path, camera | {"coeffs": LENS})


@pytest.mark.parametrize("text", ["500 0 0\n0 500 0\n320 240 1", "500 1 320\n0 500 240\n0 0 1"])
def test_a_bare_matrix_that_is_transposed_or_skew_is_refused(tmp_path, text):
    (tmp_path / "K.txt").write_text(text)
    with pytest.raises(InputError, match="skew or in the wrong order; try fx 0 cx"):
        read_intrinsics(tmp_path / "K.txt", (640, 480))


@pytest.mark.parametrize(
    "text",
    [
        "1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 640 480 600 600 320 240\n",
        "cam0:\n  intrinsics: [500.0, 500.0, 320.0, 240.0]\n  resolution: [640, 480]\n"
        "cam1:\n  intrinsics: [600.0, 600.0, 320.0, 240.0]\n  resolution: [640, 480]\n",
    ],
)
def test_of_two_cameras_of_one_size_none_is_chosen(tmp_path, text):
    (tmp_path / "cameras.txt").write_text(text)
    with pytest.raises(
        InputError, match="has 2 cameras for images of 640 x 480 pixels; try a file with only"
    ):
        read_intrinsics(tmp_path / "cameras.txt", (640, 480))
    (tmp_path / "cameras.txt").write_text(text.replace("600", "500"))
    assert read_intrinsics(tmp_path / "cameras.txt", (640, 480)).fx_px == 500.0
    (tmp_path / "cameras.txt").write_text(
        text.replace("640 480 500", "64 48 50").replace("640, 480", "64, 48", 1)
    )
    assert read_intrinsics(tmp_path / "cameras.txt", (640, 480)).fx_px == 600.0

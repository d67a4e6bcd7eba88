"""What a refusal tells to do works when it is done."""

import json
import re

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.importing.depth_units import depth_of
from pipeline.io.depth_scale import FARTHEST_M, PLAUSIBLE_MEDIAN_M, likely_depth_scale
from pipeline.io.images import read_depth
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_frame, load_rig, save_rig
from tests.pipeline.importing.recordings import orbit

CAMERA = {"width": 40, "height": 30, "fx": 30.0, "fy": 30.5, "cx": 19.5, "cy": 14.5}


def scale_in(message):
    return float(re.search(r"--depth-scale ([0-9.e+-]+)", message)[1])


@given(st.floats(1e-6, 1e12))
def test_the_scale_that_is_told_makes_a_median_that_is_read(median_units):
    nearest_m, farthest_m = PLAUSIBLE_MEDIAN_M
    assert nearest_m <= median_units / likely_depth_scale(median_units) <= min(farthest_m, FARTHEST_M)


@pytest.mark.parametrize("median_units", [1e-5, 3e-3, 700.0, 2.5e4, 4e6, 9e9])
def test_a_depth_image_opens_at_the_scale_that_is_told(tmp_path, median_units):
    np.save(tmp_path / "depth.npy", np.full((4, 4), median_units, np.float32))
    with pytest.raises(InputError, match="try --depth-scale") as error:
        read_depth(tmp_path / "depth.npy")
    depth = read_depth(tmp_path / "depth.npy", scale_in(str(error.value)))
    assert 0.2 <= float(depth.z_m[0, 0]) <= 15.0


def test_depth_of_a_recording_opens_at_the_scale_that_is_told():
    values = np.full((4, 4), 8e8, np.float32)
    with pytest.raises(InputError, match="farther than 66 m everywhere") as error:
        depth_of("of a topic", values, 1.0, stated=True)
    read = depth_of("of a topic", values, scale_in(str(error.value)), stated=True)
    assert np.isfinite(read.depth.z_m).all()


def test_a_bare_matrix_opens_as_the_json_that_is_told(tmp_path):
    path = tmp_path / "camera.txt"
    path.write_text("30 0 19.5\n0 30.5 14.5\n0 0 1\n")
    with pytest.raises(
        InputError, match=r"is a bare matrix .*; try JSON with width, height, fx, fy, cx and cy"
    ):
        read_intrinsics(path)
    path.write_text(json.dumps(CAMERA))
    assert read_intrinsics(path).fy_px == 30.5


def test_a_matrix_that_is_none_is_quoted_and_opens_when_it_is_one(tmp_path):
    """The published camera of ICL-NUIM."""
    path = tmp_path / "camera.txt"
    path.write_text("481.2 0 319.5\n0 -480 239.5\n0 0 1\n")
    says = "holds the matrix 481.2 0 319.5; 0 -480 239.5; 0 0 1, no camera matrix; try .* fx and fy positive"
    with pytest.raises(InputError, match=says):
        read_intrinsics(path, (640, 480))
    path.write_text(path.read_text().replace("-", ""))
    assert read_intrinsics(path, (640, 480)).fy_px == 480.0


@pytest.mark.parametrize(
    "text",
    [
        "30, 0, 19.5\n0, 30.5, 14.5\n0, 0, 1\n",
        "30;0;19.5\r\n0;30.5;14.5\r\n0;0;1\r\n",
        "[[30. 0. 19.5]\n [0. 30.5 14.5]\n [0. 0. 1.]]\n",
        "# fx 0 cx\n30\t0\t19.5\n0\t30.5\t14.5\n0\t0\t1\n",
        "30 0 19.5 0\r0 30.5 14.5 0\r0 0 1 0\r0 0 0 1\r",
    ],
)
def test_a_bare_matrix_may_have_marks_between_its_numbers(tmp_path, text):
    (tmp_path / "camera.txt").write_bytes(text.encode())
    camera = read_intrinsics(tmp_path / "camera.txt", (40, 30))
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (30.0, 30.5, 19.5, 14.5)


def test_a_file_without_a_size_has_that_of_the_images(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({key: value for key, value in CAMERA.items() if len(key) == 2}))
    camera = read_intrinsics(path, (40, 30))
    assert (camera.width_px, camera.height_px, camera.fx_px) == (40, 30, 30.0)
    path.write_text(json.dumps({key: value for key, value in CAMERA.items() if key != "height"}))
    with pytest.raises(InputError, match="no known format"):
        read_intrinsics(path, (40, 30))


def test_text_in_another_encoding_opens_when_it_is_saved_as_utf8(tmp_path):
    path = tmp_path / "note.txt"
    path.write_bytes("Größe\n".encode("latin-1"))
    with pytest.raises(InputError, match="not a text file in UTF-8; try to save it as one"):
        read_text(path, "note")
    path.write_text("Größe\n", encoding="utf-8")
    assert read_text(path, "note") == "Größe\n"


def test_intrinsics_of_another_size_open_as_those_of_the_images(tmp_path):
    save_rig(tmp_path / "rig", orbit(1))
    file = tmp_path / "rig" / "node_00" / "intrinsics.json"
    file.write_text(json.dumps({**CAMERA, "width": 41}))
    says = (
        "is for 41 x 30 pixels but the colour image .* has 40 x 30; try the intrinsics of images of that size"
    )
    with pytest.raises(InputError, match=says):
        load_rig(tmp_path / "rig")
    file.write_text(json.dumps(CAMERA))
    assert len(load_rig(tmp_path / "rig").frames) == 1


def test_a_node_with_two_colour_images_opens_with_one(tmp_path):
    save_rig(tmp_path / "rig", orbit(1))
    node = tmp_path / "rig" / "node_00"
    image = cv2.imread(str(node / "color.png"))
    for suffix in (".jpg", ".tif"):
        cv2.imwrite(str(node / f"color{suffix}"), image)
    (node / "color.png").unlink()
    with pytest.raises(InputError, match=r"has several images, color.jpg, color.tif; try to keep one"):
        load_rig(tmp_path / "rig")
    (node / "color.tif").unlink()
    assert len(load_rig(tmp_path / "rig").frames) == 1


@pytest.mark.parametrize("suffix", [".txt", ".yaml", ".yml"])
def test_a_node_may_have_its_intrinsics_as_text_or_yaml(tmp_path, suffix):
    save_rig(tmp_path / "rig", orbit(1))
    file = tmp_path / "rig" / "node_00" / "intrinsics.json"
    file.unlink()
    text = "".join(f"{key}: {value}\n" for key, value in CAMERA.items())
    file.with_suffix(suffix).write_text(text)
    assert load_rig(tmp_path / "rig").frames[0].intrinsics.fy_px == 30.5


@pytest.mark.parametrize(
    ("given", "missing"), [("depth_intrinsics", "extrinsics"), ("extrinsics", "depth intrinsics")]
)
def test_half_of_a_depth_camera_opens_with_both_files_or_none(tmp_path, given, missing):
    save_rig(tmp_path / "rig", orbit(1))
    node = tmp_path / "rig" / "node_00"
    files = {"depth_intrinsics": node / "intrinsics.json", "extrinsics": node / "extrinsics.json"}
    files["extrinsics"].write_text(json.dumps({"T_color_depth": np.eye(4).tolist()}))
    images = node / "color.png", node / "depth.png", node / "intrinsics.json"
    with pytest.raises(InputError, match=f"but without {missing}; try both .* and none if it is"):
        load_frame(*images, **{given: files[given]})
    both = load_frame(*images, **files).depth
    np.testing.assert_allclose(both.z_m[10:-2, 10:-2], load_frame(*images).depth.z_m[10:-2, 10:-2], atol=0.2)


def test_an_exr_image_of_other_channels_names_them(tmp_path):
    OpenEXR = pytest.importorskip("OpenEXR")
    values = np.full((4, 5), 2.0, np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    path = tmp_path / "depth.exr"
    with OpenEXR.File(header, {"near": values, "far": values}) as file:
        file.write(str(path))
    with pytest.raises(
        InputError, match=r"has the channels .*; try one channel, one named Z, Y or V, or R, G, B"
    ):
        read_depth(path)
    with OpenEXR.File(header, {"Z": values, "far": 2.0 * values}) as file:
        file.write(str(path))
    np.testing.assert_array_equal(read_depth(path).z_m, values)

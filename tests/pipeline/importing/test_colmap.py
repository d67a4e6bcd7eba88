"""COLMAP's models, whose unit is unknown until depth or a person tells it."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.colmap import read_colmap, read_depth_map
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from pipeline.types import DepthMap, Rig
from tests.pipeline.importing.recordings import CAMERA, orbit, write_colmap


def steps_m(rig):
    """Distances between cameras that follow each other: free of the world's axes."""
    places_m = np.array([frame.T_world_camera[:3, 3] for frame in rig.frames])
    return np.linalg.norm(np.diff(places_m, axis=0), axis=1)


def test_measured_depth_tells_how_long_a_unit_of_the_model_is(tmp_path):
    """A quarter of the points lies where the sensor measured something else."""
    written = orbit(3)
    write_colmap(tmp_path / "model", written, metres_a_unit=0.37, sensor=True)
    report = drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    rig = load_rig(tmp_path / "rig")
    np.testing.assert_allclose(steps_m(rig), steps_m(written), rtol=1e-3)
    np.testing.assert_array_equal(rig.frames[0].depth.z_m, written.frames[0].depth.z_m)
    assert any("0.37 m" in note for note in report.notes)


@pytest.mark.parametrize("sensor", [False, True])
def test_the_depth_scale_holds_for_depth_and_poses(tmp_path, sensor):
    """Four units a metre where the model or, in thousands, the sensor's images have one."""
    written = orbit(2)
    write_colmap(tmp_path / "model", written, sensor=sensor)
    drain(iterate_import(tmp_path / "model", tmp_path / "rig", depth_scale=4000.0 if sensor else 4.0))
    rig = load_rig(tmp_path / "rig")
    np.testing.assert_allclose(steps_m(rig), steps_m(written) / 4.0, rtol=1e-6)
    np.testing.assert_allclose(rig.frames[0].depth.z_m, written.frames[0].depth.z_m / 4.0, atol=6e-4)


def test_depth_smaller_than_its_photograph_has_its_camera_resized(tmp_path):
    """Pixel 0 of 20 covers pixels 0 and 1 of 40, so that its centre is at 0.5 there."""
    write_colmap(tmp_path / "model", orbit(1))
    small = np.full((15, 20), 2.0, "<f4")
    (file,) = (tmp_path / "model").rglob("*.bin")
    file.write_bytes(b"20&15&1&" + small.tobytes())
    drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    camera = read_intrinsics(tmp_path / "rig" / "node_00" / "depth_intrinsics.json")
    assert (camera.width_px, camera.height_px) == (20, 15)
    assert (camera.fx_px, camera.fy_px) == pytest.approx((CAMERA.fx_px / 2, CAMERA.fy_px / 2))
    assert (camera.cx_px, camera.cy_px) == pytest.approx(((19.5 - 0.5) / 2, (14.5 - 0.5) / 2))
    np.testing.assert_array_equal(
        read_extrinsics(tmp_path / "rig" / "node_00" / "extrinsics.json"), np.eye(4)
    )


def test_a_sensor_with_fewer_pixels_than_the_photographs_tells_the_unit_as_well(tmp_path):
    """Depth that grows downwards, the same in rows 0 and 1, 2 and 3, so that half the rows keep it."""
    z_m = np.repeat(1.0 + 0.1 * (np.arange(30) // 2)[:, None], 40, axis=1).astype(np.float32)
    frames = tuple(replace(frame, depth=DepthMap(z_m)) for frame in orbit(3).frames)
    write_colmap(tmp_path / "model", Rig("slope", frames), metres_a_unit=0.37, sensor=True)
    for path in (tmp_path / "model" / "depth").rglob("*.png"):
        cv2.imwrite(str(path), cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[::2, ::2])
    report = drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    assert any("A unit of the model is 0.37 m" in note for note in report.notes)


def test_a_camera_of_two_radial_terms_keeps_them(tmp_path):
    write_colmap(tmp_path / "model", orbit(1))
    line = "7 OPENCV_FISHEYE 40 30 1 1 1 1 0 0 0 0\n1 RADIAL 40 30 31 20 15 0.1 -0.02\n"
    (tmp_path / "model" / "sparse" / "cameras.txt").write_text(line)
    camera = read_colmap(tmp_path / "model", None).camera
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (31.0, 31.0, 19.5, 14.5)
    np.testing.assert_array_equal(camera.distortion, [0.1, -0.02, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("file", "text", "sentence"),
    [
        ("cameras.txt", "1 FOV 40 30 1 1 1 1 1\n", "image_undistorter"),
        ("cameras.txt", "1 PINHOLE 40 30 1 1\n", "numbers"),
        ("cameras.txt", "2 PINHOLE 40 30 30 30 20 15\n", "no camera 1"),
        ("images.txt", "1 2 3\n\n", "where an image is expected"),
        ("images.txt", "1 0 0 0 0 0 0 0 1 room/view_0.png\n\n", "no rotation"),
        ("images.txt", "1 1 0 0 0 0 0 0 1 ../secret.png\n\n", "outside"),
        ("images.txt", "1 1 0 0 0 0 0 0 1 nowhere.png\n\n", "none of the 1 photographs .*nowhere.png"),
        ("images.txt", "# none\n", "none of the 0 photographs"),
        ("points3D.txt", "1 0 0 1 0 0 0 0.5\n", "too few"),
        ("points3D.txt", "1 0 zero 1 0 0 0 0.5\n", "numbers"),
    ],
)
def test_a_model_that_cannot_be_used_is_refused_in_a_sentence(tmp_path, file, text, sentence):
    write_colmap(tmp_path / "model", orbit(2), sensor=True)
    (tmp_path / "model" / "sparse" / file).write_text(text)
    with pytest.raises(InputError, match=sentence):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    assert not (tmp_path / "rig").exists()


def test_a_binary_model_is_to_be_converted(tmp_path):
    write_colmap(tmp_path / "model", orbit(1))
    for name in ("cameras", "images"):
        file = tmp_path / "model" / "sparse" / f"{name}.txt"
        file.rename(file.with_suffix(".bin"))
    with pytest.raises(InputError, match="model_converter"):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))


@pytest.mark.parametrize(
    "data", [b"", b"40&30&1&", b"40&30&3&" + bytes(14400), b"99999&99999&1&", b"4&1&1&" + bytes(16)]
)
def test_a_damaged_depth_map_is_refused_in_a_sentence(tmp_path, data):
    (tmp_path / "map.bin").write_bytes(data)
    with pytest.raises(InputError, match=r"map\.bin"):
        read_depth_map(tmp_path / "map.bin")


def test_photographs_that_are_elsewhere_open_in_the_folder_that_is_told(tmp_path):
    """The depth is there, so that patch_match_stereo would not help."""
    write_colmap(tmp_path / "model", orbit(2))
    (tmp_path / "model" / "images").rename(tmp_path / "model" / "pictures")
    says = r"none of the 2 photographs of images.txt, such as room/view_0.png; try to put them in images/"
    with pytest.raises(InputError, match=says):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    (tmp_path / "model" / "pictures").rename(tmp_path / "model" / "images")
    assert len(drain(iterate_import(tmp_path / "model", tmp_path / "rig")).frames) == 2


def test_a_camera_model_that_is_not_read_is_named_and_opens_with_intrinsics(tmp_path):
    """Another camera of the file is read; the images are not its."""
    write_colmap(tmp_path / "model", orbit(2))
    cameras = "1 FOV 40 30 30 30.5 20 15 0.1\n2 PINHOLE 40 30 30 30.5 20 15\n"
    (tmp_path / "model" / "sparse" / "cameras.txt").write_text(cameras)
    with pytest.raises(InputError, match=r"Camera 1 of .* has the model FOV, .* or --intrinsics FILE"):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    (tmp_path / "own.txt").write_text("30 0 19.5\n0 30.5 14.5\n0 0 1\n")
    drain(iterate_import(tmp_path / "model", tmp_path / "rig", intrinsics=tmp_path / "own.txt"))
    np.testing.assert_array_equal(load_rig(tmp_path / "rig").frames[0].intrinsics.matrix, CAMERA.matrix)


def test_a_binary_model_opens_when_its_text_is_in_the_folder_that_is_told(tmp_path):
    """colmap model_converter writes it to --output_path."""
    write_colmap(tmp_path / "model", orbit(2))
    sparse = tmp_path / "model" / "sparse"
    texts = {file.name: file.read_text() for file in sparse.iterdir()}
    for file in list(sparse.iterdir()):
        file.rename(file.with_suffix(".bin"))
    with pytest.raises(InputError, match=r"model_converter") as error:
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    told = Path(re.search(r"--output_path (\S+)", str(error.value))[1])
    for name, text in texts.items():
        (told / name).write_text(text)
    assert len(drain(iterate_import(tmp_path / "model", tmp_path / "rig")).frames) == 2

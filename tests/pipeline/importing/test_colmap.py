"""COLMAP's models, whose unit is unknown until depth or a person tells it."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.colmap import read_colmap, read_depth_map
from pipeline.io.rigs import load_rig
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


def test_depth_smaller_than_its_photograph_has_a_camera_of_its_own(tmp_path):
    write_colmap(tmp_path / "model", orbit(1))
    small = np.full((15, 20), 2.0, "<f4")
    (file,) = (tmp_path / "model").rglob("*.bin")
    file.write_bytes(b"20&15&1&" + small.tobytes())
    sequence = read_colmap(tmp_path / "model", None)
    assert (sequence.depth_camera.width_px, sequence.depth_camera.height_px) == (20, 15)
    assert sequence.depth_camera.fx_px == pytest.approx(CAMERA.fx_px / 2)
    np.testing.assert_array_equal(sequence.T_color_depth, np.eye(4))


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
        ("images.txt", "1 1 0 0 0 0 0 0 1 nowhere.png\n\n", "patch_match_stereo"),
        ("images.txt", "# none\n", "patch_match_stereo"),
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

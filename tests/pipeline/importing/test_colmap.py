"""COLMAP's models, whose unit is unknown until depth or a person tells it."""

import struct
from dataclasses import replace

import cv2
import numpy as np
import pycolmap
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.colmap import read_colmap, read_depth_map
from pipeline.importing.colmap_binary import read_binary_model
from pipeline.importing.colmap_model import PARAMETERS
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import project
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


@pytest.mark.parametrize(
    ("sensor", "options", "says"),
    [
        (False, {}, "COLMAP's models have no scale: one unit is read as one metre; --depth-scale says"),
        (False, {"depth_scale": 4.0}, None),
        (True, {}, "A unit of the model is 0.5 m by"),
        (True, {"depth_scale": 4000.0}, "A unit of the model is 0.125 m by"),
    ],
)
def test_what_is_said_of_the_model_s_unit_holds_at_the_scale_that_is_used(tmp_path, sensor, options, says):
    write_colmap(tmp_path / "model", orbit(3), metres_a_unit=0.5, sensor=sensor)
    report = drain(iterate_import(tmp_path / "model", tmp_path / "rig", **options))
    of_unit = [note for note in report.notes if "unit of the model" in note or "one unit" in note]
    assert len(of_unit) == (says is not None)
    assert all(note.startswith(says) for note in of_unit)


def test_maps_of_some_images_and_a_sensor_s_depth_of_others_are_refused_until_one_is_moved_away(tmp_path):
    write_colmap(tmp_path / "model", orbit(3), metres_a_unit=0.5, sensor=True)
    maps = tmp_path / "model" / "stereo" / "depth_maps" / "room"
    maps.mkdir(parents=True)
    values = np.full((30, 40), 4.0, "<f4")
    (maps / "view_0.png.geometric.bin").write_bytes(b"40&30&1&" + values.tobytes())
    says = "has stereo/depth_maps for 1 of 3 images and a sensor's depth for the others, .*; try to move one"
    with pytest.raises(InputError, match=says):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    (tmp_path / "model" / "stereo").rename(tmp_path / "away")
    assert len(drain(iterate_import(tmp_path / "model", tmp_path / "rig")).frames) == 3


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
        (
            "cameras.txt",
            "1 PINHOLE 40 30 0 30 20 15\n",
            "Camera 1 of .* has focal lengths 0 and 30 px",
        ),
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


def test_images_of_several_cameras_each_keep_theirs(tmp_path):
    """As networks write them that find a camera for every photograph."""
    written = orbit(3)
    write_colmap(tmp_path / "model", written, metres_a_unit=0.37, sensor=True)
    sparse = tmp_path / "model" / "sparse"
    cameras = [f"{k} PINHOLE 40 30 {30 + k} 30.5 20 15" for k in (1, 2, 3)]
    (sparse / "cameras.txt").write_text("\n".join(cameras) + "\n")
    lines = (sparse / "images.txt").read_text().splitlines()
    for k in range(3):
        words = lines[1 + 2 * k].split()
        words[8] = str(k + 1)
        lines[1 + 2 * k] = " ".join(words)
    (sparse / "images.txt").write_text("\n".join(lines) + "\n")
    drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    rig = load_rig(tmp_path / "rig")
    assert [frame.intrinsics.fx_px for frame in rig.frames] == [31.0, 32.0, 33.0]
    np.testing.assert_allclose(steps_m(rig), steps_m(written), rtol=1e-3)


def binary(folder):
    """Replace the text model by the binary one that pycolmap writes."""
    sparse = folder / "sparse"
    (sparse / "points3D.txt").write_text(_with_tracks(sparse))
    model = pycolmap.Reconstruction(str(sparse))
    for file in sparse.iterdir():
        file.unlink()
    model.write_binary(str(sparse))


def _with_tracks(sparse):
    """points3D.txt with the image and the feature of each point, which pycolmap checks."""
    lines = [line for line in (sparse / "images.txt").read_text().splitlines() if not line.startswith("#")]
    tracks = {}
    for image, features in enumerate(lines[1::2], start=1):
        for place, number in enumerate(features.split()[2::3]):
            tracks[number] = f"{image} {place}"
    points = [line for line in (sparse / "points3D.txt").read_text().splitlines() if not line.startswith("#")]
    return "\n".join(f"{' '.join(line.split()[:8])} {tracks[line.split()[0]]}" for line in points) + "\n"


def test_a_binary_model_of_pycolmap_is_the_rig_that_it_was_written_from(tmp_path):
    """Its folder also has rigs.bin and frames.bin."""
    written = orbit(3)
    write_colmap(tmp_path / "model", written, metres_a_unit=0.37, sensor=True)
    text = read_colmap(tmp_path / "model", None)
    binary(tmp_path / "model")
    assert {file.name for file in (tmp_path / "model" / "sparse").iterdir()} >= {"rigs.bin", "frames.bin"}
    read = read_colmap(tmp_path / "model", None)
    np.testing.assert_array_equal(read.camera.matrix, CAMERA.matrix)
    for own, expected in zip(read.candidates, text.candidates, strict=True):
        assert (own.color, own.depth) == (expected.color, expected.depth)
        np.testing.assert_allclose(own.T_world_camera, expected.T_world_camera, atol=1e-9)
    drain(iterate_import(tmp_path / "model", tmp_path / "rig"))
    np.testing.assert_allclose(steps_m(load_rig(tmp_path / "rig")), steps_m(written), rtol=1e-3)


@pytest.mark.parametrize("name", [name for name in pycolmap.CameraModelId.__members__ if name != "INVALID"])
def test_every_camera_model_of_pycolmap_is_read_or_named(tmp_path, name):
    """Those that are read project a point to where pycolmap projects it."""
    model = pycolmap.CameraModelId.__members__[name]
    camera = pycolmap.Camera.create_from_model_id(1, model, 30.0, 40, 30)
    if name != "EQUIRECTANGULAR":
        parameters = camera.params
        for at in range(3, len(parameters)):
            parameters[at] = parameters[at] if parameters[at] > 1.0 else 0.01 * (at - 2)
        camera.params = parameters
    reconstruction = pycolmap.Reconstruction()
    reconstruction.add_camera(camera)
    reconstruction.write_binary(str(tmp_path))
    read = read_binary_model(tmp_path)
    if name not in PARAMETERS:
        assert read.others == {1: name}
        return
    point_m = np.array([[0.2, -0.1, 1.0]])
    expected = camera.img_from_cam(point_m) - 0.5
    np.testing.assert_allclose(project(read.cameras[1], point_m), expected, atol=1e-6)


@pytest.mark.parametrize("file", ["cameras.bin", "images.bin", "points3D.bin"])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.99])
def test_a_cut_binary_file_gets_a_sentence(tmp_path, file, share):
    write_colmap(tmp_path / "model", orbit(3), sensor=True)
    binary(tmp_path / "model")
    path = tmp_path / "model" / "sparse" / file
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=rf"{file}.*(truncated or damaged|is empty)"):
        drain(iterate_import(tmp_path / "model", tmp_path / "rig"))


def test_an_unknown_camera_model_of_a_binary_file_gets_a_sentence(tmp_path):
    write_colmap(tmp_path / "model", orbit(2), sensor=True)
    binary(tmp_path / "model")
    path = tmp_path / "model" / "sparse" / "cameras.bin"
    data = bytearray(path.read_bytes())
    data[12:16] = struct.pack("<i", 99)
    path.write_bytes(data)
    with pytest.raises(
        InputError, match=r"Camera 1 of .* has the unknown model 99; try colmap model_converter"
    ):
        read_colmap(tmp_path / "model", None)

"""Azure Kinect's Matroska files, with the headers that k4arecorder writes."""

import sys

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.kinect import read_kinect
from pipeline.importing.recorded import open_recording
from pipeline.io.extrinsics import read_extrinsics
from pipeline.io.intrinsics import read_intrinsics
from pipeline.kernels.geometry import apply, pixel_rays, rigid, rotation_exp
from pipeline.types import CameraIntrinsics
from tests.pipeline.lenses import RATIONAL
from tests.pipeline.strangers.containers import DEPTH_SIZE, jpeg, kinect_calibration, write_matroska

COLOR_SIZE = 160, 90
DEPTH_LENS = (5.83, 4.02, 9.2e-5, -1.7e-5, 0.21, 6.16, 5.99, 1.09)
"""k1, k2, p1, p2, k3 to k6 of the depth camera of an Azure Kinect."""
T_COLOR_DEPTH = rigid(rotation_exp(np.array([0.104, 0.003, -0.002])), np.array([-0.032, -0.0021, 0.0040]))
NORMAL, OFFSET_M = np.array([0.2, -0.1, 0.9747]), 1.4


def lens(fx, cx, cy, size, distortion):
    matrix = np.array([[fx, 0.0, cx], [0.0, fx, cy], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, np.array(distortion), *size)


COLOR = lens(76.0, 79.8, 45.1, COLOR_SIZE, RATIONAL)
DEPTH = lens(252.0, 160.7, 168.2 - 24.0, DEPTH_SIZE, DEPTH_LENS)


def wall(own, offset_m=OFFSET_M):
    """(H, W) depth of a tilted wall, normal . p = offset in the depth camera's frame."""
    return offset_m / (pixel_rays(own) @ NORMAL)


def write(file, count=4, tag=b"MJPG", calibration=None, **options):
    """Each frame shows the wall a centimetre farther, in its own grey."""
    units = [np.rint(1000.0 * wall(DEPTH, OFFSET_M + 0.01 * k)) for k in range(count)]
    images = [np.where(own < 6000, own, 0).astype(np.uint16) for own in units]
    colors = [np.full((90, 160, 3), 25 * (k % 10), np.uint8) for k in range(count)]
    encoded = {
        b"MJPG": jpeg,
        b"BGRA": lambda rgb: np.dstack([rgb[..., ::-1], np.full((90, 160), 255, np.uint8)]).tobytes(),
        b"NV12": lambda rgb: nv12(rgb).tobytes(),
        b"YUY2": lambda rgb: cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_YUY2).tobytes(),
    }[tag]
    if calibration is None:
        calibration = kinect_calibration(COLOR, DEPTH, T_COLOR_DEPTH)
    write_matroska(file, calibration, [encoded(rgb) for rgb in colors], images, COLOR_SIZE, tag, **options)
    return images


def nv12(rgb):
    planes = cv2.cvtColor(rgb, cv2.COLOR_RGB2YUV_I420)
    chroma = planes[90:].reshape(2, -1)
    return np.concatenate([planes[:90], np.stack([chroma[0], chroma[1]], axis=-1).reshape(45, 160)])


@pytest.mark.parametrize("tag", [b"MJPG", b"BGRA", b"NV12", b"YUY2"])
def test_frames_are_those_that_were_written_in_any_order(tmp_path, tag):
    images = write(tmp_path / "room.mkv", 9, tag)
    recording = open_recording(tmp_path / "room.mkv")
    assert recording.kind == "Azure Kinect or Femto"
    np.testing.assert_allclose(recording.times_s, 0.033 * np.arange(9), atol=1e-9)
    candidates = recording.sequence.candidates
    for k in (0, 1, 2, 8, 3, 7, 0, 5, 5, 4):
        np.testing.assert_array_equal(candidates[k].depth.read(), images[k])
        assert np.abs(candidates[k].color.read().astype(int) - 25 * k).max() <= 3
    assert recording.T_world_camera is None


def test_the_cameras_are_those_of_the_calibration(tmp_path):
    write(tmp_path / "room.mkv")
    drain(iterate_import(tmp_path / "room.mkv", tmp_path / "rig"))
    node = tmp_path / "rig" / "node_00"
    for name, expected in (("intrinsics", COLOR), ("depth_intrinsics", DEPTH)):
        own = read_intrinsics(node / f"{name}.json")
        np.testing.assert_allclose(own.matrix, expected.matrix, atol=1e-9)
        np.testing.assert_allclose(own.distortion, expected.distortion, atol=1e-12)
    np.testing.assert_allclose(read_extrinsics(node / "extrinsics.json"), T_COLOR_DEPTH, atol=1e-9)


@pytest.mark.parametrize(
    ("depth", "color", "depth_camera", "color_camera"),
    [
        # cx 1024 - 192 - .5, and so on; colour loses (1440 - 1080) / 2 rows of a sensor of 4 : 3
        ((640, 576), (1920, 1080), (504.5, 504.7, 320.7, 335.9), (918.1, 917.8, 956.3, 547.9)),
        ((320, 288), (1280, 720), (252.2, 252.3, 160.1, 167.7), (612.1, 611.9, 637.4, 365.1)),
        ((512, 512), (2048, 1536), (252.2, 252.3, 256.1, 257.7), (979.3, 979.0, 1020.1, 776.4)),
        ((1024, 1024), (4096, 3072), (504.5, 504.7, 512.7, 515.9), (1958.7, 1958.0, 2040.7, 1553.4)),
    ],
)
def test_modes_have_the_cameras_of_the_sdk(tmp_path, depth, color, depth_camera, color_camera):
    """Worked out from mode_specific_calibration.c for the calibration below, to a tenth of a pixel."""
    numbers = [0.50119, 0.50430, 0.49265, 0.49283], [0.49835, 0.50582, 0.47819, 0.63736]
    cameras = [
        {
            "Intrinsics": {
                "ModelParameters": [*own, *[0.0] * 10],
                "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
            },
            "Purpose": f"CALIBRATION_CameraPurpose{purpose}",
            "Rt": {"Rotation": np.eye(3).ravel().tolist(), "Translation": [0.0, 0.0, 0.0]},
            "SensorWidth": size[0],
            "SensorHeight": size[1],
        }
        for own, purpose, size in zip(
            numbers, ("Depth", "PhotoVideo"), ((1024, 1024), (4096, 3072)), strict=True
        )
    ]
    calibration = {"CalibrationInformation": {"Cameras": cameras}}
    black = jpeg(np.zeros((*color[::-1], 3), np.uint8))
    units = np.full(depth[::-1], 1000, np.uint16)
    write_matroska(tmp_path / "room.mkv", calibration, [black], [units], color)
    sequence = read_kinect(tmp_path / "room.mkv", None)
    for camera, expected in ((sequence.depth_camera, depth_camera), (sequence.camera, color_camera)):
        own = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
        np.testing.assert_allclose(own, expected, atol=0.06)


def test_an_old_calibration_of_the_middle_rows_is_the_same_camera(tmp_path):
    """Of 4096 x 2304 pixels; a row y of it is row y + 384 of the whole sensor."""
    calibration = kinect_calibration(COLOR, DEPTH, T_COLOR_DEPTH)
    own = calibration["CalibrationInformation"]["Cameras"][1]
    own["SensorHeight"] = 2304
    numbers = own["Intrinsics"]["ModelParameters"]
    numbers[1], numbers[3] = (numbers[1] * 3072 - 384) / 2304, numbers[3] * 3072 / 2304
    write(tmp_path / "room.mkv", calibration=calibration)
    camera = read_kinect(tmp_path / "room.mkv", None).camera
    np.testing.assert_allclose(camera.matrix, COLOR.matrix, atol=1e-9)


def test_the_wall_is_where_it_was_in_both_cameras(tmp_path):
    """Depth without its lens, and depth registered to colour: the wall, moved by the extrinsics."""
    write(tmp_path / "room.mkv", 1)
    recording = open_recording(tmp_path / "room.mkv")
    view = recording.view(0)
    known = view.depth.valid
    assert known.mean() > 0.6
    points_m = (pixel_rays(view.camera) * view.depth.z_m[..., None])[known]
    assert np.percentile(np.abs(points_m @ NORMAL - OFFSET_M), 95) < 0.004
    frame = recording.frame(0)
    known = frame.depth.valid
    assert known.mean() > 0.4
    points_m = (pixel_rays(frame.intrinsics) * frame.depth.z_m[..., None])[known]
    off_m = apply(np.linalg.inv(T_COLOR_DEPTH), points_m) @ NORMAL - OFFSET_M
    assert np.percentile(np.abs(off_m), 95) < 0.015
    assert abs(np.median(off_m)) < 0.002


def test_images_apart_by_more_than_20_ms_are_not_pairs(tmp_path):
    write(tmp_path / "room.mkv", 3, late_ms=25)  # the next colour image is 8 ms later
    sequence = read_kinect(tmp_path / "room.mkv", None)
    names = [
        (str(own.color).split(" in ")[0], str(own.depth).split(" in ")[0]) for own in sequence.candidates
    ]
    assert names == [("colour image 1", "depth image 0"), ("colour image 2", "depth image 1")]


def without(*keys):
    """A calibration from which something is missing."""
    calibration = kinect_calibration(COLOR, DEPTH, T_COLOR_DEPTH)
    of = calibration["CalibrationInformation"]["Cameras"][0]
    for key in keys[:-1]:
        of = of[key]
    del of[keys[-1]]
    return calibration


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            {"titles": ("COLOR", "INFRARED")},
            r"no depth track DEPTH .*tracks: COLOR, INFRARED, IR.*; try to record with k4arec",
        ),
        ({"titles": ("FILM", "DEPTH")}, r"no colour track COLOR"),
        ({"calibration": []}, r"calibration.json in .* holds no JSON object"),
        ({"calibration": {}}, r"not in Azure Kinect's format \('CalibrationInformation'\)"),
        ({"calibration": without("Intrinsics", "ModelParameters")}, r"Kinect's format \('ModelParameters'\)"),
        ({"calibration": without("Rt")}, r"Kinect's format \('Rt'\)"),
    ],
)
def test_a_missing_part_gets_a_sentence(tmp_path, options, says):
    write(tmp_path / "room.mkv", 2, **options)
    with pytest.raises(InputError, match=says) as error:
        drain(iterate_import(tmp_path / "room.mkv", tmp_path / "rig"))
    assert "room.mkv" in str(error.value)
    assert not (tmp_path / "rig").exists()


def test_without_a_calibration_the_sentence_says_so(tmp_path):
    units = [np.full(DEPTH_SIZE[::-1], 1000, np.uint16)]
    write_matroska(tmp_path / "room.mkv", None, [jpeg(np.zeros((90, 160, 3), np.uint8))], units, COLOR_SIZE)
    with pytest.raises(InputError, match=r"room.mkv has no attached calibration.json"):
        open_recording(tmp_path / "room.mkv")


def test_another_lens_model_is_named(tmp_path):
    calibration = kinect_calibration(COLOR, DEPTH, T_COLOR_DEPTH)
    own = calibration["CalibrationInformation"]["Cameras"][0]
    own["Intrinsics"]["ModelType"] = "CALIBRATION_LensDistortionModelTheta"
    write(tmp_path / "room.mkv", calibration=calibration)
    with pytest.raises(InputError, match="DistortionModelTheta"):
        open_recording(tmp_path / "room.mkv")


def test_another_compression_of_depth_is_named(tmp_path):
    write(tmp_path / "room.mkv")
    data = (tmp_path / "room.mkv").read_bytes()
    (tmp_path / "room.mkv").write_bytes(data.replace(b"b16g", b"Y16 "))
    with pytest.raises(InputError, match=r"unknown compression, not b16g; try the file as k4arecorder"):
        open_recording(tmp_path / "room.mkv")


def test_a_file_that_ends_early_gives_what_it_has_and_says_so(tmp_path):
    images = write(tmp_path / "room.mkv", 60)
    data = (tmp_path / "room.mkv").read_bytes()
    (tmp_path / "room.mkv").write_bytes(data[: len(data) // 3])
    recording = open_recording(tmp_path / "room.mkv")
    count = len(recording.times_s)
    assert 10 < count < 30
    assert any("room.mkv is cut: it ends at" in note for note in recording.notes)
    for k in (count - 1, 0):
        np.testing.assert_array_equal(recording.sequence.candidates[k].depth.read(), images[k])


PLAYLIST = b"#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nsecret.ts\n#EXT-X-ENDLIST\n"


@pytest.mark.parametrize("data", [b"", b"no video", b"\x1aE\xdf\xa3" + bytes(500), PLAYLIST])
def test_a_file_that_is_no_video_gets_a_sentence(tmp_path, data):
    (tmp_path / "room.mkv").write_bytes(data)
    with pytest.raises(InputError, match=r"room.mkv (cannot be read as a video file|has no colour track)"):
        open_recording(tmp_path / "room.mkv")


def test_without_pyav_its_extra_is_named(tmp_path, monkeypatch):
    write(tmp_path / "room.mkv")
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InputError, match=r"needs PyAV; try pip install 'packetmesh\[video\]'"):
        open_recording(tmp_path / "room.mkv")

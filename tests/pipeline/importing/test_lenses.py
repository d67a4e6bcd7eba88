"""Lenses of recordings: they are those of the rig that import writes."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.importing import iterate_import
from pipeline.importing.choosing import overlaps
from pipeline.importing.colmap_model import _cameras
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import look_at
from pipeline.types import CameraIntrinsics, Rig
from tests.pipeline.importing.bags import write_bag
from tests.pipeline.importing.recordings import CAMERA, orbit
from tests.pipeline.lenses import KIND

LENSES = {kind: (np.array(numbers), kind == "fisheye") for kind, (_, numbers) in KIND.items()}


@pytest.mark.parametrize("bag", ["ros1", "ros2"])
@pytest.mark.parametrize("kind", ["rational", "prism", "tilt", "fisheye"])
def test_a_bag_s_camera_info_gives_the_lens(kind, bag, tmp_path):
    distortion, fisheye = LENSES[kind]
    camera = replace(CAMERA, distortion=distortion, fisheye=fisheye)
    frames = tuple(replace(frame, intrinsics=camera) for frame in orbit(2).frames)
    path = tmp_path / ("recording.bag" if bag == "ros1" else "recording")
    write_bag(path, Rig("orbit", frames), bag)
    drain(iterate_import(path, tmp_path / "rig"))
    for frame in load_rig(tmp_path / "rig").frames:
        np.testing.assert_array_equal(frame.intrinsics.distortion, distortion)
        np.testing.assert_array_equal(frame.intrinsics.matrix, camera.matrix)
        assert frame.intrinsics.fisheye == fisheye


@pytest.mark.parametrize(
    ("line", "distortion", "fisheye"),
    [
        (
            "FULL_OPENCV 40 30 31 32 20 15 .1 .2 .3 .4 .5 .6 .7 .8",
            [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8],
            False,
        ),
        ("FULL_OPENCV 40 30 31 32 20 15 .1 .2 .3 .4 .5 0 0 0", [0.1, 0.2, 0.3, 0.4, 0.5], False),
        ("OPENCV_FISHEYE 40 30 31 32 20 15 .1 .2 .3 .4", [0.1, 0.2, 0.3, 0.4], True),
        ("RADIAL_FISHEYE 40 30 31 20 15 .1 .2", [0.1, 0.2, 0.0, 0.0], True),
        ("SIMPLE_RADIAL_FISHEYE 40 30 31 20 15 .1", [0.1, 0.0, 0.0, 0.0], True),
        ("OPENCV 40 30 31 32 20 15 .1 .2 .3 .4", [0.1, 0.2, 0.3, 0.4, 0.0], False),
    ],
)
def test_colmap_s_models(line, distortion, fisheye, tmp_path):
    (tmp_path / "cameras.txt").write_text(f"3 {line}\n")
    camera = _cameras(tmp_path / "cameras.txt")[0][3]
    np.testing.assert_array_equal(camera.distortion, distortion)
    assert (camera.fisheye, camera.cx_px, camera.cy_px) == (fisheye, 19.5, 14.5)


def test_colmap_s_other_fisheyes_are_not_read(tmp_path):
    (tmp_path / "cameras.txt").write_text("3 THIN_PRISM_FISHEYE 40 30 31 32 20 15 0 0 0 0 0 0 0 0\n")
    assert _cameras(tmp_path / "cameras.txt") == ({}, {3: "THIN_PRISM_FISHEYE"})


def test_a_fisheye_overlaps_more_than_a_pinhole_camera_of_its_focal_length():
    """At a focal length of 0.32 widths a pinhole camera sees 57 degrees to each side, a fisheye 90."""
    pinhole = CameraIntrinsics.pinhole(204.0, 204.0, 319.5, 239.5, 640, 480)
    fisheye = replace(pinhole, distortion=np.zeros(4), fisheye=True)
    poses = np.array([look_at((0, 0, 0), (np.sin(a), np.cos(a), 0)) for a in np.radians([0.0, 60.0])])
    narrow, wide = (overlaps(poses, camera, 2.0) for camera in (pinhole, fisheye))
    assert np.isfinite(wide).all()
    assert wide[0, 1] > narrow[0, 1] > 0.0
    assert wide[0, 0] == pytest.approx(1.0)

"""Photographs of a recording's frames: which are read, and which decide nothing."""

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.recorded import DepthView
from pipeline.kernels.geometry import inverse, pixel_rays, rigid, scaled
from pipeline.recording.brightness import Brightness, shrunk
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame
from tests.pipeline.recording.rendered import NOISE
from tests.pipeline.registration import test_photometric as walls

ALONG = np.eye(6)[:, 3:5]
"""Motions along the wall."""


class Wall:
    """Frames of a painted wall, each 2 cm farther right; has what ``Brightness`` reads."""

    def __init__(self, unreadable=()):
        self.read, self._unreadable = [], unreadable

    def pose(self, index):
        return rigid(np.eye(3), np.array([0.02 * index, 0.0, 0.0]))

    def view(self, index):
        return DepthView(walls.seen(self.pose(index)).depth, walls.CAMERA, walls.DEPTH_IN_COLOR, NOISE)

    def frame(self, index):
        self.read.append(index)
        if index in self._unreadable:
            raise InputError(f"image {index} is cut")
        return walls.seen(self.pose(index), seed=index)


def test_the_slide_of_the_depth_camera_is_found_and_the_keyframe_read_once():
    wall = Wall()
    brightness = Brightness(wall)
    for source in (1, 2):
        T, information = brightness.corrected(source, 0, np.eye(4), ALONG)
        true = inverse(walls.DEPTH_IN_COLOR) @ wall.pose(source) @ walls.DEPTH_IN_COLOR
        assert np.linalg.norm((inverse(true) @ T)[:2, 3]) < 0.001
        assert information[3, 3] > 1e3
    assert sorted(wall.read) == [0, 1, 2]
    brightness.corrected(2, 1, np.eye(4), ALONG)
    assert sorted(wall.read) == [0, 1, 1, 2, 2]


def test_photographs_that_cannot_be_read_decide_nothing():
    brightness = Brightness(Wall(unreadable=(1,)))
    assert brightness.corrected(1, 0, np.eye(4), ALONG) is None
    assert brightness.corrected(2, 0, np.eye(4), ALONG) is not None
    assert brightness.corrected(2, 1, np.eye(4), ALONG) is None


def test_photographs_of_another_size_decide_nothing(monkeypatch):
    wall = Wall()
    brightness = Brightness(wall)
    assert brightness.corrected(1, 0, np.eye(4), ALONG) is not None
    camera = scaled(walls.CAMERA, 0.5)
    monkeypatch.setattr(walls, "CAMERA", camera)
    assert wall.frame(1).rgb.shape == (60, 80, 3)
    assert brightness.corrected(1, 0, np.eye(4), ALONG) is None


def test_a_smaller_image_shows_the_same_points_in_the_same_colours():
    """A plane seen at an angle, 642 x 482: every second pixel, and its place stays within half a pixel."""
    camera = CameraIntrinsics.pinhole(525.0, 525.0, 320.0, 240.0, 642, 482)
    v, u = np.mgrid[0:482, 0:642]
    z_m = (2.0 / (1.0 + 0.2 * (u - 320.0) / 525.0)).astype(np.float32)
    rgb = np.stack([u // 4, v // 4, 0 * u], axis=-1).astype(np.uint8)
    small = shrunk(RgbdFrame("frame", rgb, DepthMap(z_m), camera, np.eye(4)))
    assert small.rgb.shape == (241, 321, 3)
    assert small.depth.z_m.shape == (241, 321)
    assert (small.intrinsics.height_px, small.intrinsics.width_px) == (241, 321)
    rays = pixel_rays(small.intrinsics)
    expected_m = 2.0 / (1.0 + 0.2 * rays[..., 0])
    np.testing.assert_allclose(small.depth.z_m, expected_m, rtol=0.0005)
    np.testing.assert_allclose(small.rgb[..., 0], (525.0 * rays[..., 0] + 320.0) / 4.0, atol=1.0)
    np.testing.assert_allclose(small.rgb[..., 1], (525.0 * rays[..., 1] + 240.0) / 4.0, atol=1.0)
    assert shrunk(small) is small

"""Depth of the same view in fewer pixels has the colour camera, resized."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.rigs import load_frame
from pipeline.io.same_view import depth_camera_of
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import CameraIntrinsics

PHONE = CameraIntrinsics.pinhole(1575.0, 1580.0, 959.5, 725.0, 1920, 1440)


def depth_camera(camera, width_px, height_px):
    return depth_camera_of(camera, (height_px, width_px), "depth.png", "color.png", "try another")


def test_a_pixel_of_the_smaller_image_looks_along_the_mean_of_the_pixels_that_it_covers():
    """So cv2.resize with INTER_AREA makes it; the block of 7.5 pixels has its middle between them."""
    small = depth_camera(PHONE, 128, 96)
    assert (small.fx_px, small.fy_px) == pytest.approx((105.0, 1580.0 / 15.0))
    means = cv2.resize(pixel_rays(PHONE)[..., :2], (128, 96), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(pixel_rays(small)[..., :2], means, atol=1e-9)


def test_equal_sizes_need_no_camera():
    assert depth_camera(PHONE, 1920, 1440) is None


@pytest.mark.parametrize(
    ("size", "other"),
    [
        ((1296, 968), (640, 480)),
        ((1280, 720), (424, 240)),
        ((1920, 1440), (256, 190)),
        ((640, 480), (480, 640)),
    ],
)
def test_sides_out_of_proportion_get_a_sentence(size, other):
    """Sizes of ScanNet and of a RealSense camera, whose colour and depth cameras have other views."""
    camera = CameraIntrinsics.pinhole(500.0, 500.0, size[0] / 2, size[1] / 2, *size)
    says = f"depth.png has {other[0]} x {other[1]} pixels but .* has {size[0]} x {size[1]}.*; try another"
    with pytest.raises(InputError, match=says):
        depth_camera(camera, *other)


@pytest.fixture
def pair(tmp_path):
    """A wall that is oblique to the camera: 1 / z is linear in the image, in both sizes."""
    camera = CameraIntrinsics.pinhole(150.0, 150.0, 95.5, 71.5, 192, 144)
    small = CameraIntrinsics.pinhole(37.5, 37.5, 23.5, 17.5, 48, 36)
    for name, own in (("full", camera), ("small", small)):
        z_m = 2.0 / (pixel_rays(own) @ [0.3, -0.2, 1.0])
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.rint(1000.0 * z_m).astype(np.uint16))
    cv2.imwrite(str(tmp_path / "color.jpg"), np.full((144, 192, 3), 90, np.uint8))
    (tmp_path / "camera.csv").write_text("150,0,95.5\n0,150,71.5\n0,0,1\n")
    return tmp_path


def test_a_pair_of_a_telephone_is_registered_to_its_photograph(pair):
    frame = load_frame(pair / "color.jpg", pair / "small.png", pair / "camera.csv")
    full = load_frame(pair / "color.jpg", pair / "full.png", pair / "camera.csv")
    assert frame.depth.coverage > 0.99
    np.testing.assert_allclose(frame.depth.z_m[2:-2, 2:-2], full.depth.z_m[2:-2, 2:-2], rtol=3e-3)
    assert full.notes == ()
    assert any("48 x 36 pixels and colour 192 x 144" in note for note in frame.notes)


def test_a_pair_of_other_views_opens_with_the_depth_cameras_own_files(pair):
    """The remedy of the message."""
    cv2.imwrite(str(pair / "other.png"), np.full((36, 60), 2000, np.uint16))
    images = pair / "color.jpg", pair / "other.png", pair / "camera.csv"
    with pytest.raises(InputError, match="or the depth camera's own intrinsics and extrinsics"):
        load_frame(*images)
    (pair / "depth.txt").write_text("37.5 0 29.5\n0 37.5 17.5\n0 0 1\n")
    (pair / "extrinsics.json").write_text(f'{{"T_color_depth": {np.eye(4).tolist()}}}')
    own = {"depth_intrinsics": pair / "depth.txt", "extrinsics": pair / "extrinsics.json"}
    frame = load_frame(*images, **own)
    np.testing.assert_allclose(frame.depth.z_m[frame.depth.valid], 2.0, atol=1e-6)

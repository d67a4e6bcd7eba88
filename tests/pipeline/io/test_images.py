"""Images come back as they were written."""

import cv2
import numpy as np
import pytest

from pipeline.io.images import read_color, read_depth, write_color, write_depth_mm
from pipeline.types import DepthMap


def test_colour_is_rgb_and_exact(tmp_path):
    rgb = np.random.default_rng(0).integers(0, 256, (7, 9, 3), dtype=np.uint8)
    write_color(tmp_path / "color.png", rgb)
    np.testing.assert_array_equal(read_color(tmp_path / "color.png"), rgb)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "color.png"))[..., ::-1], rgb)


def test_grey_colour_images_get_three_channels(tmp_path):
    grey = np.arange(63, dtype=np.uint8).reshape(7, 9)
    cv2.imwrite(str(tmp_path / "grey.png"), grey)
    np.testing.assert_array_equal(read_color(tmp_path / "grey.png"), np.stack([grey] * 3, axis=-1))


def test_jpeg_is_read(tmp_path):
    rgb = np.full((16, 24, 3), (200, 100, 50), dtype=np.uint8)
    write_color(tmp_path / "color.jpg", rgb)
    np.testing.assert_allclose(read_color(tmp_path / "color.jpg"), rgb, atol=3)


@pytest.mark.parametrize("name", ["color.ppm", "grey.pgm"])
def test_images_of_machine_vision_cameras_are_read(name, tmp_path):
    image = np.random.default_rng(1).integers(0, 256, (7, 9, 3)[: 3 if name == "color.ppm" else 2], np.uint8)
    cv2.imwrite(str(tmp_path / name), image)
    expected = image[..., ::-1] if image.ndim == 3 else np.stack([image] * 3, axis=-1)
    np.testing.assert_array_equal(read_color(tmp_path / name), expected)
    commented = (tmp_path / name).read_bytes().replace(b"\n", b"\n# by somebody\n", 1)
    (tmp_path / name).write_bytes(commented)
    np.testing.assert_array_equal(read_color(tmp_path / name), expected)


def test_every_millimetre_survives(tmp_path):
    """65535 is no millimetre: it stands for an unknown depth."""
    depth_mm = np.append(np.arange(65535, dtype=np.uint16), np.uint16(0)).reshape(256, 256)
    z_m = (depth_mm / 1000.0).astype(np.float32)
    z_m[depth_mm == 0] = np.nan
    write_depth_mm(tmp_path / "depth.png", DepthMap(z_m))
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "depth.png"), cv2.IMREAD_UNCHANGED), depth_mm)
    again = read_depth(tmp_path / "depth.png")
    assert again.z_m.dtype == np.float32
    assert again.kind == "metric"
    np.testing.assert_array_equal(again.z_m, z_m)


@pytest.mark.parametrize("scale", [256.0, 1000.0, 5000.0])
def test_the_scale_is_units_per_metre(tmp_path, scale):
    cv2.imwrite(str(tmp_path / "depth.png"), np.full((4, 5), 1280, np.uint16))
    assert read_depth(tmp_path / "depth.png", scale).z_m == pytest.approx(1280 / scale)

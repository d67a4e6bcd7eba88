"""The coders beside each other: what they give back, and what likeness means."""

import numpy as np
import pytest

from lab.benchmarks.codings import COLOR_CODERS, _at_likeness, _depth_rows, _line, depth_coders, likeness
from lab.results.codings import codings
from tests.pipeline.delivery.pictures import noise_images, smooth_images

IMAGES = [
    ("made", images.rgb, images.depth) for images in (smooth_images(70, 90, 1), noise_images(40, 50, 2))
]


@pytest.mark.parametrize("coder", depth_coders(), ids=lambda coder: f"{coder.name}, {coder.pieces}")
def test_every_depth_coder_is_exact(coder):
    for _, _, depth in IMAGES:
        np.testing.assert_array_equal(coder.read(coder.write(depth), depth.shape), depth)


def test_likeness_of_equal_images_is_one_and_falls_with_noise():
    rgb, rng = smooth_images(64, 64, 3).rgb, np.random.default_rng(0)
    noisy = [np.clip(rgb + rng.normal(0, sd, rgb.shape), 0, 255).astype(np.uint8) for sd in (5, 20)]
    assert likeness(rgb, rgb) == pytest.approx(1.0)
    assert 1.0 > likeness(rgb, noisy[0]) > likeness(rgb, noisy[1])


def test_two_flat_images_are_as_like_as_their_grey_values():
    """Without structure SSIM is (2ab + c) / (a² + b² + c) with c = (0.01 · 255)²."""
    one, two = np.full((32, 32, 3), 100, np.uint8), np.full((32, 32, 3), 130, np.uint8)
    c = 2.55**2
    assert likeness(one, two) == pytest.approx((2 * 100 * 130 + c) / (100**2 + 130**2 + c))


def test_the_lowest_quality_that_is_like_enough_is_taken():
    _, rgb, depth = IMAGES[0]
    coder = next(coder for coder in COLOR_CODERS if coder.name == "JPEG" and coder.side_px == 0)
    low, high = (_at_likeness(coder, rgb, depth, least) for least in (0.9, 0.99))
    assert low["quality"] < high["quality"]
    assert low["bytes"] < high["bytes"]
    assert high["ssim"] >= 0.99


def test_rows_become_lines_and_a_table():
    rows = list(_depth_rows(IMAGES))
    ours = next(row for row in rows if row["coder"] == "levels")
    assert all(row["exact"] for row in rows)
    assert ours["images"] == 2
    assert "of RVL's" in _line(ours)
    page = codings({"codings": {"runs": rows}})
    assert "| levels | 32 px, up to the gap |" in page

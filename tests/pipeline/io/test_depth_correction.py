"""A depth correction on disk and over an image."""

import json

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.depth_correction import (
    DepthCorrection,
    map_means,
    read_depth_correction,
    write_depth_correction,
)
from pipeline.types import DepthMap, DepthNoise

SIZE = (64, 48)
MAP = np.arange(12.0).reshape(3, 4) / 1000.0
FULL = DepthCorrection(
    SIZE,
    0.03,
    1.01,
    -0.004,
    MAP - (MAP * map_means()).sum(),
    DepthNoise(0.002, 0.0019, 2.36, 0.5),
    (0.5, 2.0),
    {"offset_m": np.array([0.02, 0.04]), "map_coefficients": np.zeros((3, 4, 2))},
)


def test_the_file_gives_the_same_numbers(tmp_path):
    path = tmp_path / "node_00" / "depth_correction.json"
    write_depth_correction(path, FULL)
    again = read_depth_correction(path)
    for name in ("size_px", "offset_m", "scale", "curvature_per_m", "noise", "range_m"):
        assert getattr(again, name) == getattr(FULL, name)
    np.testing.assert_array_equal(again.map_coefficients, FULL.map_coefficients)
    assert {name: value.tolist() for name, value in again.ci95.items()} == {
        name: value.tolist() for name, value in FULL.ci95.items()
    }


def test_without_terms_nothing_changes_and_an_unbounded_range_survives_the_file(tmp_path):
    path = tmp_path / "depth_correction.json"
    write_depth_correction(path, DepthCorrection(SIZE))
    again = read_depth_correction(path)
    assert again.range_m == (0.0, float("inf"))
    assert again.noise is None
    z_m = np.random.default_rng(0).uniform(0.4, 4.5, SIZE[::-1]).astype(np.float32)
    z_m[3, 4] = np.nan
    np.testing.assert_array_equal(again.apply(DepthMap(z_m)).z_m, z_m)


def test_an_image_and_its_pixels_are_corrected_alike():
    rng = np.random.default_rng(1)
    z_m = rng.uniform(0.4, 4.5, SIZE[::-1]).astype(np.float32)
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    pixels = np.stack([u, v], axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(
        FULL.apply(DepthMap(z_m)).z_m.ravel(), FULL.corrected_m(z_m.ravel(), pixels), rtol=1e-6
    )


def test_every_term_is_the_printed_formula():
    z_m = np.array([1.0, 2.0])
    pixels = np.zeros((2, 2))
    plain = DepthCorrection(SIZE, 0.03, 1.01, -0.004)
    np.testing.assert_allclose(plain.corrected_m(z_m, pixels), 0.03 + 1.01 * z_m - 0.004 * z_m**2)
    flat = DepthCorrection(SIZE, map_coefficients=np.full((3, 4), 0.01))
    np.testing.assert_allclose(flat.corrected_m(z_m, pixels), 1.01 * z_m)


def test_the_map_has_its_mean_where_the_coefficients_say():
    large = DepthCorrection((640, 480), map_coefficients=MAP)
    assert large.map_over_image().mean() == pytest.approx((MAP * map_means()).sum(), abs=1e-7)
    assert map_means().sum() == pytest.approx(1.0)
    assert abs(FULL.map_over_image().mean()) < 1e-5


def test_depth_that_would_lie_behind_the_camera_is_unknown():
    z_m = np.full(SIZE[::-1], 0.2, np.float32)
    assert not DepthCorrection(SIZE, offset_m=-0.3).apply(DepthMap(z_m)).valid.any()


def test_other_images_are_refused():
    with pytest.raises(InputError, match="64 x 48 pixels, and this one has 32 x 24"):
        FULL.apply(DepthMap(np.ones((24, 32), np.float32)))
    with pytest.raises(InputError, match="Relative"):
        FULL.apply(DepthMap(np.ones((48, 64), np.float32), "relative"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "something else"}, "no depth correction"),
        ({"scale": "one"}, "no number"),
        ({"offset_m": None}, "no number"),
        ({"map_coefficients": [[0.0, 0.0]]}, "no number"),
        ({"noise": {"s0_m": -1.0, "s1_m": 0.0, "p": 0.0, "q": 0.0}}, "impossible"),
        ({"scale": 1000.0}, "units"),
        ({"ci95": 3}, "lacks a term"),
    ],
)
def test_a_broken_or_foreign_file_is_refused_in_a_sentence(tmp_path, change, said):
    path = tmp_path / "depth_correction.json"
    write_depth_correction(path, FULL)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=said):
        read_depth_correction(path)


@pytest.mark.parametrize("text", ["{", "[1]", "[" * 100_000, '{"width": 3}', '{"scale": NaN}'])
def test_no_json_of_ours_is_refused(tmp_path, text):
    path = tmp_path / "depth_correction.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"calibrate again|JSON"):
        read_depth_correction(path)
    with pytest.raises(InputError, match="does not exist"):
        read_depth_correction(tmp_path / "none.json")

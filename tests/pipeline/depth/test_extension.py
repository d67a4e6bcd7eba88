"""A field continued into holes: known answers."""

import numpy as np
import pytest

from pipeline.depth.extension import SLOPE_SHARE, WINDOW_PX, _predict, _upsample, extrapolated

GREY = np.full((240, 320, 3), 90, np.uint8)
HOLE = np.s_[90:150, 120:200]


def known_but(hole, shape=(240, 320)):
    known = np.ones(shape, bool)
    known[hole] = False
    return known


def test_a_constant_stays_what_it_is():
    known = known_but(HOLE)
    field = np.where(known, np.float32(0.25), np.float32(0.0))
    np.testing.assert_allclose(extrapolated(field, known, GREY), 0.25, atol=1e-6)


def test_a_hole_takes_the_value_of_the_side_of_its_own_colour():
    rgb = GREY.copy()
    rgb[:, 160:] = 200
    side = np.where(np.arange(320) < 160, np.float32(0.1), np.float32(-0.3))
    field = np.broadcast_to(side, (240, 320)).copy()
    known = known_but(HOLE)
    filled = extrapolated(np.where(known, field, np.float32(0.0)), known, rgb)
    away = np.abs(np.arange(320) - 159.5) > 6  # the colours are blurred before they are compared
    np.testing.assert_allclose(filled[:, away], field[:, away], atol=1e-3)


def test_a_slope_goes_on_past_the_rim_and_fades():
    slope = 0.004
    field = np.broadcast_to(slope * np.arange(320, dtype=np.float32), (240, 320)).copy()
    known = known_but(np.s_[:, 200:])
    filled = extrapolated(np.where(known, field, np.float32(0.0)), known, GREY)
    steps = np.diff(filled[120, 199:])
    assert 0.5 * SLOPE_SHARE * slope < steps[:8].mean() <= slope
    assert steps[-30:].mean() < 0.5 * steps[:8].mean()


@pytest.mark.parametrize("away", [(WINDOW_PX, 0), (-WINDOW_PX, 0), (0, WINDOW_PX), (0, -WINDOW_PX)])
def test_a_pixel_is_predicted_from_any_side_of_its_window(away):
    """By one known pixel at the window's rim, and by none beyond it."""
    known = np.zeros((20, 20), bool)
    v, u = 10, 9
    at, beyond = (v + away[0], u + away[1]), (v + 4 * away[0] // 3, u + 4 * away[1] // 3)
    known[at] = known[beyond] = True
    values = np.zeros((20, 20, 3), np.float32)
    values[at], values[beyond] = (0.25, 0.01, -0.02), (9.0, 0.0, 0.0)
    weights, predicted = np.ones((7, 7)), np.empty(3)
    _predict(values, known, np.zeros((20, 20, 3), np.float32), weights, v, u, predicted)
    np.testing.assert_allclose(predicted[0], 0.25 - away[0] * 0.01 + away[1] * 0.02, rtol=1e-6)
    np.testing.assert_allclose(predicted[1:], [0.97 * 0.01, -0.97 * 0.02], rtol=1e-6)


def test_between_coarse_pixels_of_one_colour_a_plane_stays_a_plane():
    step, shape = 3, (30, 42)
    down, right = np.indices(shape).astype(np.float32)
    plane = 0.5 + 0.02 * down - 0.03 * right
    coarse = np.ascontiguousarray(plane[1::step, 1::step])
    field, known = np.zeros(shape, np.float32), np.zeros(shape, bool)
    _upsample(field, known, np.zeros((*shape, 3)), coarse, np.zeros((*coarse.shape, 3)), step)
    inside = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(field[inside], plane[inside], atol=1e-5)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_slope_loses_three_per_cent_of_the_mean_of_the_rings_before(axis):
    """Behind a straight rim slopes fall as l^k, with 1 = .97 (w1 / l + w2 / l^2 + w3 / l^3)."""
    shape = (320, 240) if axis == 0 else (240, 320)
    field = 0.004 * np.indices(shape)[axis].astype(np.float32)
    known = np.indices(shape)[axis] < 200
    filled = extrapolated(np.where(known, field, np.float32(0.0)), known, np.full((*shape, 3), 90, np.uint8))
    weights = np.exp(-(np.arange(1, 4) ** 2) / (2.0 * 1.7**2))
    decay = max(np.roots([1.0, *(-0.97 * weights / weights.sum())]).real)
    steps = np.diff(np.moveaxis(filled, axis, 0)[:, 120])
    assert steps[270] / steps[220] == pytest.approx(decay**50, rel=0.01)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_opposite_border_has_no_effect_on_a_hole(axis):
    """A ramp of 0.05 over the image, and a hole 4 pixels from its border."""
    shape, hole = ((320, 240), np.s_[4:60, 60:180]) if axis == 0 else ((240, 320), np.s_[60:180, 4:60])
    field = 0.05 / 320 * np.indices(shape)[axis].astype(np.float32)
    known = known_but(hole, shape)
    changed = field.copy()
    np.moveaxis(changed, axis, 0)[-1] += 0.02
    filled, other = (
        extrapolated(np.where(known, one, np.float32(0.0)), known, np.full((*shape, 3), 90, np.uint8))[hole]
        for one in (field, changed)
    )
    np.testing.assert_allclose(filled, other, atol=1e-6)
    assert np.abs(filled - field[hole]).max() < 0.003


@pytest.mark.parametrize("shape", [(2, 2), (5, 700), (37, 53), (480, 640), (300, 1280)])
@pytest.mark.parametrize("share", [0.02, 0.9])
def test_what_is_known_stays_and_the_rest_is_finite_whatever_the_size(shape, share):
    rng = np.random.default_rng(0)
    known = rng.random(shape) < share
    known[0, 0] = True
    field = np.where(known, rng.normal(size=shape), 0.0).astype(np.float32)
    filled = extrapolated(field, known, rng.integers(0, 256, (*shape, 3), np.uint8))
    np.testing.assert_array_equal(filled[known], field[known])
    assert np.isfinite(filled).all()

"""Depth images of a camera that stands, averaged pixel by pixel."""

import time

import numpy as np
import pytest

from pipeline.acquisition.planes import inverse_depth
from pipeline.recording.still import WITHIN_SD, step_at, voted
from pipeline.types import DepthMap, DepthNoise

LAW = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)
SHAPE = (120, 160)


def flat(*shape, z_m=2.0):
    return np.full(shape, 1.0 / z_m, np.float32)


def slanted():
    """1/z of a wall from 1 to 5 m."""
    return 1.0 / np.broadcast_to(np.linspace(1.0, 5.0, SHAPE[1]), SHAPE)


def law_of(x):
    return LAW.sd_m(1.0 / x) * x**2


def noisy(x, frames, seed=0, factor=1.0):
    rng = np.random.default_rng(seed)
    return (x + factor * law_of(x) * rng.standard_normal((frames, *x.shape))).astype(np.float32)


def errors(vote, x):
    """Error of 1/z in standard deviations of one measurement."""
    return (1.0 / vote.depth.z_m - x) / law_of(x)


@pytest.mark.parametrize("frames", [1, 2, 4, 16, 64])
def test_noise_falls_with_the_root_of_the_frames(frames):
    x = slanted()
    vote = voted(noisy(x, frames), LAW)
    known = vote.depth.valid
    assert known.mean() > 0.99
    assert np.std(errors(vote, x)[known]) * np.sqrt(frames) == pytest.approx(1.0, abs=0.1)
    assert not vote.flickering.any()


def test_the_deviation_of_every_pixel_is_that_of_its_error():
    x = slanted()
    for frames in (16, 64):
        vote = voted(noisy(x, frames), LAW)
        sd = vote.sd_m / vote.depth.z_m**2 / law_of(x)
        assert np.sqrt(np.mean(sd**2)) * np.sqrt(frames) == pytest.approx(1.0, abs=0.1)
    assert np.abs(errors(vote, x) / sd).max() < 7.0  # 64 measurements: sd is known to a tenth


def test_the_noise_stops_at_the_sensors_step():
    """Steps of 1/z far above the noise: no average tells more than which step it is."""
    x = np.random.default_rng(1).uniform(0.2, 1.0, SHAPE)
    step = 4.0 * law_of(x).mean()
    deviations, off = [], []
    for frames in (1, 4, 16, 64):
        stack = np.round(noisy(x, frames, factor=0.1) / step) * step
        vote = voted(stack.astype(np.float32), LAW)
        deviations.append(np.median(vote.sd_m / vote.depth.z_m**2))
        off.append(np.sqrt(np.nanmean((1.0 / vote.depth.z_m - x) ** 2)))
    assert deviations[-1] == pytest.approx(step / np.sqrt(12.0), rel=0.1)
    assert off[-1] == pytest.approx(step / np.sqrt(12.0), rel=0.1)
    assert deviations[0] > deviations[-1]


def test_until_the_step_the_noise_still_falls():
    x = slanted()
    step = 0.5 * law_of(x).mean()
    for frames in (4, 16):
        vote = voted(np.round(noisy(x, frames) / step).astype(np.float32) * np.float32(step), LAW)
        known = vote.depth.valid
        assert np.std(errors(vote, x)[known]) * np.sqrt(frames) == pytest.approx(1.0, abs=0.1)


def test_steps_are_found_in_the_measured_levels():
    rng = np.random.default_rng(0)
    disparity = np.round(rng.uniform(0.2, 1.0, 100_000) / 0.003) * 0.003
    np.testing.assert_allclose(step_at(np.array([0.3, 0.6, 0.9]), disparity), 0.003, rtol=1e-6)
    millimetres_m = np.round(1000.0 * rng.uniform(1.0, 4.0, 100_000)) / 1000.0
    found = step_at(np.array([1.0 / 1.5, 1.0 / 3.0]), 1.0 / millimetres_m)
    np.testing.assert_allclose(found, [0.001 / 1.5**2, 0.001 / 3.0**2], rtol=0.1)
    assert step_at(np.array([0.5]), rng.uniform(0.2, 1.0, 100_000))[0] < 1e-4
    assert step_at(np.array([0.5]), np.array([0.5, 0.5]))[0] == 0.0


def test_a_few_wrong_measurements_are_outvoted():
    x = slanted()
    stack = noisy(x, 20)
    stack[3:9] *= 1.4  # someone walks by in six of twenty frames
    vote = voted(stack, LAW)
    assert not vote.moving.any()
    assert vote.counts.max() <= 14
    assert np.abs(errors(vote, x)).max() < 2.5


def test_what_moves_is_masked_with_its_neighbours():
    stack = flat(12, *SHAPE)
    stack[6:, 50:55, 60:64] = 1.0 / 1.5
    vote = voted(stack, LAW)
    expected = np.zeros(SHAPE, bool)
    expected[49:56, 59:65] = True
    for corner in ((49, 59), (49, 64), (55, 59), (55, 64)):
        expected[corner] = False  # next to a corner, in whose 3 x 3 pixels only four move
    np.testing.assert_array_equal(vote.moving, expected)
    np.testing.assert_array_equal(vote.depth.valid, ~expected)
    np.testing.assert_array_equal(np.isfinite(vote.sd_m), ~expected)
    np.testing.assert_array_equal(vote.counts == 0, expected)


def test_a_resting_edge_that_jumps_is_masked_alone():
    stack = flat(12, *SHAPE)
    stack[:, :, 80:] = 1.0 / 1.5
    stack[6:, :, 80] = 1.0 / 2.0
    vote = voted(stack, LAW)
    assert np.unique(np.nonzero(vote.moving)[1]).tolist() == [80]


def test_a_spread_up_to_three_deviations_is_no_motion():
    x, sd = 0.5, float(law_of(np.array(0.5)))
    for factor, moves in ((0.9, False), (1.1, True)):
        stack = flat(20, *SHAPE)
        off = factor * WITHIN_SD * sd / 1.4826  # the median distance from the median
        stack[:, 10, 10] = x + np.linspace(-2.0 * off, 2.0 * off, 20)
        assert voted(stack, LAW).moving[10, 10] == moves


def test_flickering_pixels_are_filled_by_what_was_measured():
    stack = flat(16, *SHAPE)
    sd = float(law_of(np.array(0.5)))
    stack[:, 20:24, 20] = 0.0
    stack[5:9, 20, 20] = 0.5  # a quarter of the frames: no flicker
    stack[5:8, 21, 20] = 0.5 + sd * np.array([-1.0, 0.0, 1.0])  # three that agree
    stack[5:7, 22, 20] = 0.5  # too few
    stack[[1, 5, 8], 23, 20] = 0.5, 0.5, 0.7  # one that does not agree
    vote = voted(stack, LAW)
    assert vote.flickering[:, 20].nonzero()[0].tolist() == [21, 22, 23]
    assert vote.flickering.sum() == 3
    assert vote.depth.valid[20:24, 20].tolist() == [True, True, False, False]
    assert vote.counts[20:24, 20].tolist() == [4, 3, 0, 0]
    assert vote.depth.z_m[21, 20] == pytest.approx(2.0, rel=1e-5)
    assert vote.sd_m[21, 20] == pytest.approx(sd / np.sqrt(3.0) * 2.0**2, rel=0.01)  # sample sd is 1 sd


def test_pixels_that_no_frame_measured_stay_unknown():
    stack = flat(8, *SHAPE)
    stack[:, :, :30] = 0.0
    vote = voted(stack, LAW)
    assert not vote.depth.valid[:, :30].any()
    assert vote.depth.valid[:, 30:].all()
    assert not vote.flickering.any()
    assert not vote.moving.any()
    nothing = voted(np.zeros((3, 4, 5), np.float32), LAW)
    assert not nothing.depth.valid.any()


def test_two_that_disagree_are_no_depth():
    stack = flat(2, *SHAPE)
    stack[1, 40, 40] = 1.0
    vote = voted(stack, LAW)
    assert np.argwhere(~vote.depth.valid).tolist() == [[40, 40]]


def test_a_noisier_sensor_is_no_moving_scene():
    x = slanted()
    vote = voted(noisy(x, 32, factor=5.0), LAW)
    assert vote.depth.coverage > 0.999
    assert np.std(errors(vote, x)) * np.sqrt(32) == pytest.approx(5.0, rel=0.1)


def test_inverse_depth_is_zero_where_unknown():
    z_m = np.array([[2.0, np.nan, 0.0, 4.0]], np.float32)
    assert inverse_depth(DepthMap(z_m)).tolist() == [[0.5, 0.0, 0.0, 0.25]]


def test_sixty_frames_a_second():
    stack = noisy(1.0 / np.broadcast_to(np.linspace(1.0, 5.0, 640), (480, 640)), 64)
    voted(stack[:, :8, :8].copy(), LAW)  # compiles
    seconds = []
    for _ in range(3):
        started = time.process_time()
        voted(stack, LAW)
        seconds.append(time.process_time() - started)
    assert len(stack) / min(seconds) > 30.0  # twice that on a machine that does nothing else

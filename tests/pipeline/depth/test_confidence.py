from itertools import pairwise

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.depth import align_depth
from pipeline.depth.alignment import AlignmentResult
from pipeline.depth.completion import CompletedDepth
from pipeline.depth.confidence import (
    confidence_of,
    confirmed_relief,
    distance_to_measured,
    features_of_completion,
    judge,
    meet_rims,
)
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 240, 320
HOLE = np.s_[80:160, 120:200]
DIAGONAL_PX = np.hypot(HEIGHT_PX, WIDTH_PX)


def floor_m() -> np.ndarray:
    """A slanted, slightly waved floor 2 to 4 m away."""
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    return 4.0 - 2.0 * v / HEIGHT_PX + 0.1 * np.sin(u / 40.0)


def with_hole(z_m: np.ndarray) -> DepthMap:
    z_m = z_m.astype(np.float32)
    z_m[HOLE] = np.nan
    return DepthMap(z_m)


def grey() -> np.ndarray:
    return np.full((HEIGHT_PX, WIDTH_PX, 3), 128, np.uint8)


def step() -> tuple[np.ndarray, np.ndarray]:
    """A box 1 m away before a wall 2 m away, of other colours; its edge goes through the hole."""
    z_m, rgb = np.full((HEIGHT_PX, WIDTH_PX), 2.0), grey()
    z_m[:, 160:], rgb[:, 160:] = 1.0, 20
    return z_m, rgb


def blurred(z_m: np.ndarray, width_px: int = 16) -> np.ndarray:
    """The network's usual fault: edges along the columns become ramps."""
    kernel = np.ones(width_px) / width_px
    padded = np.pad(z_m, ((0, 0), (width_px // 2, width_px // 2 - 1)), mode="edge")
    return np.apply_along_axis(np.convolve, 1, padded, kernel, "valid")


@pytest.mark.parametrize("mode", ["affine_depth", "affine_inverse", "local"])
def test_a_perfect_network_fills_perfectly(mode):
    sensor = with_hole(floor_m())
    alignment = align_depth(DepthMap(floor_m().astype(np.float32)), sensor, mode)
    met = meet_rims(alignment, sensor, grey())
    np.testing.assert_allclose(met.z_m, floor_m(), rtol=0.05 if mode == "local" else 2e-4)
    np.testing.assert_array_equal(met.z_m[sensor.valid], alignment.depth.z_m[sensor.valid])


def test_a_biased_network_is_bent_to_the_rims():
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    bias = np.exp(0.15 * np.sin(2.0 * np.pi * u / 300.0) * np.cos(2.0 * np.pi * v / 260.0))
    sensor = with_hole(floor_m())
    alignment = align_depth(DepthMap((floor_m() * bias).astype(np.float32)), sensor, "affine_depth")
    before, after = (
        np.abs(z_m / floor_m() - 1.0)[HOLE]
        for z_m in (alignment.depth.z_m, meet_rims(alignment, sensor, grey()).z_m)
    )
    assert after.mean() < 0.5 * before.mean()
    assert after[0].max() < 0.01


def test_a_network_that_knows_nothing_does_no_harm():
    noise = np.exp(np.random.default_rng(0).normal(0.0, 0.3, (HEIGHT_PX, WIDTH_PX)))
    wall_m = np.full((HEIGHT_PX, WIDTH_PX), 2.5)
    sensor = with_hole(wall_m)
    alignment = align_depth(DepthMap((2.5 * noise).astype(np.float32)), sensor, "median")
    np.testing.assert_allclose(meet_rims(alignment, sensor, grey()).z_m[HOLE], 2.5, rtol=1e-4)


def test_a_blurred_edge_in_a_hole_follows_the_colours():
    z_m, rgb = step()
    sensor = with_hole(z_m)
    alignment = align_depth(DepthMap(blurred(z_m).astype(np.float32)), sensor, "affine_depth")
    close = [
        np.mean(np.abs(filled_m / z_m - 1.0)[HOLE] < 0.05)
        for filled_m in (alignment.depth.z_m, meet_rims(alignment, sensor, rgb).z_m)
    ]
    assert close[1] > max(0.9, close[0])


def test_pixels_between_two_surfaces_fly_and_those_of_the_surfaces_do_not():
    z_m, _ = step()
    sensor = with_hole(z_m)
    alignment = align_depth(DepthMap(blurred(z_m, 6).astype(np.float32)), sensor, "none")
    judged = judge(alignment, sensor, grey(), 1.0, 0.0)
    met_m = meet_rims(alignment, sensor, grey()).z_m
    assert judged.flying[HOLE].any()
    assert ((met_m > 1.02) & (met_m < 1.96))[judged.flying].all()
    assert np.isnan(judged.depth.z_m[judged.flying]).all()
    smooth = judge(
        align_depth(DepthMap(floor_m().astype(np.float32)), with_hole(floor_m())),
        with_hole(floor_m()),
        grey(),
        1.0,
        0.0,
    )
    assert not smooth.flying.any()
    assert smooth.depth.coverage == 1.0


@pytest.mark.parametrize("reach_px", [0, 5, 20])
def test_nothing_is_filled_beyond_the_reach(reach_px):
    sensor = with_hole(floor_m())
    alignment = align_depth(DepthMap(floor_m().astype(np.float32)), sensor)
    judged = judge(alignment, sensor, grey(), (reach_px + 0.5) / DIAGONAL_PX, 0.0)
    expected = np.ones((HEIGHT_PX, WIDTH_PX), bool)
    expected[80 + reach_px : 160 - reach_px, 120 + reach_px : 200 - reach_px] = False
    differs = np.argwhere(judged.depth.valid != expected)
    np.testing.assert_array_equal(judged.out_of_reach, ~judged.depth.valid)
    assert len(differs) <= 0.01 * sensor.z_m.size
    assert judged.depth.valid[sensor.valid].all()


def test_confidence_falls_inwards_and_with_the_residual():
    sensor = with_hole(floor_m())
    rough = np.exp(np.random.default_rng(1).normal(0.0, 0.06, (HEIGHT_PX, WIDTH_PX)))
    good, bad = (
        judge(align_depth(DepthMap(z_m.astype(np.float32)), sensor), sensor, grey(), 1.0, 0.0).confidence
        for z_m in (floor_m(), floor_m() * rough)
    )
    assert good.dtype == np.float32
    assert good.min() >= 0.0
    assert good.max() <= 1.0
    inwards = good[120, 120:160]
    assert (np.diff(inwards) < 0.0).all()
    assert inwards[0] > 0.95
    assert (bad[HOLE] < good[HOLE]).all()
    assert good[sensor.valid].min() > 0.99
    assert bad[sensor.valid].mean() < 0.75


@pytest.mark.parametrize(("ratio", "agrees"), [(1.049, 1.0), (1.051, 0.0), (0.951, 1.0), (0.949, 0.0)])
def test_depth_agrees_with_the_sensor_within_five_per_cent_of_the_sensors(ratio, agrees):
    sensor_m = floor_m().astype(np.float32)
    aligned = AlignmentResult(DepthMap(ratio * sensor_m), "median", {}, 0.0, 0.0)
    everywhere = np.zeros(sensor_m.shape, np.float32)
    confidence = confidence_of(aligned, DepthMap(sensor_m), everywhere)
    np.testing.assert_allclose(confidence, agrees, atol=1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_relief_is_the_share_of_slopes_that_the_sensor_confirms_off_its_edges(axis):
    """A depth step of 0.3 at which the network has only 0.1 is an edge, and does not count."""
    place = np.indices((HEIGHT_PX, WIDTH_PX))[axis].astype(np.float32)
    log_z = 0.002 * place
    log_p = 0.6 * log_z + np.where(place > 100, np.float32(0.3), np.float32(0.0))
    log_z += np.where(place > 100, np.float32(0.1), np.float32(0.0))
    everywhere = np.ones(place.shape, bool)
    assert confirmed_relief(log_z, log_p, everywhere) == pytest.approx(0.6, abs=1e-3)


def test_what_tells_of_completed_depth_is_worked_out():
    aligned, completed = np.full((2, 2, 3), 2.0, np.float32)
    aligned[0, 0], completed[1] = np.nan, 3.0
    distance = np.full((2, 3), 0.1, np.float32)
    log_scale = np.full((2, 3), -2.2, np.float32)  # half more than the usual -2.7
    features = features_of_completion(
        DepthMap(aligned), CompletedDepth(DepthMap(completed), log_scale), distance
    )
    same, apart = np.log(0.005), np.log(np.log(1.5) + 0.005)
    dissent = [[same, same, same], [apart, apart, apart]]
    for found, expected in zip(features, (0.5, 0.25, np.log(0.1), dissent), strict=True):
        np.testing.assert_allclose(found, np.broadcast_to(expected, (2, 3)), rtol=1e-5)


def test_distances_are_shares_of_the_diagonal():
    measured = np.ones((300, 400), bool)
    measured[:, 100:] = False
    assert distance_to_measured(measured)[150, 149] == pytest.approx(50 / 500, rel=1e-3)


def test_less_is_kept_the_more_confidence_is_asked_for():
    sensor = with_hole(floor_m())
    alignment = align_depth(DepthMap(floor_m().astype(np.float32)), sensor)
    kept = [judge(alignment, sensor, grey(), 1.0, least).depth.valid for least in (0.0, 0.98, 0.99, 1.0)]
    assert kept[0].all()
    assert all((more | less == more).all() and (more != less).any() for more, less in pairwise(kept))


def test_unknown_inferred_depth_stays_unknown_and_never_flies():
    inferred_m = floor_m().astype(np.float32)
    inferred_m[:, :30] = np.nan
    sensor = with_hole(floor_m())
    judged = judge(align_depth(DepthMap(inferred_m), sensor), sensor, grey(), 1.0, 0.0)
    unknown = np.isnan(inferred_m)
    np.testing.assert_array_equal(np.isnan(judged.confidence), unknown)
    np.testing.assert_array_equal(judged.depth.valid, ~unknown)
    assert not (judged.flying | judged.out_of_reach)[unknown].any()


def test_without_any_sensor_depth_everything_is_out_of_reach():
    nothing = DepthMap(np.full((HEIGHT_PX, WIDTH_PX), np.nan, np.float32))
    alignment = align_depth(DepthMap(floor_m().astype(np.float32)), nothing, "none")
    judged = judge(alignment, nothing, grey(), 0.25, 0.0)
    assert judged.out_of_reach.all()
    assert judged.depth.coverage == 0.0
    assert judged.confidence.max() < 1e-6


def test_images_of_other_sizes_and_shares_out_of_range_are_refused():
    sensor = with_hole(floor_m())
    alignment = align_depth(DepthMap(floor_m().astype(np.float32)), sensor)
    with pytest.raises(InputError, match="register the images first"):
        judge(alignment, sensor, grey()[:100], 0.25, 0.0)
    with pytest.raises(InputError, match="register the images first"):
        judge(alignment, DepthMap(sensor.z_m[:100]), grey(), 0.25, 0.0)
    with pytest.raises(InputError, match=r"reach of -1 .* try 0\.25"):
        judge(alignment, sensor, grey(), -1, 0.0)
    with pytest.raises(InputError, match=r"confidence of 1\.5 .* try 0\.5"):
        judge(alignment, sensor, grey(), 0.25, 1.5)

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.depth import CompletedDepth, align_depth, complete, judge
from pipeline.depth.completion import enlarged
from pipeline.depth.confidence import COMPLETED_FROM, distance_to_measured, odds_of_completion
from pipeline.depth.slopes import (
    CHANNELS_IN,
    CHANNELS_OUT,
    DISTANCES,
    MULTIPLE,
    Grid,
    coarse,
    network_input,
    solved,
)
from pipeline.types import DepthMap

SHAPE = (120, 160)
SURE, UNSURE = -7.0, 2.0


def a_wall(shape=(480, 640)):
    """A wall seen at a slant: 1/z is linear in the pixel."""
    y, x = np.indices(shape)
    return (1.0 / (0.3 + 0.3 * x / shape[1] + 0.05 * y / shape[0])).astype(np.float32)


def with_disc(z_m, radius_px, centre=(0.5, 0.5)):
    y, x = np.indices(z_m.shape)
    disc = np.hypot(y - centre[0] * z_m.shape[0], x - centre[1] * z_m.shape[1]) < radius_px
    return DepthMap(np.where(disc, np.float32(np.nan), z_m)), disc


def grid_of(log_z, unknown):
    return Grid(
        np.where(unknown, 0.0, log_z).astype(np.float32), ~unknown, np.full((*log_z.shape, 3), 90, np.uint8)
    )


def answer(log_z, start, scales):
    """What a network says that knows the truth, each family of differences with its own log scale."""
    output = np.zeros((CHANNELS_OUT, *log_z.shape), np.float32)
    output[0], output[1] = log_z - start, scales[0]
    for level, distance in enumerate(DISTANCES):
        output[2 + 4 * level, :, :-distance] = log_z[:, distance:] - log_z[:, :-distance]
        output[4 + 4 * level, :-distance] = log_z[distance:] - log_z[:-distance]
        output[[3 + 4 * level, 5 + 4 * level]] = scales[1 + level]
    return output


@pytest.fixture(scope="module")
def relief():
    y, x = np.indices(SHAPE)
    return (0.8 + 0.3 * np.sin(x / 17.0) + 0.2 * np.cos(y / 11.0) + 0.3 * (x > 90)).astype(np.float32)


@pytest.mark.parametrize(
    "scales", [(SURE, UNSURE, UNSURE, UNSURE), (UNSURE, SURE, UNSURE, UNSURE), (-1.0, -5.0, -4.0, -3.0)]
)
def test_true_differences_give_the_true_depth_whichever_of_them_is_sure(relief, scales):
    y, x = np.indices(SHAPE)
    unknown = np.hypot(y - 60, x - 90) < 25
    grid = grid_of(relief, unknown)
    _, start = network_input(grid)
    log_z = solved(grid, start, answer(relief, start, scales))
    np.testing.assert_array_equal(log_z[~unknown], relief[~unknown])
    np.testing.assert_allclose(log_z, relief, atol=2e-3)


def test_a_pixel_between_two_measured_ones_lies_where_the_surer_difference_puts_it():
    grid = Grid(np.array([[0.0, 0.0, 1.0]], np.float32), np.array([[True, False, True]]), np.zeros((1, 3, 3)))
    output = np.zeros((CHANNELS_OUT, 1, 3))
    output[1::2] = UNSURE
    output[3, 0, 0], output[3, 0, 1] = -4.0, -4.0 + 0.5 * np.log(3.0)  # variances in the ratio 1 : 3
    log_z = solved(grid, np.zeros((1, 3)), output)
    assert log_z[0, 1] == pytest.approx(0.25, abs=0.01)  # 3 parts of 0 and one of 1


def test_an_unsure_difference_is_an_edge(relief):
    unknown = np.zeros(SHAPE, bool)
    unknown[40:80, 60:120] = True
    two = np.where(np.indices(SHAPE)[1] < 90, 0.5, 1.0).astype(np.float32)
    grid = grid_of(two, unknown)
    output = np.zeros((CHANNELS_OUT, *SHAPE))
    output[1::2] = UNSURE
    output[[3, 5]] = SURE
    output[3, :, 89] = UNSURE  # flat everywhere, but nobody knows what happens here
    log_z = solved(grid, network_input(grid)[1], output)
    np.testing.assert_allclose(log_z, two, atol=1e-2)


def test_the_grid_takes_the_middle_most_measured_pixel_of_a_cell_and_averages_colours():
    z_m = np.arange(1.0, 1.0 + 8 * 640).reshape(8, 640).astype(np.float32)
    known = np.ones(z_m.shape, bool)
    known[1:3, 1:3] = False  # the middle of the first cell of 4 x 4
    known[4:8, 4:8] = False  # a whole cell
    rgb = np.zeros((*z_m.shape, 3), np.uint8)
    rgb[:4, :2] = 200
    grid = coarse(z_m, known, rgb)
    assert grid.log_z.shape == (2, 160)
    assert np.exp(grid.log_z[0, 0]) == pytest.approx(2.0)  # beside the middle, of those measured
    assert np.exp(grid.log_z[0, 1]) == pytest.approx(z_m[1, 5])
    assert not grid.known[1, 1]
    assert grid.known.sum() == grid.known.size - 1
    np.testing.assert_array_equal(grid.rgb[0, 0], [100, 100, 100])


def test_a_pixel_of_the_last_broken_cell_counts():
    z_m, known = np.full((481, 641), 2.0, np.float32), np.zeros((481, 641), bool)
    known[480, 640] = True
    grid = coarse(z_m, known, np.zeros((481, 641, 3), np.uint8))
    assert grid.known.shape == (121, 161)
    assert np.argwhere(grid.known).tolist() == [[120, 160]]
    alone = complete(DepthMap(np.where(known, z_m, np.nan)), np.zeros((481, 641, 3), np.uint8))
    assert np.isfinite(alone.depth.z_m).all()


def test_the_network_sees_a_padded_grid_and_only_what_was_measured(relief):
    unknown = np.zeros(SHAPE, bool)
    unknown[30:60, 30:60] = True
    planes, start = network_input(grid_of(relief, unknown))
    assert planes.shape == (CHANNELS_IN, 128, 160)
    assert not planes.shape[1] % MULTIPLE
    assert not planes[:, 120:].any()
    other, _ = network_input(grid_of(relief + 5.0 * unknown, unknown))
    np.testing.assert_array_equal(planes, other)
    nearer, _ = network_input(grid_of(relief + np.float32(0.7), unknown))  # log depth: a scale is a shift
    np.testing.assert_allclose(planes, nearer, atol=1e-4)
    assert set(start[unknown]) <= set(relief[~unknown])


@pytest.mark.parametrize("shape", [(480, 640), (240, 320), (360, 640), (97, 131), (720, 1280)])
def test_what_is_measured_stays_and_what_is_not_becomes_dense(shape):
    z_m = a_wall(shape)
    sensor, disc = with_disc(z_m, 0.1 * shape[1])
    rgb = np.full((*shape, 3), 128, np.uint8)
    completed = complete(sensor, rgb)
    np.testing.assert_array_equal(completed.depth.z_m[~disc], z_m[~disc])
    assert np.isfinite(completed.depth.z_m).all()
    assert np.isfinite(completed.log_scale).all()


@pytest.mark.parametrize("radius_px", [10, 20, 40, 75])
def test_a_wall_goes_on_behind_its_hole(radius_px):
    z_m = a_wall()
    sensor, disc = with_disc(z_m, radius_px)
    completed = complete(sensor, np.full((480, 640, 3), 128, np.uint8))
    error = np.abs(completed.depth.z_m / z_m - 1.0)[disc]
    assert error.mean() < 0.012
    assert completed.log_scale[disc].mean() < np.log(0.05)


def test_completion_does_not_care_in_what_unit_depth_is():
    z_m = a_wall()
    sensor, disc = with_disc(z_m, 50)
    rgb = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    near, far = complete(sensor, rgb), complete(DepthMap(3.0 * sensor.z_m), rgb)
    np.testing.assert_allclose(far.depth.z_m[disc], 3.0 * near.depth.z_m[disc], rtol=2e-3)


def test_confidence_falls_with_doubt_and_with_dissent():
    shape = (48, 64)
    distance = np.full(shape, 0.05, np.float32)
    completed = CompletedDepth(DepthMap(np.full(shape, 2.0, np.float32)), np.full(shape, -3.0, np.float32))
    agreed = odds_of_completion(completed.depth, completed, distance)
    doubted = odds_of_completion(
        completed.depth, CompletedDepth(completed.depth, completed.log_scale + 1.0), distance
    )
    dissented = odds_of_completion(DepthMap(np.full(shape, 2.3, np.float32)), completed, distance)
    unaligned = odds_of_completion(DepthMap(np.full(shape, np.nan, np.float32)), completed, distance)
    assert (doubted < agreed).all()
    assert (dissented < agreed).all()
    np.testing.assert_array_equal(unaligned, agreed)


def test_a_plane_of_the_grid_keeps_its_places_at_full_size():
    x = np.indices((121, 161), dtype=np.float32)[1]
    whole = enlarged(x, (483, 641))  # four pixels a cell, some over
    assert whole.shape == (483, 641)
    np.testing.assert_allclose(whole[100, 2:636], (np.arange(2, 636) - 1.5) / 4.0, atol=1e-3)


def test_a_judged_frame_is_the_aligned_depth_at_rims_and_the_completion_within():
    z_m = a_wall()
    sensor, disc = with_disc(z_m, 60)
    rgb = np.full((480, 640, 3), 128, np.uint8)
    aligned = align_depth(DepthMap(2.0 * z_m), sensor)
    completed = CompletedDepth(DepthMap(1.2 * z_m), np.full(z_m.shape, -4.0, np.float32))
    judged = judge(aligned, sensor, rgb, 0.1, 0.0, completed)
    np.testing.assert_array_equal(judged.depth.z_m[~disc], aligned.depth.z_m[~disc])
    ratio = judged.depth.z_m / z_m
    distance = distance_to_measured(sensor.valid)
    assert np.nanmedian(ratio[disc & (distance < 0.003)]) < 1.02
    assert np.nanmedian(ratio[disc & (distance > 0.06)]) > 1.18
    half = disc & (np.abs(distance - COMPLETED_FROM) < 0.0007)
    assert np.nanmedian(ratio[half]) == pytest.approx(np.sqrt(1.2), abs=0.02)
    nothing = judge(aligned, sensor, rgb, 0.1, 0.0)
    assert np.nanmedian(nothing.depth.z_m[disc] / z_m[disc]) < 1.02


def test_nothing_measured_or_another_size_is_one_sentence():
    rgb = np.zeros((48, 64, 3), np.uint8)
    with pytest.raises(InputError, match="no valid pixel"):
        complete(DepthMap(np.full((48, 64), np.nan, np.float32)), rgb)
    with pytest.raises(InputError, match="pixel grid"):
        complete(DepthMap(np.ones((48, 60), np.float32)), rgb)

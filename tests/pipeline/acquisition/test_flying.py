"""What flies goes and everything else stays: walls however slanted, steps, wires."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.acquisition import acquire, back_project, filter_outliers
from pipeline.acquisition.flying import flying_score
from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes, local_planes
from pipeline.config import AcquisitionConfig
from pipeline.types import DepthMap, DepthNoise, RgbdFrame
from tests.pipeline.acquisition.depths import (
    CAMERA,
    box,
    in_steps,
    nearest,
    off_everything,
    sensed,
    wall,
)

BY_NEIGHBOURS = ("thesis", "depth_normalised", "robust")


def flies(depth: DepthMap, noise: DepthNoise | None = None) -> np.ndarray:
    return flying_score(local_planes(depth, CAMERA, noise)) > FARTHEST_SD


def frame_of(depth: DepthMap) -> RgbdFrame:
    rgb = np.zeros((*depth.z_m.shape, 3), np.uint8)
    return RgbdFrame("node", rgb, depth, CAMERA, np.eye(4))


def dropped(depth: DepthMap, mode) -> np.ndarray:
    """(H, W) by one of the filters that judge neighbours."""
    cloud = back_project(frame_of(depth))
    keep = filter_outliers(cloud, AcquisitionConfig(mode), CAMERA.fx_px).keep
    image = np.zeros(depth.z_m.shape, bool)
    image[cloud.pixels[~keep, 1], cloud.pixels[~keep, 0]] = True
    return image


@pytest.mark.parametrize("seed", range(3))
def test_what_flies_goes_and_what_a_sensor_has_seen_stays(seed):
    """Three boards before a slanted wall, through the sensor model, with its noise, steps and holes."""
    rng = np.random.default_rng(seed)
    boards = [
        box(rng.uniform(1.2, 1.9), slice(top, top + 110), slice(left, left + 60))
        for top, left in ((60, 30), (90, 130), (40, 230))
    ]
    true_m, normals = nearest(wall(rng.uniform(20.0, 35.0), 2.6), *boards)
    depth = sensed(true_m, normals, seed, flying_share=0.3)
    planted = off_everything(depth, true_m)
    assert planted.sum() > 50
    found = flies(depth)
    assert found[planted].mean() > 0.6
    good = depth.valid & ~planted
    lost = found[good].mean()
    assert lost < 0.003
    for mode in BY_NEIGHBOURS:
        assert dropped(depth, mode)[good].mean() > 8.0 * lost


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 60.0, 75.0])
@pytest.mark.parametrize("distance_m", [1.0, 2.0, 4.0])
def test_no_wall_has_an_outlier_however_it_is_slanted_and_comes_in_steps(angle_deg, distance_m):
    z_m, normals = wall(angle_deg, distance_m)
    seen = np.where((z_m > 0.4) & (z_m < 6.0), z_m, np.nan)
    assert not flies(DepthMap(seen.astype(np.float32))).any()
    assert not flies(in_steps(seen)).any()
    noisy = sensed(seen, normals, 1, far_m=8.0, grazing_deg=(85.0, 89.0))
    assert flies(noisy)[noisy.valid].mean() < 1e-3


def test_the_filters_by_neighbours_take_slanted_walls_in_steps_for_outliers():
    z_m, normals = wall(60.0, 2.5)
    depth = sensed(z_m, normals, 1, grazing_deg=(85.0, 89.0))
    for mode in BY_NEIGHBOURS:
        assert dropped(depth, mode)[depth.valid].mean() > 0.03


@pytest.mark.parametrize("transposed", [False, True])
def test_a_veil_between_front_and_back_goes_to_the_last_pixel(transposed):
    """Two pixels between a board at 1 m and a wall at 2 m, as stereo and time of flight leave them."""
    z_m = np.full((240, 320), 2.0)
    z_m[80:160, 100:200] = 1.0
    veil = np.zeros(z_m.shape, bool)
    for k, between_m in enumerate((1.33, 1.67)):
        z_m[80:160, 200 + k] = between_m
        veil[80:160, 200 + k] = True
    if transposed:
        z_m, veil = z_m.T, veil.T
    np.testing.assert_array_equal(flies(DepthMap(z_m.astype(np.float32))), veil)


def planes_of(pixels, slope=0.0):
    """Of 7 x 7 pixels, from 1/z and sd of the known ones; 1/z grows by so much down and to the right."""
    inverse, sd = np.zeros((2, 7, 7), np.float32)
    for place, (known, known_sd) in pixels.items():
        inverse[place], sd[place] = known, known_sd
    slopes = np.full_like(inverse, slope)
    return LocalPlanes(inverse, slopes, slopes, sd)


@pytest.mark.parametrize(("down", "right"), [(0, 1), (1, 0), (1, 1), (1, -1)])
@pytest.mark.parametrize("way", [-1, 1])
@pytest.mark.parametrize(("behind", "score"), [(0.5, 4.0), (0.3, 6.0)])
def test_a_pixel_flies_by_the_lesser_distance_in_sds_of_both_pixels(down, right, way, behind, score):
    """Its sd of 0.03 and those beside it of 0.04 are together 0.05; 0.3 before it and 0.2 or 0.4 behind."""
    front, back = (3 + way * down, 3 + way * right), (3 - way * down, 3 - way * right)
    planes = planes_of({(3, 3): (0.7, 0.03), front: (1.0, 0.04), back: (behind, 0.04)})
    assert flying_score(planes)[3, 3] == pytest.approx(score, rel=1e-5)


@pytest.mark.parametrize(("down", "right"), [(0, 2), (2, 0)])
def test_planes_are_continued_over_the_gap_beside_a_pixel(down, right):
    """By 2 x 0.05: one meets the pixel's line at 1.1, the other at 0.4."""
    front, back = (3 - down, 3 - right), (3 + down, 3 + right)
    planes = planes_of({(3, 3): (0.7, 0.03), front: (1.0, 0.04), back: (0.5, 0.04)}, slope=0.05)
    assert flying_score(planes)[3, 3] == pytest.approx(6.0, rel=1e-5)


def test_who_stands_alone_has_far_planes_on_three_sides_and_flies_by_the_nearest():
    before = {(3, 2): (1.0, 0.04), (2, 3): (1.1, 0.04), (2, 2): (1.2, 0.04)}
    for count, score in ((2, 0.0), (3, 6.0)):
        planes = planes_of({(3, 3): (0.7, 0.03), **dict(list(before.items())[:count])})
        assert flying_score(planes)[3, 3] == pytest.approx(score, rel=1e-5)


def test_wires_stay_and_lone_pixels_go():
    z_m = np.full((240, 320), 2.0, np.float32)
    z_m[20:200, 60] = 1.5
    rows = np.arange(30, 180)
    z_m[rows, 100 + rows // 2] = 1.2
    z_m[50, 250] = z_m[120, 280] = 1.6
    lone = np.zeros(z_m.shape, bool)
    lone[50, 250] = lone[120, 280] = True
    np.testing.assert_array_equal(flies(DepthMap(z_m)), lone)


def test_pixels_that_nothing_can_judge_stay():
    """Points of a laser scanner far from each other in the image."""
    z_m = np.full((240, 320), np.nan, np.float32)
    z_m[::20, ::20] = np.random.default_rng(0).uniform(1.0, 5.0, (12, 16))
    assert not flies(DepthMap(z_m)).any()


def test_the_law_of_a_calibration_decides_what_is_far():
    z_m = np.full((240, 320), 2.0, np.float32)
    z_m[50, 250] = 1.9
    fine, coarse = (DepthNoise(sd_m, sd_m, 0.0, 0.0) for sd_m in (0.01, 0.05))
    assert flies(DepthMap(z_m), fine)[50, 250]
    assert not flies(DepthMap(z_m), coarse).any()


def test_neither_the_unit_nor_a_mirror_changes_anything():
    true_m, normals = nearest(wall(40.0, 2.5), box(1.4, slice(60, 180), slice(90, 210)))
    depth = sensed(true_m, normals, 5)
    found = flies(depth)
    assert found.any()
    np.testing.assert_array_equal(flies(DepthMap(1000.0 * depth.z_m)), found)
    np.testing.assert_array_equal(flies(DepthMap(depth.z_m[:, ::-1].copy()))[:, ::-1], found)


def test_the_frame_keeps_all_other_points():
    true_m, normals = nearest(wall(40.0, 2.5), box(1.4, slice(60, 180), slice(90, 210)))
    frame = frame_of(sensed(true_m, normals, 5))
    found = acquire(frame, AcquisitionConfig(average=False))
    cloud = found.cloud(frame)
    u, v = cloud.outliers.pixels.T
    np.testing.assert_array_equal(np.argwhere(flies(frame.depth)), np.stack([v, u], axis=1))
    assert len(cloud.kept) + len(cloud.outliers) == frame.depth.valid.sum()
    by_neighbours = acquire(frame, AcquisitionConfig("thesis", average=False)).outliers.keep
    np.testing.assert_array_equal(
        by_neighbours,
        filter_outliers(back_project(frame), AcquisitionConfig("thesis"), CAMERA.fx_px).keep,
    )
    calibrated = replace(frame, noise=DepthNoise(1.0, 1.0, 0.0, 0.0))
    assert acquire(calibrated, AcquisitionConfig()).outliers.keep.all()

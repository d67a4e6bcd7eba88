from dataclasses import replace

import numpy as np
import pytest

from pipeline.registration import fuse
from pipeline.types import PointCloud, PointSource


def _wall(pixels, z_m, **columns) -> PointCloud:
    """Points of a wall at depth ``z_m`` seen by a camera of focal length 100 px."""
    pixels = np.asarray(pixels)
    rays = np.column_stack([pixels / 100.0, np.ones(len(pixels))])
    colors = np.zeros((len(pixels), 3), dtype=np.uint8)
    return PointCloud(rays * np.asarray(z_m).reshape(-1, 1), colors=colors, pixels=pixels, **columns)


GRID = np.stack(np.meshgrid(np.arange(20), np.arange(15)), axis=-1).reshape(-1, 2)
HOLE = (np.abs(GRID - [10, 7]) <= 2).all(axis=1)


@pytest.fixture
def clouds():
    """A wall with a hole of 25 pixels, and its inferred twin, 10 % too near and without a hole."""
    sensor_count = int((~HOLE).sum())
    return (
        _wall(GRID[~HOLE], np.full(sensor_count, 2.0), sigma_m=np.full(sensor_count, 0.01)),
        _wall(GRID, np.full(len(GRID), 1.8)),
    )


def test_union_keeps_every_point_with_its_label(clouds):
    sensor, inferred = clouds
    fused = fuse(sensor, inferred, "union")
    np.testing.assert_array_equal(fused.points_m, np.concatenate([sensor.points_m, inferred.points_m]))
    assert np.count_nonzero(fused.source == PointSource.SENSOR) == len(sensor)
    assert np.count_nonzero(fused.source == PointSource.INFERRED) == len(inferred)


def test_fill_closes_the_hole_and_nothing_else(clouds):
    """Even though the inferred layer lies 20 cm off, no second layer grows over what the sensor saw."""
    sensor, inferred = clouds
    fused = fuse(sensor, inferred, "fill")
    np.testing.assert_array_equal(fused.points_m[: len(sensor)], sensor.points_m)
    filled = fused.select(fused.source == PointSource.INFERRED)
    np.testing.assert_array_equal(filled.pixels, GRID[HOLE])
    assert len(np.unique(fused.pixels, axis=0)) == len(fused) == len(GRID)


def test_fill_without_pixels_goes_by_distance(clouds):
    sensor, _ = clouds
    spacing_m = np.array([0.0, 0.0, 0.02])
    near = sensor.points_m[:5] + 1.9 * spacing_m
    far = sensor.points_m[5:9] + 3.0 * spacing_m
    inferred = PointCloud(np.concatenate([near, far]))
    fused = fuse(replace(sensor, pixels=None), inferred, "fill")
    np.testing.assert_array_equal(fused.points_m[len(sensor) :], far)


def test_inferred_points_are_as_uncertain_as_they_disagree(clouds):
    sensor, inferred = clouds
    fused = fuse(sensor, inferred, "fill")
    np.testing.assert_allclose(fused.sigma_m[: len(sensor)], 0.01)
    np.testing.assert_allclose(fused.sigma_m[len(sensor) :], 1.4826 * 0.1 * 1.8)


def test_columns_that_one_cloud_lacks_are_left_out(clouds):
    sensor, inferred = clouds
    fused = fuse(sensor, replace(inferred, colors=None), "union")
    assert fused.colors is None
    assert fused.pixels is not None


def test_without_sensor_points_everything_is_filled(clouds):
    sensor, inferred = clouds
    fused = fuse(sensor.select(np.arange(0)), inferred, "fill")
    np.testing.assert_array_equal(fused.points_m, inferred.points_m)
    assert (fused.source == PointSource.INFERRED).all()

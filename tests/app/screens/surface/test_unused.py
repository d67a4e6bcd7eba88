"""The points that the ball left out, and the ball that lies on the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.screens.surface.unused import resting_ball_m, unused_view
from app.screens.surface.view import Ray
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.types import PointCloud, PointSource


@pytest.fixture
def cloud():
    """A flat sheet of points 1 cm apart, the right half inferred, and one point that lies apart."""
    sheet_m = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [0.0]), axis=-1).reshape(-1, 3) / 100
    points_m = np.append(sheet_m, [[0.1, 0.1, 0.5]], axis=0)
    source = np.where(points_m[:, 0] > 0.095, PointSource.INFERRED, PointSource.SENSOR).astype(np.uint8)
    normals = np.tile([0.0, 0.0, 1.0], (len(points_m), 1))
    return PointCloud(points_m, normals=normals, source=source)


def test_what_no_triangle_uses_is_left_out_by_its_source(cloud):
    surface = roll_or_nothing(cloud, [0.01])
    left = unused_view(cloud, surface, 0.005)
    np.testing.assert_allclose(left.inferred_m, [[0.1, 0.1, 0.5]])
    assert len(left.measured_m) == 0
    assert len(left.inferred_m) + len(surface.vertices_m) == len(cloud)


def test_where_the_ball_falls_through_the_whole_cloud_stays(cloud):
    left = unused_view(cloud, roll_or_nothing(cloud, [0.001]), 0.005)
    assert (len(left.measured_m), len(left.inferred_m)) == (200, 201)


def test_many_points_are_thinned_evenly(cloud):
    left = unused_view(cloud, roll_or_nothing(cloud, [0.001]), 0.005, most=100)
    assert 70 <= len(left.measured_m) + len(left.inferred_m) <= 100


def test_the_ball_lies_on_the_first_point_that_is_meant(cloud):
    down = Ray((0.05, 0.05, 2.0), (0.0, 0.0, -3.0))
    np.testing.assert_allclose(resting_ball_m(cloud, down, 0.03), [0.05, 0.05, 0.03])
    over_both = Ray((0.1, 0.1, 2.0), (0.0, 0.0, -1.0))
    np.testing.assert_allclose(resting_ball_m(cloud, over_both, 0.03), [0.1, 0.1, 0.53])


def test_it_lies_on_the_nearest_by_angle_where_none_is_meant_and_nowhere_behind(cloud):
    beside = Ray((-0.2, 0.0, 0.4), (0.0, 0.0, -1.0))
    np.testing.assert_allclose(resting_ball_m(cloud, beside, 0.03), [0.0, 0.0, 0.03])
    assert resting_ball_m(cloud, Ray((0.05, 0.05, 2.0), (0.0, 0.0, 1.0)), 0.03) is None
    assert resting_ball_m(replace(cloud, normals=None), beside, 0.03) is None

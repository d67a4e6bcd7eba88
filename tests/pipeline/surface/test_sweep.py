"""What a sweep of the ball radius says of clouds whose surface is known."""

import math

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.rays import Camera
from pipeline.surface.ball_pivoting import reconstruct_surface
from pipeline.surface.sweep import iterate_sweep, sweep_radii_m
from pipeline.surface.truth import compare_with_truth
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, RigTruth
from tests.pipeline.surface.shapes import perforated_plane, rectangle

SPACING_M = 0.02
EYE = Camera(CameraIntrinsics.pinhole(50.0, 50.0, 31.5, 23.5, 64, 48), np.eye(4))


def wall(side=61, lift_m=0.0):
    """A square grid a metre before the camera, seen from it, wider than its image is high."""
    axis = SPACING_M * (np.arange(side) - (side - 1) / 2)
    x, y = (part.ravel() for part in np.meshgrid(axis, axis))
    flat = np.zeros(x.size)
    return PointCloud(
        np.column_stack([x, y, flat + 1.0 + lift_m]), normals=np.column_stack([flat, flat, flat - 1.0])
    )


def wall_truth():
    vertices_m, triangles = rectangle((-3.0, 3.0), (-3.0, 3.0), 1.0)
    depth = DepthMap(np.ones((48, 64), np.float32))
    return RigTruth(vertices_m, triangles, (np.eye(4),), (depth,), (EYE.intrinsics,))


def test_twelve_radii_in_equal_ratios_and_others_between_them():
    radii_m = sweep_radii_m(0.02)
    assert len(radii_m) == 12
    assert (radii_m[0], radii_m[-1]) == pytest.approx((0.01, 0.12))
    ratios = np.diff(np.log(radii_m))
    np.testing.assert_allclose(ratios, ratios[0])
    assert sweep_radii_m(0.02, (0.5, 0.011, 0.5)) == tuple(sorted([*radii_m, 0.011, 0.5]))


@pytest.mark.parametrize("r_F_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_spacing_that_is_none_gets_its_sentence(r_F_m):
    with pytest.raises(InputError, match=r"The point spacing r_F is .* no ball fits"):
        sweep_radii_m(r_F_m)


def test_a_grid_is_open_below_its_circumradius_and_closed_above():
    cloud, factors = wall(), np.array([0.3, 0.5, 0.70, 0.71, 1.0, 2.0, 5.0])
    points = list(iterate_sweep(cloud, factors * SPACING_M, [EYE]))
    assert [point.radius_m for point in points] == (factors * SPACING_M).tolist()
    for point in points[:3]:
        assert (point.triangles, point.unused_share, point.no_hit_ray_share) == (0, 1.0, 1.0)
        assert point.hole_area_m2 == 0.0
    for point in points[3:]:
        assert point.triangles == 2 * 60 * 60
        assert point.unused_share == 0.0
        assert point.hole_area_m2 == 0.0
        assert point.no_hit_ray_share == pytest.approx(1 - 59 / 64, abs=0.03)
    assert all(point.elapsed_s > 0.0 for point in points)


def test_with_a_truth_there_is_accuracy_wherever_there_is_a_triangle():
    """The grid lies 2 cm behind the true wall: none of it within 1 cm, all of it within 5 cm."""
    near, far = wall(121), wall(121, lift_m=0.02)
    radii_m = (0.5 * SPACING_M, SPACING_M)
    (nothing, good), (_, bad) = (iterate_sweep(cloud, radii_m, [EYE], wall_truth()) for cloud in (near, far))
    assert nothing.triangles == 0
    assert math.isnan(nothing.accuracy_1cm)
    assert math.isnan(nothing.f_score_5cm)
    assert (good.accuracy_1cm, bad.accuracy_1cm) == (1.0, 0.0)
    assert good.f_score_5cm == bad.f_score_5cm == 1.0


def test_without_cameras_and_truth_their_measures_are_unknown():
    (point,) = iterate_sweep(wall(), (SPACING_M,))
    assert math.isnan(point.no_hit_ray_share)
    assert math.isnan(point.accuracy_1cm)
    assert math.isnan(point.f_score_5cm)


def test_each_ball_rolls_alone_and_is_measured_like_any_surface():
    """The small ball leaves the disc open, the large one closes it."""
    cloud = perforated_plane(0.3, 0.01, 0.03)
    small, large = iterate_sweep(cloud, (0.01, 0.045))
    assert small.hole_area_m2 == pytest.approx(np.pi * 0.03**2, rel=0.3)
    assert large.hole_area_m2 == 0.0
    for point in (small, large):
        surface = reconstruct_surface(cloud, (point.radius_m,))
        assert point.triangles == len(surface.triangles)
        assert point.unused_share == pytest.approx(surface.quality.unused_points / len(cloud))
        assert point.hole_area_m2 == pytest.approx(surface.quality.hole_area_m2)


def test_the_truth_is_compared_as_everywhere_else():
    cloud, truth = wall(121, lift_m=0.006), wall_truth()
    (point,) = iterate_sweep(cloud, (SPACING_M,), [EYE], truth)
    surface = reconstruct_surface(cloud, (SPACING_M,))
    measures = compare_with_truth(surface.vertices_m, surface.triangles, truth, [EYE])
    assert point.accuracy_1cm == pytest.approx(measures["accuracy_1cm"], abs=0.01)
    assert point.f_score_5cm == pytest.approx(measures["f_score_5cm"], abs=0.01)


def test_it_rolls_only_when_asked_for_the_next():
    sweep = iterate_sweep(wall(), (SPACING_M, -1.0))
    assert next(sweep).triangles > 0
    with pytest.raises(InputError, match="A ball radius is -1"):
        next(sweep)
    assert list(iterate_sweep(wall(), ())) == []


@pytest.mark.parametrize(
    ("cloud", "truth", "says"),
    [
        (PointCloud(np.eye(3)), None, "needs a normal"),
        (PointCloud(np.eye(3)[:2], normals=np.eye(3)[:2]), None, "at least 3 points, not 2"),
        (wall(), wall_truth(), "placed by the cameras and there are none"),
    ],
)
def test_what_cannot_be_swept_gets_its_sentence(cloud, truth, says):
    with pytest.raises(InputError, match=says):
        next(iterate_sweep(cloud, (SPACING_M,), (), truth))

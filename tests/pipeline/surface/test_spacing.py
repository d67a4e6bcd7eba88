"""Spacing, the radius rules and normals."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.config import SurfaceConfig
from pipeline.surface.normals import estimate_normals
from pipeline.surface.radii import radii, spacing
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import sphere


def test_spacing_of_pairs_with_known_distances():
    """Pairs 1, 2 and 3 cm apart, far from each other."""
    points_m = np.array([[10.0 * k, 0.0, end * k / 100] for k in (1, 2, 3) for end in (0, 1)])
    assert spacing(points_m) == pytest.approx((0.02, np.sqrt(2 / 3) / 100))


def test_spacing_of_a_grid_has_no_spread():
    grid = np.stack(np.meshgrid(*[np.arange(5) * 0.04] * 3), axis=-1).reshape(-1, 3)
    assert spacing(grid) == pytest.approx((0.04, 0.0), abs=1e-12)


def test_the_thesis_rule_gives_the_thesis_radii():
    """r_F = .0102 and sigma_D = .0107 predict the figures' .0102, .0129, .0156, .0209 (SPEC 5)."""
    chosen = radii(SurfaceConfig("thesis"), 0.0102, 0.0107)
    np.testing.assert_allclose(chosen, [0.0102, 0.0129, 0.0156, 0.0209], atol=5e-5)


def test_the_wider_rule_reaches_four_sigmas():
    np.testing.assert_allclose(radii(SurfaceConfig("thesis+"), 0.01, 0.005), [0.01, 0.015, 0.02, 0.03])


def test_manual_radii_are_sorted_and_single():
    assert radii(SurfaceConfig("manual", (0.03, 0.01, 0.03, 0.02)), 1.0, 1.0) == (0.01, 0.02, 0.03)


def test_without_spread_there_is_one_radius():
    assert radii(SurfaceConfig("thesis"), 0.01, 0.0) == (0.01,)


@pytest.mark.parametrize(("r_F_m", "sigma_D_m"), [(0.0, 0.1), (float("nan"), 0.1), (-0.1, 0.0)])
def test_a_radius_that_is_not_positive_is_refused(r_F_m, sigma_D_m):
    with pytest.raises(InputError, match="A ball radius is"):
        radii(SurfaceConfig("thesis"), r_F_m, sigma_D_m)


@pytest.mark.parametrize("count", [0, 1])
def test_a_single_point_has_no_spacing(count):
    with pytest.raises(InputError, match=f"A cloud of {count} points has no spacing"):
        spacing(np.zeros((count, 3)))


def test_normals_of_a_plane_are_exact_and_face_the_viewpoint():
    xy = np.random.default_rng(0).uniform(-1, 1, (400, 2))
    cloud = PointCloud(np.column_stack([xy, 0.5 * xy[:, 0] + 3.0]), colors=np.zeros((400, 3), np.uint8))
    expected = np.array([0.5, 0.0, -1.0]) / np.sqrt(1.25)
    for viewpoint_m, sign in ((np.zeros(3), 1.0), (np.array([0.0, 0.0, 9.0]), -1.0)):
        oriented = estimate_normals(cloud, viewpoint_m)
        np.testing.assert_allclose(oriented.normals, np.tile(sign * expected, (400, 1)), atol=1e-6)
        assert oriented.colors is cloud.colors


def test_normals_of_a_sphere_seen_from_inside_point_inwards():
    cloud = sphere(3000)
    normals = estimate_normals(cloud, np.zeros(3)).normals
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)
    assert np.sum(normals * -cloud.normals, axis=1).min() > np.cos(np.deg2rad(2.0))


@pytest.mark.parametrize(("count", "neighbours"), [(2, 20), (0, 20), (50, 2)])
def test_too_few_points_for_a_plane(count, neighbours):
    with pytest.raises(InputError, match="at least 3 points and 3 neighbours"):
        estimate_normals(PointCloud(np.zeros((count, 3))), np.zeros(3), neighbours)

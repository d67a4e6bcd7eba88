"""Every degradation does what its number says, and nothing else."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.registration.degradation import LIMITS, Degradation, degrade
from pipeline.types import PointCloud


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    """A wall's corner as a camera sees it, with every column that must stay in step."""
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, 80), np.linspace(-0.45, 0.45, 60))
    z_m = 2.0 + 0.5 * np.abs(u)
    points_m = np.stack([u * z_m, v * z_m, z_m], axis=-1).reshape(-1, 3)
    rows = np.arange(len(points_m))
    normals = points_m / -np.linalg.norm(points_m, axis=1, keepdims=True)
    return PointCloud(points_m, np.stack([rows % 256] * 3, axis=1).astype(np.uint8), normals, rows[:, None])


def _view(cloud: PointCloud) -> np.ndarray:
    return cloud.points_m[:, :2] / cloud.points_m[:, 2:]


def test_nothing_asked_is_nothing_done(cloud):
    np.testing.assert_array_equal(degrade(cloud, Degradation(), 3).points_m, cloud.points_m)


@pytest.mark.parametrize("name", LIMITS)
def test_the_seed_decides(cloud, name):
    how = Degradation(**{name: 0.5 * LIMITS[name]})
    first, again, other = (degrade(cloud, how, seed).points_m for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert first.shape == other.shape
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", ["hole_share", "crop_share"])
def test_exactly_the_share_goes_and_the_rest_stays_with_all_its_columns(cloud, name):
    worse = degrade(cloud, Degradation(**{name: 0.3}), 1)
    kept = worse.pixels[:, 0]
    assert len(worse) == len(cloud) - round(0.3 * len(cloud))
    np.testing.assert_array_equal(worse.points_m, cloud.points_m[kept])
    np.testing.assert_array_equal(worse.colors, cloud.colors[kept])
    np.testing.assert_array_equal(worse.normals, cloud.normals[kept])


def test_a_crop_is_cut_off_by_a_straight_line(cloud):
    """The kept points lie on one side of a line in the view, and the removed ones on the other."""
    kept = np.zeros(len(cloud), bool)
    kept[degrade(cloud, Degradation(crop_share=0.4), 2).pixels[:, 0]] = True
    view = _view(cloud)
    angles_rad = np.linspace(0, 2 * np.pi, 721)
    along = view @ np.stack([np.cos(angles_rad), np.sin(angles_rad)])
    gap = along[~kept].min(axis=0) - along[kept].max(axis=0)
    assert gap.max() > -0.02


def test_holes_are_round_patches_not_single_points(cloud):
    gone = np.ones(len(cloud), bool)
    gone[degrade(cloud, Degradation(hole_share=0.3), 4).pixels[:, 0]] = False
    image = gone.reshape(60, 80)
    alike = image[:, 1:] == image[:, :-1]
    assert alike.mean() > 0.93
    assert 0.5 < np.mean(_view(cloud)[gone].std(axis=0) / _view(cloud).std(axis=0)) < 1.2


def test_holes_are_about_random_points_not_about_the_middle(cloud):
    middle = np.argmin(np.linalg.norm(_view(cloud), axis=1))
    kept = [degrade(cloud, Degradation(hole_share=0.05), seed).pixels for seed in range(20)]
    assert sum(cloud.pixels[middle] in pixels for pixels in kept) > 10


def test_noise_moves_along_the_ray_by_its_standard_deviation(cloud):
    worse = degrade(cloud, Degradation(noise_m=0.05), 5)
    np.testing.assert_allclose(np.cross(worse.points_m, cloud.points_m), 0.0, atol=1e-12)
    moved_m = np.linalg.norm(worse.points_m, axis=1) - np.linalg.norm(cloud.points_m, axis=1)
    assert moved_m.std() == pytest.approx(0.05, rel=0.05)
    assert abs(moved_m.mean()) < 4 * 0.05 / np.sqrt(len(cloud))


def test_bias_is_relative_smooth_and_as_large_as_asked(cloud):
    worse = degrade(cloud, Degradation(depth_bias=0.06), 6)
    np.testing.assert_allclose(_view(worse), _view(cloud), atol=1e-12)
    error = np.log(worse.points_m[:, 2] / cloud.points_m[:, 2])
    assert error.std() == pytest.approx(0.06, rel=1e-9)
    assert abs(error.mean()) < 1e-12
    assert np.abs(np.diff(error.reshape(60, 80), axis=1)).max() < 0.02


def test_outliers_replace_their_share_within_the_bounding_box(cloud):
    worse = degrade(cloud, Degradation(outlier_share=0.2), 7)
    replaced = np.any(worse.points_m != cloud.points_m, axis=1)
    assert replaced.sum() == round(0.2 * len(cloud))
    assert np.all(worse.points_m >= cloud.points_m.min(axis=0))
    assert np.all(worse.points_m <= cloud.points_m.max(axis=0))


def test_each_kind_has_its_own_stream(cloud):
    """The holes are in the same places with and without noise."""
    holes = degrade(cloud, Degradation(hole_share=0.3), 9)
    both = degrade(cloud, Degradation(hole_share=0.3, noise_m=0.02), 9)
    np.testing.assert_array_equal(holes.pixels, both.pixels)


def test_everything_at_its_limit_leaves_points(cloud):
    worse = degrade(cloud, Degradation(**LIMITS), 10)
    assert len(worse) == pytest.approx(0.01 * len(cloud), abs=2)
    assert np.isfinite(worse.points_m).all()


@pytest.mark.parametrize("name", LIMITS)
def test_values_out_of_range_are_told(name):
    for value in (-0.01, LIMITS[name] + 0.01, float("nan")):
        with pytest.raises(InputError, match=name):
            Degradation(**{name: value})


def test_a_cloud_behind_its_camera_is_told(cloud):
    with pytest.raises(InputError, match="camera"):
        degrade(PointCloud(cloud.points_m - [0, 0, 3.0]), Degradation(noise_m=0.01), 0)

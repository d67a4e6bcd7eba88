import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.acquisition import filter_outliers
from pipeline.config import AcquisitionConfig
from pipeline.types import PointCloud

FOCAL_PX = 100.0
MODES = ("thesis", "depth_normalised", "robust")


def _slanted_floor(rng) -> np.ndarray:
    """Points of a floor from 1 to 5 m, spaced as a depth image of focal length 100 px spaces them."""
    u, v = np.meshgrid(np.arange(-40, 40), np.arange(20, 100))
    z_m = 100.0 / v.ravel()
    points_m = np.column_stack([u.ravel() / FOCAL_PX * z_m, v.ravel() / FOCAL_PX * z_m, z_m])
    return points_m + rng.normal(scale=1e-3, size=points_m.shape) * z_m[:, None]


@pytest.fixture(scope="module")
def floor_and_outliers() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    floor_m = _slanted_floor(rng)
    outliers_m = np.column_stack([rng.uniform(-1, 1, (60, 2)) - [0.0, 1.5], rng.uniform(1, 5, 60)])
    return floor_m, outliers_m


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("neighbours", "t"), [(4, 1.0), (7, 2.5)])
def test_equals_the_formula_by_brute_force(mode, neighbours, t):
    rng = np.random.default_rng(2)
    points_m = np.concatenate([rng.normal(size=(200, 3)), 5 * rng.normal(size=(5, 3))])
    points_m[:, 2] += 30.0
    gaps_m = np.sort(np.linalg.norm(points_m[:, None] - points_m[None], axis=2), axis=1)
    score = gaps_m[:, 1 : neighbours + 1].mean(axis=1)
    if mode != "thesis":
        score = score * FOCAL_PX / points_m[:, 2]
    threshold = score.mean() + t * np.sqrt(np.mean((score - score.mean()) ** 2))
    if mode == "robust":
        threshold = np.median(score) + 3 * 1.4826 * np.median(np.abs(score - np.median(score)))
    config = AcquisitionConfig(mode, neighbours, t)
    result = filter_outliers(PointCloud(points_m), config, FOCAL_PX)
    np.testing.assert_allclose(result.score, score)
    assert result.threshold == pytest.approx(threshold)
    np.testing.assert_array_equal(result.keep, score <= threshold)
    np.testing.assert_array_equal(result.kept.points_m, points_m[result.keep])
    np.testing.assert_array_equal(result.outliers.points_m, points_m[~result.keep])


@pytest.mark.parametrize("mode", MODES)
def test_planted_outliers_are_found(floor_and_outliers, mode):
    floor_m, outliers_m = floor_and_outliers
    cloud = PointCloud(np.concatenate([floor_m, outliers_m]))
    keep = filter_outliers(cloud, AcquisitionConfig(mode), FOCAL_PX).keep
    assert (~keep[len(floor_m) :]).mean() > 0.9
    assert keep[: len(floor_m)].mean() > 0.95


def test_the_thesis_rule_eats_far_surfaces_and_the_robust_rule_does_not(floor_and_outliers):
    floor_m, _ = floor_and_outliers
    far = floor_m[:, 2] > 4.0
    lost = {
        mode: (~filter_outliers(PointCloud(floor_m), AcquisitionConfig(mode), FOCAL_PX).keep)[far].mean()
        for mode in ("thesis", "robust")
    }
    assert lost["thesis"] > 0.5
    assert lost["robust"] < 0.3


def test_the_unit_of_length_does_not_matter(floor_and_outliers):
    cloud_m = np.concatenate(floor_and_outliers)
    for mode in MODES:
        in_m, in_mm = (
            filter_outliers(PointCloud(scale * cloud_m), AcquisitionConfig(mode), FOCAL_PX)
            for scale in (1.0, 1000.0)
        )
        np.testing.assert_array_equal(in_m.keep, in_mm.keep)


@pytest.mark.parametrize("mode", MODES)
def test_equal_spacing_has_no_outlier(mode):
    """On a ring every point has the same neighbours; rounding must not split it."""
    angles = np.linspace(0, 2 * np.pi, 500, endpoint=False)
    ring_m = np.column_stack([np.cos(angles), np.sin(angles), np.full(500, 2.0)])
    assert filter_outliers(PointCloud(ring_m), AcquisitionConfig(mode), FOCAL_PX).keep.all()


def test_bad_input():
    points_m = np.random.default_rng(0).normal(size=(10, 3))
    with pytest.raises(InputError, match="4 points, too few"):
        filter_outliers(PointCloud(points_m[:4]), AcquisitionConfig("thesis"), FOCAL_PX)
    with pytest.raises(InputError, match="in front of the camera"):
        filter_outliers(PointCloud(points_m), AcquisitionConfig("robust"), FOCAL_PX)
    with pytest.raises(InputError, match="a depth image, not a cloud"):
        filter_outliers(PointCloud(points_m), AcquisitionConfig("flying"), FOCAL_PX)

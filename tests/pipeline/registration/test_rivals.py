"""The rivals of Table 4.4 and a modern one by known answers, and what every method owes (SPEC 4.6)."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.registration import iterate_registration, point_error_m, register
from pipeline.registration.fast_robust import FastRobustIcp, neighbourhood_m
from pipeline.registration.ficp import Ficp, inlier_fraction
from pipeline.registration.hicp import Hicp, hue_coordinates
from pipeline.registration.icp import TrimmedIcp
from pipeline.registration.matching import Matching
from pipeline.registration.methods import METHODS
from pipeline.registration.mricp import Mricp
from pipeline.registration.picp import Picp
from pipeline.registration.ricp import Ricp, rigid_fits
from pipeline.types import PointCloud
from tests.pipeline.registration.pairs import pairs_at

AWAY = rigid(rotation_exp(np.array([0.4, 1.1, -0.7])), [3.0, -2.0, 5.0])
EVERY = [
    pytest.param(RegistrationConfig(method, metric), id=f"{method}-{metric}")
    for method in METHODS
    for metric in ("point", "plane")
]
SPREADING = ("ceicp-ml", "kernel-correlation")
"""Methods that pair a point with several: the scene's bend, and five that are not each other's nearest,
pull at the truth by a small part of the 3 cm between points."""
BY_ROW = "ricp"
"""Draws subsets of the pairs by their row, so that another order is another draw."""


@pytest.fixture(scope="module")
def coloured(corner):
    return replace(
        corner, colors=np.clip(255.0 * (corner.points_m - [-1, -1, 1]) / 2, 0, 255).astype(np.uint8)
    )


@pytest.fixture(scope="module")
def displacement():
    """2 degrees and 2 cm."""
    return rigid(rotation_exp(np.deg2rad(2.0) * np.array([2.0, -1.0, 2.0]) / 3.0), [0.012, -0.012, 0.0106])


@pytest.fixture(scope="module")
def halves(coloured, displacement):
    """Two different random halves of the same place, displaced."""
    rows = np.random.default_rng(3).permutation(len(coloured))
    return coloured.select(rows[:900]).transformed(inverse(displacement)), coloured.select(rows[600:])


# What every method owes.


@pytest.mark.parametrize("config", EVERY)
def test_identity_stays_identity(coloured, config):
    result = register(coloured, coloured, config)
    bound = 3e-4 if config.method in SPREADING else 1e-9
    np.testing.assert_allclose(result.T_target_source, np.eye(4), atol=bound)
    assert result.converged or config.method == "ceicp-literal"


@pytest.mark.parametrize("config", EVERY)
def test_a_clean_displacement_is_recovered_to_a_millimetre(coloured, displacement, config):
    source = coloured.transformed(inverse(displacement))
    result = register(source, coloured, config)
    assert point_error_m(np.eye(4), displacement, source.points_m) > 0.02
    assert point_error_m(result.T_target_source, displacement, source.points_m) < 1e-3
    rotation = result.T_target_source[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


@pytest.fixture(scope="module")
def many(displacement):
    """Two looks at a corner of 2,800 points each, coloured by their place: more than a coarse kernel uses."""
    rng = np.random.default_rng(5)

    def look():
        a, b = rng.uniform(0.0, 1.0, (2, 700))
        faces = [np.stack(face, axis=1) for face in ((a, 0 * a, b), (0 * a, a, b), (a, b, 0 * a))]
        ball = rng.normal(size=(700, 3))
        ball = 0.25 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0.6, 0.5, 0.55]
        points_m = np.concatenate([*faces, ball])
        return PointCloud(
            points_m + np.array([0.0, 0.2, 1.5]), colors=(255 * np.clip(points_m, 0, 1)).astype(np.uint8)
        )

    return look().transformed(inverse(displacement)), look()


@pytest.mark.parametrize("max_points", [10_000, 2_500], ids=["whole", "thinned"])
@pytest.mark.parametrize("config", [case for case in EVERY if case.values[0].method != BY_ROW])
def test_the_order_of_points_does_not_matter(many, config, max_points):
    """Neither where all points take part in coarser and finer steps, nor where some are drawn first."""
    source, target = many
    rng, config = np.random.default_rng(0), replace(config, max_points=max_points)
    shuffled = register(
        source.select(rng.permutation(len(source))), target.select(rng.permutation(len(target))), config
    )
    result = register(source, target, config)
    np.testing.assert_allclose(shuffled.T_target_source, result.T_target_source, atol=1e-7)
    assert len(shuffled.steps) == len(result.steps)
    assert len(result.steps[-1].pairs) > 1000 or config.method in SPREADING


@pytest.mark.parametrize("config", EVERY)
def test_moving_both_clouds_moves_the_answer(halves, config):
    source, target = halves
    result = register(source, target, config)
    moved = register(source.transformed(AWAY), target.transformed(AWAY), config)
    expected = AWAY @ result.T_target_source @ inverse(AWAY)
    np.testing.assert_allclose(moved.T_target_source, expected, atol=1e-6)
    assert len(moved.steps) == len(result.steps)


@pytest.mark.parametrize("config", EVERY)
def test_every_step_keeps_pairs_with_weights_that_sum_to_one(halves, config):
    for step in iterate_registration(*halves, config):
        assert (step.weights >= 0.0).all()
        assert step.weights.sum() == pytest.approx(1.0, abs=1e-9)
        assert len(step.pairs) == len(step.weights) == len(step.distances_m)
        assert len(np.unique(step.pairs, axis=0)) == len(step.pairs)


# Known answers.


def test_trimming_keeps_the_closest_share():
    distances_m = np.array([0.5, 0.1, 0.4, 0.2, 0.3])
    for share, rows in ((0.2, [1]), (0.6, [1, 3, 4]), (0.61, [1, 2, 3, 4]), (1.0, [0, 1, 2, 3, 4])):
        kept = TrimmedIcp(share).weigh(pairs_at(distances_m))
        assert kept.rows.tolist() == rows
        np.testing.assert_allclose(kept.weights, 1.0 / len(rows))


@pytest.mark.parametrize("inliers", [10, 60, 137, 200])
def test_ficp_picks_exactly_the_inliers(inliers):
    rng = np.random.default_rng(inliers)
    distances_m = rng.permutation(np.r_[np.full(inliers, 0.01), rng.uniform(0.5, 1.0, 200 - inliers)])
    assert inlier_fraction(distances_m) == pytest.approx(inliers / 200)
    kept = Ficp().weigh(pairs_at(distances_m))
    assert kept.rows.tolist() == np.flatnonzero(distances_m == 0.01).tolist()


def test_ficp_minimises_the_fractional_rmsd():
    distances_m = np.abs(np.random.default_rng(1).normal(size=300))
    ranked = np.sort(distances_m)
    frmsd = {k: (k / 300) ** -0.95 * np.sqrt(np.mean(ranked[:k] ** 2)) for k in range(15, 301)}
    assert inlier_fraction(distances_m) == pytest.approx(min(frmsd, key=frmsd.get) / 300)


def test_picp_pairs_one_to_one_with_the_closest():
    kept = Picp(0, 20).weigh(pairs_at([0.3, 0.1, 0.2, 0.15, 0.3], target_rows=[7, 7, 5, 5, 9]))
    assert kept.rows.tolist() == [1, 3, 4]


def test_picp_rejects_before_it_pairs():
    """Median 0.10, MAD 0.01: pairs beyond 0.10 + 2.5 * 1.4826 * 0.01 = 0.137 go."""
    distances_m = [0.09, 0.09, 0.10, 0.10, 0.10, 0.11, 0.11, 0.13, 0.14]
    assert Picp(0, 20).weigh(pairs_at(distances_m)).rows.tolist() == list(range(8))


def test_picp_keeps_every_point_once_in_both_directions(halves):
    for step in iterate_registration(*halves, RegistrationConfig("picp", direction="both")):
        assert len(np.unique(step.pairs[:, 0])) == len(step.pairs) == len(np.unique(step.pairs[:, 1]))


@pytest.mark.parametrize(("start", "thinning"), [(Mricp.starting, 4), (Picp.starting, 2)])
def test_levels_shrink_to_all_points_when_they_come_to_rest(start, thinning):
    cloud = PointCloud(np.zeros((6000, 3)))
    method = start(RegistrationConfig(max_iterations=100), cloud, cloud)
    levels, shares, tolerances = [method.level], [method.source_share], [method.tolerance]
    while not method.settled:
        assert method.following(None, still=False).level == method.level
        method = method.following(None, still=True)
        levels.append(method.level)
        shares.append(method.source_share)
        tolerances.append(method.tolerance)
    assert levels == list(range(levels[0], -1, -1))
    assert shares == [thinning**-level for level in levels]
    assert tolerances == ([8, 4, 2, 1] if thinning == 4 else [25, 16, 9, 4, 1])
    assert levels[0] == (3 if thinning == 4 else 4)
    assert method.following(None, still=True).settled


def test_a_restless_level_gives_way_after_its_share():
    method = Mricp(level=2, most_steps=25)
    for _ in range(25):
        assert method.level == 2
        method = method.following(None, still=False)
    assert method.level == 1


def test_levels_of_mricp_take_a_quarter_of_the_points_each(coloured, displacement):
    source = coloured.transformed(inverse(displacement))
    counts = [len(step.pairs) for step in iterate_registration(source, coloured, RegistrationConfig("mricp"))]
    assert sorted(set(counts)) == [94, 375, 1500]
    assert counts == sorted(counts)


def test_small_clouds_have_fewer_levels():
    cloud = PointCloud(np.zeros((100, 3)))
    assert Mricp.starting(RegistrationConfig(), cloud, cloud).level == 0
    assert Picp.starting(RegistrationConfig(), cloud.select(np.arange(100)), cloud).level == 0


def test_ricp_ignores_thirty_percent_gross_outliers():
    """Pairs that agree on a large motion, and 30 % that do not: exactly the former are kept."""
    rng = np.random.default_rng(0)
    source_m, T = (
        rng.uniform(-1.0, 1.0, (400, 3)),
        rigid(rotation_exp(np.array([0.3, 0.2, -0.4])), [0.5, 0, 0.2]),
    )
    target_m = source_m @ T[:3, :3].T + T[:3, 3] + rng.uniform(-1e-3, 1e-3, (400, 3))
    target_m[:120] += rng.choice([-1.0, 1.0], (120, 3)) * rng.uniform(0.3, 1.0, (120, 3))
    rows = np.arange(400)
    pairs = Matching(rows, rows, source_m, target_m, np.linalg.norm(source_m - target_m, axis=1))
    for seed in range(10):
        kept = Ricp(seed).weigh(pairs)
        assert kept.rows.min() >= 120
        assert len(kept.rows) > 260


def test_ricp_knows_the_present_pose():
    """A minority of agreeing subsets cannot beat a pose at which most pairs already coincide."""
    rng = np.random.default_rng(0)
    source_m = rng.uniform(-1.0, 1.0, (100, 3))
    target_m = source_m.copy()
    target_m[:49] += rng.uniform(0.3, 1.0, (49, 3))
    rows = np.arange(100)
    pairs = Matching(rows, rows, source_m, target_m, np.linalg.norm(source_m - target_m, axis=1))
    assert Ricp(0).weigh(pairs).rows.tolist() == list(range(49, 100))


@pytest.mark.parametrize(("far_m", "kept"), [(6.7, 10), (6.9, 8)])
def test_ricp_keeps_two_and_a_half_robust_sds_which_are_wider_for_few_pairs(far_m, kept):
    """2.5 x 1.4826 (1 + 5 / (10 - 4)) = 6.8: no motion of one place makes a ring around it any nearer."""
    turn = 2.0 * np.pi * np.arange(8) / 8
    ring_m = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    target_m = np.concatenate([ring_m, [[0.0, 0.0, far_m], [0.0, 0.0, -far_m]]])
    rows = np.arange(10)
    pairs = Matching(rows, rows, np.zeros((10, 3)), target_m, np.linalg.norm(target_m, axis=1))
    assert Ricp(0).weigh(pairs).rows.tolist() == list(range(kept))


def test_ricp_draws_anew_every_iteration_and_the_same_for_a_seed(halves):
    source, target = halves
    config = RegistrationConfig("ricp", "point")
    assert Ricp(3).following(None, still=False) == Ricp(3, 1)
    first, second = (register(source, target, config).T_target_source for _ in range(2))
    assert first.tobytes() == second.tobytes()
    assert register(source, target, replace(config, seed=1)).T_target_source.tobytes() != first.tobytes()


def test_small_fits_are_rigid_and_exact():
    rng = np.random.default_rng(4)
    source_m = rng.normal(size=(20, 4, 3))
    rotations = np.array([rotation_exp(rng.normal(size=3)) for _ in range(20)])
    translations_m = rng.normal(size=(20, 3))
    target_m = np.einsum("sij,skj->ski", rotations, source_m) + translations_m[:, None]
    fitted, shifts_m = rigid_fits(source_m, target_m)
    np.testing.assert_allclose(fitted, rotations, atol=1e-9)
    np.testing.assert_allclose(shifts_m, translations_m, atol=1e-9)
    mirrored, _ = rigid_fits(source_m, target_m * [1.0, 1.0, -1.0])
    np.testing.assert_allclose(np.linalg.det(mirrored), 1.0, atol=1e-9)


def test_the_hue_circle_wraps():
    hsv = np.float32([[h, 1.0, 1.0] for h in range(0, 360, 30)])[None]
    colors = np.rint(255.0 * cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0]).astype(np.uint8)
    places_m = hue_coordinates(colors, 0.3)
    np.testing.assert_allclose(np.linalg.norm(places_m, axis=1), 0.3, rtol=1e-6)
    steps_m = np.linalg.norm(places_m - np.roll(places_m, 1, axis=0), axis=1)
    np.testing.assert_allclose(steps_m, 0.6 * np.sin(np.deg2rad(15.0)), rtol=0.01)
    np.testing.assert_allclose(
        hue_coordinates(np.uint8([[255, 0, 0], [0, 255, 255]]), 0.3), [[0.3, 0], [-0.3, 0]], atol=1e-7
    )
    beside_red_m = hue_coordinates(np.uint8([[255, 4, 0], [255, 0, 4]]), 0.3)
    assert np.linalg.norm(beside_red_m[0] - beside_red_m[1]) < 0.02


def test_greys_have_no_hue():
    colors = np.uint8([[0, 0, 0], [128, 128, 128], [200, 185, 190], [200, 150, 150]])
    places_m = hue_coordinates(colors, 0.3)
    assert (places_m[:3] == 0.0).all()
    assert np.linalg.norm(places_m[3]) == pytest.approx(0.3)
    assert hue_coordinates(np.empty((0, 3), np.uint8), 0.3).shape == (0, 2)


def test_hicp_matches_like_with_like():
    """Red and green points among each other, displaced by most of their spacing."""
    place_m = np.random.default_rng(0).uniform(0.0, 1.0, (300, 3))
    colors = np.where(np.arange(300)[:, None] % 2, np.uint8([255, 0, 0]), np.uint8([0, 255, 0]))
    target = PointCloud(place_m, colors=colors)
    source = PointCloud(place_m + np.array([0.06, 0.0, 0.0]), colors=colors)
    step = next(iterate_registration(source, target, RegistrationConfig("hicp", "point", trim=1.0)))
    assert (step.pairs[:, 0] % 2 == step.pairs[:, 1] % 2).all()
    blind = next(iterate_registration(source, target, RegistrationConfig("trimmed-icp", "point", trim=1.0)))
    assert (blind.pairs[:, 0] % 2 != blind.pairs[:, 1] % 2).sum() > 10


def test_hicp_asks_for_colours(coloured, corner):
    with pytest.raises(InputError, match="the target cloud has no colours; try another method"):
        register(coloured, corner, RegistrationConfig("hicp"))
    assert Hicp.starting(RegistrationConfig(trim=0.7), coloured, coloured).share == 0.7


def test_welsch_weights_follow_the_formula():
    distances_m = np.array([0.0, 0.02, 0.05, 2.0])
    kept = FastRobustIcp(0.001, nu_m=0.02).weigh(pairs_at(distances_m))
    expected = np.exp(-(distances_m**2) / (2.0 * 0.02**2))
    np.testing.assert_allclose(kept.weights, expected / expected.sum(), atol=1e-15)
    assert kept.energy == pytest.approx(np.mean(1.0 - expected))
    far = FastRobustIcp(0.001, nu_m=0.001).weigh(pairs_at(10.0 + distances_m))
    assert far.weights.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_the_welsch_scale_halves_at_rest_from_three_medians_down():
    method = FastRobustIcp(nu_min_m=0.1)
    assert not method.settled
    kept = method.weigh(pairs_at([0.1, 0.2, 0.3]))
    assert kept.sigma_m == pytest.approx(0.6)
    method = method.following(kept, still=False)
    scales_m = []
    while not method.settled:
        scales_m.append(method.nu_m)
        kept = method.weigh(pairs_at([5.0, 5.0, 5.0]))
        assert method.following(kept, still=False).nu_m == method.nu_m
        method = method.following(kept, still=True)
    np.testing.assert_allclose([*scales_m, method.nu_m], [0.6, 0.3, 0.15, 0.1])


def test_the_last_welsch_scale_comes_from_the_six_nearest():
    """On a line every inner point's nearest six are at 1, 1, 2, 2, 3, 3 spacings."""
    line = np.arange(100.0)[:, None] * [0.01, 0.0, 0.0]
    assert neighbourhood_m(line) == pytest.approx(0.02)
    first = FastRobustIcp.starting(RegistrationConfig(metric="point"), PointCloud(line), PointCloud(line))
    assert first.nu_min_m == pytest.approx(0.02 / (3.0 * np.sqrt(3.0)))


@pytest.mark.parametrize("nu_m", [0.1, 0.3])
def test_acceleration_saves_iterations_and_keeps_the_answer(coloured, nu_m):
    """The same weights with plain steps take longer from 6 degrees and 6 cm to the same place."""

    class Plain(FastRobustIcp):
        accelerated = False

    rows = np.random.default_rng(3).permutation(len(coloured))
    T = rigid(rotation_exp(np.deg2rad(6.0) * np.array([2.0, -1.0, 2.0]) / 3.0), [0.036, -0.036, 0.032])
    source, target = coloured.select(rows[:900]).transformed(inverse(T)), coloured.select(rows[600:])
    config = RegistrationConfig("fast-robust-icp", "point")
    fast = register(source, target, config, method=lambda *_: FastRobustIcp(nu_m, nu_m))
    plain = register(source, target, config, method=lambda *_: Plain(nu_m, nu_m))
    assert fast.converged
    assert plain.converged
    assert len(fast.steps) < 0.75 * len(plain.steps)
    assert point_error_m(fast.T_target_source, plain.T_target_source, source.points_m) < 2e-3

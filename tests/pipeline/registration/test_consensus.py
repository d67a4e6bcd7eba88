"""Consensus of pairs of points, most of which are wrong."""

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_angle_rad, rotation_exp
from pipeline.registration.consensus import PointPairs, consensus

T_TRUE = rigid(rotation_exp(np.array([0.5, -1.2, 0.8])), np.array([0.7, -0.2, 1.1]))
T_OTHER = rigid(rotation_exp(np.array([0.0, 0.9, 0.0])), np.array([-1.0, 0.4, 0.0]))


def _pairs(right: int, wrong: int, seed: int, sigma_m: float = 0.01, other: int = 0) -> PointPairs:
    """Right pairs first, then pairs of another motion, then pairs at random."""
    rng = np.random.default_rng(seed)
    source_m = rng.uniform(-2.0, 2.0, (right + other + wrong, 3))
    target_m = rng.uniform(-2.0, 2.0, source_m.shape)
    target_m[:right] = apply(T_TRUE, source_m[:right]) + rng.normal(0.0, sigma_m / 2.0, (right, 3))
    of_other = slice(right, right + other)
    target_m[of_other] = apply(T_OTHER, source_m[of_other])
    return PointPairs(source_m, target_m, np.full(len(source_m), sigma_m), np.ones(len(source_m)))


@pytest.mark.parametrize("seed", range(4))
def test_twelve_right_pairs_of_two_hundred_are_found(seed):
    found, *others = consensus(_pairs(12, 188, seed))
    apart = inverse(T_TRUE) @ found.T_target_source
    assert np.degrees(rotation_angle_rad(apart[:3, :3])) < 0.5
    assert np.linalg.norm(apart[:3, 3]) < 0.01
    assert found.inliers[:12].all()
    assert found.inliers[12:].sum() <= 2
    assert all(one.votes < 0.6 * found.votes for one in others)


def test_votes_are_one_less_the_squared_share_of_the_limit():
    """Four pairs at corners of a square, each 6 mm off outwards: no motion brings them nearer."""
    corners_m = np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
    away_m = corners_m * (1.0 + 0.006 / np.sqrt(2.0))
    found, *_ = consensus(PointPairs(corners_m, away_m, np.full(4, 0.01), np.ones(4)))
    np.testing.assert_allclose(found.T_target_source, np.eye(4), atol=1e-9)
    assert found.votes == pytest.approx(4.0 * (1.0 - (0.006 / 0.03) ** 2))


def test_a_precise_pair_counts_more_than_a_rough_one():
    """Along a line of three precise pairs, rough ones that are all 3 cm off hardly move the pose."""
    pairs = _pairs(20, 0, 1, sigma_m=1e-4)
    target_m = pairs.target_m.copy()
    target_m[10:, 0] += 0.03
    sigma_m = np.where(np.arange(20) < 10, 0.001, 0.05)
    found, *_ = consensus(PointPairs(pairs.source_m, target_m, sigma_m, pairs.votes))
    off_m = apply(found.T_target_source, pairs.source_m[:10]) - apply(T_TRUE, pairs.source_m[:10])
    assert np.linalg.norm(off_m, axis=1).max() < 0.001


def test_the_rival_is_the_second_best_motion():
    found, *others = consensus(_pairs(20, 30, 5, other=14))
    assert np.linalg.norm(found.T_target_source - T_TRUE) < 0.05
    assert 12.0 < others[0].votes <= 16.0


def test_no_motion_from_less_than_three_pairs_or_from_a_line():
    assert not consensus(_pairs(2, 0, 0))
    line_m = np.linspace(0.0, 1.0, 10)[:, None] * np.array([1.0, 2.0, 3.0])
    assert not consensus(PointPairs(line_m, line_m, np.full(10, 0.01), np.ones(10)))


def test_three_pairs_are_enough():
    found, *others = consensus(_pairs(3, 0, 3, sigma_m=1e-6))
    np.testing.assert_allclose(found.T_target_source, T_TRUE, atol=1e-5)
    assert not others


def test_a_mirrored_cloud_has_no_consensus():
    pairs = _pairs(100, 0, 2)
    mirrored_m = pairs.target_m * np.array([-1.0, 1.0, 1.0])
    found = consensus(PointPairs(pairs.source_m, mirrored_m, pairs.sigma_m, pairs.votes))
    assert all(one.inliers.sum() < 15 for one in found)


def test_a_picture_on_a_wall_is_not_seen_from_behind():
    """A mirrored plane is that plane seen from the other side: a rigid motion, but no camera sees it so."""
    rng = np.random.default_rng(4)
    wall_m = np.column_stack([rng.uniform(-1.0, 1.0, (40, 2)), np.full(40, 2.0)])
    sigma_m, votes = np.full(40, 0.01), np.ones(40)
    mirrored_m = wall_m * np.array([-1.0, 1.0, 1.0])
    assert not consensus(PointPairs(wall_m, mirrored_m, sigma_m, votes))
    turn = rigid(rotation_exp(np.array([0.0, 0.3, 0.0])), np.array([0.5, 0.0, 0.1]))
    found, *_ = consensus(PointPairs(wall_m, apply(turn, wall_m), sigma_m, votes))
    np.testing.assert_allclose(found.T_target_source, turn, atol=1e-9)

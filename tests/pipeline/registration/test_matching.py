"""Pairs at any pose equal a search from scratch, although most are reused from the pose before."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.registration.matching import Matcher
from pipeline.types import PointCloud

COUNT = 300


def _clouds(rng: np.random.Generator) -> tuple[PointCloud, PointCloud]:
    """Two samples of one wavy sheet, 2 m wide: points about 6 cm apart."""

    def look() -> PointCloud:
        x, y = rng.uniform(-1.0, 1.0, (2, COUNT))
        return PointCloud(np.stack([x, y, 0.2 * np.sin(4 * x) * np.cos(3 * y)], axis=1))

    return look(), look()


def _walk(rng: np.random.Generator, steps: int, pace: float) -> list[np.ndarray]:
    """Poses that wander: each is the one before, moved by up to ``pace`` metres and radians."""
    poses = [np.eye(4)]
    for _ in range(steps):
        omega, shift = pace * rng.uniform(-1.0, 1.0, (2, 3))
        poses.append(rigid(rotation_exp(omega), shift) @ poses[-1])
    return poses


def _searched(source: PointCloud, target: PointCloud, T: np.ndarray, direction: str, gate_m: float) -> set:
    """The pairs within the gate by a new search at the pose."""
    moved_m, pairs = apply(T, source.points_m), set()
    if direction != "p2q":
        gaps_m, nearest = cKDTree(target.points_m).query(moved_m)
        pairs |= {(i, int(nearest[i])) for i in np.flatnonzero(gaps_m <= gate_m).tolist()}
    if direction != "q2p":
        gaps_m, nearest = cKDTree(moved_m).query(target.points_m)
        pairs |= {(int(nearest[j]), j) for j in np.flatnonzero(gaps_m <= gate_m).tolist()}
    return pairs


@pytest.mark.parametrize("direction", ["q2p", "p2q", "both"])
@pytest.mark.parametrize("counts", [(1, 50), (50, 1), (1, 1)])
def test_a_cloud_may_be_one_point(counts, direction):
    rng = np.random.default_rng(0)
    source, target = (PointCloud(rng.uniform(-1.0, 1.0, (count, 3))) for count in counts)
    matcher = Matcher(source, target, direction)
    for T, gate_m in zip(_walk(rng, 4, 0.1), (0.3, 1.0, 0.1, 2.0, np.inf), strict=True):
        found = matcher.match(T, gate_m=gate_m)
        near = found.distances_m <= gate_m
        pairs = np.stack([found.source_rows, found.target_rows], axis=1)[near]
        assert set(map(tuple, pairs.tolist())) == _searched(source, target, T, direction, gate_m)


@given(
    seed=st.integers(0, 2**32 - 1),
    direction=st.sampled_from(["q2p", "p2q", "both"]),
    pace=st.sampled_from([0.0, 0.001, 0.01, 0.1]),
    gates_m=st.lists(st.sampled_from([0.01, 0.03, 0.06, 0.1, 0.3, np.inf]), min_size=2, max_size=12),
)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_reused_neighbours_are_those_of_a_new_search(seed, direction, pace, gates_m):
    """Under gates that grow and shrink in any order, while the pose stays, creeps or jumps."""
    rng = np.random.default_rng(seed)
    source, target = _clouds(rng)
    matcher = Matcher(source, target, direction)
    for T, gate_m in zip(_walk(rng, len(gates_m) - 1, pace), gates_m, strict=True):
        matching = matcher.match(T, gate_m=gate_m)
        pairs = np.stack([matching.source_rows, matching.target_rows], axis=1)
        moved_m = apply(T, source.points_m)[matching.source_rows]
        gaps_m = np.linalg.norm(moved_m - target.points_m[matching.target_rows], axis=1)
        np.testing.assert_allclose(matching.distances_m, gaps_m, atol=1e-12)
        within = set(map(tuple, pairs[matching.distances_m <= gate_m].tolist()))
        assert within == _searched(source, target, T, direction, gate_m)
        everything = _searched(source, target, T, direction, np.inf)
        assert set(map(tuple, pairs.tolist())) <= everything  # beyond the gate, at most true neighbours


@given(
    seed=st.integers(0, 2**32 - 1), shares=st.lists(st.sampled_from([0.1, 0.4, 1.0]), min_size=2, max_size=8)
)
@settings(max_examples=50, deadline=None, derandomize=True)
def test_subsets_of_the_points_do_not_mix_their_neighbours(seed, shares):
    """Each share has its own neighbours, also when a smaller one comes back after a larger one."""
    rng = np.random.default_rng(seed)
    source, target = _clouds(rng)
    matcher = Matcher(source, target, "q2p")
    for T, share in zip(_walk(rng, len(shares) - 1, 0.005), shares, strict=True):
        matching = matcher.match(T, source_share=share, target_share=share)
        used = np.unique(matcher.match(T, source_share=1.0, target_share=share).target_rows)
        assert len(matching.source_rows) == len(np.unique(matching.source_rows)) == round(share * COUNT)
        gaps_m = np.linalg.norm(matching.moved_m[:, None] - target.points_m[used][None], axis=2)
        np.testing.assert_allclose(matching.distances_m, gaps_m.min(axis=1), atol=1e-12)


def test_smaller_shares_lie_within_larger_ones():
    source, target = _clouds(np.random.default_rng(0))
    matcher = Matcher(source, target, "q2p")
    rows = [set(matcher.match(np.eye(4), source_share=share).source_rows.tolist()) for share in (0.1, 0.5, 1)]
    assert rows[0] < rows[1] < rows[2] == set(range(COUNT))


@pytest.mark.parametrize("scale", [1 / 3, 3.0])
def test_the_gate_is_measured_in_the_targets_unit(scale):
    """Target points look for partners in the source's frame, whose unit of length is another one."""
    source, target = _clouds(np.random.default_rng(1))
    T, source = np.diag([scale, scale, scale, 1.0]), PointCloud(source.points_m / scale)
    matching = Matcher(source, target, "p2q").match(T, gate_m=0.05)
    within = matching.distances_m <= 0.05
    pairs = np.stack([matching.source_rows, matching.target_rows], axis=1)[within]
    assert set(map(tuple, pairs.tolist())) == _searched(source, target, T, "p2q", 0.05)


def test_of_several_neighbours_the_nearest_come_first_in_each_block():
    source, target = _clouds(np.random.default_rng(2))
    matching = Matcher(source, target, "q2p").match(np.eye(4), neighbours=4)
    _, nearest = cKDTree(target.points_m).query(source.points_m, k=4)
    np.testing.assert_array_equal(matching.source_rows, np.repeat(np.arange(COUNT), 4))
    np.testing.assert_array_equal(matching.target_rows.reshape(COUNT, 4), nearest)


def _with_normals(normals) -> PointCloud:
    """Points far apart, each with its own normal."""
    normals = np.asarray(normals, dtype=float)
    places = 10.0 * np.eye(3)[: len(normals)]
    return PointCloud(places, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def test_the_normal_of_a_pair_is_the_mean_of_both_in_the_targets_frame():
    """Turned by 90 degrees about z, x becomes y, halfway to which (1, 1, 0) is at 67.5 degrees."""
    T = rigid(rotation_exp(np.array([0.0, 0.0, np.pi / 2])), np.zeros(3))
    source = _with_normals([[1, 0, 0], [0, 0, -1], [0, -1, 0]])
    normals = _with_normals([[1, 1, 0], [0, 0, 1], [3, 0, 4]]).normals
    target = PointCloud(apply(T, source.points_m), normals=normals)
    pairs = Matcher(source, target, "q2p", with_normals=True).match(T)
    np.testing.assert_allclose(pairs.cosines, [np.sqrt(0.5), 1.0, 0.6], atol=1e-12)
    halfway = np.radians(67.5)
    expected = np.array([[np.cos(halfway), np.sin(halfway), 0.0], [0.0, 0.0, 1.0], [1.6, 0.0, 0.8]])
    expected[2] /= np.sqrt(3.2)
    np.testing.assert_allclose(pairs.normals, expected, atol=1e-12)


@pytest.mark.parametrize("scale", [0.2, 1.0, 7.0])
def test_the_scale_of_a_pose_changes_no_normal(scale):
    rng = np.random.default_rng(4)
    source, turn = _clouds(rng)[0], rotation_exp(np.array([0.3, -0.2, 0.5]))
    target = PointCloud(apply(rigid(turn, np.ones(3)), source.points_m))
    normals = _with_unit(rng.normal(size=(COUNT, 3)))
    source = PointCloud(source.points_m / scale, normals=normals)
    target = PointCloud(target.points_m, normals=normals @ turn.T)
    pairs = Matcher(source, target, "q2p", with_normals=True).match(rigid(scale * turn, np.ones(3)))
    np.testing.assert_allclose(pairs.cosines, 1.0, atol=1e-12)
    np.testing.assert_allclose(pairs.normals, target.normals[pairs.target_rows], atol=1e-12)


def test_matching_back_is_matching_the_swapped_clouds():
    """Pairs, cosines and normals, up to the frame, of p2q at T and of q2p at its inverse."""
    source, target = (
        PointCloud(cloud.points_m, normals=_with_unit(rng.normal(size=(COUNT, 3))))
        for rng in [np.random.default_rng(5)]
        for cloud in _clouds(rng)
    )
    T = rigid(rotation_exp(np.array([0.1, 0.2, -0.1])), [0.05, 0.0, -0.02])
    back = Matcher(source, target, "p2q", with_normals=True).match(T)
    swapped = Matcher(target, source, "q2p", with_normals=True).match(np.linalg.inv(T))
    np.testing.assert_array_equal(back.source_rows, swapped.target_rows)
    np.testing.assert_array_equal(back.target_rows, swapped.source_rows)
    np.testing.assert_allclose(back.distances_m, swapped.distances_m, atol=1e-12)
    np.testing.assert_allclose(back.cosines, swapped.cosines, atol=1e-12)
    turned = swapped.normals @ T[:3, :3].T
    sides = np.sign(np.einsum("mi,mi->m", turned, back.normals))
    np.testing.assert_allclose(sides[:, None] * turned, back.normals, atol=1e-9)


def _with_unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

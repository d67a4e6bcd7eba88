"""The peers get the same question as our methods, and answer it."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.geometry import inverse
from pipeline.registration.metrics import point_error_m
from pipeline.registration.peers import PEERS, available_peers, run_peer
from pipeline.types import PointCloud

GATE_M = 0.3


@pytest.fixture(scope="module")
def two_looks(corner, motion) -> tuple[PointCloud, PointCloud]:
    """The corner through two disjoint halves of its points; ``motion`` brings source to target."""
    rows = np.random.default_rng(1).permutation(len(corner))
    half = len(corner) // 2
    return corner.select(rows[:half]).transformed(inverse(motion)), corner.select(rows[half:])


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_finds_the_motion_from_the_identity(name, two_looks, motion):
    if name not in available_peers():
        pytest.skip(f"{PEERS[name].module} is not installed")
    source, target = two_looks
    result = run_peer(name, source, target, GATE_M)
    start_m = point_error_m(np.eye(4), motion, source.points_m)
    assert start_m > 0.05
    assert point_error_m(result.T_target_source, motion, source.points_m) < 0.4 * start_m
    rotation = result.T_target_source[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
    assert result.elapsed_s > 0
    assert result.iterations is None or 0 < result.iterations <= 100


@pytest.mark.parametrize("name", available_peers())
def test_a_start_at_the_truth_is_kept(name, two_looks, motion):
    source, target = two_looks
    result = run_peer(name, source, target, GATE_M, motion)
    assert point_error_m(result.T_target_source, motion, source.points_m) < 0.015


@pytest.mark.parametrize("name", [name for name in available_peers() if name != "cpd"])
def test_clouds_apart_are_degenerate_and_keep_the_start(name, two_looks):
    source, target = two_looks
    away = np.eye(4)
    away[0, 3] = 50.0
    result = run_peer(name, source, target, GATE_M, away)
    assert result.stop_reason.startswith("degenerate")
    np.testing.assert_allclose(result.T_target_source, away, atol=1e-9)


def test_an_unknown_peer_is_named_beside_the_known(corner):
    with pytest.raises(InputError, match="no peer 'pcl' here; try one of open3d-point"):
        run_peer("pcl", corner, corner, GATE_M)


def test_points_that_are_not_finite_are_refused(corner):
    broken = PointCloud(np.full((5, 3), np.nan))
    with pytest.raises(InputError, match="source cloud has 5 points with NaN"):
        run_peer("open3d-point", broken, corner, GATE_M)

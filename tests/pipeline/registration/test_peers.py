"""Every peer finds a known motion, as exactly as its method can."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import inverse
from pipeline.registration.metrics import point_error_m
from pipeline.registration.peers import PEERS, available_peers, run_peer
from pipeline.types import PointCloud

GATE_M = 0.3
WORST_M = {
    "open3d-point": 0.009,
    "open3d-plane": 0.003,
    "open3d-gicp": 0.0005,
    "small-gicp": 0.0005,
    "small-vgicp": 0.001,
    "small-gicp-staged": 0.0005,
    "small-vgicp-staged": 0.001,
    "cpd": 0.012,
}
"""Largest point error where the two clouds share no point: points are 3 cm apart, the start is 9.6 cm off."""


@pytest.fixture(scope="module", params=range(2))
def two_looks(request, corner, motion) -> tuple[PointCloud, PointCloud]:
    """The corner through two disjoint halves of its points; ``motion`` brings source to target."""
    rows = np.random.default_rng(request.param).permutation(len(corner))
    half = len(corner) // 2
    return corner.select(rows[:half]).transformed(inverse(motion)), corner.select(rows[half:])


def _skip_unless_installed(name):
    if name not in available_peers():
        pytest.skip(f"{PEERS[name].module} is not installed")


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_finds_the_motion_between_two_samplings(name, two_looks, motion):
    _skip_unless_installed(name)
    source, target = two_looks
    result = run_peer(name, source, target, GATE_M)
    assert point_error_m(np.eye(4), motion, source.points_m) > 0.09
    assert point_error_m(result.T_target_source, motion, source.points_m) < WORST_M[name]
    rotation = result.T_target_source[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
    assert result.iterations is None or 0 < result.iterations <= 100


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_finds_the_motion_of_the_same_points_exactly(name, corner, motion):
    """Every point has its partner; only voxels, which average the target, leave up to half a millimetre."""
    _skip_unless_installed(name)
    result = run_peer(name, corner.transformed(inverse(motion)), corner, GATE_M)
    error_m = point_error_m(result.T_target_source, motion, corner.points_m)
    assert error_m < (0.0005 if "vgicp" in name else 1e-9)


@pytest.mark.parametrize("name", available_peers())
def test_a_peer_goes_on_from_the_start_pose_that_it_is_given(name, two_looks, motion):
    """From 40 cm off it would not find back: at the truth it stays, wherever the source's own frame is."""
    source, target = two_looks
    away = np.eye(4)
    away[:3, 3] = [0.3, -0.2, 0.2]
    result = run_peer(name, source.transformed(away), target, 0.1, motion @ inverse(away))
    assert point_error_m(result.T_target_source @ away, motion, source.points_m) < WORST_M[name]


@pytest.mark.parametrize("name", [name for name in available_peers() if not name.startswith("open3d")])
@pytest.mark.parametrize("most", [1, 2])
def test_a_peer_uses_up_its_iterations_in_all_its_stages_together(name, most, two_looks):
    """From 10 cm off, none converges in two."""
    result = run_peer(name, *two_looks, GATE_M, max_iterations=most)
    assert (result.iterations, result.stop_reason) == (most, "max_iterations")


def test_one_iteration_moves_the_source_once(two_looks):
    """Two stages of one iteration each would come nearer to the truth than one iteration."""
    _skip_unless_installed("small-gicp-staged")
    staged, plain = (
        run_peer(name, *two_looks, GATE_M, max_iterations=1) for name in ("small-gicp-staged", "small-gicp")
    )
    np.testing.assert_allclose(staged.T_target_source, plain.T_target_source, atol=1e-9)


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

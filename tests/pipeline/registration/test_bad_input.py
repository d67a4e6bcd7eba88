from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import rigid
from pipeline.registration import iterate_registration, register
from pipeline.types import PointCloud

CONFIG = RegistrationConfig()
FAR = rigid(np.eye(3), [0.0, 0.0, 50.0])


def test_fewer_than_three_points(corner):
    with pytest.raises(InputError, match="source cloud has 2 points"):
        iterate_registration(corner.select(np.arange(2)), corner, CONFIG)
    with pytest.raises(InputError, match="target cloud has 0 points"):
        iterate_registration(corner, PointCloud(np.empty((0, 3))), CONFIG)


def test_a_method_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(InputError, match=r"registration\.method is cpd; try one of icp, .*fast-robust-icp"):
        RegistrationConfig("cpd")


def test_points_that_are_not_finite(corner):
    points_m = corner.points_m.copy()
    points_m[[3, 8], 1] = np.nan, np.inf
    with pytest.raises(InputError, match="target cloud has 2 points with NaN"):
        iterate_registration(corner, PointCloud(points_m), CONFIG)


@pytest.mark.parametrize("T", [np.eye(3), np.full((4, 4), np.nan)])
def test_a_start_pose_that_is_none(corner, T):
    with pytest.raises(InputError, match="start pose"):
        iterate_registration(corner, corner, CONFIG, T)


@pytest.mark.parametrize("method", ["ceicp-n", "ceicp-a"])
@pytest.mark.parametrize(("gate_m", "gate"), [(0.3, "30 cm"), (0.001, "0.1 cm"), (2.5, "2.5 m")])
def test_clouds_without_overlap(corner, method, gate_m, gate):
    config = replace(CONFIG, method=method, gate_m=gate_m)
    with pytest.raises(ReconstructionError, match=f"within the gate of {gate} at the start.*do not overlap"):
        register(corner, corner, config, FAR)


def test_clouds_without_overlap_for_a_method_without_a_gate(corner):
    away = rigid(np.eye(3), [0.0, 0.0, 3000.0])
    with pytest.raises(
        ReconstructionError, match="No pair of points counts at the start pose: the clouds are"
    ):
        register(corner, corner, replace(CONFIG, method="ceicp-ml"), away)


def test_near_points_whose_normals_differ_are_not_said_to_be_far():
    rng = np.random.default_rng(0)
    points_m = np.column_stack([rng.uniform(-1.0, 1.0, (500, 2)), np.full(500, 2.0)])
    up, across = (PointCloud(points_m, normals=np.tile(normal, (500, 1))) for normal in np.eye(3)[[2, 0]])
    with pytest.raises(ReconstructionError, match="No pair of near points has similar normals at the start"):
        register(up, across, CONFIG)


def test_too_few_pairs_keep_the_start_pose(corner):
    lonely = PointCloud(np.concatenate([corner.points_m[:4], corner.points_m[4:] + FAR[:3, 3]]))
    result = register(lonely, corner, replace(CONFIG, method="ceicp-n", metric="point"), np.eye(4))
    assert result.stop_reason == "degenerate: only 4 pairs are close enough"
    assert not result.converged
    assert not result.steps
    np.testing.assert_array_equal(result.T_target_source, np.eye(4))


def test_too_few_effective_pairs(corner):
    nine = corner.select(np.arange(9))
    result = register(nine, corner, replace(CONFIG, method="icp"))
    assert result.stop_reason.startswith("degenerate: only 9.0 pairs carry")


def test_a_lone_wall_lets_the_source_slide():
    rng = np.random.default_rng(0)
    wall = PointCloud(np.column_stack([rng.uniform(-1, 1, (500, 2)), np.full(500, 2.0)]))
    result = register(wall, wall, CONFIG, rigid(np.eye(3), [0.0, 0.0, 0.1]))
    assert result.stop_reason.startswith(
        "degenerate: sliding in any direction perpendicular to z and turning about z changes no"
    )
    assert register(wall, wall, replace(CONFIG, metric="point")).converged


def test_a_line_of_points():
    line = PointCloud(np.linspace(0.0, 1.0, 50)[:, None] * np.array([1.0, 1.0, 2.0]) + 1.0)
    result = register(line, line, replace(CONFIG, metric="point"))
    assert result.stop_reason.startswith("degenerate: the pairs lie on one line")


def test_it_widens_once_before_giving_up():
    """Points 20 cm off in alternating directions pull nowhere, and a gate of 15 cm holds none of them."""
    index = np.stack(np.meshgrid(*3 * [np.arange(4)]), axis=-1).reshape(-1, 3)
    offset_m = 0.2 * (-1.0) ** index.sum(axis=1, keepdims=True) * np.array([1.0, 0.0, 0.0])
    grid = PointCloud(1.0 * index)
    config = replace(CONFIG, metric="point", sigma_decay=0.5, sigma_min_m=0.001)
    result = register(PointCloud(grid.points_m + offset_m), grid, config)
    np.testing.assert_allclose([step.sigma_m for step in result.steps], [0.2, 0.1, 0.1])
    assert result.stop_reason == "degenerate: only 0 pairs are close enough"
    np.testing.assert_allclose(result.T_target_source, np.eye(4), atol=1e-12)

"""Errors of trajectories beside those of evo, the program that the field uses (Grupp 2017)."""

import numpy as np
import pytest
from evo.core import metrics
from evo.core.trajectory import PosePath3D, PoseTrajectory3D

from lab.walks.judging import rpe_m
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.recording.errors import ate_m

FRAMES = 90


@pytest.fixture(scope="module")
def paths():
    """A walk of three seconds, and the same with drift and noise in another world."""
    rng = np.random.default_rng(5)
    true, drifted, T = [], [], np.eye(4)
    world = rigid(rotation_exp(np.array([0.4, -1.1, 0.7])), np.array([3.0, -1.0, 2.0]))
    for _ in range(FRAMES):
        step = rigid(rotation_exp(rng.normal(0.0, 0.02, 3)), rng.normal(0.02, 0.01, 3))
        T = T @ step
        true.append(T)
        off = rigid(rotation_exp(rng.normal(0.0, 0.003, 3)), rng.normal(0.0, 0.003, 3))
        drifted.append((drifted[-1] @ step if drifted else world @ step) @ off)
    return drifted, true


def test_the_absolute_error_is_evo_s_after_rigid_alignment(paths):
    own, true = (PosePath3D(poses_se3=path) for path in paths)
    own.align(true)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((true, own))
    rmse_m = error.get_statistic(metrics.StatisticsType.rmse)
    assert rmse_m > 0.005
    assert ate_m(*paths) == pytest.approx(rmse_m, rel=1e-9)


def test_the_relative_error_over_a_second_is_evo_s(paths):
    times_s = np.arange(FRAMES) / 30.0
    own, true = (PoseTrajectory3D(poses_se3=path, timestamps=times_s) for path in paths)
    error = metrics.RPE(
        metrics.PoseRelation.translation_part, delta=30, delta_unit=metrics.Unit.frames, all_pairs=True
    )
    error.process_data((true, own))
    rmse_m = error.get_statistic(metrics.StatisticsType.rmse)
    assert rmse_m > 0.005
    assert rpe_m(*paths, times_s) == pytest.approx(rmse_m, rel=1e-9)

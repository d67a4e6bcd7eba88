"""The calibration experiments: their trials are those of SPEC 1.4, and a verdict can come out either way."""

from dataclasses import replace

import numpy as np
import pytest

from lab.claims.calibration import protocol
from lab.claims.calibration.claims import CLAIMS
from lab.claims.calibration.photograph import seen_px
from lab.claims.calibration.protocol import (
    BOARD,
    CAMERA,
    EULER_DEG,
    SIGMAS_PX,
    TRUTH,
    VIEWS,
    CalibrationStudy,
    JointTask,
    PhotographTask,
    PoseTask,
    euler_deg,
    joint_trials,
    photograph_trial,
    pose_trials,
    random_pose,
)
from pipeline.kernels.geometry import rigid, rotation_exp


def test_boards_are_wholly_in_the_picture_and_tilted_as_asked():
    rng = np.random.default_rng(0)
    for _ in range(50):
        T = random_pose(rng)
        points_px = seen_px(BOARD, T, CAMERA)
        assert points_px.min() >= 5.0
        assert (points_px.max(axis=0) <= (594.0, 494.0)).all()
        assert 15.0 - 1e-9 <= np.degrees(np.arccos(T[2, 2])) <= 45.0 + 1e-9
        assert 0.4 <= T[2, 3] <= 0.8


def test_angles_come_back():
    rx, ry, rz = np.radians(EULER_DEG)
    R = np.eye(3)
    for axis, angle in ((2, rz), (1, ry), (0, rx)):
        R = R @ rotation_exp(angle * np.eye(3)[axis])
    assert euler_deg(rigid(R, np.zeros(3))) == pytest.approx(EULER_DEG)


def test_without_noise_nothing_is_off_and_errors_grow_with_it(monkeypatch):
    monkeypatch.setattr(protocol, "CHUNK", 4)
    exact, noisy, double = (joint_trials(JointTask(4, sigma, 0)) for sigma in (0.0, 0.3, 0.6))
    for name in TRUTH:
        assert np.abs(exact[name]).max() < 1e-3
        assert np.std(double[name]) == pytest.approx(2.0 * np.std(noisy[name]), rel=0.2)
    assert np.mean(noisy["rms_px"]) == pytest.approx(0.3 * np.sqrt(2.0), rel=0.1)
    assert np.abs(pose_trials(PoseTask(0.0, 0))).max() < 1e-3
    assert np.abs(pose_trials(PoseTask(1.0, 0))).max() > 1e-3


def test_a_photograph_is_found_the_right_way_up():
    found = photograph_trial(PhotographTask(20))
    assert (found["found"], found["upright"]) == (1.0, 1.0)
    assert found["error_px"] < 0.15


def study(scale):
    """Made-up trials whose errors are so many times those expected."""
    rng = np.random.default_rng(0)
    sizes = {"fx": 3.3, "fy": 3.3, "cx": 1.1, "cy": 1.1, "k1": 0.0165, "k2": 0.044}
    joint = {}
    for views in VIEWS:
        for sigma in SIGMAS_PX:
            by = scale * sigma * np.sqrt(8.0 / views)
            cell = {name: by * size * rng.standard_normal(200) for name, size in sizes.items()}
            cell["fy"] = cell["fx"]
            cell |= {f"sd_{name}": np.full(200, by * size) for name, size in sizes.items()}
            rms = np.full(200, 1.4 * sigma)
            others = {"rotation_deg": rms, "translation": rms}
            joint[views, sigma] = cell | {"rms_px": rms, "held_out_px": 1.01 * rms} | others
    pose = {sigma: scale * sigma * 1e-4 * rng.standard_normal((200, 6)) for sigma in SIGMAS_PX}
    photographs = [{"found": float(scale < 5.0), "upright": 1.0, "error_px": 0.05 * scale}] * 40
    return CalibrationStudy(joint, pose, photographs)


@pytest.mark.parametrize("claim", [one for one in CLAIMS if one.prepare], ids=lambda one: one.id)
def test_every_claim_judges_the_expected_and_says_why(claim):
    verdict = claim.judge(study(1.0))
    assert verdict.verdict == "reproduced"
    assert len(verdict.why) > 30


@pytest.mark.parametrize("name", ["C01", "C04", "C05", "C07"])
def test_ten_times_the_errors_are_not_reproduced(name):
    (claim,) = (one for one in CLAIMS if one.id == name)
    assert claim.judge(study(40.0)).verdict == "not reproduced"


def test_c01_needs_every_photograph_not_their_mean():
    (claim,) = (one for one in CLAIMS if one.id == "C01")
    trials = study(1.0)
    one_off = replace(
        trials, photographs=[*trials.photographs[1:], {"found": 1, "upright": 1, "error_px": 0.2}]
    )
    assert claim.judge(one_off).ours["mean_error_px"] < 0.15
    assert claim.judge(one_off).verdict == "not reproduced"


def test_the_misprints_are_worked_out_from_the_printed_table():
    (claim,) = (one for one in CLAIMS if one.id == "C08")
    verdict = claim.judge()
    assert verdict.verdict == "true by definition"
    assert verdict.ours["sd_ty"] > 0.5
    assert verdict.ours["sd_ty_with_20_for_21_67"] < 0.01

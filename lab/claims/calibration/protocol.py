"""The experiments E1 and E2 of SPEC 1.4: a known camera, views of the thesis's board, noise on its points."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lab.claims.calibration.photograph import photograph, seen_px
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.estimate import View, calibrate, place, rms_px
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.registration import rotation_error_rad
from pipeline.types import CameraIntrinsics, FloatArray

BOARD = Board()
CAMERA = CameraIntrinsics(
    np.array([[500.0, 0.0, 300.0], [0.0, 500.0, 250.0], [0.0, 0.0, 1.0]]),
    np.array([0.05, 0.1, 0.0, 0.0, 0.0]),
    600,
    500,
)
TRUTH = {"fx": 500.0, "fy": 500.0, "cx": 300.0, "cy": 250.0, "k1": 0.05, "k2": 0.1}
VIEWS = (4, 8, 16)
SIGMAS_PX = (0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0)
TRIALS, CHUNK = 200, 50
HELD_OUT = 4
TILT_DEG, TURN_DEG = (15.0, 45.0), 20.0
AWAY_M, MARGIN_PX = (0.4, 0.8), 5.0
EULER_DEG, MOVE_M = (60.0, -10.0, 18.0), (0.03, 0.02, 0.6)
"""E2's pose: about x, then y, then z; with the thesis's own translation the board is out of view."""
LARGE = CameraIntrinsics(
    np.array([[1150.0, 0.0, 690.0], [0.0, 1150.0, 515.0], [0.0, 0.0, 1.0]]),
    np.array([0.05, 0.1, 0.0, 0.0, 0.0]),
    1380,
    1030,
)
"""A camera with the thesis's image size."""
PHOTOGRAPHS, MOST_TILT_DEG, GREY_SD, AWAY_LARGE_M = 40, 50.0, 3.0, 0.65


@dataclass(frozen=True, slots=True)
class JointTask:
    """E1: lens and poses estimated together; ``CHUNK`` of the trials with this number of views and noise."""

    views: int
    sigma_px: float
    first: int
    """Seed of the first trial; the others follow."""


@dataclass(frozen=True, slots=True)
class PoseTask:
    """E2: the pose estimated alone, with a known lens; ``CHUNK`` of the trials with this noise."""

    sigma_px: float
    first: int
    """Seed of the first trial; the others follow."""


@dataclass(frozen=True, slots=True)
class PhotographTask:
    """C01: one rendered photograph of the board."""

    index: int
    """Number of the photograph, from 0; the tilt grows with it."""


@dataclass(frozen=True, slots=True)
class CalibrationStudy:
    """All trials of C01 to C08."""

    joint: dict[tuple[int, float], dict[str, FloatArray]]
    """(TRIALS,) of each measure, by number of views and noise."""
    pose: dict[float, FloatArray]
    """(TRIALS, 6) errors by noise: degrees about x, y, z and metres along x, y, z."""
    photographs: list[dict[str, float]]


def random_pose(rng: np.random.Generator) -> FloatArray:
    """Return a random (4, 4) T_camera_board with the whole board in the picture."""
    while True:
        axis, turn = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(-TURN_DEG, TURN_DEG))
        tilt = np.radians(rng.uniform(*TILT_DEG))
        R = rotation_exp(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
        away_m = rng.uniform(*AWAY_M)
        aside_m = rng.uniform(-0.4, 0.4, 2) * away_m
        T = rigid(R @ rotation_exp(np.array([0.0, 0.0, turn])), np.array([*aside_m, away_m]))
        points_px = seen_px(BOARD, T, CAMERA)
        high_px = np.array([CAMERA.width_px, CAMERA.height_px]) - 1.0 - MARGIN_PX
        if ((points_px >= MARGIN_PX) & (points_px <= high_px)).all():
            return T


def noisy_view(T: FloatArray, sigma_px: float, rng: np.random.Generator) -> View:
    """Return a view of the board at the pose T, with Gaussian noise on its image points."""
    points_px = seen_px(BOARD, T, CAMERA)
    return View("", points_px + sigma_px * rng.standard_normal(points_px.shape), BOARD.points_m)


def joint_trials(task: JointTask) -> dict[str, list[float]]:
    """Return by name, for each trial: parameter errors, their predicted standard errors, RMS in pixels of the
    used and held-out views, and mean errors of the poses (degrees, and share of the distance)."""
    found: dict[str, list[float]] = {}
    for seed in range(task.first, task.first + CHUNK):
        rng = np.random.default_rng((task.views, seed))
        poses = [random_pose(rng) for _ in range(task.views + HELD_OUT)]
        views = [noisy_view(T, task.sigma_px, rng) for T in poses]
        camera = calibrate(views[: task.views], (CAMERA.width_px, CAMERA.height_px))
        unseen = [place(view, camera.matrix, camera.distortion) for view in views[task.views :]]
        values = {name: camera.parameters[name] - value for name, value in TRUTH.items()}
        values |= {f"sd_{name}": value for name, value in camera.standard_errors.items()}
        values["rms_px"] = camera.rms_px
        values["held_out_px"] = rms_px(np.concatenate([view.residuals_px for view in unseen]))
        both = list(zip((view.T_camera_board for view in camera.views), poses, strict=False))
        values["rotation_deg"] = float(
            np.degrees(np.mean([rotation_error_rad(one, true) for one, true in both]))
        )
        moved = [np.linalg.norm(one[:3, 3] - true[:3, 3]) / np.linalg.norm(true[:3, 3]) for one, true in both]
        values["translation"] = float(np.mean(moved))
        for name, value in values.items():
            found.setdefault(name, []).append(float(value))
    return found


def pose_trials(task: PoseTask) -> list[list[float]]:
    """Return (CHUNK, 6) errors of the pose: degrees about x, y, z and metres along x, y, z."""
    rx, ry, rz = np.radians(EULER_DEG)
    R = rotation_exp(np.array([0.0, 0.0, rz])) @ rotation_exp(np.array([0.0, ry, 0.0]))
    true = rigid(R @ rotation_exp(np.array([rx, 0.0, 0.0])), np.array(MOVE_M))
    errors = []
    for seed in range(task.first, task.first + CHUNK):
        rng = np.random.default_rng((2, seed))
        found = place(noisy_view(true, task.sigma_px, rng), CAMERA.matrix, CAMERA.distortion).T_camera_board
        turned = np.array(euler_deg(found)) - EULER_DEG
        errors.append([*turned.tolist(), *(found[:3, 3] - true[:3, 3]).tolist()])
    return errors


def euler_deg(T: FloatArray) -> tuple[float, float, float]:
    """Return the angles about x, y, z, in degrees, of the rotation R = Rz Ry Rx in T."""
    R = T[:3, :3]
    angles = (np.arctan2(R[2, 1], R[2, 2]), -np.arcsin(R[2, 0]), np.arctan2(R[1, 0], R[0, 0]))
    rx, ry, rz = np.degrees(angles).tolist()
    return rx, ry, rz


def photograph_trial(task: PhotographTask) -> dict[str, float]:
    """Return, for a noisy photograph, whether the board is found, whether it is the right way up, and the
    mean error of its centres in pixels (NaN if it is not found)."""
    rng = np.random.default_rng((3, task.index))
    axis, turn = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(-180.0, 180.0))
    tilt = np.radians(MOST_TILT_DEG * task.index / max(PHOTOGRAPHS - 1, 1))
    R = rotation_exp(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
    T = rigid(R @ rotation_exp(np.array([0.0, 0.0, turn])), np.array([0.0, 0.0, AWAY_LARGE_M]))
    picture = photograph(BOARD, T, LARGE) + rng.normal(0.0, GREY_SD, (LARGE.height_px, LARGE.width_px))
    found = detect(np.clip(np.rint(picture), 0, 255).astype(np.uint8), BOARD)
    if not found.found:
        return {"found": 0.0, "upright": 0.0, "error_px": float("nan")}
    wanted_px = seen_px(BOARD, T, LARGE)
    apart_px = np.linalg.norm(found.points_px - wanted_px, axis=1)
    turned_px = np.linalg.norm(found.points_px[::-1] - wanted_px, axis=1)
    upright = bool(apart_px.mean() < turned_px.mean())
    error_px = float(min(apart_px.mean(), turned_px.mean()))
    return {"found": 1.0, "upright": float(upright), "error_px": error_px}


def calibration_study(folder: Path, scheduler: str | None) -> Generator[Progress, None, CalibrationStudy]:
    """Run all trials of C01 to C08."""
    run = partial(iterate_trials, folder=folder, scheduler=scheduler)
    chunks = range(0, TRIALS, CHUNK)
    joint = [JointTask(n, sigma, first) for n in VIEWS for sigma in SIGMAS_PX for first in chunks]
    poses = [PoseTask(sigma, first) for sigma in SIGMAS_PX for first in chunks]
    pictures = [PhotographTask(index) for index in range(PHOTOGRAPHS)]
    of_joint = yield from run("E1, lens and poses", joint_trials, joint)
    of_pose = yield from run("E2, the pose alone", pose_trials, poses)
    of_pictures = yield from run("C01, photographs", photograph_trial, pictures)
    cells: dict[tuple[int, float], dict[str, FloatArray]] = {}
    for joint_task, values in zip(joint, of_joint, strict=True):
        cell = cells.setdefault((joint_task.views, joint_task.sigma_px), {})
        for name, column in values.items():
            cell[name] = np.append(cell.get(name, []), column)
    errors: dict[float, list[list[float]]] = {}
    for pose_task, rows in zip(poses, of_pose, strict=True):
        errors.setdefault(pose_task.sigma_px, []).extend(rows)
    return CalibrationStudy(cells, {sigma: np.array(rows) for sigma, rows in errors.items()}, of_pictures)

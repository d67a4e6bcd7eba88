"""A box of known size in front of a camera, and the board views that calibrate the camera (SPEC 7)."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.claims.calibration.box_size import box_size_m
from lab.worlds.board_files import save_board_views
from lab.worlds.board_poses import propose_poses
from lab.worlds.board_views import BoardCamera, render_board_views
from lab.worlds.depth_bias import DepthBias
from lab.worlds.furniture.placing import ORIGIN, board
from lab.worlds.render import Renderer
from lab.worlds.scene import Light, Material, Scene
from lab.worlds.sensor import sense_depth
from lab.worlds.staging import VGA
from lab.worlds.textures import cardboard, plaster
from packetmesh.progress import drain
from pipeline.acquisition import acquire
from pipeline.calibration.board import Board
from pipeline.calibration.depth_from_images import depth_beside, depth_fit
from pipeline.calibration.from_images import image_files, iterate_calibration
from pipeline.config import PRESETS
from pipeline.io.depth_correction import DepthCorrection
from pipeline.kernels.geometry import look_at
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, RgbdFrame

SIZES_M = ((0.30, 0.20, 0.15), (0.40, 0.30, 0.25), (0.20, 0.15, 0.10))
POSITIONS_DEG = (0.0, 45.0, 90.0)
ELEVATION_DEG, AWAY_M = 25.0, (0.8, 1.2)
GROUND_M = 1.6
"""Side length of the table."""
STATES = ("as bought", "lens calibrated", "lens and depth calibrated", "known exactly")
BOARD, MOMENTS = Board("circles", 11, 9, 0.05), 12
FOCAL_SHARE, CENTER_PX = 0.02, 8.0
"""Deviation of the camera from its data sheet: of the focal lengths (more or less by this share, with 0.2 %
of noise), and of the principal point (at most)."""
SCALE, OFFSET_M, WAVE = 0.01, 0.03, 0.002
"""Largest biases of the depth sensor; such sizes were measured on an Astra and on Kinects (SPEC 1.5)."""


@dataclass(frozen=True, slots=True)
class BoxTask:
    """One camera, its calibration, and all boxes at all positions."""

    seed: int


def uncalibrated_camera(rng: np.random.Generator) -> BoardCamera:
    """Return a camera with its true parameters; its buyer knows only ``VGA``, from which they deviate."""
    focal_px = VGA.fx_px * (1.0 + FOCAL_SHARE * rng.choice([-1.0, 1.0])) * (1.0 + 0.002 * rng.normal(size=2))
    center_px = np.array([VGA.cx_px, VGA.cy_px]) + rng.uniform(-CENTER_PX, CENTER_PX, 2)
    k1 = rng.uniform(0.05, 0.15) * rng.choice([-1.0, 1.0])
    matrix = np.array([[focal_px[0], 0.0, center_px[0]], [0.0, focal_px[1], center_px[1]], [0.0, 0.0, 1.0]])
    lens = CameraIntrinsics(matrix, np.array([k1, -2.0 * k1, 0.0, 0.0, 0.0]), VGA.width_px, VGA.height_px)
    waves = WAVE * rng.uniform(-1.0, 1.0, (3, 3)) * (np.add.outer(np.arange(3), np.arange(3)) % 3 != 0)
    bias = DepthBias(rng.uniform(-OFFSET_M, OFFSET_M), 1.0 + rng.uniform(-SCALE, SCALE), 0.0, waves)
    return BoardCamera(lens, look_at((0.0, -1.6, 1.3), (0.0, 0.0, 0.9)), bias)


def calibrated(camera: BoardCamera, seed: int) -> tuple[CameraIntrinsics, DepthCorrection]:
    """Return lens and depth correction from the program's own calibration of rendered images in a folder."""
    poses = propose_poses(BOARD, [camera], MOMENTS, seed)
    views = render_board_views(BOARD, [camera], poses, seed)
    with tempfile.TemporaryDirectory() as folder:
        save_board_views(Path(folder), views)
        photographs = image_files([f"{folder}/node_00/color_*.jpg"])
        found = drain(iterate_calibration(photographs, BOARD))
        fit = depth_fit(found.calibration, depth_beside(photographs), BOARD)
    return found.intrinsics, fit.correction


def box_scene(size_m: Sequence[float], seed: int) -> Scene:
    """Return a box on a table, its length along x."""
    table = board((GROUND_M, GROUND_M, 0.04), Material(plaster("#c9c2b4", seed)), ORIGIN, (0.0, 0.0, -0.02))
    box = board(
        size_m, Material(cardboard(seed=seed, size_m=max(size_m))), ORIGIN, (0.0, 0.0, size_m[2] / 2.0)
    )
    lamp = Light(np.array([0.8, -1.0, 2.0]), np.array([4.0, 3.9, 3.6]), 0.2)
    return Scene("box", (table, box), (lamp,), np.full(3, 0.4), (), VGA)


def box_depth(
    size_m: Sequence[float], position_deg: float, camera: BoardCamera, rng: np.random.Generator
) -> tuple[DepthMap, DepthMap]:
    """Return the depth of a box from the camera's own sensor, and from one without bias."""
    scene = box_scene(size_m, int(rng.integers(1 << 30)))
    azimuth, elevation = np.radians(position_deg - 90.0), np.radians(ELEVATION_DEG)
    flat, up = np.cos(elevation), np.sin(elevation)
    way = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), up])
    middle_m = np.array([0.0, 0.0, 0.5 * size_m[2]])
    pose = look_at(middle_m + rng.uniform(*AWAY_M) * way, middle_m)
    view = Renderer(scene, threads=1).view(camera.intrinsics, pose, "fast", rng)
    right = sense_depth(view, camera.intrinsics, rng)
    return camera.bias.measured(right), right


def measured_m(depth: DepthMap, lens: CameraIntrinsics) -> FloatArray:
    """Return the (3,) size from the sensor's points, without outliers as in the chain."""
    rgb = np.zeros((*depth.z_m.shape, 3), np.uint8)
    frame = RgbdFrame("box", rgb, depth, lens, np.eye(4))
    return box_size_m(acquire(frame, PRESETS["packetmesh"].acquisition).cloud(frame).kept.points_m)


def box_trial(task: BoxTask) -> dict[str, list[list[list[float]]]]:
    """Return (sizes, positions, 3) errors of length, width and height in metres, for each of ``STATES``."""
    rng = np.random.default_rng((25, task.seed))
    camera = uncalibrated_camera(rng)
    lens, correction = calibrated(camera, task.seed)
    errors: dict[str, list[list[list[float]]]] = {state: [] for state in STATES}
    for size_m in SIZES_M:
        rows: dict[str, list[list[float]]] = {state: [] for state in STATES}
        for position_deg in POSITIONS_DEG:
            raw, right = box_depth(size_m, position_deg, camera, rng)
            given = ((raw, VGA), (raw, lens), (correction.apply(raw), lens), (right, camera.intrinsics))
            for state, (depth, known) in zip(STATES, given, strict=True):
                rows[state].append((measured_m(depth, known) - size_m).tolist())
        for state in STATES:
            errors[state].append(rows[state])
    return errors

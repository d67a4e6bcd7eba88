"""Photographs of a board by cameras that are known: rendered once, small and quick to look at."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from lab.claims.calibration.photograph import photograph
from pipeline.calibration.board import Board
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.rigs import save_rig
from pipeline.kernels.geometry import inverse, look_at, rigid, rotation_exp
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, FloatArray, RgbdFrame, Rig

BOARD = Board("circles", 7, 5, 0.05)
CAMERAS = (
    CameraIntrinsics(
        np.array([[330.0, 0.0, 162.0], [0.0, 331.0, 118.0], [0.0, 0.0, 1.0]]),
        np.array([-0.08, 0.05, 0.0, 0.0, 0.0]),
        320,
        240,
    ),
    CameraIntrinsics(
        np.array([[325.0, 0.0, 158.0], [0.0, 326.0, 121.0], [0.0, 0.0, 1.0]]),
        np.array([0.06, -0.04, 0.0, 0.0, 0.0]),
        320,
        240,
    ),
)
OFFSET_M = 0.02
"""By which the depth of the first camera is too near."""
MOMENTS = 8
BLANK = "99"
"""A moment at which nobody holds a board."""
T_WORLD_CAMERA = tuple(
    look_at(np.array(eye), np.array([0.0, 1.0, 0.0])) for eye in ([-0.12, 0.0, 0.0], [0.12, 0.0, 0.0])
)


def save_boards(folder: Path) -> None:
    """Write node_00 and node_01 with their photographs, depth of the first, board.json and truth.json."""
    for node, views in enumerate(_views()):
        for moment, (rgb, z_m) in enumerate(views):
            write_color(folder / f"node_{node:02d}" / f"color_{moment:02d}.png", rgb)
            if node == 0:
                write_depth_mm(folder / "node_00" / f"depth_{moment:02d}.png", DepthMap(z_m))
        write_color(folder / f"node_{node:02d}" / f"color_{BLANK}.png", np.full((240, 320, 3), 180, np.uint8))
    board = {"pattern": "circles", "columns": BOARD.columns, "rows": BOARD.rows, "spacing_mm": 50.0}
    (folder / "board.json").write_text(json.dumps(board))
    (folder / "truth.json").write_text(json.dumps({"cameras": dict(map(_true, enumerate(CAMERAS)))}))


def save_believing_rig(folder: Path, nodes: int = 2) -> None:
    """Write a rig of the first cameras, which look at nothing much and take their lenses for straight."""
    rng, frames = np.random.default_rng(0), []
    for node, T in enumerate(T_WORLD_CAMERA[:nodes]):
        rgb = rng.integers(0, 255, (240, 320, 3), dtype=np.uint8)
        depth = DepthMap(np.full((240, 320), 1.5, np.float32))
        believed = replace(CAMERAS[node], distortion=np.zeros(5))
        frames.append(RgbdFrame(f"node_{node:02d}", rgb, depth, believed, T))
    save_rig(folder, Rig("rig", tuple(frames)))


def _true(numbered: tuple[int, CameraIntrinsics]) -> tuple[str, dict[str, object]]:
    node, camera = numbered
    places = {"fx": camera.fx_px, "fy": camera.fy_px, "cx": camera.cx_px, "cy": camera.cy_px}
    return f"node_{node:02d}", places | {"distortion": camera.distortion.tolist()}


@lru_cache(1)
def _views() -> list[list[tuple[ByteArray, FloatArray]]]:
    rng = np.random.default_rng(5)
    poses = []
    for moment in range(MOMENTS):
        axis = 2.0 * np.pi * moment / MOMENTS
        tilt = np.radians(30.0) * np.array([np.cos(axis), np.sin(axis), 0.0])
        away_m = 0.8 + 0.06 * moment
        aside_m = 0.1 * np.array([np.cos(2.0 * axis), np.sin(3.0 * axis)])
        upright = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]))
        poses.append(upright @ rigid(rotation_exp(tilt), np.array([*aside_m, away_m])))
    return [
        [_view(camera, inverse(T) @ pose, rng) for pose in poses]
        for camera, T in zip(CAMERAS, T_WORLD_CAMERA, strict=True)
    ]


def _view(camera: CameraIntrinsics, T: FloatArray, rng: np.random.Generator) -> tuple[ByteArray, FloatArray]:
    """The photograph, and the depth of the board's plane, too near and with noise."""
    gray = photograph(BOARD, T, camera) + rng.normal(0.0, 2.0, (camera.height_px, camera.width_px))
    v, u = np.mgrid[0 : camera.height_px, 0 : camera.width_px]
    x, y = (u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px
    z_m = (T[:3, 2] @ T[:3, 3]) / (T[0, 2] * x + T[1, 2] * y + T[2, 2])
    z_m = z_m - OFFSET_M + rng.normal(0.0, 0.002, z_m.shape)
    rgb = np.repeat(np.clip(gray, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    return rgb, np.where((z_m > 0.2) & (z_m < 5.0), z_m, np.nan).astype(np.float32)

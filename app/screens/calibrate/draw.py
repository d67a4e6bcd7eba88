"""Boards and cameras in space: as the camera sees them, or as the board does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from app.drawing.cameras import Stage
from app.drawing.clouds import clear
from app.drawing.colors import BRAND, NEUTRAL, SOURCE, TARGET
from app.drawing.poses import place
from app.screens.calibrate.labels import Around
from app.screens.calibrate.photograph import decoded, picture_of
from app.screens.calibrate.view import CameraView
from pipeline.calibration.board import Board
from pipeline.geometry import inverse, look_at
from pipeline.types import FloatArray

BELOW = "/calibrate"
LEVEL = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]))
"""(4, 4) of what stays, upright and looking along +y."""
FACES = np.array([[0, 1, 2], [0, 2, 3]])
RIM = 0.9
"""Of the board beyond its outer points, in its spacing."""


class BoardsDrawing:
    """The boards of one camera's views, or the cameras around one board, of which one is chosen."""

    def __init__(self, scene: viser.SceneApi, on_pick: Callable[[str], None]) -> None:
        """Draw nothing yet; ``on_pick`` is called, on any thread, with a view that was clicked."""
        self._scene, self._on_pick = scene, on_pick
        self._handles: dict[str, Any] = {}
        self._dropped: frozenset[str] = frozenset()

    def draw(self, camera: CameraView | None, board: Board | None, around: Around, chosen: str) -> None:
        """Draw another camera's views."""
        clear(self._scene, BELOW)
        self._handles, self._around = {}, around
        if camera is None or camera.calibration is None or board is None:
            return
        poses = {}
        for photograph in camera.photographs:
            fitted = camera.fitted(photograph.name)
            if fitted is not None:
                poses[photograph.name] = fitted.T_camera_board
        self._dropped = frozenset(camera.dropped)
        if around == "camera":
            self._add_frustum(camera, "camera", LEVEL, camera.name, chosen)
            for name, pose in poses.items():
                self._add_board(board, name, LEVEL @ pose)
        else:
            self._add_board(board, "", LEVEL)
            for name, pose in poses.items():
                self._add_frustum(camera, name, LEVEL @ inverse(pose), name, name)
        self.choose(chosen)

    def choose(self, chosen: str) -> None:
        """Show one of the views as the chosen one."""
        for name, handle in self._handles.items():
            color = SOURCE if name == chosen else NEUTRAL if name in self._dropped else TARGET
            if tuple(handle.color) != color:
                handle.color = color

    def _add_board(self, board: Board, name: str, pose: FloatArray) -> None:
        """A sheet with its points; one without a name is the board of all views."""
        low, high = board.points_m.min(axis=0), board.points_m.max(axis=0)
        rim = RIM * board.spacing_m
        corners = np.array(
            [
                [low[0] - rim, low[1] - rim, 0.0],
                [high[0] + rim, low[1] - rim, 0.0],
                [high[0] + rim, high[1] + rim, 0.0],
                [low[0] - rim, high[1] + rim, 0.0],
            ]
        )
        below = f"{BELOW}/board-{name or 'all'}"
        sheet = self._scene.add_mesh_simple(
            below, corners, FACES, color=TARGET, opacity=0.35 if name else 0.9, side="double"
        )
        place(sheet, pose)
        points = self._scene.add_point_cloud(
            f"{below}/points",
            board.points_m.astype(np.float32),
            np.array((30, 30, 30), np.uint8),
            point_size=0.16 * board.spacing_m if name else 0.4 * board.spacing_m,
            point_shape="circle",
            point_shading="flat",
        )
        place(points, np.eye(4))
        if name:
            self._scene.add_label(f"{below}/name", name, position=tuple(corners[0]), font_screen_scale=0.8)
            self._handles[name] = sheet
            sheet.on_click(lambda _, name=name: self._on_pick(name))

    def _add_frustum(self, camera: CameraView, name: str, pose: FloatArray, label: str, picture: str) -> None:
        assert camera.calibration is not None
        width_px, height_px = camera.size_px
        fov = 2.0 * float(np.arctan2(0.5 * height_px, camera.calibration.matrix[1, 1]))
        around_camera = self._around == "camera"
        frustum = self._scene.add_camera_frustum(
            f"{BELOW}/frustum-{name}",
            fov=fov,
            aspect=width_px / height_px,
            scale=0.16 if around_camera else 0.06,
            thickness=0.004 if around_camera else 0.002,
            color=BRAND if around_camera else TARGET,
            image=decoded(picture_of(camera, picture))[::4, ::4] if around_camera else None,
        )
        place(frustum, pose)
        self._scene.add_label(
            f"{BELOW}/frustum-{name}/name", label, position=(0.0, -0.1, 0.0), font_screen_scale=0.8
        )
        if not around_camera:
            self._handles[name] = frustum
            frustum.on_click(lambda _: self._on_pick(name))


def place_of(camera: CameraView, around: Around) -> Stage | None:
    """Where to stand to see all of it; None without a calibration."""
    if camera.calibration is None:
        return None
    poses = [view.T_camera_board for view in camera.calibration.views]
    spread_m = np.array([(LEVEL @ (pose if around == "camera" else inverse(pose)))[:3, 3] for pose in poses])
    every_m = np.vstack([spread_m, np.zeros((1, 3))])
    middle_m = 0.5 * (every_m.min(axis=0) + every_m.max(axis=0))
    size_m = max(float(np.linalg.norm(np.ptp(every_m, axis=0))), 0.5)
    direction = np.array([0.85, -0.75 if around == "camera" else -0.9, 0.55])
    stand_m = middle_m + 1.15 * size_m * direction / np.linalg.norm(direction)
    right = np.cross(middle_m - stand_m, (0.0, 0.0, 1.0))
    return Stage(stand_m, middle_m, right / np.linalg.norm(right), size_m, middle_m)

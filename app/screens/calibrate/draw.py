"""Drawings of the boards around a camera, of the cameras around a board, and of the cameras of a rig."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from app.compute.records import SceneView, Stage
from app.drawing.cameras import add_camera, turn
from app.drawing.clouds import add_sensor_cloud, clear
from app.drawing.colors import BRAND, NEUTRAL, SOURCE, TARGET
from app.drawing.poses import place
from app.screens.calibrate.labels import Around
from app.screens.calibrate.photographs import decoded, picture_of
from app.screens.calibrate.view import CalibrationView, CameraView, RigView
from pipeline.calibration.board import Board
from pipeline.kernels.geometry import LEVEL_POSE, inverse
from pipeline.types import FloatArray

BELOW = "/calibrate"
FACES = np.array([[0, 1, 2], [0, 2, 3]])
RIM = 0.9
"""Width of the board beyond its outer points, in multiples of its spacing."""
ASPECT = 1.2
"""Width over height of a window; in narrower windows the viewpoint is farther away."""
FAR = 0.95
"""Distance of the viewpoint over the size of the drawing."""


class BoardsDrawing:
    """The boards of one camera, the cameras around one board, or a rig's; one view is highlighted."""

    def __init__(self, scene: viser.SceneApi, on_pick: Callable[[str], None]) -> None:
        """Start empty; ``on_pick`` is called, on any thread, with a clicked view."""
        self._scene, self._on_pick = scene, on_pick
        self._handles: dict[str, Any] = {}
        self._dropped: frozenset[str] = frozenset()

    def draw_scene(self, scene: SceneView | None) -> None:
        """Draw a scene's cameras and sensor clouds, if there are no views of a board; None draws nothing."""
        clear(self._scene, BELOW)
        self._handles = {}
        for node in () if scene is None else scene.nodes:
            add_sensor_cloud(self._scene, f"{BELOW}/{node.name}/cloud", node.sensor, node.T_world_camera)
            add_camera(self._scene, f"{BELOW}/{node.name}/camera", node, node.T_world_camera)

    def draw_camera(self, camera: CameraView, board: Board, around: Around, chosen: str) -> None:
        """Draw the boards around the camera or, unless ``around`` is "camera", cameras around the board."""
        clear(self._scene, BELOW)
        self._handles, self._dropped = {}, frozenset(camera.dropped)
        poses = poses_of(camera)
        if around == "camera":
            self._add_frustum("camera", LEVEL_POSE, camera, camera.name, 0.16, BRAND, chosen)
            for name, pose in poses.items():
                self._add_board(board, name, LEVEL_POSE @ pose)
        else:
            self._add_board(board, "", LEVEL_POSE, 0.9)
            for name, pose in poses.items():
                self._add_frustum(name, LEVEL_POSE @ inverse(pose), camera, name, 0.06, TARGET)
        self.choose(chosen)

    def draw_rig(
        self,
        view: CalibrationView,
        rig: RigView,
        scene: SceneView | None,
        loaded: SceneView | None,
        chosen: str,
    ) -> None:
        """Draw the boards and the calibrated cameras at their poses, and in grey the cameras' loaded poses.

        Args:
            view: the cameras.
            rig: poses of the cameras and the boards.
            scene: the scene in the chain, whose sensor clouds are drawn.
            loaded: the scene as it was loaded; the first camera keeps its pose there.
            chosen: name of the view to highlight.
        """
        clear(self._scene, BELOW)
        self._handles, self._dropped = {}, frozenset()
        first = rig.cameras[0].name
        believed: dict[str, FloatArray] = (
            {} if loaded is None else {node.name: node.T_world_camera for node in loaded.nodes}
        )
        T_world_first = believed.get(first, LEVEL_POSE)
        for node in () if scene is None else scene.nodes:
            add_sensor_cloud(self._scene, f"{BELOW}/{node.name}/cloud", node.sensor, node.T_world_camera)
        for one in rig.cameras:
            camera = view.camera(one.name)
            if camera is None or camera.calibration is None:
                continue
            sure = f" ± {1000.0 * one.position_sd_m:.2g} mm" if one.position_sd_m else ""
            placed = T_world_first @ one.T_first_camera
            self._add_frustum(one.name, placed, camera, f"{one.name}{sure}", 0.12, BRAND)
            if one.name in believed and one.name != first:
                self._add_frustum(f"before-{one.name}", believed[one.name], camera, "", 0.12, NEUTRAL)
        for name, pose in rig.T_first_board.items():
            self._add_board(view.board, name, T_world_first @ pose, 0.12)
        self.choose(chosen)

    def choose(self, chosen: str) -> None:
        """Highlight the view of this name."""
        for name, handle in self._handles.items():
            color = SOURCE if name == chosen else NEUTRAL if name in self._dropped else TARGET
            if tuple(handle.color) != color:
                handle.color = color

    def _add_board(self, board: Board, name: str, pose: FloatArray, opacity: float = 0.35) -> None:
        """Add a sheet with the board's points; without a name it is the board of all views."""
        (left, upper, _), (right, lower, _) = board.points_m.min(axis=0), board.points_m.max(axis=0)
        rim = RIM * board.spacing_m
        corners = np.array(
            [
                [left - rim, upper - rim, 0.0],
                [right + rim, upper - rim, 0.0],
                [right + rim, lower + rim, 0.0],
                [left - rim, lower + rim, 0.0],
            ]
        )
        below = f"{BELOW}/board-{name or 'all'}"
        sheet = self._scene.add_mesh_simple(
            below, corners, FACES, color=TARGET, opacity=opacity, side="double"
        )
        place(sheet, pose)
        self._scene.add_point_cloud(
            f"{below}/points",
            board.points_m.astype(np.float32),
            np.array((30, 30, 30), np.uint8),
            point_size=(0.16 if name else 0.4) * board.spacing_m,
            point_shape="circle",
            point_shading="flat",
        )
        if name:
            self._scene.add_label(f"{below}/name", name, position=tuple(corners[0]), font_screen_scale=0.8)
            self._handles[name] = sheet
            sheet.on_click(lambda _, name=name: self._on_pick(name))

    def _add_frustum(
        self,
        name: str,
        pose: FloatArray,
        camera: CameraView,
        label: str,
        scale: float,
        color: tuple[int, int, int],
        picture: str | None = None,
    ) -> None:
        """Add a camera's frustum; it can be clicked if its label is the name of a fitted view."""
        assert camera.calibration is not None
        width_px, height_px = camera.size_px
        path = f"{BELOW}/frustum-{name.replace('/', '-')}"  # never below another camera of the node
        frustum = self._scene.add_camera_frustum(
            path,
            fov=2.0 * float(np.arctan2(0.5 * height_px, camera.calibration.matrix[1, 1])),
            aspect=width_px / height_px,
            scale=scale,
            thickness=0.025 * scale,
            color=color,
            image=None if picture is None else decoded(picture_of(camera, picture))[::4, ::4],
        )
        place(frustum, pose)
        if label:
            self._scene.add_label(
                f"{path}/name", label, position=(0.0, -0.9 * scale, 0.0), font_screen_scale=0.8
            )
        if label == name and camera.fitted(name) is not None:
            self._handles[name] = frustum
            frustum.on_click(lambda _: self._on_pick(name))


def poses_of(camera: CameraView) -> dict[str, FloatArray]:
    """Return (4, 4) T_camera_board by name of the views that have a pose."""
    fitted = (camera.fitted(photograph.name) for photograph in camera.photographs)
    return {view.name: view.T_camera_board for view in fitted if view is not None}


def place_of(camera: CameraView, around: Around) -> Stage:
    """Return the viewpoint that shows all views of a camera."""
    poses = poses_of(camera).values()
    spread = [LEVEL_POSE @ (pose if around == "camera" else inverse(pose)) for pose in poses]
    every_m = np.array([np.zeros(3), *(pose[:3, 3] for pose in spread)])
    middle_m = 0.5 * (every_m.min(axis=0) + every_m.max(axis=0))
    size_m = max(float(np.linalg.norm(np.ptp(every_m, axis=0))), 0.5)
    direction = np.array([0.85, -0.75 if around == "camera" else -0.9, 0.55])
    stand_m = middle_m + FAR * size_m * direction / np.linalg.norm(direction)
    right = np.cross(middle_m - stand_m, (0.0, 0.0, 1.0))
    return Stage(stand_m, middle_m, right / np.linalg.norm(right), size_m, middle_m)


def stand_before(client: viser.ClientHandle, stage: Stage) -> None:
    """Turn a browser's view to the stage, from farther away in a narrow window, so that all is visible."""
    away = max(1.0, ASPECT / max(client.camera.aspect, 0.1))
    turn(client, stage.middle_m, stage.middle_m + away * (stage.viewpoint_m - stage.middle_m))

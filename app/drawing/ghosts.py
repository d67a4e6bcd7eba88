"""Ghosts: planned cameras in the scene, one of which can be dragged, and what they would newly see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from app.drawing.clouds import clear
from app.drawing.colors import BACKGROUND, GHOST, GHOST_DARK
from app.drawing.poses import move, place
from pipeline.kernels.geometry import rigid
from pipeline.types import BoolArray, FloatArray

if TYPE_CHECKING:
    import viser

HANDLE, HANDLE_M = 0.12, (0.3, 0.9)
"""Length of the handle's arrows, as a share of the diagonal of the targets' box; its least and most."""
FRUSTUM = 0.7
"""viser's ``scale`` of a frustum, as a share of that length."""
POINT_M = 0.016
"""Size of a point."""
LEAST_CHANCE = 0.1
"""Least chance of being measured with which a point is drawn."""
PALE = 0.6
"""Share of the background in the points of ghosts that are not chosen."""
AWAY_M = (0.0, 0.0, -1000.0)
"""Place of points that are not drawn, because a cloud's number of points cannot change."""


class Ghosts:
    """The planned cameras below a scene node."""

    def __init__(
        self,
        scene: viser.SceneApi,
        below: str,
        on_move: Callable[[int, FloatArray, bool], None] | None = None,
        on_pick: Callable[[int], None] | None = None,
    ) -> None:
        """Draw nothing yet.

        Args:
            scene: the scene.
            below: scene node below which all is drawn.
            on_move: called on a thread of the browser's messages with the index of a dragged ghost, its
                (4, 4) pose, and whether it was released; None: nothing can be dragged.
            on_pick: called on such a thread with the index of a ghost that was clicked.
        """
        self._scene, self._below = scene, below
        self._on_move, self._on_pick = on_move, on_pick
        self._frusta: list[viser.CameraFrustumHandle] = []
        self._handle: viser.TransformControlsHandle | None = None
        self._cloud: viser.PointCloudHandle | None = None
        self._targets_m: FloatArray = np.zeros((0, 3), np.float32)
        self._colors = np.zeros((0, 3), int)
        self._chosen = 0
        self._size_m = HANDLE_M[0]

    def draw(
        self,
        T_world_camera: Sequence[FloatArray],
        fov_rad: float,
        aspect: float,
        targets_m: FloatArray,
        dark: BoolArray,
    ) -> None:
        """Draw ghosts of one lens at (4, 4) poses; the first is chosen.

        Args:
            T_world_camera: pose of each ghost.
            fov_rad: vertical field of view.
            aspect: width over height.
            targets_m: (T, 3) float32 places that they might newly see, world frame.
            dark: (T,) True where these look dark to a present sensor.
        """
        self.clear()
        self._targets_m = targets_m
        self._colors = np.where(dark[:, None], GHOST_DARK, GHOST)
        diagonal_m = float(np.linalg.norm(np.ptp(targets_m, axis=0))) if len(targets_m) else 0.0
        self._size_m = float(np.clip(HANDLE * diagonal_m, *HANDLE_M))
        for row, T in enumerate(T_world_camera):
            name = f"{self._below}/{row + 1}"
            frustum = self._scene.add_camera_frustum(
                name, fov=fov_rad, aspect=aspect, scale=FRUSTUM * self._size_m, thickness=0.008, color=GHOST
            )
            place(frustum, T)
            ahead_m = (0.0, 0.0, FRUSTUM * self._size_m)  # where no arrow is, and no name of a present camera
            self._scene.add_label(f"{name}/name", str(row + 1), position=ahead_m, anchor="center-center")
            if self._on_pick is not None:
                frustum.on_click(lambda _, row=row: self._on_pick(row))
            self._frusta.append(frustum)
        if len(targets_m):
            self._cloud = self._scene.add_point_cloud(
                f"{self._below}/seen",
                np.tile(np.array(AWAY_M, np.float32), (len(targets_m), 1)),
                self._colors.astype(np.uint8),
                point_size=POINT_M,
                point_shape="circle",
                precision="float32",
            )
        self.choose(0)

    def choose(self, row: int) -> None:
        """Give the handle to a ghost."""
        self._chosen = row
        if self._on_move is None or row >= len(self._frusta):
            return
        if self._handle is not None:
            self._handle.remove()
        frustum = self._frusta[row]
        handle = self._handle = self._scene.add_transform_controls(
            f"{self._below}/handle-{row + 1}", scale=self._size_m, disable_sliders=True, depth_test=False
        )
        place(handle, _pose(frustum))
        handle.on_update(partial(self._dragged, row, handle))

    def _dragged(self, row: int, handle: viser.TransformControlsHandle, event: Any) -> None:
        pose = _pose(handle)
        if self._on_move is not None:
            self._on_move(row, pose, event.phase == "end")

    def move_frustum(self, row: int, T_world_camera: FloatArray) -> None:
        """Move a ghost's frustum to a (4, 4) pose, but not its handle, which may be dragged just now."""
        if row < len(self._frusta):
            move(self._frusta[row], T_world_camera)

    def move_handle(self, T_world_camera: FloatArray) -> None:
        """Move the handle to a (4, 4) pose that the chosen ghost got in another way, such as by numbers."""
        if self._handle is not None:
            move(self._handle, T_world_camera)

    def show_newly(self, newly: Sequence[FloatArray]) -> None:
        """Show the targets that some ghost newly measures with a chance of ``LEAST_CHANCE`` or more.

        A target belongs to the ghost that measures it most likely; those of ghosts not chosen are pale.

        Args:
            newly: for each ghost, (T,) chances that it newly measures each target.
        """
        chances = np.stack([*newly])
        best = chances.argmax(axis=0)
        self._show_points(chances.max(axis=0) >= LEAST_CHANCE, np.where(best == self._chosen, 0.0, PALE))

    def show_targets(self) -> None:
        """Show all places that a camera might newly see."""
        count = len(self._targets_m)
        self._show_points(np.ones(count, bool), np.zeros(count))

    def _show_points(self, seen: BoolArray, pale: FloatArray) -> None:
        """Show the (T,) targets that are ``seen``, with these shares of the background in their colours."""
        if self._cloud is None:
            return
        pale = pale[:, None]
        colors = (1.0 - pale) * self._colors + pale * np.array(BACKGROUND)
        self._cloud.points = np.where(seen[:, None], self._targets_m, np.array(AWAY_M, np.float32))
        self._cloud.colors = np.rint(colors).astype(np.uint8)
        self._cloud.visible = bool(seen.any())

    def clear(self) -> None:
        """Remove all ghosts."""
        clear(self._scene, self._below)
        self._frusta, self._handle, self._cloud = [], None, None


def _pose(handle: Any) -> FloatArray:
    """Return the (4, 4) pose of a scene node in its parent."""
    from viser import transforms

    turn = transforms.SO3(np.asarray(handle.wxyz, float)).as_matrix()
    return rigid(np.asarray(turn), np.asarray(handle.position, float))

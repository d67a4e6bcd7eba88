"""Registrations side by side: the clouds are sent once, then only poses and pairs move."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import viser
from viser import transforms

from app.drawing.cameras import Stage, turn
from app.drawing.clouds import add_cloud, clear
from app.drawing.colors import SOURCE, TARGET
from app.drawing.poses import move, place
from app.screens.fuse.view import RaceStep, RaceView, Start
from pipeline.geometry import apply, inverse, rigid, rotation_exp
from pipeline.types import ByteArray, FloatArray

FAINT, STRONG = np.array([235.0, 235.0, 235.0]), np.array([20.0, 20.0, 20.0])
POINT_M = 0.009
GAP = 1.05
"""Distance of two lanes in widths, or heights, of the scene."""
AWAY = 2.3
"""How far the viewer of two rows of lanes stands, in distances for one lane."""
MARKS = "①②③④"


class RaceDrawing:
    """The lanes of one race below a scene node: up to two in a row, and a second row below."""

    def __init__(self, scene: viser.SceneApi, below: str, view: RaceView, stage: Stage) -> None:
        clear(scene, below)
        self._scene, self._below, self._view = scene, below, view
        self._sources: list[viser.PointCloudHandle] = []
        self._pairs: list[viser.LineSegmentsHandle] = []
        for index, (lane, offset_m) in enumerate(zip(view.lanes, _offsets_m(view, stage), strict=True)):
            name, first = f"{below}/lane{index}", lane.steps[0]
            frame = scene.add_frame(name, show_axes=False)
            place(frame, rigid(np.eye(3), offset_m) @ view.T_world_target)
            add_cloud(scene, f"{name}/target", view.target, np.eye(4), TARGET, POINT_M)
            self._sources.append(
                add_cloud(scene, f"{name}/source", view.source, first.T_target_source, SOURCE, POINT_M)
            )
            points, colors = pair_lines(first)
            self._pairs.append(
                scene.add_line_segments(
                    f"{name}/pairs", points, colors, thickness=3.0, thickness_units="screen"
                )
            )
            scene.add_label(
                f"{below}/label{index}",
                f"{MARKS[index]} {lane.label}",
                position=stage.top_m + offset_m,
                anchor="bottom-center",
            )

    def show(self, rows: Sequence[int]) -> None:
        """Move every lane to one of its steps."""
        for lane, row, source, pairs in zip(self._view.lanes, rows, self._sources, self._pairs, strict=True):
            step = lane.steps[row]
            move(source, step.T_target_source)
            points, colors = pair_lines(step)
            pairs.visible = bool(len(points))
            if len(points):
                pairs.points, pairs.colors = points, colors

    def add_gizmo(
        self, start: Start, on_drag: Callable[[Start, bool], None]
    ) -> viser.TransformControlsHandle:
        """Arrows and rings in the first lane that move the cloud; ``on_drag`` gets the start and whether
        the drag has ended."""
        handle = self._scene.add_transform_controls(f"{self._below}/lane0/gizmo", scale=0.5, depth_test=False)
        place(handle, gizmo_pose(start, self._view.center_m))

        def dragged(event: Any) -> None:
            pose = rigid(transforms.SO3(np.asarray(handle.wxyz)).as_matrix(), np.asarray(handle.position))
            on_drag(start_of(pose, self._view.center_m), event.phase == "end")

        handle.on_update(dragged)
        return handle

    def preview(self, before: Start, start: Start) -> None:
        """Put all moving clouds at another start than that of the race, without pairs."""
        center_m = self._view.center_m
        shift = gizmo_pose(start, center_m) @ inverse(gizmo_pose(before, center_m))
        for lane, source, pairs in zip(self._view.lanes, self._sources, self._pairs, strict=True):
            move(source, shift @ lane.steps[0].T_target_source)
            pairs.visible = False


def gizmo_pose(start: Start, center_m: FloatArray) -> FloatArray:
    """(4, 4) pose of the gizmo in the target's frame: at the moved centre, turned as the cloud is."""
    return rigid(rotation_exp(np.radians(start.turn_deg)), center_m + np.array(start.shift_cm) / 100.0)


def start_of(pose: FloatArray, center_m: FloatArray) -> Start:
    """The start that a gizmo's (4, 4) pose in the target's frame means."""
    turn_deg = np.degrees(transforms.SO3.from_matrix(pose[:3, :3]).log()).round(2).tolist()
    return Start(tuple(turn_deg), tuple((100.0 * (pose[:3, 3] - center_m)).round(2).tolist()))


def look_at_rows(clients: Iterable[viser.ClientHandle], stage: Stage) -> None:
    """Step back until both rows of lanes are in the picture."""
    for client in clients:
        turn(client, stage.middle_m, stage.middle_m + AWAY * (stage.viewpoint_m - stage.middle_m))


def _offsets_m(view: RaceView, stage: Stage) -> list[FloatArray]:
    """Where each lane stands: side by side, the third and fourth below, all about the stage's middle."""
    count = len(view.lanes)
    height_m = apply(view.T_world_target, view.target.points_m.astype(float))[:, 2]
    low_m, high_m = np.percentile(height_m, [2, 98])
    right_m = stage.right * stage.width_m * GAP
    down_m = np.array([0.0, 0.0, -1.5 * (high_m - low_m) * GAP])
    rows = [min(count, 2), max(0, count - 2)]
    return [
        right_m * (column - (rows[row] - 1) / 2) + down_m * (row - (0.5 if rows[1] else 0.0))
        for row in range(2)
        for column in range(rows[row])
    ]


def pair_lines(step: RaceStep) -> tuple[FloatArray, ByteArray]:
    """(M, 2, 3) segments from source to target points in the target frame, darker for more weight."""
    ends = np.stack([apply(step.T_target_source, step.source_points_m), step.target_points_m], axis=1)
    colors = FAINT + (STRONG - FAINT) * np.clip(step.weights, 0.0, 1.0)[:, None]
    return ends.astype(np.float32), np.repeat(colors[:, None], 2, axis=1).astype(np.uint8)

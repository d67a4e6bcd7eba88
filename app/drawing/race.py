"""Two registrations side by side: the clouds are sent once, then only poses and pairs move."""

from __future__ import annotations

import numpy as np
import viser

from app.drawing.cameras import Stage
from app.drawing.clouds import add_cloud, clear
from app.drawing.colors import SOURCE, TARGET
from app.drawing.poses import move
from app.jobs.records import RaceStep, RaceView
from pipeline.geometry import apply, rigid
from pipeline.types import ByteArray, FloatArray

FAINT, STRONG = np.array([235.0, 235.0, 235.0]), np.array([20.0, 20.0, 20.0])
POINT_M = 0.009
GAP = 1.05
"""Distance of the two lanes in widths of the scene."""


class RaceDrawing:
    """The lanes of one race below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str, view: RaceView, stage: Stage) -> None:
        clear(scene, below)
        self._view = view
        middle = (len(view.lanes) - 1) / 2
        self._sources: list[viser.PointCloudHandle] = []
        self._pairs: list[viser.LineSegmentsHandle] = []
        for index, lane in enumerate(view.lanes):
            offset_m = stage.right * stage.width_m * GAP * (index - middle)
            name = f"{below}/lane{index}"
            frame = scene.add_frame(name, show_axes=False)
            move(frame, rigid(np.eye(3), offset_m) @ view.T_world_target)
            add_cloud(scene, f"{name}/target", view.target, np.eye(4), TARGET, POINT_M)
            self._sources.append(
                add_cloud(
                    scene, f"{name}/source", view.source, lane.steps[0].T_target_source, SOURCE, POINT_M
                )
            )
            points, colors = pair_lines(lane.steps[0])
            self._pairs.append(
                scene.add_line_segments(
                    f"{name}/pairs", points, colors, thickness=3.0, thickness_units="screen"
                )
            )
            scene.add_label(
                f"{below}/label{index}", lane.label, position=stage.top_m + offset_m, anchor="bottom-center"
            )

    def show(self, position: int) -> None:
        """Move to an iteration; a lane that ended before stays at its end."""
        for lane, source, pairs in zip(self._view.lanes, self._sources, self._pairs, strict=True):
            step = lane.steps[min(position, len(lane.steps) - 1)]
            move(source, step.T_target_source)
            points, colors = pair_lines(step)
            pairs.visible = bool(len(points))
            if len(points):
                pairs.points, pairs.colors = points, colors


def pair_lines(step: RaceStep) -> tuple[FloatArray, ByteArray]:
    """(M, 2, 3) segments from source to target points in the target frame, darker for more weight."""
    ends = np.stack([apply(step.T_target_source, step.source_points_m), step.target_points_m], axis=1)
    colors = FAINT + (STRONG - FAINT) * np.clip(step.weights, 0.0, 1.0)[:, None]
    return ends.astype(np.float32), np.repeat(colors[:, None], 2, axis=1).astype(np.uint8)

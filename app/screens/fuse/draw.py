"""Drawings of registrations side by side: the clouds are sent once, then poses, colours and pairs change.

All lanes of a race are at the same place in the scene; the page draws each in its own window
(``lanes.js``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser
from viser import transforms

from app.compute.records import DepthView, Stage
from app.drawing.cameras import VIEW_FOV_RAD, turn
from app.drawing.clouds import add_cloud, clear
from app.drawing.colors import DISTANCE_STOPS, NEUTRAL, ramp
from app.drawing.poses import move, place
from app.screens.fuse.view import FuseView, LensView, RaceStep, RaceView, Start
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.types import ByteArray, FloatArray

FAINT, STRONG = np.array([235.0, 235.0, 235.0]), np.array([20.0, 20.0, 20.0])
POINT_M, ROOM_POINT_M = 0.011, 0.022
"""Size of a drawn point, in a scene and in a synthetic room, which is larger and has fewer points."""
PALETTE = ramp(np.arange(256.0), 255.0, DISTANCE_STOPS)
"""RGB of every shade of a distance."""
FOV_RAD = np.radians(25.0)
"""Field of view of a race."""
HEAD, HEAD_PX = 0.225, 88.0
"""Space for names and numbers: share of the picture's height, and at least so many px (``board.css``)."""
FOOT, WHOLE_FOOT = 0.58, 0.95
"""Lower edge of the clouds over the picture's height, from the top: with and without magnified corner."""
RING, RING_PARTS = (20, 20, 20), 48
"""Colour of the ring around the magnified corner, and its number of segments."""
MARGIN = 0.04
"""Free margin on each side, over a lane's width and the picture's height."""
ROOM_STAGE = Stage(
    np.array([0.0, -2.0, 3.6]), np.zeros(3), np.array([1.0, 0.0, 0.0]), 8.0, np.array([0.0, 0.0, 2.0])
)
"""Viewpoint for a synthetic room: from above and from the side along which x runs to the right."""
FITTED = 2_000
"""Most cloud points that are fitted into the picture."""


class RaceDrawing:
    """The lanes of one race side by side, below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str, view: RaceView, stage: Stage) -> None:
        clear(scene, below)
        self._scene, self._below, self._view = scene, below, view
        self._extent = _extent_of(view, stage)
        point_m = ROOM_POINT_M if stage is ROOM_STAGE else POINT_M
        self._foot = WHOLE_FOOT if view.lens is None else FOOT
        self._sources: list[viser.PointCloudHandle] = []
        self._pairs: list[viser.LineSegmentsHandle] = []
        for index, lane in enumerate(view.lanes):
            name, first = f"{below}/lane{index}", lane.steps[0]
            place(scene.add_frame(name, show_axes=False), view.T_world_target)
            add_cloud(scene, f"{name}/target", view.target, np.eye(4), NEUTRAL, point_m)
            moving = replace(view.source, colors=PALETTE[first.shades])
            self._sources.append(
                add_cloud(scene, f"{name}/source", moving, first.T_target_source, size_m=point_m)
            )
            if view.lens is not None:
                self._add_ring(f"{name}/ring", view.lens)
            points, colors = pair_lines(first)
            self._pairs.append(
                scene.add_line_segments(
                    f"{name}/pairs", points, colors, thickness=2.0, thickness_units="screen"
                )
            )

    def _add_ring(self, name: str, lens: LensView) -> None:
        """Draw a circle around the magnified corner, facing the viewer."""
        angles = np.linspace(0.0, 2.0 * np.pi, RING_PARTS + 1)[:, None]
        around = np.cos(angles) * self._extent.right + np.sin(angles) * self._extent.up
        ring_m = lens.center_m + 0.5 * lens.window_m * around @ self._view.T_world_target[:3, :3]
        parts_m = np.stack([ring_m[:-1], ring_m[1:]], axis=1).astype(np.float32)
        self._scene.add_line_segments(name, parts_m, np.array(RING), thickness=4.0, thickness_units="screen")

    def look(self, clients: Iterable[viser.ClientHandle]) -> None:
        """Turn the view to the middle of a lane, from where each lane fits into its window."""
        extent = self._extent
        for client in clients:
            band = (max(HEAD, HEAD_PX / max(client.camera.image_height, 1.0)), self._foot)
            picture_m = height_m(extent.points_m, len(self._sources), client.camera.aspect, band)
            back_m = 0.5 * picture_m / np.tan(0.5 * FOV_RAD) * extent.forward
            with client.atomic():
                client.camera.fov = FOV_RAD
                turn(client, extent.middle_m, extent.middle_m - back_m)

    def show(self, rows: Sequence[int]) -> None:
        """Move every lane to one of its steps."""
        for lane, row, source, pairs in zip(self._view.lanes, rows, self._sources, self._pairs, strict=True):
            step = lane.steps[row]
            move(source, step.T_target_source)
            source.colors = PALETTE[step.shades]
            points, colors = pair_lines(step)
            pairs.visible = bool(len(points))
            if len(points):
                pairs.points, pairs.colors = points, colors

    def add_gizmo(
        self, start: Start, on_drag: Callable[[Start, bool], None]
    ) -> viser.TransformControlsHandle:
        """Add a gizmo for the first lane's cloud; ``on_drag`` gets the start and whether the drag ended."""
        handle = self._scene.add_transform_controls(f"{self._below}/lane0/gizmo", scale=0.5, depth_test=False)
        place(handle, gizmo_pose(start, self._view.center_m))

        def dragged(event: Any) -> None:
            pose = rigid(transforms.SO3(np.asarray(handle.wxyz)).as_matrix(), np.asarray(handle.position))
            on_drag(start_of(pose, self._view.center_m), event.phase == "end")

        handle.on_update(dragged)
        return handle

    def preview(self, before: Start, start: Start) -> None:
        """Move all source clouds from the start ``before`` to ``start`` and hide the pairs."""
        center_m = self._view.center_m
        shift = gizmo_pose(start, center_m) @ inverse(gizmo_pose(before, center_m))
        for lane, source, pairs in zip(self._view.lanes, self._sources, self._pairs, strict=True):
            move(source, shift @ lane.steps[0].T_target_source)
            pairs.visible = False


def gizmo_pose(start: Start, center_m: FloatArray) -> FloatArray:
    """Return the gizmo's (4, 4) pose in the target frame: at the moved centre, turned like the cloud."""
    return rigid(rotation_exp(np.radians(start.turn_deg)), center_m + np.array(start.shift_cm) / 100.0)


def start_of(pose: FloatArray, center_m: FloatArray) -> Start:
    """Return the start for a gizmo's (4, 4) pose in the target frame."""
    turn_deg = np.degrees(transforms.SO3.from_matrix(pose[:3, :3]).log()).round(2).tolist()
    return Start(tuple(turn_deg), tuple((100.0 * (pose[:3, 3] - center_m)).round(2).tolist()))


@dataclass(frozen=True, slots=True)
class _Extent:
    """The extent of a lane's clouds in the picture."""

    right: FloatArray
    """(3,) unit vectors to the right of the picture, up and into it."""
    up: FloatArray
    forward: FloatArray
    middle_m: FloatArray
    """(3,) middle of the clouds."""
    points_m: FloatArray
    """(N, 3) some points relative to the middle, along these directions."""


def _extent_of(view: RaceView, stage: Stage) -> _Extent:
    forward = stage.middle_m - stage.viewpoint_m
    forward = forward / np.linalg.norm(forward)
    axes = np.stack([stage.right, np.cross(stage.right, forward), forward])
    start = apply(view.lanes[0].steps[0].T_target_source, view.source.points_m.astype(float))
    points_m = np.concatenate([view.target.points_m.astype(float), start])
    low_m, high_m = np.percentile(apply(view.T_world_target, points_m) @ axes.T, [0.5, 99.5], axis=0)
    seen_m = apply(view.T_world_target, points_m[:: -(-len(points_m) // FITTED)]) @ axes.T
    seen_m = np.clip(seen_m, low_m, high_m)
    if view.lens is not None:
        ring = 0.5 * view.lens.window_m * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
        seen_m = np.concatenate(
            [seen_m, apply(view.T_world_target, view.lens.center_m[None]) @ axes.T + ring]
        )
    middle_m = 0.5 * (low_m + high_m)
    return _Extent(axes[0], axes[1], axes[2], middle_m @ axes, seen_m - middle_m)


def height_m(points_m: FloatArray, count: int, aspect: float, band: tuple[float, float]) -> float:
    """Return the height of the picture, metres at the middle of a lane, at which a lane fits into its window.

    Args:
        points_m: (N, 3) from the middle of a lane: to the right, up and away from the viewer.
        count: number of windows next to each other.
        aspect: width over height of the picture.
        band: upper and lower edge of the lanes over the picture's height, from the top.
    """
    low_m, high_m = 1e-3, 100.0 * max(1.0, float(np.abs(points_m).max()))
    for _ in range(40):
        tried_m = 0.5 * (low_m + high_m)
        across, down = in_window(points_m, count, aspect, band, tried_m)
        fits = across.min() >= MARGIN and across.max() <= 1.0 - MARGIN
        fits = fits and down.min() >= band[0] and down.max() <= band[1]
        low_m, high_m = (low_m, tried_m) if fits else (tried_m, high_m)
    return high_m


def in_window(
    points_m: FloatArray, count: int, aspect: float, band: tuple[float, float], picture_m: float
) -> tuple[FloatArray, FloatArray]:
    """Project points of a lane into its window, as ``lanes.js`` does.

    Args:
        points_m, count, aspect, band: as for ``height_m``.
        picture_m: height of the picture at the middle of a lane, metres.

    Returns:
        (N,) positions from the left of the window, as shares of its width, and (N,) from the top of the
        picture, as shares of its height; 1e9 for points behind the viewer, or nearer to it than a tenth of
        the distance to the middle of the lane.
    """
    right_m, up_m, away_m = points_m.T
    nearer = 1.0 + 2.0 * away_m * np.tan(0.5 * FOV_RAD) / picture_m
    nearer = np.where(nearer > 0.1, nearer, np.nan)
    across = 0.5 + count * right_m / (nearer * picture_m * aspect)
    down = 0.5 * sum(band) - up_m / (nearer * picture_m)
    return np.nan_to_num(across, nan=1e9), np.nan_to_num(down, nan=1e9)


def pair_lines(step: RaceStep) -> tuple[FloatArray, ByteArray]:
    """Return (M, 2, 3) segments from source to target points in the target frame, darker for more weight."""
    ends = np.stack([apply(step.T_target_source, step.source_points_m), step.target_points_m], axis=1)
    colors = FAINT + (STRONG - FAINT) * np.clip(step.weights, 0.0, 1.0)[:, None]
    return ends.astype(np.float32), np.repeat(colors[:, None], 2, axis=1).astype(np.uint8)


class RaceFraming:
    """Narrows the browsers' field of view for a race, and restores it afterwards."""

    def __init__(self) -> None:
        self._shapes: tuple[tuple[int, float, int], ...] = ()
        self._narrowed = False

    def anew(self) -> None:
        """Let the next call of ``frame`` frame again, because another drawing is shown."""
        self._shapes = ()

    def frame(self, drawing: RaceDrawing, clients: Iterable[viser.ClientHandle]) -> None:
        """Fit all lanes into the picture, once for each shape of the windows."""
        clients = list(clients)
        shapes = tuple(
            (client.client_id, round(client.camera.aspect, 2), client.camera.image_height)
            for client in clients
        )
        if shapes != self._shapes and clients:
            self._shapes, self._narrowed = shapes, True
            drawing.look(clients)

    def widen(self, clients: Iterable[viser.ClientHandle]) -> None:
        """Restore the field of view that the race had narrowed."""
        if self._narrowed:
            for client in clients:
                client.camera.fov = VIEW_FOV_RAD
            self._narrowed, self._shapes = False, ()


class NodesDrawing:
    """The clouds of all nodes below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._view: FuseView | None = None
        self._clouds: list[viser.PointCloudHandle] = []

    def draw(self, depth: DepthView, view: FuseView) -> None:
        """Draw the fused clouds of the chain's nodes at their registered poses."""
        clear(self._scene, self._below)
        self._view = view
        self._clouds = [
            add_cloud(self._scene, f"{self._below}/{node.name}", node.fused, T)
            for node, T in zip(depth.nodes, view.registered, strict=True)
        ]

    def place(self, before: bool) -> None:
        """Move the nodes to their poses before registration, or to the registered ones."""
        if self._view is None:
            return
        poses = self._view.believed if before else self._view.registered
        for handle, T in zip(self._clouds, poses, strict=True):
            move(handle, T)

"""Camera nodes in the scene, and viewpoints from which to look at them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from app.compute.records import SceneNode, Stage
from app.drawing.colors import NEUTRAL
from app.drawing.poses import place
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray

if TYPE_CHECKING:
    import viser

LOOKING_AROUND = 0.5
"""Cameras look in all directions if the mean of their unit viewing directions is shorter than this."""
VIEW_FOV_RAD = float(np.radians(75.0))
"""Vertical field of view of a browser's camera, viser's own."""
SLOPE_RAD, HALF_VIEW = np.radians(50.0), 0.9 * np.tan(0.5 * VIEW_FOV_RAD)
"""Downward angle of the view of such a scene; tangent of half the vertical field of view, less a margin."""


def add_camera(
    scene: viser.SceneApi, name: str, node: SceneNode, T_world_camera: FloatArray, with_image: bool = True
) -> viser.CameraFrustumHandle:
    """Draw a frustum at a (4, 4) pose, with the node's image on it and its name below it."""
    frustum = scene.add_camera_frustum(
        name,
        fov=node.fov_rad,
        aspect=node.aspect,
        scale=0.15,
        thickness=0.006,
        color=NEUTRAL,
        image=node.color.rgb[::4, ::4] if with_image else None,
    )
    place(frustum, T_world_camera)
    scene.add_label(f"{name}/name", node.name, font_screen_scale=0.9, anchor="top-center")
    return frustum


def stage_around(clouds_m: Sequence[FloatArray], T_world_camera: Sequence[FloatArray]) -> Stage:
    """Return the viewpoint behind and above the cameras that looks at the middle of what they see.

    Args:
        clouds_m: (N, 3) points that each camera sees, in its own frame.
        T_world_camera: (4, 4) pose of each camera.
    """
    seen_m = [apply(pose, points_m) for pose, points_m in zip(T_world_camera, clouds_m, strict=True)]
    middle_m = np.mean([np.median(points_m, axis=0) for points_m in seen_m], axis=0)
    cameras_m = np.mean([pose[:3, 3] for pose in T_world_camera], axis=0)
    back_m = cameras_m - middle_m
    distance_m = float(np.linalg.norm(back_m))
    viewpoint_m = cameras_m + 0.4 * back_m + np.array([0.0, 0.0, 0.45 * distance_m])
    points_m = np.concatenate(seen_m)
    gaze = np.mean([pose[:3, 2] for pose in T_world_camera], axis=0)
    if float(np.linalg.norm(gaze)) < LOOKING_AROUND:
        middle_m, viewpoint_m = _above(points_m, gaze)
    right = np.cross(middle_m - viewpoint_m, (0.0, 0.0, 1.0))
    right /= max(float(np.linalg.norm(right)), 1e-9)
    low_m, high_m = np.percentile(points_m @ right, [1, 99])
    top_m = np.array([middle_m[0], middle_m[1], float(np.percentile(points_m[:, 2], 98)) + 0.4])
    return Stage(viewpoint_m, middle_m, right, float(high_m - low_m), top_m)


def _above(points_m: FloatArray, gaze: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (3,) the middle of (N, 3) points and (3,) a place above from which 98 % fit a square picture."""
    axes = axes_downwards(gaze)
    low_m, high_m = np.percentile(points_m @ axes.T, [1, 99], axis=0)
    middle_m = 0.5 * (low_m + high_m) @ axes
    needed_m = distances_m((points_m - middle_m) @ axes.T, HALF_VIEW, HALF_VIEW)
    return middle_m, middle_m - float(np.percentile(needed_m, 98)) * axes[2]


def axes_downwards(gaze: FloatArray) -> FloatArray:
    """Return (3, 3) right, up and forward of a view along a (3,) gaze that looks down by ``SLOPE_RAD``."""
    level = np.array([gaze[0], gaze[1], 0.0]) + np.array([1e-9, 0.0, 0.0])
    level /= float(np.linalg.norm(level))
    forward = np.cos(SLOPE_RAD) * level - np.array([0.0, 0.0, np.sin(SLOPE_RAD)])
    up = np.sin(SLOPE_RAD) * level + np.array([0.0, 0.0, np.cos(SLOPE_RAD)])
    return np.stack([np.cross(forward, up), up, forward])


def distances_m(points_m: FloatArray, half_width: float, half_height: float) -> FloatArray:
    """Return (N,) distances, metres, by which a camera must be behind the origin to have each point in view.

    Args:
        points_m: (N, 3) points along the axes of the view: right, up and forward.
        half_width: tangent of half the horizontal field of view.
        half_height: the same, vertical.
    """
    across_m, up_m, away_m = points_m.T
    needed_m: FloatArray = np.maximum(np.abs(across_m) / half_width, np.abs(up_m) / half_height) - away_m
    return needed_m


def look(clients: Iterable[viser.ClientHandle], stage: Stage, wide: bool = False) -> None:
    """Turn each browser's view to the scene, from where the scene, or two side by side (``wide``), fits."""
    back_m = stage.viewpoint_m - stage.middle_m
    width_m = (2.6 if wide else 1.3) * stage.width_m
    for client in clients:
        half_angle = np.tan(0.5 * client.camera.fov) * client.camera.aspect
        fitting = 0.5 * width_m / max(half_angle * float(np.linalg.norm(back_m)), 1e-9)
        turn(client, stage.middle_m, stage.middle_m + max(1.35 if wide else 1.0, fitting) * back_m)


def turn(client: viser.ClientHandle, center_m: FloatArray, stand_m: FloatArray) -> None:
    """Turn a browser's view: the camera at ``stand_m`` (3,) looks at ``center_m`` (3,)."""
    with client.atomic():
        client.camera.position = stand_m
        client.camera.look_at = center_m

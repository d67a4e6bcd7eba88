"""Results drawn in a viser scene, and the playback of a registration's steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import singledispatch
from typing import Any, Protocol

import numpy as np
import viser

from app.compute.records import sample
from app.drawing.cameras import stage_around
from app.drawing.clouds import add_cloud
from app.drawing.colors import NEUTRAL, SOURCE, TARGET
from app.drawing.meshes import surface_glb
from app.drawing.poses import move, place
from packetmesh.errors import InputError
from pipeline.acquisition import back_project
from pipeline.notebook.pictures import small_photograph
from pipeline.notebook.views import View, in_its_camera, view_of
from pipeline.reconstruct import Reconstruction
from pipeline.surface.radii import spacing
from pipeline.types import FloatArray, PointCloud, RegistrationResult, Rig, Surface

DRAWN_POINTS = 60_000
SIZE_OF_SPACING = 1.5
"""Diameter of a point over the mean spacing of the drawn points."""
SMALLEST_M = 1e-4
APP_FOV_RAD = float(np.radians(75.0))
"""Vertical field of view for which ``stage_around`` chooses the viewpoint."""
HELD_S, STEP_S, LONGEST_S = 1.5, 0.2, 6.0
"""Pause before and after the steps of a registration, time of a step, longest time of all steps; seconds."""


class Recording(Protocol):
    """The recording of a viser scene."""

    def insert_sleep(self, duration: float) -> None:
        """Add a pause of ``duration`` seconds."""


Play = Callable[[Recording], None]
"""Changes the scene while a recording runs."""


@singledispatch
def add_result(result: object, scene: viser.SceneApi) -> View:
    """Draw a result; returns the view of it.

    Raises:
        InputError: it is of another kind, or empty.
    """
    raise InputError(
        "pm.show draws reconstructions, surfaces, clouds, rigs and registrations; try one of these instead "
        f"of {type(result).__name__}"
    )


@add_result.register
def _cloud(cloud: PointCloud, scene: viser.SceneApi) -> View:
    if not len(cloud):
        raise InputError("The cloud has no points to show; try the cloud from which it was made")
    _add_points(scene, "/cloud", cloud)
    return view_of(cloud.points_m, cloud.normals, in_its_camera(cloud))


@add_result.register
def _surface(surface: Surface, scene: viser.SceneApi) -> View:
    glb = surface_glb(surface, surface.colors, photographed=True)
    if not glb:
        raise InputError("The surface has no triangles to show; try a larger ball radius")
    scene.add_glb("/surface", glb)
    corners = np.unique(surface.triangles)
    normals = None if surface.normals is None else surface.normals[corners]
    return view_of(surface.vertices_m[corners], normals)


@add_result.register
def _rig(rig: Rig, scene: viser.SceneApi) -> View:
    clouds = [back_project(frame) for frame in rig.frames]
    poses = [frame.T_world_camera for frame in rig.frames]
    _add_cameras(scene, rig, poses)
    for index, (cloud, pose) in enumerate(zip(clouds, poses, strict=True)):
        if len(cloud):
            _add_points(scene, f"/points/{index}", cloud, pose, DRAWN_POINTS // len(clouds))
    return _view_of_cameras(clouds, poses)


@add_result.register
def _reconstruction(result: Reconstruction, scene: viser.SceneApi) -> View:
    around = _surface(result.after, scene)
    poses = result.placement.T_world_camera
    _add_cameras(scene, result.rig, poses)
    clouds = [node.sensor for node in result.nodes]
    return _view_of_cameras(clouds, poses) if any(map(len, clouds)) else around


def add_registration(
    scene: viser.SceneApi,
    result: RegistrationResult,
    source: PointCloud,
    target: PointCloud,
    T_init: FloatArray | None,
) -> tuple[View, Play]:
    """Draw both clouds. Returns the view and the function that records all steps from the start pose.

    Raises:
        InputError: a cloud is empty, or the start pose is not a (4, 4) matrix.
    """
    if not (len(source) and len(target)):
        raise InputError("A cloud of the registration has no points to show; try the clouds that were given")
    start = np.eye(4) if T_init is None else np.asarray(T_init, float)
    if start.shape != (4, 4):
        raise InputError(f"T_init has the shape {start.shape}; try the (4, 4) matrix given to pm.register")
    _add_points(scene, "/target", target, color=TARGET)
    moving = _add_points(scene, "/source", source, start, color=SOURCE)
    poses = [step.T_target_source for step in result.steps]

    def play(recording: Recording) -> None:
        recording.insert_sleep(HELD_S)
        for pose in poses:
            move(moving, pose)
            recording.insert_sleep(min(STEP_S, LONGEST_S / len(poses)))
        recording.insert_sleep(HELD_S)

    return view_of(target.points_m, target.normals, in_its_camera(target)), play


def _add_points(
    scene: viser.SceneApi,
    name: str,
    cloud: PointCloud,
    T: FloatArray | None = None,
    most: int = DRAWN_POINTS,
    color: tuple[int, int, int] | None = None,
) -> Any:
    """Draw at most ``most`` points, in their own colours or in one; returns the handle."""
    drawn = sample(cloud.points_m, cloud.colors, max(most, 1))
    size_m = SIZE_OF_SPACING * spacing(drawn.points_m)[0] if len(drawn.points_m) > 1 else SMALLEST_M
    return add_cloud(scene, name, drawn, np.eye(4) if T is None else T, color, max(size_m, SMALLEST_M))


def _add_cameras(scene: viser.SceneApi, rig: Rig, poses: Sequence[FloatArray]) -> None:
    for index, (frame, pose) in enumerate(zip(rig.frames, poses, strict=True)):
        camera = frame.intrinsics
        frustum = scene.add_camera_frustum(
            f"/cameras/{index}",
            fov=2.0 * float(np.arctan2(camera.height_px / 2, camera.fy_px)),
            aspect=camera.width_px / camera.height_px,
            scale=0.15,
            color=NEUTRAL,
            image=small_photograph(frame),
        )
        place(frustum, pose)


def _view_of_cameras(clouds: Sequence[PointCloud], poses: Sequence[FloatArray]) -> View:
    """Return the view from behind the cameras.

    Raises:
        InputError: all clouds are empty.
    """
    seen = [(cloud.points_m, pose) for cloud, pose in zip(clouds, poses, strict=True) if len(cloud)]
    if not seen:
        raise InputError("No camera of the rig has measured any depth to show; try another rig")
    stage = stage_around(*map(list, zip(*seen, strict=True)))
    return View(stage.viewpoint_m, stage.middle_m, np.array([0.0, 0.0, 1.0]), APP_FOV_RAD)

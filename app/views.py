"""The jobs that the session runs, one for each step: compute what is missing, answer with a view."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from app.chain import (
    RolledBalls,
    ball_clouds,
    cameras_of,
    compared,
    placed,
    prepared,
    rig_of,
    rolled,
)
from app.drawing.meshes import mesh_view
from app.drawing.pictures import depth_picture, depth_range_m
from app.records import (
    SCREEN_POINTS,
    FuseView,
    Picture,
    RegistrationRow,
    SceneNode,
    SceneView,
    SpacingView,
    sample,
)
from app.screens.surface.holes_job import hole_views, parts_of
from app.screens.surface.sweep_job import suggest_job
from app.screens.surface.view import SurfaceView
from app.state import Spec
from app.store import Store
from packetmesh.progress import Progress
from pipeline import geometry
from pipeline.acquisition import back_project
from pipeline.reconstruct import NodeClouds, NodeRegistration
from pipeline.registration import point_error_m
from pipeline.types import FloatArray, RgbdFrame, Rig


def scene_job(store: Store, spec: Spec) -> Generator[Progress, None, SceneView]:
    """The rig as it was loaded."""
    rig = yield from rig_of(store, spec)
    most = SCREEN_POINTS // len(rig.frames)
    nodes = tuple(_scene_node(frame, most) for frame in rig.frames)
    return SceneView(spec.source.title, nodes, rig.truth is not None)


def _scene_node(frame: RgbdFrame, most: int) -> SceneNode:
    cloud = back_project(frame)
    range_m = depth_range_m(frame.depth)
    camera = frame.intrinsics
    return SceneNode(
        name=frame.name,
        color=Picture(frame.rgb, f"Colour image of {frame.name}"),
        depth=depth_picture(frame.depth, range_m, "Sensor depth"),
        sensor=sample(cloud.points_m, cloud.colors, most),
        T_world_camera=frame.T_world_camera,
        fov_rad=2.0 * float(np.arctan2(camera.height_px / 2, camera.fy_px)),
        aspect=camera.width_px / camera.height_px,
        coverage=frame.depth.coverage,
        nearest_m=range_m[0],
        farthest_m=range_m[1],
    )


def fuse_job(store: Store, spec: Spec) -> Generator[Progress, None, FuseView]:
    """Where registration placed the nodes."""
    rig = yield from rig_of(store, spec)
    work = yield from prepared(store, spec)
    places = yield from placed(store, spec)
    believed = tuple(frame.T_world_camera for frame in rig.frames)
    rows = tuple(
        _registration_row(rig, row, work.nodes, spec.config.node_registration.method)
        for row in places.registrations
    )
    return FuseView(believed, places.T_world_camera, rows)


def _registration_row(
    rig: Rig, registration: NodeRegistration, nodes: Sequence[NodeClouds], method: str
) -> RegistrationRow:
    names = [node.name for node in nodes]
    source, target = names.index(registration.source), names.index(registration.target)
    result, points_m = registration.result, nodes[source].sensor.points_m
    before = after = None
    T_true = true_pose(rig, source, target)
    if T_true is not None:
        T_believed = geometry.inverse(rig.frames[target].T_world_camera) @ rig.frames[source].T_world_camera
        before = point_error_m(T_believed, T_true, points_m)
        after = point_error_m(result.T_target_source, T_true, points_m)
    return RegistrationRow(
        source=registration.source,
        target=registration.target,
        method=method,
        iterations=len(result.steps),
        stop_reason=result.stop_reason,
        rmse_m=result.steps[-1].rmse_m if result.steps else float("nan"),
        error_before_m=before,
        error_after_m=after,
        loop_error_m=registration.loop_error_m,
        used=registration.used,
    )


def surface_job(store: Store, spec: Spec) -> Generator[Progress | SurfaceView, None, SurfaceView]:
    """The surfaces and everything about them; yielded as far as they are there."""
    rig = yield from rig_of(store, spec)
    places = yield from placed(store, spec)
    clouds = yield from ball_clouds(store, spec)
    balls = yield from _shown(rolled(store, spec), clouds.spacing)
    view = _surface_view(clouds.spacing, balls)
    assert balls.before is not None
    assert view.before is not None
    yield view
    if rig.truth is not None:
        yield Progress("comparing with the truth", 0.8)
        cameras = cameras_of(rig, places)
        view = replace(
            view,
            after=replace(view.after, truth=compared(rig, balls.after, cameras)),
            before=replace(view.before, truth=compared(rig, balls.before, cameras)),
        )
        yield view
    yield Progress("looking for holes", 0.9)
    return replace(
        view,
        holes={"after": hole_views(balls.after), "before": hole_views(balls.before)},
        parts=(yield from parts_of(store, spec, balls.after)),
        suggestions=(yield from suggest_job(store, spec)),
    )


def _shown(
    work: Generator[Progress | RolledBalls, None, RolledBalls], distances: SpacingView
) -> Generator[Progress | SurfaceView, None, RolledBalls]:
    """Pass reports on, surfaces as views."""
    while True:
        try:
            said = next(work)
        except StopIteration as stop:
            return stop.value
        yield _surface_view(distances, said) if isinstance(said, RolledBalls) else said


def _surface_view(distances: SpacingView, balls: RolledBalls) -> SurfaceView:
    before = None if balls.before is None else mesh_view(balls.before, None)
    return SurfaceView(distances, balls.radii_m, mesh_view(balls.after, None), before, balls.elapsed_s)


def true_pose(rig: Rig, source: int, target: int) -> FloatArray | None:
    """T_target_source of two nodes, where the truth is known."""
    if rig.truth is None:
        return None
    return geometry.inverse(rig.truth.T_world_camera[target]) @ rig.truth.T_world_camera[source]

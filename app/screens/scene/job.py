"""The job of the Scene screen: a loaded rig with its images and thinned clouds."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.compute.records import AveragedView, Picture, Sample, SceneNode, SceneView, grid_step, on_grid
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.cameras import stage_around
from app.drawing.pictures import depth_picture, depth_range_m
from packetmesh.progress import Progress
from pipeline.acquisition import back_project
from pipeline.folders.walk import walk_sentences
from pipeline.types import RgbdFrame, Rig


def scene_job(store: Store, spec: Spec) -> Generator[Progress, None, SceneView]:
    """Return the rig as it was loaded."""
    rig = yield from store.stage(spec, "rig")
    step = grid_step(sum(int(frame.depth.valid.sum()) for frame in rig.frames))
    nodes = tuple(_scene_node(frame, step) for frame in rig.frames)
    notes = rig.notes if rig.walk is None else (*walk_sentences(rig.walk, len(nodes)), *rig.notes)
    clouds_m = [node.sensor.points_m.astype(float) for node in nodes]
    return SceneView(
        spec.source.title,
        nodes,
        rig.truth is not None,
        notes,
        stage_around(clouds_m, [node.T_world_camera for node in nodes]),
        rig.walk is not None,
        averaged_view(rig),
    )


def averaged_view(rig: Rig) -> AveragedView | None:
    """Return numbers on the averaged depth of cameras at rest; None if no depth is averaged.

    Over several cameras, counts are the largest, shares the mean, and the standard deviation the median.
    """
    frames = [frame for frame in rig.frames if frame.averaging is not None]
    found = [frame.averaging for frame in frames if frame.averaging is not None]
    if not found:
        return None
    return AveragedView(
        frames=max(one.frames for one in found),
        available=max(one.available for one in found),
        unmeasured_share=float(np.mean([1.0 - frame.depth.coverage for frame in frames])),
        moving_share=float(np.mean([one.moving_share for one in found])),
        flickering_share=float(np.mean([one.flickering_share for one in found])),
        median_sd_m=float(np.median([one.median_sd_m for one in found])),
    )


def _scene_node(frame: RgbdFrame, step: int) -> SceneNode:
    cloud = back_project(frame)
    assert cloud.pixels is not None
    drawn = cloud.select(on_grid(cloud.pixels, step))
    range_m = depth_range_m(frame.depth)
    camera = frame.intrinsics
    return SceneNode(
        name=frame.name,
        color=Picture(frame.rgb, f"Colour image of {frame.name}"),
        depth=depth_picture(frame.depth, range_m, "Sensor depth"),
        sensor=Sample(
            drawn.points_m.astype(np.float32), drawn.colors, len(cloud), spacing=step / camera.fx_px
        ),
        T_world_camera=frame.T_world_camera,
        fov_rad=2.0 * float(np.arctan2(camera.height_px / 2, camera.fy_px)),
        aspect=camera.width_px / camera.height_px,
        coverage=frame.depth.coverage,
        nearest_m=range_m[0],
        farthest_m=range_m[1],
    )

"""Point clouds in the scene: sent once, then moved by their pose."""

from __future__ import annotations

import numpy as np
import viser

from app.compute.records import Sample
from app.drawing.colors import NEUTRAL
from app.drawing.poses import place
from pipeline.types import ByteArray, FloatArray

POINT_SIZE_M = 0.012


def add_cloud(
    scene: viser.SceneApi,
    name: str,
    cloud: Sample,
    T_parent_cloud: FloatArray,
    color: tuple[int, int, int] | None = None,
    size_m: float = POINT_SIZE_M,
    visible: bool = True,
) -> viser.PointCloudHandle:
    """Draw a cloud in its own colours, or in one colour shaded by its own brightness."""
    handle = scene.add_point_cloud(
        name,
        cloud.points_m,
        _colors(cloud, color),
        point_size=size_m,
        point_shape="rounded",
        point_shading="flat",
        precision="float32",
        visible=visible,
    )
    place(handle, T_parent_cloud)
    return handle


def _colors(cloud: Sample, color: tuple[int, int, int] | None) -> ByteArray:
    if cloud.colors is None:
        return np.array(color or NEUTRAL, np.uint8)
    if color is None:
        return cloud.colors
    light = cloud.colors.mean(axis=1, keepdims=True) / 255.0
    return np.clip(np.array(color) * (0.6 + 0.7 * light), 0, 255).astype(np.uint8)


def clear(scene: viser.SceneApi, name: str) -> None:
    """Remove everything below a node; the node itself stays and keeps its visibility."""
    frame = scene.get_handle_by_name(name)
    visible = True
    if frame is not None:
        visible = frame.visible
        frame.remove()
    scene.add_frame(name, show_axes=False, visible=visible)

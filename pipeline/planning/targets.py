"""Targets of new cameras: the rays of the present cameras that meet no measured surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.kernels.geometry import apply, pixel_rays
from pipeline.planning.views import Meets, PresentView, pixels_of
from pipeline.types import BoolArray, FloatArray, IntArray

MOST_TARGETS = 3000
"""Most unmeasured rays that are judged; of more, an even grid of pixels is taken."""
SAME_M = 0.05
"""A camera sees a target if the depth at its pixel differs by less."""


@dataclass(frozen=True, slots=True)
class Targets:
    """Unmeasured rays, as the points where they would meet the surface."""

    points_m: FloatArray
    """(T, 3) estimated points, world frame."""
    normals: FloatArray
    """(T, 3) estimated unit normals, towards the camera of the ray."""
    view: IntArray
    """(T,) row of the camera of the ray."""
    dark_return: FloatArray
    """(T,) largest cosine over squared depth at which a present sensor got no return from there although
    nothing in the geometry explains that; 0 where there is no such sensor."""
    apart_rad: FloatArray
    """(T,) angle to the nearest pixel with the sensor's depth, in the image of the ray; of a hole's points,
    the smallest in the images that show them."""
    share: float
    """Share of all rays of the present cameras that each row stands for."""


def targets_of(views: Sequence[PresentView]) -> Targets:
    """Return the unmeasured rays of all views, on an even grid of pixels."""
    unmeasured = sum(int(np.isin(view.meets, (Meets.GUESSED, Meets.NOTHING)).sum()) for view in views)
    step = max(1, int(np.ceil(np.sqrt(unmeasured / MOST_TARGETS))))
    parts = [_targets_in(view, step) for view in views]
    points_m, normals, apart_rad = (np.concatenate(column) for column in zip(*parts, strict=True))
    view = np.repeat(np.arange(len(views)), [len(part[0]) for part in parts])
    rays = sum(int((view.meets != Meets.NO_RAY).sum()) for view in views)
    dark_return, _ = sensed(points_m, views)
    return Targets(points_m, normals, view, dark_return, apart_rad, step * step / rays)


def _targets_in(view: PresentView, step: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    height, width = view.meets.shape
    v, u = (of.ravel() for of in np.mgrid[step // 2 : height : step, step // 2 : width : step])
    wanted = np.isin(view.meets[v, u], (Meets.GUESSED, Meets.NOTHING)) & (view.z_m[v, u] > 0.0)
    v, u = v[wanted], u[wanted]
    T = view.camera.T_world_camera
    at_m = pixel_rays(view.camera.intrinsics)[v, u] * view.z_m[v, u][:, None]
    return apply(T, at_m), view.normals[v, u] @ T[:3, :3].T, view.apart_rad[v, u]


def sensed(points_m: FloatArray, views: Sequence[PresentView]) -> tuple[FloatArray, FloatArray]:
    """Return (T,) ``Targets.dark_return`` of (T, 3) points, and the smallest angle to a pixel with depth in
    the images that show them; 0 where none does.
    """
    largest, apart_rad = np.zeros(len(points_m)), np.full(len(points_m), np.inf)
    for view in views:
        depth_m, rows, u, v = pixels_of(points_m, view.camera)
        seen = np.abs(depth_m[rows] - view.z_m[v, u]) < SAME_M
        rows, u, v = rows[seen], u[seen], v[seen]
        largest[rows] = np.maximum(largest[rows], view.dark_return[v, u])
        apart_rad[rows] = np.minimum(apart_rad[rows], view.apart_rad[v, u])
    return largest, np.where(np.isfinite(apart_rad), apart_rad, 0.0)


def targets_at(targets: Targets, rows: BoolArray) -> Targets:
    """Return those targets whose (T,) row is True."""
    arrays = ("points_m", "normals", "view", "dark_return", "apart_rad")
    return replace(targets, **{name: getattr(targets, name)[rows] for name in arrays})

"""Classification of the cameras' pixel rays: they hit measured surface, inferred surface, or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, has_ray, inverse, project, undistorted_rays
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, camera_hits, first_hits, guessed_triangles, triangle_scene
from pipeline.surface.findings import RayParts
from pipeline.types import BoolArray, FloatArray, IntArray, SurfaceResult

_FOLDED = 1e-3
"""A projected pixel whose ray misses the point by more than this (at z = 1) is a distortion artefact."""


@dataclass(frozen=True, slots=True)
class View:
    """Masks of one camera's pixels with measured and with inferred depth."""

    camera: Camera
    sensor_valid: BoolArray
    """(H, W) True where the sensor measured a depth."""
    inferred_valid: BoolArray | None
    """(H, W) True where the depth network gives a depth; None if it did not run."""


@dataclass(frozen=True, slots=True)
class Known:
    """Visibility and depth of some points in all cameras together; NaN without views."""

    outside_share: float
    """Share of the points that are in no camera's image."""
    hidden_share: float
    """Share of the points that are in images, but behind the surface in all of them."""
    past_share: float
    """Share of the points past which a camera sees the surface farther away."""
    sensor_share: float
    """Share of the pixels, in all cameras that see the points, with measured depth."""
    inferred_share: float
    """Share of these pixels with only the network's depth."""
    unknown_share: float
    """Share of these pixels without any depth."""


@dataclass(frozen=True, slots=True)
class Sight:
    """Visibility of (N, 3) points near a surface in one camera."""

    in_image: BoolArray
    """(N,) True where the point is in front of the camera and its projection in the image."""
    hidden: BoolArray
    """(N,) True where the surface is in front of the point."""
    past: BoolArray
    """(N,) True where the camera looks past the point onto a surface farther away."""
    pixels: IntArray
    """(N, 2) u, v of the nearest pixel; (0, 0) outside the image."""


def ray_parts(surface: SurfaceResult, views: Sequence[View]) -> RayParts:
    """Classify the pixel rays of all views by the surface that they hit, or by the pixel's depth if none.

    Raises:
        InputError: a mask that does not have its camera's image size.
    """
    if not views:
        return RayParts(*5 * [float("nan")])
    scene = triangle_scene(surface.vertices_m, surface.triangles)
    inferred = np.zeros(len(surface.triangles), dtype=bool)
    if surface.source is not None:
        inferred = guessed_triangles(surface.triangles, surface.source)
    counts = np.zeros(5)
    for view in views:
        sensor, network = _known_pixels(view)
        triangle = camera_hits(scene, view.camera)["primitive_ids"].numpy()  # a miss has a larger id
        hit = triangle < len(inferred)
        missed = ~hit & has_ray(view.camera.intrinsics)
        on_inferred = np.zeros(hit.shape, dtype=bool)
        on_inferred[hit] = inferred[triangle[hit]]
        counts += [
            np.count_nonzero(part)
            for part in (
                hit & ~on_inferred,
                on_inferred,
                missed & sensor,
                missed & ~sensor & network,
                missed & ~sensor & ~network,
            )
        ]
    return RayParts(*(counts / counts.sum()).tolist())


def known_there(points_m: FloatArray, surface: SurfaceResult, views: Sequence[View], slack_m: float) -> Known:
    """Determine visibility and depth of (N, 3) points in or near a surface in all cameras.

    Args:
        points_m: (N, 3) points.
        surface: surface that may be in front of them or behind them.
        views: views of all cameras.
        slack_m: surface within this distance of a point along the ray does not count.

    Raises:
        InputError: a mask that does not have its camera's image size.
    """
    if not views:
        return Known(*6 * [float("nan")])
    scene = triangle_scene(surface.vertices_m, surface.triangles)
    in_image, visible, past = np.zeros((3, len(points_m)), dtype=bool)
    counts = np.zeros(3)
    for view in views:
        seen = sight(points_m, scene, view.camera, slack_m)
        in_image |= seen.in_image
        visible |= seen.in_image & ~seen.hidden
        past |= seen.past
        sensor, network = _known_pixels(view)
        u, v = np.unique(seen.pixels[seen.in_image & ~seen.hidden], axis=0).T
        measured = sensor[v, u]
        inferred = network[v, u] & ~measured
        counts += [measured.sum(), inferred.sum(), np.sum(~measured & ~inferred)]
    shares = counts / counts.sum() if counts.any() else np.full(3, np.nan)
    outside, hidden = ~in_image, in_image & ~visible
    return Known(float(outside.mean()), float(hidden.mean()), float(past.mean()), *shares.tolist())


def _known_pixels(view: View) -> tuple[BoolArray, BoolArray]:
    """Return (H, W) masks of pixels with measured depth, and with the network's depth.

    Raises:
        InputError: a mask that does not have the camera's image size.
    """
    intrinsics = view.camera.intrinsics
    size = (intrinsics.height_px, intrinsics.width_px)
    network = np.zeros(size, dtype=bool) if view.inferred_valid is None else view.inferred_valid
    for mask in (view.sensor_valid, network):
        if mask.shape != size:
            raise InputError(
                f"A mask of known pixels has the shape {mask.shape} and the camera's image {size}; "
                "take the depth image of that camera"
            )
    return view.sensor_valid, network


def sight(
    points_m: FloatArray, scene: o3d.t.geometry.RaycastingScene, camera: Camera, slack_m: float
) -> Sight:
    """Find the visibility of (N, 3) points in a camera; surface within ``slack_m`` of them is ignored."""
    in_camera_m = apply(inverse(camera.T_world_camera), points_m)
    in_image = in_camera_m[:, 2] > slack_m
    uv = project(camera.intrinsics, in_camera_m[in_image])
    size_px = np.array([camera.intrinsics.width_px, camera.intrinsics.height_px])
    inside = np.all((uv > -0.5) & (uv < size_px - 0.5), axis=1)
    rays = undistorted_rays(camera.intrinsics, uv[inside])
    wanted = in_camera_m[in_image][inside]
    inside[inside] = np.all(np.abs(rays - wanted / wanted[:, 2:]) < _FOLDED, axis=1)
    in_image[in_image] = inside
    pixels = np.zeros((len(points_m), 2), dtype=np.int64)
    pixels[in_image] = np.rint(uv[inside])
    eye_m = camera.T_world_camera[:3, 3]
    to_point_m = points_m[in_image] - eye_m
    distance_m = np.linalg.norm(to_point_m, axis=1)
    hit_m = first_hits(scene, np.broadcast_to(eye_m, to_point_m.shape), to_point_m / distance_m[:, None])
    hidden, past = np.zeros((2, len(points_m)), dtype=bool)
    hidden[in_image] = hit_m < distance_m - slack_m
    past[in_image] = np.isfinite(hit_m) & (hit_m > distance_m + slack_m)
    return Sight(in_image, hidden, past, pixels)

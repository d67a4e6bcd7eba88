"""What the present cameras know of a place: measured surface, guesses, free space, unmeasured rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project
from pipeline.kernels.kdtree import compiled
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, camera_hits, guessed_triangles, triangle_scene
from pipeline.nodes import NodeClouds
from pipeline.planning.sensors import SENSORS
from pipeline.reconstruct import Reconstruction
from pipeline.types import BoolArray, FloatArray, IntArray, Surface

MOST_TARGETS = 3000
"""Most unmeasured rays that are judged; of more, an even grid of pixels is taken."""
CELL_M = 0.1
"""Edge of the cells of free space."""
MARGIN_M = 0.5
"""Width of the border of cells around the surface and the cameras."""
STANDS_FREE_M = 0.6
"""Space within this distance of a camera is free: something stands there without being in its own way."""
BEFORE_M = 0.05
"""A cell is free if its middle is at least this far in front of what a camera sees."""


@dataclass(frozen=True, slots=True)
class Targets:
    """Rays of the present cameras that meet no measured surface, as the points where they would meet it."""

    points_m: FloatArray
    """(T, 3) estimated points, world frame."""
    normals: FloatArray
    """(T, 3) estimated unit normals, towards the camera of the ray."""
    guessed: BoolArray
    """(T,) True where the ray meets guessed surface; False where it meets none."""
    confidence: FloatArray
    """(T,) estimated chance that the depth is within 5 % of the truth; 0 where unknown."""
    lost_return: FloatArray
    """(T,) cosine over squared depth at which the ray's own sensor got no return although nothing in its
    geometry explains that: the surface is probably dark or shiny; 0 where it is explained."""
    share: float
    """Share of all rays of the present cameras that each row stands for."""


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Cells of the room's box: free if a camera sees through them."""

    low_m: FloatArray
    """(3,) corner of the first cell."""
    free: BoolArray
    """(X, Y, Z) True for free cells; the others are unknown or filled."""


@dataclass(frozen=True, slots=True)
class SeenPlace:
    """Everything that judges a camera which is not there yet."""

    surface: Surface
    whole: o3d.t.geometry.RaycastingScene
    """All triangles."""
    measured: o3d.t.geometry.RaycastingScene
    """Triangles without the guessed ones."""
    guessed: BoolArray
    """(F,) True for guessed triangles."""
    cameras: tuple[Camera, ...]
    """Registered cameras of the rig."""
    depths_m: tuple[FloatArray, ...]
    """(H, W) of each camera: depth of the surface, or of the best guess where there is none."""
    targets: Targets
    space: FreeSpace
    measured_share: float
    """Share of the present cameras' rays on measured surface."""


def seen_place(done: Reconstruction) -> SeenPlace:
    """Collect what a reconstruction knows of its place.

    Raises:
        InputError: the surface after fusion has no triangles, so that no camera can be judged.
    """
    surface = done.after
    if not len(surface.triangles):
        raise InputError(
            "The fused cloud has no surface, so no place for a camera can be judged; try a larger ball radius"
        )
    source = surface.source
    guessed = (
        np.zeros(len(surface.triangles), bool)
        if source is None
        else guessed_triangles(surface.triangles, source)
    )
    whole = triangle_scene(surface.vertices_m, surface.triangles)
    nodes = done.placement.placed(done.nodes)
    poses = done.placement.placed(done.placement.T_world_camera)
    cameras = tuple(Camera(node.frame.intrinsics, T) for node, T in zip(nodes, poses, strict=True))
    views = [_view(whole, guessed, node, camera) for node, camera in zip(nodes, cameras, strict=True)]
    depths_m = tuple(view.z_m for view in views)
    rays = sum(view.state.size for view in views)
    measured_share = sum(int((view.state == _MEASURED).sum()) for view in views) / rays
    return SeenPlace(
        surface,
        whole,
        triangle_scene(surface.vertices_m, surface.triangles[~guessed]),
        guessed,
        cameras,
        depths_m,
        _targets(views, cameras, rays),
        _free_space(surface.vertices_m, cameras, depths_m),
        measured_share,
    )


_MEASURED, _GUESSED, _MISSED, _NO_RAY = 0, 1, 2, 3


@dataclass(frozen=True, slots=True)
class _View:
    """One camera's rays."""

    state: IntArray
    """(H, W) what each ray meets."""
    z_m: FloatArray
    """(H, W) depth of the surface, else of the best guess; NaN where neither is known."""
    confidence: FloatArray
    returned: BoolArray
    """(H, W) True where the sensor measured, or geometry explains why not."""


def _view(
    scene: o3d.t.geometry.RaycastingScene, guessed: BoolArray, node: NodeClouds, camera: Camera
) -> _View:
    hits = camera_hits(scene, camera)
    triangle, z_m = hits["primitive_ids"].numpy(), hits["t_hit"].numpy()
    met = triangle < len(guessed)
    state = np.where(met, _MEASURED, _MISSED)
    state[met] = np.where(guessed[triangle[met]], _GUESSED, _MEASURED)
    state[~np.isfinite(pixel_rays(camera.intrinsics)[..., 2])] = _NO_RAY
    best_m = np.where(node.judged.depth.valid, node.judged.depth.z_m, node.alignment.depth.z_m)
    z_m = np.where(met, z_m, best_m)
    return _View(state, z_m, np.nan_to_num(node.judged.confidence), node.frame.depth.valid)


def _targets(views: Sequence[_View], cameras: Sequence[Camera], rays: int) -> Targets:
    """Return the unmeasured rays on an even grid of pixels."""
    unmeasured = sum(int(((view.state == _GUESSED) | (view.state == _MISSED)).sum()) for view in views)
    step = max(1, int(np.ceil(np.sqrt(unmeasured / MOST_TARGETS))))
    parts = [_targets_of(view, camera, step) for view, camera in zip(views, cameras, strict=True)]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    points_m, normals, guessed, confidence, lost_return = columns
    return Targets(points_m, normals, guessed, confidence, lost_return, step * step / rays)


def _targets_of(view: _View, camera: Camera, step: int) -> tuple[np.ndarray, ...]:
    v, u = np.mgrid[step // 2 : view.state.shape[0] : step, step // 2 : view.state.shape[1] : step]
    v, u = v.ravel(), u.ravel()
    wanted = np.isin(view.state[v, u], (_GUESSED, _MISSED)) & np.isfinite(view.z_m[v, u])
    v, u = v[wanted], u[wanted]
    rays = pixel_rays(camera.intrinsics)
    normals = _normals(rays, view.z_m, v, u)
    at_m = rays[v, u] * view.z_m[v, u][:, None]
    cosine = np.abs(np.sum(normals * at_m, axis=1)) / np.linalg.norm(at_m, axis=1)
    dark = ~view.returned[v, u] & ~_explained(view.z_m, v, u, camera, cosine)
    lost_return = np.where(dark, cosine / view.z_m[v, u] ** 2, 0.0)
    T = camera.T_world_camera
    return (
        apply(T, at_m),
        normals @ T[:3, :3].T,
        view.state[v, u] == _GUESSED,
        view.confidence[v, u],
        lost_return,
    )


_KINECT_BASELINE_M = SENSORS["kinect-v1"].baseline_m
_BORDER_PX = 16
"""Width of the border that a Kinect's registered depth does not reach."""
_EDGE_PX = 3
"""Pixels this close to a depth edge lose their depth without being dark."""
_STEEP = np.cos(np.radians(65.0))
"""Cosine below which the angle explains a lost return."""
_FAR_M = 3.9
"""Depth from which distance explains a lost return."""


def _explained(z_m: FloatArray, v: IntArray, u: IntArray, camera: Camera, cosine: FloatArray) -> BoolArray:
    """Return (T,) True where edge, shadow, border, angle or distance explains that a pixel has no depth.

    The shadow is that of a Kinect's projector, 7.5 cm to the right.
    """
    height, width = z_m.shape
    disparity_px = camera.intrinsics.fx_px * _KINECT_BASELINE_M / np.where(z_m > 0.0, z_m, np.inf)
    disparity_px = np.nan_to_num(disparity_px)
    in_projector_px = np.arange(width) - disparity_px
    nearest_px = np.minimum.accumulate(in_projector_px[:, ::-1], axis=1)[:, ::-1]
    shadow = nearest_px < in_projector_px - 1.0
    edge = np.zeros(z_m.shape, np.uint8)
    edge[:, 1:] |= np.abs(np.diff(disparity_px, axis=1)) > 1.0
    edge[1:] |= np.abs(np.diff(disparity_px, axis=0)) > 1.0
    near_edge = cv2.dilate(edge, np.ones((2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1), np.uint8)) > 0
    border = (u < _BORDER_PX) | (v < _BORDER_PX) | (u >= width - _BORDER_PX) | (v >= height - _BORDER_PX)
    return shadow[v, u] | near_edge[v, u] | border | (cosine < _STEEP) | (z_m[v, u] > _FAR_M)


def _normals(rays: FloatArray, z_m: FloatArray, v: IntArray, u: IntArray) -> FloatArray:
    """Return (T, 3) normals at pixels, towards the camera, from the depths two pixels to each side."""
    height, width = z_m.shape
    left, right = np.maximum(u - 2, 0), np.minimum(u + 2, width - 1)
    above, below = np.maximum(v - 2, 0), np.minimum(v + 2, height - 1)

    def at(rows: IntArray, columns: IntArray) -> FloatArray:
        return rays[rows, columns] * z_m[rows, columns][:, None]

    normals = np.cross(at(below, u) - at(above, u), at(v, right) - at(v, left))
    rays_here = rays[v, u]
    normals = np.where(np.isfinite(normals), normals, -rays_here)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    away = np.sum(normals * rays_here, axis=1, keepdims=True) > 0.0
    return np.where(away, -normals, normals)


def _free_space(
    vertices_m: FloatArray, cameras: Sequence[Camera], depths_m: Sequence[FloatArray]
) -> FreeSpace:
    """Return the cells that some camera sees through."""
    eyes_m = np.array([camera.T_world_camera[:3, 3] for camera in cameras])
    low_m = np.minimum(vertices_m.min(axis=0), eyes_m.min(axis=0)) - MARGIN_M
    high_m = np.maximum(vertices_m.max(axis=0), eyes_m.max(axis=0)) + MARGIN_M
    counts = np.ceil((high_m - low_m) / CELL_M).astype(int)
    axes = [low + CELL_M * (np.arange(count) + 0.5) for low, count in zip(low_m, counts, strict=True)]
    middles_m = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    free = np.zeros(len(middles_m), bool)
    for camera, z_m in zip(cameras, depths_m, strict=True):
        depth_m, there_m = depth_at(middles_m, camera, z_m)
        free |= depth_m < there_m - BEFORE_M
        free |= np.linalg.norm(middles_m - camera.T_world_camera[:3, 3], axis=1) < STANDS_FREE_M
    return FreeSpace(low_m, free.reshape(tuple(counts)))


def depth_at(points_m: FloatArray, camera: Camera, z_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (N,) depths of (N, 3) world points in a camera, and the image's depth at their pixels.

    The latter is NaN for points behind the camera or outside its image.
    """
    in_camera_m = apply(inverse(camera.T_world_camera), points_m)
    there_m = np.full(len(points_m), np.nan)
    ahead = np.flatnonzero(in_camera_m[:, 2] > 0.05)
    pixels = np.rint(project(camera.intrinsics, in_camera_m[ahead]))
    height, width = z_m.shape
    inside = np.all((pixels >= 0) & (pixels < (width, height)), axis=1)  # False for NaN
    u, v = pixels[inside].astype(np.int64).T
    there_m[ahead[inside]] = z_m[v, u]
    return in_camera_m[:, 2], there_m


@compiled
def unknown_lengths_m(
    low_m: FloatArray, free: BoolArray, from_m: FloatArray, to_m: FloatArray, spare_m: float
) -> FloatArray:
    """Return (N,) lengths outside free cells on the way from a (3,) point to (N, 3) points.

    The last ``spare_m`` of each way are left out: there the surface begins that is looked for.
    """
    lengths_m = np.zeros(len(to_m))
    step_m = 0.5 * CELL_M
    for row in range(len(to_m)):
        way_m = to_m[row] - from_m
        length_m = np.sqrt(way_m[0] ** 2 + way_m[1] ** 2 + way_m[2] ** 2)
        steps = int((length_m - spare_m) / step_m)
        for k in range(steps):
            t = (k + 0.5) * step_m / length_m
            inside = True
            cell = np.zeros(3, np.int64)
            for axis in range(3):
                place = (from_m[axis] + t * way_m[axis] - low_m[axis]) / CELL_M
                cell[axis] = int(np.floor(place))
                if cell[axis] < 0 or cell[axis] >= free.shape[axis]:
                    inside = False
            if not inside or not free[cell[0], cell[1], cell[2]]:
                lengths_m[row] += step_m
    return lengths_m

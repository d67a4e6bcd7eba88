"""Random camera poses in a room: of handheld depth cameras, and of cameras below the ceiling.

The room must be closed; parts[0] is its floor slab, parts[1] its ceiling slab, parts[:6] its shell.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from lab.worlds.pieces import bounds
from lab.worlds.render import Renderer
from lab.worlds.scene import Rng, Scene
from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at, rigid, rotation_exp
from pipeline.types import CameraIntrinsics, FloatArray, IntArray

NEAREST_M = 0.3
"""Least depth of a pixel in a varied view."""
_MARGIN_M = 0.25
"""Distance of cameras from walls."""
_CLOSE_UP_SHARE = 0.3
_CEILING_SHARE = 0.25
_CLEARANCE_M = 0.45
"""Distance from the bounding box of any object. With a field of view of 75 degrees the corner of the image is
44 degrees off the axis, so an object 0.42 m away can have a depth of 0.3 m."""
_PREVIEW = CameraIntrinsics.pinhole(26.25, 26.25, 15.5, 11.5, 32, 24)

_View = TypeVar("_View")


def random_views(scene: Scene, rng: Rng, count: int, renderer: Renderer | None = None) -> list[FloatArray]:
    """Return T_world_camera of ``count`` plausible cameras: room views, and close-ups from above.

    Args:
        scene: a closed room.
        rng: source of all randomness.
        count: number of cameras.
        renderer: the scene's renderer; None creates one.

    Raises:
        InputError: the room is so full that fewer cameras with a usable view were found.
    """
    renderer = renderer or Renderer(scene)
    low, high = _inside(scene, np.max)
    things = _things(scene, low, high)

    def candidate() -> FloatArray | None:
        close = bool(len(things)) and rng.random() < _CLOSE_UP_SHARE
        camera = _close_up(rng, things, low, high) if close else _room_view(rng, low, high)
        if camera is None:
            return None
        z_m, part = renderer.parts_seen(_PREVIEW, camera)
        return camera if _sees_enough(z_m, part, close) else None

    return list(_found(scene, count, 200, candidate))


def varied_views(
    seed: int, scene: Scene, count: int = 5, renderer: Renderer | None = None, width_px: int = 320
) -> Iterator[tuple[FloatArray, CameraIntrinsics]]:
    """Yield T_world_camera and intrinsics (4:3) of cameras with a usable view that are inside no object.

    Three in four proposals are handheld, at 1.0 to 1.8 m; the others hang at 2.2 to 3 m and look down. Their
    horizontal fields of view are 45 to 75 degrees.

    Args:
        seed: seed of the views.
        scene: a closed room.
        count: number of views.
        renderer: the scene's renderer; None creates one.
        width_px: width of the images.

    Raises:
        InputError: the room is so full that fewer cameras with a usable view were found.
    """
    rng = np.random.default_rng([seed, 5333])
    renderer = renderer or Renderer(scene)
    low, high = _inside(scene, np.min)
    box_lows, box_highs = _boxes(scene)

    def candidate() -> tuple[FloatArray, CameraIntrinsics] | None:
        pose = _overhead(rng, low, high) if rng.random() < _CEILING_SHARE else _handheld(rng, low, high)
        fov_rad = np.radians(rng.uniform(45.0, 75.0))
        outside_m = np.maximum(np.maximum(box_lows - pose[:3, 3], pose[:3, 3] - box_highs), 0.0)
        if np.any(np.linalg.norm(outside_m, axis=1) < _CLEARANCE_M):
            return None
        z_m, part = renderer.parts_seen(_camera(fov_rad, _PREVIEW.width_px), pose)
        near = z_m.min() <= NEAREST_M + 0.07 or np.median(z_m) <= 0.8 or np.percentile(z_m, 95.0) <= 1.3
        return None if near or _is_bare(part, 0.7) else (pose, _camera(fov_rad, width_px))

    yield from _found(scene, count, 300, candidate)


def _found(scene: Scene, count: int, tries: int, candidate: Callable[[], _View | None]) -> Iterator[_View]:
    """Yield the first ``count`` candidates that are not None, of at most ``tries`` x ``count``."""
    found = 0
    for _ in range(tries * count):
        if found == count:
            return
        view = candidate()
        if view is not None:
            found += 1
            yield view
    if found < count:
        raise InputError(
            f"Scene '{scene.name}' has too little free space for the requested cameras ({count}); "
            "take another seed."
        )


def _inside(scene: Scene, face: Callable[[FloatArray], float]) -> tuple[FloatArray, FloatArray]:
    """Return the low and high corner of a room, up to the lower (np.min) or upper face of its ceiling."""
    floor, ceiling = scene.parts[:2]
    places = floor.vertices_m + floor.T_world_part[:3, 3]
    top = float(face(ceiling.vertices_m[:, 2] + ceiling.T_world_part[2, 3]))
    return np.array([*places.min(axis=0)[:2], places[:, 2].max()]), np.array([*places.max(axis=0)[:2], top])


def _things(scene: Scene, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return (K, 3) origins of the parts inside the room, without the shell, that are below 1.3 m."""
    centers = np.array([part.T_world_part[:3, 3] for part in scene.parts[6:]]).reshape(-1, 3)
    inside = np.all((centers > low) & (centers < high), axis=1) & (centers[:, 2] < 1.3)
    return centers[inside]


def _boxes(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return (K, 3) low and high corners of the bounding boxes of all parts but the shell."""
    corners = np.array([bounds([part]) for part in scene.parts[6:]]).reshape(-1, 2, 3)
    return corners[:, 0], corners[:, 1]


def _room_view(rng: Rng, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a camera at 0.5 to 2 m, pitched -38 to +10 degrees, that mostly looks across the room."""
    x, y = rng.uniform(low[:2] + _MARGIN_M, high[:2] - _MARGIN_M)
    eye = np.array([x, y, low[2] + rng.uniform(0.5, min(2.0, high[2] - low[2] - 0.2))])
    yaw = _yaw_to_middle(eye, low, high) + rng.normal(0.0, 0.9)
    pitch = np.radians(np.clip(rng.normal(-15.0, 12.0), -38.0, 10.0))
    return _rolled(look_at(eye, eye + _direction(yaw, pitch)), rng, 0.03)


def _close_up(rng: Rng, things: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """Return a camera 0.6 to 1.6 m from an object, looking down by 20 to 65 degrees; None if outside."""
    target = things[rng.integers(len(things))] + rng.normal(0.0, 0.1, 3)
    distance, yaw = rng.uniform(0.6, 1.6), rng.uniform(0.0, 2.0 * np.pi)
    pitch = np.radians(rng.uniform(20.0, 65.0))
    eye = target + distance * _direction(yaw, pitch)
    if np.any(eye < low + 0.15) or np.any(eye > high - 0.15):
        return None
    return _rolled(look_at(eye, target), rng, 0.03)


def _handheld(rng: Rng, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a camera at 1.0 to 1.8 m, pitched -45 to +10 degrees, mostly towards the middle of the room."""
    eye = _somewhere(rng, low, high, rng.uniform(1.0, 1.8), 0.35)
    pitch = np.radians(np.clip(rng.normal(-15.0, 13.0), -45.0, 10.0))
    yaw = _yaw_to_middle(eye, low, high) + rng.normal(0.0, 0.9)
    return _rolled(look_at(eye, eye + _direction(yaw, pitch)), rng, 0.04)


def _overhead(rng: Rng, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a camera at 2.2 to 3 m that looks down by 20 to 80 degrees, often from a corner."""
    height = rng.uniform(2.2, max(2.2, min(3.0, high[2] - low[2] - 0.1)))
    eye = _somewhere(rng, low, high, height, 0.15)
    if rng.random() < 0.5:
        eye[:2] = np.where(rng.random(2) < 0.5, low[:2] + 0.3, high[:2] - 0.3)
    pitch = np.radians(rng.uniform(-80.0, -20.0))
    yaw = _yaw_to_middle(eye, low, high) + rng.normal(0.0, 0.4)
    return _rolled(look_at(eye, eye + _direction(yaw, pitch)), rng, 0.02)


def _somewhere(rng: Rng, low: FloatArray, high: FloatArray, height_m: float, margin_m: float) -> FloatArray:
    x, y = rng.uniform(low[:2] + margin_m, high[:2] - margin_m)
    return np.array([x, y, low[2] + height_m])


def _yaw_to_middle(eye: FloatArray, low: FloatArray, high: FloatArray) -> float:
    middle = 0.5 * (low + high)
    return float(np.arctan2(middle[1] - eye[1], middle[0] - eye[0]))


def _direction(yaw_rad: float, pitch_rad: float) -> FloatArray:
    """Return a (3,) unit vector; upwards for a positive pitch."""
    level = np.cos(pitch_rad)
    return np.array([level * np.cos(yaw_rad), level * np.sin(yaw_rad), np.sin(pitch_rad)])


def _rolled(T_world_camera: FloatArray, rng: Rng, sigma_rad: float) -> FloatArray:
    """Return the camera turned a little about its axis, because a held camera is never level."""
    roll = np.array([0.0, 0.0, rng.normal(0.0, sigma_rad)])
    return np.asarray(T_world_camera @ rigid(rotation_exp(roll), np.zeros(3)))


def _camera(fov_rad: float, width_px: int) -> CameraIntrinsics:
    """Return a pinhole camera with square pixels and 4:3 images."""
    height_px = width_px * 3 // 4
    focal_px = 0.5 * width_px / np.tan(0.5 * fov_rad)
    return CameraIntrinsics.pinhole(
        focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1), width_px, height_px
    )


def _is_bare(part: IntArray, most: float) -> bool:
    """Return whether a ray meets nothing, or walls and ceiling fill over ``most``, 0 to 1, of the view."""
    return bool(np.any(part < 0) or np.mean((part >= 1) & (part < 6)) > most)


def _sees_enough(z_m: FloatArray, part: IntArray, close: bool) -> bool:
    """Return whether nothing is close to the lens and the picture is not mostly walls and ceiling."""
    if _is_bare(part, 0.45 if close else 0.65):
        return False
    nearest, middle, far = np.percentile(z_m, [2.0, 50.0, 95.0])
    if close:
        return bool(nearest > 0.3 and 0.5 < middle < 2.5)
    return bool(nearest > 0.4 and 1.0 < middle < 7.0 and far > 1.6)

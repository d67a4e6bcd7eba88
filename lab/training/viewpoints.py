"""Where people hold a camera in a furnished room, and where one hangs below the ceiling."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from packetmesh.errors import InputError
from pipeline.geometry import look_at, rigid, rotation_exp
from pipeline.types import CameraIntrinsics, FloatArray, IntArray

NEAREST_M = 0.3
"""No pixel of a view is nearer."""
_CEILING_SHARE = 0.25
_CLEARANCE_M = 0.45
"""From the box around any thing: at 75 degrees the corner of the image is 44 degrees off the axis, so that
what is 0.42 m away may be 0.3 m deep."""
_TRIES = 300
_PREVIEW_PX = (32, 24)


def views(
    seed: int, scene: Scene, count: int = 5, renderer: Renderer | None = None, width_px: int = 320
) -> Iterator[tuple[FloatArray, CameraIntrinsics]]:
    """T_world_camera and intrinsics (4:3) of cameras that see something and stand in nothing.

    Three in four are held by people, at 1.0 to 1.8 m; the others hang at 2.2 to 3 m and look down. Their
    horizontal fields of view are 45 to 75 degrees.

    Args:
        seed: of the random draws.
        scene: a closed room; parts[0] is the floor slab, parts[:6] the shell.
        count: number of views.
        renderer: the scene's renderer, where there is one already.
        width_px: of the images.

    Raises:
        InputError: the room is so full that no camera sees anything.
    """
    rng = np.random.default_rng([seed, 5333])
    renderer = renderer or Renderer(scene)
    low, high = _inside(scene)
    boxes = _boxes(scene)
    found = 0
    for _ in range(_TRIES * count):
        if found == count:
            return
        pose = _overhead(rng, low, high) if rng.random() < _CEILING_SHARE else _handheld(rng, low, high)
        fov_rad = np.radians(rng.uniform(45.0, 75.0))
        if np.any(_distance(pose[:3, 3], *boxes) < _CLEARANCE_M):
            continue
        if _sees_enough(*renderer.parts_seen(_camera(fov_rad, _PREVIEW_PX[0]), pose)):
            found += 1
            yield pose, _camera(fov_rad, width_px)
    if found < count:
        raise InputError(f"Scene '{scene.name}' leaves no room for {count} cameras; take another seed.")


def _camera(fov_rad: float, width_px: int) -> CameraIntrinsics:
    """A pinhole camera with square pixels and 4:3 images."""
    height_px = width_px * 3 // 4
    focal_px = 0.5 * width_px / np.tan(0.5 * fov_rad)
    return CameraIntrinsics.pinhole(
        focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1), width_px, height_px
    )


def _inside(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner of the air in a room, from its floor slab and its ceiling slab."""
    floor, ceiling = scene.parts[:2]
    places = floor.vertices_m + floor.T_world_part[:3, 3]
    top = float((ceiling.vertices_m[:, 2] + ceiling.T_world_part[2, 3]).min())
    return np.array([*places.min(axis=0)[:2], places[:, 2].max()]), np.array([*places.max(axis=0)[:2], top])


def _boxes(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """(K, 3) low and high corners of the boxes around everything but the shell."""
    corners = [
        part.vertices_m @ part.T_world_part[:3, :3].T + part.T_world_part[:3, 3] for part in scene.parts[6:]
    ]
    lows = [places.min(axis=0) for places in corners]
    return np.array(lows).reshape(-1, 3), np.array([places.max(axis=0) for places in corners]).reshape(-1, 3)


def _distance(place: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(K,) distance of a place from boxes; 0 inside."""
    return np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0.0), axis=1)


def _handheld(rng: np.random.Generator, low: FloatArray, high: FloatArray) -> FloatArray:
    """A camera held at 1.0 to 1.8 m, tilted -45 to +10 degrees, rather towards the middle of the room."""
    eye = _somewhere(rng, low, high, rng.uniform(1.0, 1.8), 0.35)
    return _towards(rng, eye, low, high, np.clip(rng.normal(-15.0, 13.0), -45.0, 10.0), 0.9, 0.04)


def _overhead(rng: np.random.Generator, low: FloatArray, high: FloatArray) -> FloatArray:
    """A camera mounted at 2.2 to 3 m that looks down by 20 to 80 degrees, often from a corner."""
    height = rng.uniform(2.2, max(2.2, min(3.0, high[2] - low[2] - 0.1)))
    eye = _somewhere(rng, low, high, height, 0.15)
    if rng.random() < 0.5:
        corner = np.where(rng.random(2) < 0.5, low[:2] + 0.3, high[:2] - 0.3)
        eye[:2] = corner
    return _towards(rng, eye, low, high, rng.uniform(-80.0, -20.0), 0.4, 0.02)


def _somewhere(
    rng: np.random.Generator, low: FloatArray, high: FloatArray, height_m: float, margin_m: float
) -> FloatArray:
    x, y = rng.uniform(low[:2] + margin_m, high[:2] - margin_m)
    return np.array([x, y, low[2] + height_m])


def _towards(
    rng: np.random.Generator,
    eye: FloatArray,
    low: FloatArray,
    high: FloatArray,
    tilt_deg: float,
    spread_rad: float,
    roll_rad: float,
) -> FloatArray:
    """T_world_camera with a tilt, a direction about that of the room's middle, and a small roll."""
    middle = 0.5 * (low + high)
    yaw = np.arctan2(middle[1] - eye[1], middle[0] - eye[0]) + rng.normal(0.0, spread_rad)
    tilt = np.radians(tilt_deg)
    forward = np.array([np.cos(tilt) * np.cos(yaw), np.cos(tilt) * np.sin(yaw), np.sin(tilt)])
    roll = rotation_exp(np.array([0.0, 0.0, rng.normal(0.0, roll_rad)]))
    return np.asarray(look_at(eye, eye + forward) @ rigid(roll, np.zeros(3)))


def _sees_enough(z_m: FloatArray, part: IntArray) -> bool:
    """Whether no wall is before the lens and the picture is not just walls and ceiling."""
    if np.any(part < 0) or np.mean((part >= 1) & (part < 6)) > 0.7:
        return False
    return bool(z_m.min() > NEAREST_M + 0.07 and np.median(z_m) > 0.8 and np.percentile(z_m, 95.0) > 1.3)

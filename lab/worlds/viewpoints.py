"""Where a person with a depth camera would stand in a room, and where they would point it."""

from __future__ import annotations

import numpy as np

from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from packetmesh.errors import InputError
from pipeline.geometry import look_at, rigid, rotation_exp
from pipeline.types import CameraIntrinsics, FloatArray, IntArray

_MARGIN_M = 0.25
"""Cameras keep this far from walls."""
_CLOSE_UP_SHARE = 0.3
_PREVIEW = CameraIntrinsics.pinhole(26.25, 26.25, 15.5, 11.5, 32, 24)


def random_views(
    scene: Scene, rng: np.random.Generator, count: int, renderer: Renderer | None = None
) -> list[FloatArray]:
    """T_world_camera of ``count`` plausible cameras: room views, and close-ups from above.

    Args:
        scene: a closed room whose first part is the floor slab.
        rng: source of all randomness.
        count: number of cameras.
        renderer: the scene's renderer, where there is one already.

    Raises:
        InputError: the room is so full that no camera sees anything.
    """
    renderer = renderer or Renderer(scene)
    low, high = _inside(scene)
    things = _things(scene, low, high)
    cameras: list[FloatArray] = []
    for _ in range(200 * count):
        if len(cameras) == count:
            return cameras
        close = bool(len(things)) and rng.random() < _CLOSE_UP_SHARE
        camera = _close_up(rng, things, low, high) if close else _room_view(rng, low, high)
        if camera is not None and _sees_enough(*renderer.parts_seen(_PREVIEW, camera), close):
            cameras.append(camera)
    if len(cameras) == count:
        return cameras
    raise InputError(f"Scene '{scene.name}' leaves no room for {count} cameras; take another seed.")


def _inside(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner of the air in a room."""
    floor = scene.parts[0]
    places = floor.vertices_m + floor.T_world_part[:3, 3]
    top = max(float((part.vertices_m[:, 2] + part.T_world_part[2, 3]).max()) for part in scene.parts[1:6])
    return np.array([*places.min(axis=0)[:2], places[:, 2].max()]), np.array([*places.max(axis=0)[:2], top])


def _things(scene: Scene, low: FloatArray, high: FloatArray) -> FloatArray:
    """(K, 3) centres of the parts that stand in the lower half of the room."""
    centers = np.array([part.T_world_part[:3, 3] for part in scene.parts[6:]]).reshape(-1, 3)
    inside = np.all((centers > low) & (centers < high), axis=1) & (centers[:, 2] < 1.3)
    return centers[inside]


def _room_view(rng: np.random.Generator, low: FloatArray, high: FloatArray) -> FloatArray | None:
    """A camera at 0.5 to 2 m, pitched -38 to +10 degrees, that rather looks across the room."""
    x, y = rng.uniform(low[:2] + _MARGIN_M, high[:2] - _MARGIN_M)
    eye = np.array([x, y, low[2] + rng.uniform(0.5, min(2.0, high[2] - low[2] - 0.2))])
    center = 0.5 * (low + high)
    yaw = np.arctan2(center[1] - y, center[0] - x) + rng.normal(0.0, 0.9)
    pitch = np.radians(np.clip(rng.normal(-15.0, 12.0), -38.0, 10.0))
    forward = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    return _rolled(look_at(eye, eye + forward), rng)


def _close_up(
    rng: np.random.Generator, things: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray | None:
    """A camera 0.6 to 1.6 m from a thing, looking down at it by 20 to 65 degrees."""
    target = things[rng.integers(len(things))] + rng.normal(0.0, 0.1, 3)
    distance, yaw, pitch = (
        rng.uniform(0.6, 1.6),
        rng.uniform(0.0, 2.0 * np.pi),
        np.radians(rng.uniform(20.0, 65.0)),
    )
    eye = target + distance * np.array(
        [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)]
    )
    if np.any(eye < low + 0.15) or np.any(eye > high - 0.15):
        return None
    return _rolled(look_at(eye, target), rng)


def _rolled(T_world_camera: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A hand does not hold a camera level."""
    return T_world_camera @ rigid(rotation_exp(np.array([0.0, 0.0, rng.normal(0.0, 0.03)])), np.zeros(3))


def _sees_enough(z_m: FloatArray, part: IntArray, close: bool) -> bool:
    """Whether nothing sits before the lens and the picture is not just walls and ceiling."""
    if np.any(part < 0) or np.mean((part >= 1) & (part < 6)) > (0.45 if close else 0.65):
        return False
    nearest, middle, far = np.percentile(z_m, [2.0, 50.0, 95.0])
    if close:
        return bool(nearest > 0.3 and 0.5 < middle < 2.5)
    return bool(nearest > 0.4 and 1.0 < middle < 7.0 and far > 1.6)

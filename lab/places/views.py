"""Two camera poses in a random room whose views overlap by a given share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.places.overlap import OverlapMeter, in_range
from lab.worlds.raycast import Hits, RayCaster
from lab.worlds.render import Renderer
from lab.worlds.scene import Rng, Scene
from lab.worlds.viewpoints import random_views
from pipeline.kernels.geometry import look_at, rotation_exp
from pipeline.types import CameraIntrinsics, FloatArray

TOLERANCE = 0.02
"""Largest accepted difference from the given overlap."""
PROPOSALS = 250
"""Second poses that are tried for a first one."""
FIRST_POSES = 4
"""First poses that are tried in a room."""
LEAST_MEASURED = 0.5
"""Least share of a view's pixels within the sensor's range."""
LARGEST_SHELL = 0.65
"""Largest share of a view that walls and ceiling fill, as for the views of ``random_views``."""
NEAREST_M = 0.4
"""Least depth in a view; 2 % of its pixels may be nearer."""
CLEARANCE_M = 0.25
"""The line between the two cameras must be free, and this much of its extension behind the second one."""
SHELL_PARTS = (1, 6)
"""Ceiling and walls of a random room: its parts from the first index up to, but not including, the second."""


@dataclass(frozen=True, slots=True)
class TwoPoses:
    """Two cameras in a room."""

    source: FloatArray
    """(4, 4) T_world_camera."""
    target: FloatArray
    overlap_share: float


def two_poses(
    scene: Scene, intrinsics: CameraIntrinsics, overlap: float, rng: Rng, renderer: Renderer
) -> TwoPoses | None:
    """Return two poses whose views overlap by ``overlap`` within ``TOLERANCE``; None if none was found.

    The first is one of ``random_views``. The second is, with equal odds at each try, the first turned by up
    to 100 degrees and shifted a little, the first moved around what it looks at, or another random view of
    the room. The first that fits is taken.

    Args:
        scene: a random room.
        intrinsics: the camera of both views.
        overlap: overlap to reach (see ``OverlapMeter.share``), 0 to 0.9.
        rng: source of all randomness.
        renderer: the room's renderer.

    Raises:
        InputError: the room is so full that no camera sees anything.
    """
    caster = RayCaster(scene, threads=1)
    meter = OverlapMeter(caster, intrinsics)
    for T_target in random_views(scene, rng, FIRST_POSES, renderer):
        seen = meter.look(T_target)
        if not is_usable(seen):
            continue
        middle_m = float(np.median(seen.t))
        for _ in range(PROPOSALS):
            T_source = _proposal(scene, T_target, middle_m, overlap, rng, renderer)
            if not is_free(caster, T_target, T_source):
                continue
            other = meter.look(T_source)
            if not is_usable(other):
                continue
            share = meter.share(T_source, other, T_target, seen)
            if abs(share - overlap) <= TOLERANCE:
                return TwoPoses(T_source, T_target, share)
    return None


def is_usable(seen: Hits) -> bool:
    """Return whether a view is like one that a person would take.

    It must see the room everywhere, not mainly walls and ceiling, enough within the sensor's range, and
    nothing close to the lens.
    """
    shell = (seen.part >= SHELL_PARTS[0]) & (seen.part < SHELL_PARTS[1])
    return bool(
        np.all(seen.part >= 0)
        and np.mean(shell) <= LARGEST_SHELL
        and np.mean(in_range(seen.t)) >= LEAST_MEASURED
        and np.percentile(seen.t, 2.0) >= NEAREST_M
    )


def _proposal(
    scene: Scene, T_first: FloatArray, middle_m: float, overlap: float, rng: Rng, renderer: Renderer
) -> FloatArray:
    """Return a random second pose; the smaller ``overlap`` is, the farther it may be from the first."""
    kind = rng.integers(3)
    if kind == 2:
        return random_views(scene, rng, 1, renderer)[0]
    apart = 1.0 - overlap
    if kind == 0:
        turn_rad = apart * np.radians(rng.uniform(-100.0, 100.0))
        rotation: FloatArray = rotation_exp(np.array([0.0, 0.0, turn_rad])) @ T_first[:3, :3]
        eye_m = T_first[:3, 3] + apart * rng.uniform([-0.6, -0.6, -0.25], [0.6, 0.6, 0.25])
    else:
        point_m = T_first[:3, 3] + middle_m * T_first[:3, 2]
        turn_rad = apart * np.radians(rng.uniform(-90.0, 90.0))
        arm_m = rotation_exp(np.array([0.0, 0.0, turn_rad])) @ (T_first[:3, 3] - point_m)
        eye_m = point_m + arm_m * rng.uniform(1.0 - 0.4 * apart, 1.0 + 0.4 * apart)
        eye_m[2] += apart * rng.uniform(-0.4, 0.4)
        rotation = look_at(eye_m, point_m)[:3, :3]
    T = np.eye(4)
    pitch_rad, yaw_rad, roll_rad = np.radians(rng.normal(0.0, [6.0, 6.0, 2.0]))
    T[:3, :3] = rotation @ rotation_exp(np.array([pitch_rad, yaw_rad, roll_rad]))
    T[:3, 3] = eye_m
    return T


def is_free(caster: RayCaster, T_first: FloatArray, T_second: FloatArray) -> bool:
    """Return whether nothing is between two cameras, so that neither is in an object or outside the room."""
    way_m = T_second[:3, 3] - T_first[:3, 3]
    length_m = float(np.linalg.norm(way_m))
    if length_m < 1e-6:
        return True
    ray = np.concatenate([T_first[:3, 3], way_m / length_m]).astype(np.float32)[None]
    return bool(caster.cast(ray).t[0] > length_m + CLEARANCE_M)

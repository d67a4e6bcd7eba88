"""Rigs of three cameras in random rooms, arranged as those of the demo scenes, with wrong believed poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import count, islice

import numpy as np

from lab.places.overlap import OverlapMeter
from lab.places.views import is_free, is_usable
from lab.training.dataset import FIRST_SEED
from lab.worlds.demos import disturbed
from lab.worlds.raycast import RayCaster, world_mesh
from lab.worlds.render import Renderer
from lab.worlds.rooms import random_room
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from lab.worlds.viewpoints import random_views
from packetmesh.errors import InputError, PacketMeshError
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import look_at, rotation_exp
from pipeline.types import DepthMap, FloatArray, RgbdFrame, Rig, RigTruth

ARCS_DEG = ((25.0, 50.0), (-25.0, -50.0), (25.0, -25.0), (18.0, 36.0), (-18.0, -36.0), (18.0, -18.0))
"""Angles of the second and third camera around the point that the first looks at; the first pair that fits is
taken. The cameras of the demo scenes are 24 or 25 degrees apart."""
FIRST_VIEWS = 4
"""First cameras that are tried in a room."""


def room_seeds(split: str, number: int) -> list[int]:
    """Return the seeds of the first rooms of a split (``validation``, ``test``) in which a rig fits."""
    return list(islice((seed for seed in count(FIRST_SEED[split]) if _poses(seed) is not None), number))


@cache
def rig_named(name: str) -> Rig:
    """Return the demo scene of that name, or the rig of the room ``room-SEED``, at its true poses."""
    rig = room_rig(int(name.removeprefix("room-"))) if name.startswith("room-") else load_demo(name)
    assert rig.truth is not None
    poses = rig.truth.T_world_camera
    frames = (replace(frame, T_world_camera=T) for frame, T in zip(rig.frames, poses, strict=True))
    return replace(rig, frames=tuple(frames))


def room_rig(seed: int) -> Rig:
    """Render three cameras in the room of a seed with a Kinect's depth, at 640 x 480.

    Raises:
        PacketMeshError: no three cameras fit.
    """
    found = _poses(seed)
    if found is None:
        raise PacketMeshError(f"No three cameras fit into room {seed}; try another seed")
    scene, poses = found
    renderer, rng = Renderer(scene, threads=1), np.random.default_rng([seed, 31])
    frames, truth = [], []
    for index, T in enumerate(poses):
        view = renderer.view(scene.intrinsics, T, "fast", rng)
        sensed = sense_depth(view, scene.intrinsics, rng)
        counts = np.rint(1000.0 * sensed.z_m)  # as a camera delivers it
        depth = DepthMap((counts / 1000.0).astype(np.float32))
        frames.append(RgbdFrame(f"node_{index:02d}", view.rgb, depth, scene.intrinsics, T))
        truth.append(DepthMap(renderer.depth(scene.intrinsics, T)))
    lenses = (scene.intrinsics,) * len(poses)
    return Rig(
        f"room-{seed}", tuple(frames), RigTruth(*world_mesh(scene), tuple(poses), tuple(truth), lenses)
    )


def room_scene(seed: int) -> Scene:
    """Return the room of ``room_rig``.

    Raises:
        PacketMeshError: no three cameras fit.
    """
    found = _poses(seed)
    if found is None:
        raise PacketMeshError(f"No three cameras fit into room {seed}; try another seed")
    return found[0]


def wrong_poses(rig: Rig, turn_deg: float, shift_m: float, seed: int = 0) -> list[FloatArray]:
    """Return the poses with an error of every camera but the first, in random directions."""
    rng = np.random.default_rng([seed, *rig.name.encode()])
    return [
        frame.T_world_camera
        if index == 0
        else disturbed(frame.T_world_camera, rng, np.radians(turn_deg), shift_m)
        for index, frame in enumerate(rig.frames)
    ]


@cache
def _poses(seed: int) -> tuple[Scene, tuple[FloatArray, ...]] | None:
    """Return a room with the poses of three cameras; None if they do not fit."""
    try:
        scene = random_room(seed)
        renderer = Renderer(scene, threads=1)
        caster = RayCaster(scene, threads=1)
        meter = OverlapMeter(caster, scene.intrinsics)
        firsts = random_views(scene, np.random.default_rng([seed, 29]), FIRST_VIEWS, renderer)
    except InputError:  # the room is too full for a camera
        return None
    for first in firsts:
        seen = meter.look(first)
        if not is_usable(seen):
            continue
        middle_m = float(np.median(seen.t))
        for angles_deg in ARCS_DEG:
            others = list(_around(first, middle_m, angles_deg))
            if all(is_free(caster, first, T) and is_usable(meter.look(T)) for T in others):
                return scene, (first, *others)
    return None


def _around(first: FloatArray, middle_m: float, angles_deg: Sequence[float]) -> Iterator[FloatArray]:
    """Yield the first camera turned about the vertical line through the point that it looks at."""
    point_m = first[:3, 3] + middle_m * first[:3, 2]
    for angle_deg in angles_deg:
        arm_m = rotation_exp(np.array([0.0, 0.0, np.radians(angle_deg)])) @ (first[:3, 3] - point_m)
        yield look_at(point_m + arm_m, point_m)

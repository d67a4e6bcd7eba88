"""The demo scenes: procedural places, photographed as rigs with their truth, which ship in assets/scenes."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np

from lab.worlds.box_on_table import box_on_table
from lab.worlds.living_room import living_room
from lab.worlds.office import office
from lab.worlds.raycast import world_mesh
from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from lab.worlds.workshop import workshop
from packetmesh.errors import InputError
from pipeline.geometry import rotation_exp
from pipeline.io.demos import DEMO_SCENES
from pipeline.types import DepthMap, FloatArray, RgbdFrame, Rig, RigTruth

POSE_ERROR_RAD = np.radians(3.0)
POSE_ERROR_M = 0.06
"""How wrong every node but the first is about its pose."""

DEMOS: dict[str, Callable[[], Scene]] = {
    "living-room": living_room,
    "office": office,
    "workshop": workshop,
    "box-on-table": box_on_table,
}
"""The builder of each demo; its ``scene.json`` describes it and holds its seed."""


def build_demo(name: str) -> Scene:
    """The procedural scene behind a demo.

    Raises:
        InputError: there is no demo of that name.
    """
    if name not in DEMOS:
        raise InputError(f"There is no demo scene {name!r}; try one of {', '.join(DEMOS)}")
    return DEMOS[name]()


def render_demo(name: str) -> Rig:
    """The rig of a demo as it ships; the same bits every time."""
    scene = build_demo(name)
    renderer = Renderer(scene)
    frames, depth = [], []
    for node, T in enumerate(scene.cameras):
        rng = np.random.default_rng([DEMO_SCENES[name].seed, zlib.crc32(name.encode()), node])
        view = renderer.view(scene.intrinsics, T, "photo", rng)
        sensed = sense_depth(view, scene.intrinsics, rng)
        believed = T if node == 0 else disturbed(T, rng)
        frames.append(RgbdFrame(f"node_{node:02d}", view.rgb, sensed, scene.intrinsics, believed))
        depth.append(DepthMap(renderer.depth(scene.intrinsics, T)))
    return Rig(name, tuple(frames), RigTruth(*world_mesh(scene), scene.cameras, tuple(depth)))


def disturbed(T_world_camera: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The (4, 4) pose turned by ``POSE_ERROR_RAD`` and shifted by ``POSE_ERROR_M``, in random directions."""
    axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    T = T_world_camera.copy()
    T[:3, :3] = T[:3, :3] @ rotation_exp(POSE_ERROR_RAD * axis)
    T[:3, 3] += POSE_ERROR_M * way
    return T

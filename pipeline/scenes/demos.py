"""The demo scenes: procedural places, shipped as rendered rigs; their truth is rebuilt on opening."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.errors import InputError
from pipeline.geometry import rotation_exp
from pipeline.io import load_rig
from pipeline.scenes.box_on_table import box_on_table
from pipeline.scenes.living_room import living_room
from pipeline.scenes.office import office
from pipeline.scenes.raycast import world_mesh
from pipeline.scenes.render import Renderer
from pipeline.scenes.scene import Scene
from pipeline.scenes.sensor import sense_depth
from pipeline.scenes.workshop import workshop
from pipeline.types import DepthMap, FloatArray, RgbdFrame, Rig, RigTruth

DEMO_SCENES: dict[str, str] = {
    "living-room": "a seating group by a sunny window, with a black television and a chrome lamp",
    "office": "a desk with two screens in a corner, a swivel chair, a pinboard and book shelves",
    "workshop": "a bench with a vice under a board of tools, a brick wall, timber and tins",
    "box-on-table": "a carton of exactly 30 x 20 x 15 cm among a few things on a table",
}
"""Name and description of every scene that ships."""

SEED = 2021
POSE_ERROR_RAD = np.radians(3.0)
POSE_ERROR_M = 0.06
"""How wrong every node but the first is about its pose."""

_BUILDERS = {
    "living-room": living_room,
    "office": office,
    "workshop": workshop,
    "box-on-table": box_on_table,
}
_FOLDER = Path(__file__).resolve().parents[2] / "assets" / "scenes"


def build_demo(name: str) -> Scene:
    """The procedural scene behind a demo.

    Raises:
        InputError: there is no demo of that name.
    """
    if name not in _BUILDERS:
        raise InputError(f"There is no demo scene {name!r}; try one of {', '.join(DEMO_SCENES)}")
    return _BUILDERS[name]()


def load_demo(name: str) -> Rig:
    """The shipped rig of a demo, with its truth: the scene's mesh, the nodes' poses and hole-free depth.

    Raises:
        InputError: there is no demo of that name, or its files are missing.
    """
    scene = build_demo(name)
    rig = load_rig(_FOLDER / name)
    vertices_m, triangles = world_mesh(scene)
    renderer = Renderer(scene)
    depth = tuple(DepthMap(renderer.depth(scene.intrinsics, T)) for T in scene.cameras)
    return Rig(name, rig.frames, RigTruth(vertices_m, triangles, scene.cameras, depth))


def render_demo(name: str) -> Rig:
    """The rig of a demo as it ships, photographed anew; the same bits every time."""
    scene = build_demo(name)
    renderer = Renderer(scene)
    frames = []
    for node, T in enumerate(scene.cameras):
        rng = np.random.default_rng([SEED, list(_BUILDERS).index(name), node])
        view = renderer.view(scene.intrinsics, T, "photo", rng)
        depth = sense_depth(view, scene.intrinsics, rng)
        believed = T if node == 0 else disturbed(T, rng)
        frames.append(RgbdFrame(f"node_{node:02d}", view.rgb, depth, scene.intrinsics, believed))
    return Rig(name, tuple(frames))


def disturbed(T_world_camera: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The (4, 4) pose turned by ``POSE_ERROR_RAD`` and shifted by ``POSE_ERROR_M``, each somewhere."""
    axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    T = T_world_camera.copy()
    T[:3, :3] = T[:3, :3] @ rotation_exp(POSE_ERROR_RAD * axis)
    T[:3, 3] += POSE_ERROR_M * way
    return T

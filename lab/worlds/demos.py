"""The demo scenes in assets/scenes: rendering of procedural rooms as rigs with their truth."""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np

from lab.worlds.board_views import BoardCamera, BoardViews
from lab.worlds.box_on_table import box_on_table
from lab.worlds.living_room import living_room
from lab.worlds.moving_day import moving_day, render_boards, true_nodes
from lab.worlds.office import office
from lab.worlds.raycast import world_mesh
from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from lab.worlds.sensor import sense_depth
from lab.worlds.workshop import workshop
from packetmesh.errors import InputError
from pipeline.io.demos import DEMO_SCENES
from pipeline.kernels.geometry import rotation_exp
from pipeline.types import DepthMap, FloatArray, RgbdFrame, Rig, RigTruth

POSE_ERROR_RAD = np.radians(3.0)
"""Error of the believed orientation of every node but the first."""
POSE_ERROR_M = 0.06
"""Error of the believed position of every node but the first."""

UNCALIBRATED = "uncalibrated"

DEMOS: dict[str, Callable[[], Scene]] = {
    "living-room": living_room,
    "office": office,
    "workshop": workshop,
    "box-on-table": box_on_table,
    UNCALIBRATED: moving_day,
}
"""Builder of each demo's scene; its ``scene.json`` holds the seed of its noise and pose errors."""


def build_demo(name: str) -> Scene:
    """Return the procedural scene behind a demo.

    Raises:
        InputError: there is no demo of that name.
    """
    if name not in DEMOS:
        raise InputError(f"There is no demo scene {name!r}; try one of {', '.join(DEMOS)}")
    return DEMOS[name]()


def render_demo(name: str) -> Rig:
    """Return the rig of a demo as it ships; every call gives the same bits.

    Raises:
        InputError: there is no demo of that name.
    """
    scene = build_demo(name)
    renderer = Renderer(scene)
    frames, depth = [], []
    nodes = nodes_of(name)
    for index, node in enumerate(nodes):
        camera, T = node.intrinsics, node.T_world_camera
        rng = np.random.default_rng([DEMO_SCENES[name].seed, zlib.crc32(name.encode()), index])
        view = renderer.view(camera, T, "photo", rng)
        sensed = node.bias.measured(sense_depth(view, camera, rng))
        believed = T if index == 0 else disturbed(T, rng)
        frames.append(RgbdFrame(f"node_{index:02d}", view.rgb, sensed, scene.intrinsics, believed))
        depth.append(DepthMap(renderer.depth(camera, T)))
    lenses = tuple(node.intrinsics for node in nodes)
    return Rig(name, tuple(frames), RigTruth(*world_mesh(scene), scene.cameras, tuple(depth), lenses))


def nodes_of(name: str) -> tuple[BoardCamera, ...]:
    """Return the nodes of a demo with their true parameters.

    Raises:
        InputError: there is no demo of that name.
    """
    if name == UNCALIBRATED:
        return true_nodes()
    scene = build_demo(name)
    return tuple(BoardCamera(scene.intrinsics, T) for T in scene.cameras)


def render_demo_boards(name: str) -> BoardViews | None:
    """Return the board views of a demo whose nodes need calibration; None for other demos."""
    return render_boards(DEMO_SCENES[name].seed) if name == UNCALIBRATED else None


def disturbed(
    T_world_camera: FloatArray,
    rng: np.random.Generator,
    turn_rad: float = POSE_ERROR_RAD,
    shift_m: float = POSE_ERROR_M,
) -> FloatArray:
    """Return a pose turned by ``turn_rad`` and shifted by ``shift_m``, in random directions."""
    axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    T = T_world_camera.copy()
    T[:3, :3] = T[:3, :3] @ rotation_exp(turn_rad * axis)
    T[:3, 3] += shift_m * way
    return T

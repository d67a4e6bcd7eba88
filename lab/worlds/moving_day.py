"""A room on moving day with three uncalibrated nodes, and board views to calibrate them.

The nodes' files state a focal length of 525 pixels and no distortion, poses with the errors of a tape measure
(but for the first node's), and depth with the sensor's bias.
"""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.board_poses import propose_poses
from lab.worlds.board_views import BoardCamera, BoardViews, render_board_views, with_depth_near_boards
from lab.worlds.depth_bias import DepthBias
from lab.worlds.furniture import fixtures, lights, plants, storage, things, tools
from lab.worlds.furniture.finishes import fabric, painted
from lab.worlds.furniture.placing import place, solid
from lab.worlds.primitives import cylinder
from lab.worlds.render import Renderer
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.staging import EAST, NORTH, SOUTH, VGA, WALL_M, WEST, arc, shell
from pipeline.calibration.board import Board
from pipeline.types import CameraIntrinsics

SIZE_M = (3.9, 3.7, 2.5)
WINDOW = (0.35, 0.9, 1.3, 1.3)
CORNER_M = (SIZE_M[0] - 0.4, SIZE_M[1] - 0.36)
"""(x, y) position of the stacked boxes."""
BOARD = Board("circles", 11, 9, 0.05)
MOMENTS = 14
"""Number of board poses; all nodes photograph each at the same time."""
AROUND_PX = 16
"""Distance from the board, in pixels, beyond which depth is removed to keep the files small."""


def _lens(fx_px: float, fy_px: float, cx_px: float, cy_px: float, k1: float, k2: float) -> CameraIntrinsics:
    matrix = np.array([[fx_px, 0.0, cx_px], [0.0, fy_px, cy_px], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, np.array([k1, k2, 0.0, 0.0, 0.0]), VGA.width_px, VGA.height_px)


LENSES = (
    _lens(541.8, 540.6, 327.4, 233.9, 0.11, -0.23),
    _lens(508.3, 509.9, 313.1, 246.8, -0.08, 0.09),
    _lens(537.2, 536.1, 321.7, 251.2, 0.14, -0.31),
)
"""True lenses: focal lengths are 2 to 3 % off those in the files."""
BIASES = (
    DepthBias(0.0, 0.99, 0.0, np.array([[0.0, 0.002, -0.002], [0.001, 0.0, 0.001], [-0.002, 0.0, 0.0]])),
    DepthBias(0.03, 1.0, 0.0, np.array([[0.0, -0.002, -0.003], [0.002, 0.001, 0.0], [-0.001, 0.0, 0.0]])),
    DepthBias(-0.03, 1.01, 0.0, np.array([[0.0, 0.001, -0.002], [-0.002, 0.0, 0.001], [-0.003, 0.0, 0.0]])),
)
"""Biases of the depth sensors: 1 % too far; 3 cm too near; 3 cm too far and 1 % too near."""


def moving_day() -> Scene:
    """Return the scene; all random choices are seeded. Its intrinsics are those in the nodes' files."""
    rng = np.random.default_rng(53)
    return Scene(
        "uncalibrated",
        (*_room(rng), *_corner(rng), *_sideboard(rng), *_floor(rng)),
        (
            Light(np.array([0.3, 2.2, 1.55]), np.array([2.9, 3.0, 3.1]), 0.5),
            Light(np.array([1.5, 1.3, 2.3]), np.array([2.2, 2.0, 1.7]), 0.15),
            Light(np.array([3.3, 0.6, 2.2]), np.array([1.6, 1.5, 1.3]), 0.3),
            Light(np.array([2.75, SIZE_M[1] - 0.22, 1.16]), np.array([0.2, 0.15, 0.1]), 0.08),
        ),
        np.array([0.3, 0.3, 0.3]),
        arc((2.75, 2.75, 0.75), 2.15, 1.5, (203.0, 228.0, 253.0)),
        VGA,
    )


def true_nodes() -> tuple[BoardCamera, ...]:
    """Return the nodes with their true parameters."""
    cameras = moving_day().cameras
    return tuple(BoardCamera(*node) for node in zip(LENSES, cameras, BIASES, strict=True))


def render_boards(seed: int) -> BoardViews:
    """Return the views of all nodes of the circle grid in the room, at ``MOMENTS`` moments."""
    scene, nodes = moving_day(), true_nodes()
    renderer = Renderer(scene)
    free_m = [renderer.depth(node.intrinsics, node.T_world_camera) for node in nodes]
    poses = propose_poses(BOARD, nodes, MOMENTS, seed, free_m)
    return with_depth_near_boards(render_board_views(BOARD, nodes, poses, seed, scene, "photo"), AROUND_PX)


def _room(rng: Rng) -> list[Part]:
    wall = Material(textures.plaster("#e4ded0", 21, 0.01, 0.05))
    green = Material(textures.plaster("#9aa894", 22, 0.01, 0.05))
    floor = Material(textures.planks("#b7966c", "#8f6d47", 23, 0.14, 1.8), 0.05)
    ceiling = painted(rng, "#f4f2ec", 0.0)
    return [
        *shell(rng, SIZE_M, floor, (wall, green, wall, wall), ceiling, {WEST: WINDOW}),
        *fixtures.window(rng, place(0.0, 2.2, WEST, 0.9), (1.3, 1.3), recess_m=WALL_M - 0.04),
        *fixtures.door(rng, place(1.1, 0.0, SOUTH), "#e8e4da"),
        *fixtures.picture(rng, place(SIZE_M[0], 2.3, EAST, 1.4), (0.6, 0.8), "#5b3a24"),
    ]


def _corner(rng: Rng) -> list[Part]:
    """Return stacks of cartons."""
    x, y = CORNER_M
    return [
        *storage.cardboard_box(rng, place(x, y, 0.04), (0.62, 0.5, 0.48)),
        *storage.cardboard_box(rng, place(x + 0.02, y + 0.03, -0.09, 0.48), (0.52, 0.42, 0.4)),
        *storage.cardboard_box(rng, place(x, y, 0.2, 0.88), (0.36, 0.3, 0.26)),
        *storage.cardboard_box(rng, place(x + 0.08, y - 0.72, -0.12), (0.5, 0.4, 0.36)),
        *storage.crate(rng, place(x + 0.1, y - 0.72, EAST + 0.1, 0.36), (0.44, 0.32, 0.26), "#b98a58"),
        *storage.books(rng, place(x + 0.11, y - 0.56, EAST + 0.1, 0.385), 0.34, 0.24, 0.24),
    ]


def _sideboard(rng: Rng) -> list[Part]:
    """Return a sideboard with objects on it that fit into no carton."""
    x, y, top = 2.3, SIZE_M[1] - 0.24, 0.8
    return [
        *storage.cabinet(rng, place(x, y, NORTH), (1.35, 0.44, top), "#8a5a33"),
        *things.globe(rng, place(x - 0.45, y, 0.6, top), 0.14),
        *things.book_pile(rng, place(x - 0.12, y - 0.02, 0.3, top), 5),
        *lights.table_lamp(rng, place(x + 0.45, y + 0.02, 0.0, top), "#a8482e"),
        *tools.drill(rng, place(x + 0.16, y - 0.06, 2.4, top)),
    ]


def _floor(rng: Rng) -> list[Part]:
    carpet = fabric(rng, "#a4533c", "#d8cfc0")
    return [
        *storage.cardboard_box(rng, place(2.55, 2.55, 0.5), (0.5, 0.36, 0.34)),
        *tools.toolbox(rng, place(2.56, 2.54, 0.62, 0.34), "#24507a"),
        solid(cylinder(0.11, 1.5, 40), carpet, place(1.5, 3.1, 0.35, 0.11), turn_rad=(0.0, np.pi / 2.0, 0.0)),
        *plants.potted_plant(rng, place(1.35, 3.45), 0.95, "#6f7f86"),
        *storage.paint_can(rng, place(2.1, 2.75, 0.4), "#9aa894"),
        *storage.bucket(rng, place(3.2, 2.05, 1.2), "#dfe5e3"),
    ]

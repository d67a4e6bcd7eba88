"""Choice of board poses whose views calibrate the cameras of a rig well."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Sequence
from itertools import combinations

import numpy as np

from lab.worlds.board_views import BoardCamera, is_partly_behind
from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.kernels.geometry import apply, inverse, project, rigid, rotation_exp
from pipeline.types import FloatArray

DISTANCES_M = (0.6, 2.5)
MOST_TILT_DEG = 45.0
MARGIN_PX = 8.0
"""Least distance of the board from the border of the image; half a spacing is added."""
LEAST_SPACING_PX = 11.0
"""Least distance between the images of neighbouring points; detection misses smaller circles."""
TRIES = 60
"""Number of random poses that are tried for each chosen one."""
CELLS = {(8, 6): 0.25, (4, 3): 4.0}
"""Grids of image parts, across and down, and the value of a new part; the large parts are those in
which the depth calibration needs views."""


def propose_poses(
    board: Board,
    cameras: Sequence[BoardCamera],
    count: int,
    seed: int,
    free_m: Sequence[FloatArray] | None = None,
    distances_m: tuple[float, float] = DISTANCES_M,
) -> tuple[FloatArray, ...]:
    """Return T_world_board of ``count`` moments, chosen one by one from random poses by their value.

    A pose has a value for each part of an image that it covers, for the distance and the tilt that a camera
    sees, and for each pair of cameras that see the board together; every chosen pose that has the same halves
    the value.

    Args:
        board: the board.
        cameras: the cameras; in every returned pose at least one of them sees the whole board, and the board
            is partly behind none, so that it can be rendered.
        count: number of moments.
        seed: seed of the random poses.
        free_m: (H, W) depth of the scene from each camera, which must not hide the board; None: an empty
            scene.
        distances_m: least and greatest depth of the board's centre in the camera for which a pose is drawn.

    Raises:
        InputError: fewer than ``count`` of the random poses are such.
    """
    rng = np.random.default_rng(seed)
    pool: list[tuple[FloatArray, dict[Hashable, float]]] = []
    for _ in range(TRIES * count):
        T = _random_pose(cameras, rng, distances_m)
        seen = [
            node
            for node, camera in enumerate(cameras)
            if sees(board, camera, T, None if free_m is None else free_m[node])
        ]
        straddles = any(is_partly_behind(board, inverse(one.T_world_camera) @ T) for one in cameras)
        if seen and not straddles:
            pool.append((T, dict(_shown(board, cameras, seen, T, distances_m))))
    if len(pool) < count:
        raise InputError(
            f"Only {len(pool)} of {count} board poses were found in which a camera sees the whole board "
            "large enough; change the board's size or its distance"
        )
    counts: Counter[Hashable] = Counter()
    chosen = []
    for _ in range(count):
        gains = [sum(worth / 2.0 ** counts[what] for what, worth in shown.items()) for _, shown in pool]
        T, shown = pool.pop(int(np.argmax(gains)))
        counts.update(shown.keys())
        chosen.append(T)
    return tuple(chosen)


def sees(
    board: Board, camera: BoardCamera, T_world_board: FloatArray, free_m: FloatArray | None = None
) -> bool:
    """Return whether a camera sees the whole board from its front, large enough and not hidden.

    Args:
        board: the board.
        camera: the camera.
        T_world_board: (4, 4).
        free_m: (H, W) depth of the scene from the camera; NaN counts as hidden. None: an empty scene.
    """
    T = inverse(camera.T_world_camera) @ T_world_board
    points_m = apply(T, board.points_m)
    if points_m[:, 2].min() < 0.3 or _tilt_rad(T) > np.radians(MOST_TILT_DEG):
        return False
    seen_px = project(camera.intrinsics, points_m)
    high_px = np.array([camera.intrinsics.width_px, camera.intrinsics.height_px]) - 1.0
    grid = seen_px.reshape(*board.grid[::-1], 2)
    spacing_px = min(float(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min()) for axis in (0, 1))
    rim_px = MARGIN_PX + 0.5 * spacing_px
    inside = (seen_px >= rim_px) & (seen_px <= high_px - rim_px)  # False for NaN: no image
    if not inside.all() or spacing_px < LEAST_SPACING_PX:
        return False
    if free_m is None:
        return True
    column, row = np.rint(seen_px).astype(int).T
    return bool((points_m[:, 2] < 0.98 * free_m[row, column]).all())


def _tilt_rad(T_camera_board: FloatArray) -> float:
    """Return the angle between the board's normal and the line of sight; over 90 degrees shows the back."""
    way = T_camera_board[:3, 3] / np.linalg.norm(T_camera_board[:3, 3])
    return float(np.arccos(np.clip(T_camera_board[:3, 2] @ way, -1.0, 1.0)))


def _random_pose(
    cameras: Sequence[BoardCamera], rng: np.random.Generator, distances_m: tuple[float, float]
) -> FloatArray:
    """Return a random (4, 4) pose in the view of one camera, tilted from facing the mean position of some."""
    camera = cameras[int(rng.integers(len(cameras)))]
    size = np.array([camera.intrinsics.width_px, camera.intrinsics.height_px])
    at_px = rng.uniform(0.1, 0.9, 2) * size
    focal_px = np.array([camera.intrinsics.fx_px, camera.intrinsics.fy_px])
    flat = (at_px - (camera.intrinsics.cx_px, camera.intrinsics.cy_px)) / focal_px
    away_m = np.exp(rng.uniform(*np.log(distances_m)))
    place_m = apply(camera.T_world_camera, away_m * np.array([*flat, 1.0]))

    towards = rng.choice(len(cameras), int(rng.integers(1, len(cameras) + 1)), replace=False)
    eye_m = np.mean([cameras[node].T_world_camera[:3, 3] for node in towards], axis=0)
    forward = (place_m - eye_m) / np.linalg.norm(place_m - eye_m)
    right = camera.T_world_camera[:3, 0] - (camera.T_world_camera[:3, 0] @ forward) * forward
    right /= np.linalg.norm(right)
    facing = np.stack([right, np.cross(forward, right), forward], axis=1)
    axis, tilt = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(0.0, 0.9 * MOST_TILT_DEG))
    roll = np.radians(rng.uniform(-25.0, 25.0))
    turned = rotation_exp(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
    return rigid(facing @ turned @ rotation_exp(np.array([0.0, 0.0, roll])), place_m)


def _shown(
    board: Board,
    cameras: Sequence[BoardCamera],
    seen: Sequence[int],
    T_world_board: FloatArray,
    distances_m: tuple[float, float],
) -> Iterator[tuple[Hashable, float]]:
    """Yield the image parts, distances, tilts and pairs of cameras that a pose shows, with their values."""
    far = {}
    for node in seen:
        camera = cameras[node].intrinsics
        T = inverse(cameras[node].T_world_camera) @ T_world_board
        at = project(camera, apply(T, board.points_m)) / (camera.width_px, camera.height_px)
        for cells, worth in CELLS.items():
            for cell in {tuple(one) for one in (at * cells).astype(int).tolist()}:
                yield ("cell", node, cells, cell), worth
        share = np.log(np.linalg.norm(T[:3, 3]) / distances_m[0]) / np.log(distances_m[1] / distances_m[0])
        far[node] = int(np.clip(4.0 * share, 0.0, 3.0))
        yield ("far", node, far[node]), 2.0
        aside = T[:2, 2] - T[:2, 3] / T[2, 3]
        tilted = _tilt_rad(T) > np.radians(15.0)
        side = int(np.arctan2(aside[1], aside[0]) // (0.5 * np.pi)) if tilted else None
        yield ("tilt", node, side), 2.0
    for pair in combinations(seen, 2):
        yield ("pair", pair, far[pair[0]]), 2.0

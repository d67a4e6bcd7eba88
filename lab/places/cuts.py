"""Pairs of bare clouds cut from a random room's true surface with a given overlap, and their true pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lab.places.pairs import Split, rooms_of
from lab.worlds.raycast import RayCaster
from lab.worlds.render import Renderer
from lab.worlds.rooms import random_room
from lab.worlds.scene import Rng, Scene
from lab.worlds.viewpoints import random_views
from packetmesh.errors import InputError, PacketMeshError
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.kernels.point_sets import distinct_rows
from pipeline.types import FloatArray, PointCloud

POINTS = 20_000
NOISE_M = 0.004
"""Standard deviation of the noise of every coordinate."""
START_DEG, START_M = 8.0, 0.14
"""Rotation and distance by which the start pose is wrong in SPEC 4.11."""
EYES = 24
"""Places in the room from which its surface is sampled."""
RAYS = 15_000
"""Rays of each eye, evenly over all directions."""
CELL_M = 0.02
"""One surface point is kept in each cube of this edge, so that the density is even."""


@dataclass(frozen=True, slots=True)
class CutPair:
    """Two clouds without colours or normals, whose registration starts at the identity."""

    source: PointCloud
    target: PointCloud
    T_target_source: FloatArray
    """(4, 4) true pose; its difference from the identity is the error of the start."""
    overlap_share: float
    """Share of each cloud's surface that the other cloud covers, 0 to 1."""
    room: int
    """Seed of the room."""


def cut_pair(
    split: Split, index: int, overlap: float, start_deg: float = START_DEG, start_m: float = START_M
) -> CutPair:
    """Return two overlapping parts of a room's visible surface, cut by two parallel upright planes.

    The planes are perpendicular to a random level direction. One cloud is the part in front of the farther
    plane, the other the part behind the nearer one. The points of both are drawn independently, at most
    ``POINTS`` each, with ``NOISE_M`` of noise.

    Args:
        split: ``VALIDATION`` or ``HELD_OUT`` of ``lab.places.pairs``; the rooms are those of ``pair``.
        index: number of the pair in its split.
        overlap: share of each cloud that the other one covers, 0 to 1.
        start_deg: angle by which the start is wrong, about a random axis through the source's middle.
        start_m: distance of the source's middle from its true place at the start.

    Raises:
        InputError: the overlap is out of range.
        PacketMeshError: no room that was tried can be sampled.
    """
    if not 0.0 <= overlap <= 1.0:
        raise InputError(f"An overlap of {overlap:g} is not possible; it is 0 to 1")
    for seed, rng in rooms_of(split, index):
        try:
            surface_m = _visible_surface(random_room(seed), rng)
        except InputError:  # the room is too full for a camera
            continue
        source_m, target_m = _halves(surface_m, overlap, rng)
        T_true = _error(source_m.mean(axis=0), start_deg, start_m, rng)
        source = PointCloud(source_m).transformed(inverse(T_true))
        return CutPair(source, PointCloud(target_m), T_true, overlap, seed)
    raise PacketMeshError(f"No room for pair {index} of {split} can be sampled; take another index")


def _visible_surface(scene: Scene, rng: Rng) -> FloatArray:
    """Return (N, 3) points on the surface that is visible from inside the room, one in each small cube."""
    caster = RayCaster(scene, threads=1)
    rays = np.empty((RAYS, 6), np.float32)
    found = []
    for T in random_views(scene, rng, EYES, Renderer(scene, threads=1)):
        directions = rng.standard_normal((RAYS, 3))
        rays[:, :3] = T[:3, 3]
        rays[:, 3:] = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        hits = caster.cast(rays)
        found.append(hits.positions[hits.part >= 0].astype(np.float64))
    points_m = np.concatenate(found)
    return points_m[distinct_rows(np.floor(points_m / CELL_M))]


def _halves(surface_m: FloatArray, overlap: float, rng: Rng) -> tuple[FloatArray, FloatArray]:
    """Return the points in front of one plane and those behind another, drawn and with noise.

    With a share h of the surface in each half, (2 h - 1) / h of each is common, so h = 1 / (2 - overlap).
    """
    angle_rad = rng.uniform(0.0, 2.0 * np.pi)
    order = np.argsort(surface_m[:, :2] @ [np.cos(angle_rad), np.sin(angle_rad)])
    half = round(len(order) / (2.0 - overlap))
    return _drawn(surface_m[order[:half]], rng), _drawn(surface_m[order[-half:]], rng)


def _drawn(points_m: FloatArray, rng: Rng) -> FloatArray:
    """Return ``POINTS`` different points, or all if there are fewer, with noise."""
    rows = rng.permutation(len(points_m))[:POINTS]
    return points_m[rows] + rng.normal(0.0, NOISE_M, (len(rows), 3))


def _error(middle_m: FloatArray, turn_deg: float, shift_m: float, rng: Rng) -> FloatArray:
    """Return a (4, 4) motion: a turn about a random axis through a point, and a shift, randomly directed."""
    axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    rotation = rotation_exp(np.radians(turn_deg) * axis)
    return rigid(rotation, middle_m - rotation @ middle_m + shift_m * way)

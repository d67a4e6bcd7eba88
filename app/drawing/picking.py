"""The search for the hole that a click in the scene selects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from app.compute.cuts import Cut, kept
from pipeline.types import FloatArray

REACH_DEG = 1.5
"""Largest angle between a click's ray and the hole that it selects."""


class Loop(Protocol):
    """A loop of edges that belong to one triangle only."""

    @property
    def loop_m(self) -> FloatArray:
        """(L, 3) world frame, closed without repeating the first point; a hole's runs clockwise seen from
        outside."""
        ...

    @property
    def rim(self) -> bool:
        """Whether the surface ends there, so that it is no hole."""
        ...


def picked_hole(
    holes: Sequence[Loop], origin_m: FloatArray, direction: FloatArray, cut: Cut = None
) -> int | None:
    """Return the hole that a ray selects.

    This is the nearest hole that the ray passes through; else the one whose edges it passes at the smallest
    angle, up to 1.5 degrees; rims only if there is no hole. A ray to any part of a surface passes through the
    rim around that surface, so a rim counts as passed through only if it runs as the loop of a hole does:
    clockwise seen from the ray's origin.

    Args:
        holes: holes of one surface.
        origin_m: (3,) origin in the frame of the holes.
        direction: (3,) of any length.
        cut: what is left out of the picture, in the frame of the holes; holes in it cannot be selected.

    Returns:
        The index in ``holes``; None if there is none near.
    """
    axes = _axes(direction)
    best: tuple[bool, float, float] | None = None
    picked = None
    for index, hole in enumerate(holes):
        if not kept(cut, hole.loop_m).any():
            continue
        loop = (hole.loop_m - origin_m) @ axes.T
        turns = _turns(loop)
        through = turns > 0 if hole.rim else turns != 0
        angle_deg = 0.0 if through else _edge_angle_deg(loop)
        rank = (hole.rim, angle_deg, float(loop[:, 2].mean()))
        if angle_deg <= REACH_DEG and (best is None or rank < best):
            best, picked = rank, index
    return picked


def _axes(direction: FloatArray) -> FloatArray:
    """Return (3, 3) right-handed unit axes as rows, the last along the direction."""
    forward = np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross(np.eye(3)[np.argmin(np.abs(forward))], forward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _turns(loop: FloatArray) -> int:
    """Return the clockwise turns of an (L, 3) loop around the z axis, looking along it; 0 if z <= 0."""
    if loop[:, 2].min() <= 0.0:
        return 0
    bearing = np.arctan2(loop[:, 1], loop[:, 0])
    change = np.roll(bearing, -1) - bearing
    return round(float(((change + np.pi) % (2 * np.pi) - np.pi).sum()) / (2 * np.pi))


def _edge_angle_deg(loop: FloatArray) -> float:
    """Return the smallest angle between the z axis and the edges of an (L, 3) loop from the origin."""
    edge = np.roll(loop, -1, axis=0) - loop
    along, ee, ss = ((a * b).sum(axis=1) for a, b in ((loop, edge), (edge, edge), (loop, loop)))
    # t at which the cosine z / |loop + t edge| is stationary; the corners are candidates too.
    below = edge[:, 2] * along - loop[:, 2] * ee
    t = np.divide(loop[:, 2] * along - edge[:, 2] * ss, below, out=np.zeros_like(below), where=below != 0.0)
    points = np.concatenate([loop, loop + np.clip(t, 0.0, 1.0)[:, None] * edge])
    cosine = points[:, 2] / np.maximum(np.linalg.norm(points, axis=1), 1e-12)
    return float(np.degrees(np.arccos(min(float(cosine.max()), 1.0))))

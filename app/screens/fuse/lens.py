"""The magnified corner of a race: an edge between two surfaces that both clouds show, seen along the edge.

In this view a surface is a line, and a cloud that is off by ten centimetres is a second line ten centimetres
away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from app.drawing.colors import MOST_DISTANCE_M
from app.screens.fuse.view import REACH_M, LensView
from pipeline.kernels.geometry import apply
from pipeline.registration.neighbourhood import pca_normals
from pipeline.types import BoolArray, ByteArray, FloatArray

WINDOW_M = 0.3
"""Width and height of the view."""
SLAB_M = 0.1
"""Half the length of the part of the edge that is shown."""
AROUND_M = 0.15
"""Radius of the neighbourhood that decides whether a point is on an edge."""
LEAST_SHARE = 0.12
"""Least share of the second direction among the normals at an edge."""
CLEAR = 0.75
"""Edges whose share of the second direction is at least this part of the largest count as equally clear."""
LEAST_POINTS = 60
CLOUD_POINTS, CANDIDATES, DRAWN = 30_000, 800, 900


@dataclass(frozen=True, slots=True)
class Lens:
    """The view of a corner, and the source points near it."""

    view: LensView
    axes: FloatArray
    """(3, 3) rows: to the right, up and towards the viewer, target frame."""
    distances: Distances
    """Distances of the source's points that are in the corner, or near it, at the aligned pose."""

    def at(self, T_target_source: FloatArray) -> ByteArray:
        """Return (M, 3) column, row and shade of the visible points at a pose."""
        pixels, inside = _pixels(
            apply(T_target_source, self.distances.points_m), self.view.center_m, self.axes
        )
        shades = shades_of(self.distances.at(T_target_source)[0])
        return np.column_stack([pixels, shades])[inside].astype(np.uint8)


def lens_of(
    source_m: FloatArray, target_m: FloatArray, T_aligned: FloatArray, distances: Distances
) -> Lens | None:
    """Return the lens at the farthest edge that both clouds show clearly, where a wrong rotation shows most;
    None if there is none.

    Args:
        source_m: (N, 3) the source cloud in its own frame.
        target_m: (M, 3) the target cloud in its camera's frame.
        T_aligned: (4, 4) correct pose of the source in the target frame.
        distances: distances of the drawn points, which give the colours.
    """
    aligned_m = apply(T_aligned, source_m)
    found = _edge(_thinned(aligned_m), _thinned(target_m))
    if found is None:
        return None
    center_m, axes = found
    near = np.abs((aligned_m - center_m) @ axes.T) <= (0.75 * WINDOW_M, 0.75 * WINDOW_M, SLAB_M)
    here = np.abs((target_m - center_m) @ axes[2]) <= SLAB_M
    pixels, inside = _pixels(target_m[here], center_m, axes)
    view = LensView(center_m, WINDOW_M, _some(pixels[inside]).astype(np.uint8))
    points_m = _some(source_m[near.all(axis=1)])
    return Lens(view, axes, Distances(points_m, distances.T_home, distances.tree))


def _edge(aligned_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return (3,) position and (3, 3) axes of an edge where both clouds' normals have two directions."""
    if min(len(aligned_m), len(target_m)) < LEAST_POINTS:
        return None
    clouds = [(cKDTree(points_m), pca_normals(points_m)) for points_m in (target_m, aligned_m)]
    candidates_m = target_m[:: max(1, len(target_m) // CANDIDATES)]
    shares = np.array([min(_two_directions(one, *cloud) for cloud in clouds) for one in candidates_m])
    if shares.max() < LEAST_SHARE:
        return None
    clear_m = candidates_m[shares >= max(LEAST_SHARE, CLEAR * shares.max())]
    center_m = clear_m[np.argmax(np.linalg.norm(clear_m - target_m.mean(axis=0), axis=1))]
    tree, normals = clouds[0]
    near = normals[tree.query_ball_point(center_m, AROUND_M)]
    along, facing = np.linalg.eigh(near.T @ near)[1][:, 0], near.mean(axis=0)
    along = along if along @ center_m < 0.0 else -along  # towards the camera, which is at the origin
    up = -(facing - facing @ along * along)
    up /= np.linalg.norm(up)
    return center_m, np.stack([np.cross(up, along), up, along])


def _two_directions(center_m: FloatArray, tree: cKDTree, normals: FloatArray) -> float:
    """Rate from 0 to 0.5 how clearly the normals around a point have a second direction and no third."""
    rows = tree.query_ball_point(center_m, AROUND_M)
    if len(rows) < LEAST_POINTS:
        return 0.0
    third, second, _ = np.linalg.eigvalsh(normals[rows].T @ normals[rows] / len(rows))
    return float(second - 2.0 * third)


def _pixels(points_m: FloatArray, center_m: FloatArray, axes: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return (N, 2) columns and rows, 0 to 255 in the window, and (N,) whether a point is in it."""
    across = ((points_m - center_m) @ axes[:2].T) / WINDOW_M
    pixels = np.rint(255.0 * (0.5 + across * (1.0, -1.0)))
    return pixels, np.all((pixels >= 0) & (pixels <= 255), axis=1)


def _thinned(points_m: FloatArray) -> FloatArray:
    return points_m[:: max(1, len(points_m) // CLOUD_POINTS)].astype(float)


def _some(rows: FloatArray) -> FloatArray:
    """Return at most ``DRAWN`` of the rows, drawn uniformly."""
    if len(rows) <= DRAWN:
        return rows
    return rows[np.sort(np.random.default_rng(0).choice(len(rows), DRAWN, replace=False))]


@dataclass(frozen=True, slots=True)
class Distances:
    """Distance of each point from its reference position or, if unknown, from the target's nearest point."""

    points_m: FloatArray
    """(N, 3) source frame."""
    T_home: FloatArray | None
    """(4, 4) reference pose of the source in the target frame; None if it is unknown."""
    tree: cKDTree
    """Search tree of the target."""

    def at(self, T_target_source: FloatArray) -> tuple[FloatArray, float]:
        """Return (N,) distances at a pose and their median (NaN if ``T_home`` is known), in metres.

        Distances from the target are at most ``REACH_M``.
        """
        places_m = apply(T_target_source, self.points_m)
        if self.T_home is not None:
            return np.linalg.norm(places_m - apply(self.T_home, self.points_m), axis=1), float("nan")
        distances_m = self.tree.query(places_m, distance_upper_bound=REACH_M)[0]
        distances_m = np.minimum(distances_m, REACH_M)
        return distances_m, float(np.median(distances_m))


def shades_of(distances_m: FloatArray) -> ByteArray:
    """Return (N,) 0 to 255 for distances from zero to ``MOST_DISTANCE_M`` and beyond."""
    return np.rint(255.0 * np.minimum(distances_m / MOST_DISTANCE_M, 1.0)).astype(np.uint8)

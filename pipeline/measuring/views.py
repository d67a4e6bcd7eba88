"""Noise, node and confidence of a surface's vertices, by comparison with the cameras' depth images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.acquisition.back_project import depth_sigma_m
from pipeline.kernels import geometry
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import first_hits, triangle_scene
from pipeline.recording.still import step_at
from pipeline.types import BoolArray, FloatArray, IntArray, RgbdFrame

WIDTH_PX = 320
"""Least width to which images are reduced, to every k-th pixel, for the comparison with the surface."""
WINDOW = 0.5
"""Standard deviation of the window over which the surface's misfit is averaged, in spacings."""
MISFIT_FACTOR = 1.25
"""Factor with which this misfit's root mean square, after the noise of averaged depth is subtracted from its
square, enters a vertex's standard deviation; it exceeds 1 because misfits have long tails.
``python -m lab.measuring misfit`` prints how often the depths in rendered rooms are inside their intervals by
several factors."""
LEAST_WINDOW_PX = 1.5
"""Least standard deviation of that window, pixels of the compared image."""
GUESS_PX = 3
"""Distance of the pixels around a vertex in which its guess is looked for."""
LEAST_Z_M = 0.05
SEEN_WITHIN = 0.02
"""A camera sees a vertex if the surface is within this share of the depth, or within two spacings."""
LEAST_MEASURED = 0.05
"""Least share of measured pixels around a vertex that a camera measured."""
ALONE = 0.8
"""Share of the measurements from which a vertex belongs to one node."""
MOST_AVERAGED = 60.0
"""About the largest number of measurements that averaging over a surface combines in one pixel."""
PATCH = 10.0
"""Effective number of vertices that smoothing averages (20 with Gaussian weights, ``surface.smooth``)."""


@dataclass(frozen=True, slots=True)
class View:
    """One placed camera, with the depth that the surface is compared with."""

    frame: RgbdFrame
    T_world_camera: FloatArray
    """(4, 4)."""
    measured_m: FloatArray
    """(H, W) measured depth after averaging over its surface; NaN where unknown."""
    guessed_m: FloatArray
    """(H, W) guessed depth that was accepted; NaN elsewhere."""
    confidence: FloatArray
    """(H, W) confidence of the guesses."""
    node: int
    """Number of the node in its rig."""


@dataclass(frozen=True, slots=True)
class Known:
    """Corrected places, noise and origin of V vertices."""

    vertices_m: FloatArray
    """(V, 3)."""
    sigma_m: FloatArray
    """(V,) standard deviation along ``rays``."""
    rays: FloatArray
    """(V, 3) unit, from camera to vertex."""
    ranges_m: FloatArray
    """(V,) distance from that camera."""
    nodes: IntArray
    """(V,) node that measured or guessed the vertex; -1 for several or none."""
    confidence: FloatArray
    """(V,) confidence of a guess; NaN for a measured vertex."""


@dataclass(frozen=True, slots=True)
class _Compared:
    """A surface compared with one camera's averaged depth at every ``every``-th pixel; arrays are (h, w)."""

    every: int
    surface_m: FloatArray
    """Depth of the surface, infinite where a ray misses."""
    share: FloatArray
    """Share of the pixels around each that have both, near each other."""
    mean_m: FloatArray
    """Mean difference of these, measured less surface."""
    square_m2: FloatArray
    """Mean square of this difference."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """V vertices as one camera sees them; all arrays are (V,) except ``rays``."""

    inside: BoolArray
    """Whether a vertex is in the image."""
    row: IntArray
    column: IntArray
    """Its pixel."""
    z_m: FloatArray
    rays: FloatArray
    """(V, 3) unit, from the camera."""
    ranges_m: FloatArray
    pixels: FloatArray
    """Pixels in a square of one spacing at this depth."""
    weights: FloatArray
    """Number of measurements there; 0 where it measured nothing or sees another surface."""
    mean_m: FloatArray
    misfit_m: FloatArray
    """Mean and root mean square difference of measured depth from the surface around it."""


def known_by(
    vertices_m: FloatArray,
    triangles: IntArray,
    guessed: BoolArray,
    views: Sequence[View],
    spacing_m: float,
    smoothed: bool,
) -> Known:
    """Compare a surface with what each camera measured; return its vertices, corrected, with their noise.

    Smoothing rounds creases and small things by more than the noise. So every measured vertex is first moved
    along its rays by the mean difference of averaged measurements from the surface around it, as far as that
    is more than noise. What the measurements then still differ by counts as noise, besides the sensor's own
    after averaging. Of the difference's square, the share that is noise of the averaged depth is not the
    surface's error: the surface is the mean of many such pixels.

    Args:
        vertices_m: (V, 3) world frame.
        triangles: (F, 3).
        guessed: (V,) True for inferred vertices.
        views: the placed cameras.
        spacing_m: typical distance of neighbouring vertices.
        smoothed: whether vertices were moved onto the planes of their neighbours.
    """
    vertices_m = vertices_m + _corrections_m(vertices_m, triangles, views, spacing_m) * ~guessed[:, None]
    scene = triangle_scene(vertices_m, triangles)
    count = len(vertices_m)
    squares_m2, total, most = np.zeros(count), np.zeros(count), np.zeros(count)
    rays, ranges_m = np.zeros((count, 3)), np.full(count, np.inf)
    nodes, confidence = np.full(count, -1), np.full(count, np.nan)
    for view in views:
        seen = _seen(vertices_m, _compared(scene, view, spacing_m), view, spacing_m)
        averaged = np.maximum(seen.pixels * (PATCH if smoothed else 1.0), 1.0)
        law_m, z_m = _law_m(view, seen), seen.z_m
        shape_m2 = np.maximum(seen.misfit_m**2 - law_m**2 / MOST_AVERAGED, 0.0)
        variance_m2 = MISFIT_FACTOR**2 * shape_m2 + law_m**2 / averaged + _steps_m(view, z_m) ** 2
        squares_m2 += seen.weights * variance_m2 * (seen.ranges_m / z_m) ** 2
        total += seen.weights
        near_m = _near_m(z_m, spacing_m)
        guess = np.where(seen.inside, _confidence(view, seen.row, seen.column, z_m, near_m), np.nan)
        known = np.where(guessed, np.nan_to_num(guess), seen.weights)
        better = known > most
        for rows in (better, (most == 0.0) & ~better & (seen.ranges_m < ranges_m)):
            rays[rows], ranges_m[rows] = seen.rays[rows], seen.ranges_m[rows]
        most[better], nodes[better] = known[better], view.node
        confidence[better & guessed] = guess[better & guessed]
    nodes[~guessed & (most < ALONE * total)] = -1
    law_m = depth_sigma_m(np.where(np.isfinite(ranges_m), ranges_m, 1.0))
    variance_m2 = np.where(total > 0.0, squares_m2 / np.maximum(total, 1e-12), law_m**2)
    return Known(vertices_m, np.sqrt(variance_m2), rays, ranges_m, nodes, confidence)


def _corrections_m(
    vertices_m: FloatArray, triangles: IntArray, views: Sequence[View], spacing_m: float
) -> FloatArray:
    """Return (V, 3) moves of vertices onto averaged measurements around them, less what noise explains."""
    scene = triangle_scene(vertices_m, triangles)
    moves_m, total = np.zeros_like(vertices_m), np.zeros(len(vertices_m))
    for view in views:
        seen = _seen(vertices_m, _compared(scene, view, spacing_m), view, spacing_m)
        independent = np.clip(4.0 * np.pi * WINDOW**2 * seen.pixels, 1.0, MOST_AVERAGED)
        noise_m2 = _law_m(view, seen) ** 2 / independent
        believed = np.maximum(1.0 - noise_m2 / np.maximum(seen.mean_m**2, 1e-18), 0.0)
        along_m = believed * seen.mean_m * seen.ranges_m / seen.z_m
        moves_m += (seen.weights * along_m)[:, None] * seen.rays
        total += seen.weights
    return moves_m / np.maximum(total, 1e-12)[:, None]


def _seen(vertices_m: FloatArray, compared: _Compared, view: View, spacing_m: float) -> _Seen:
    """Return how one camera sees (V, 3) vertices of the surface that was compared with its depth."""
    camera, T = view.frame.intrinsics, view.T_world_camera
    own_m, away_m = geometry.apply(geometry.inverse(T), vertices_m), vertices_m - T[:3, 3]
    ranges_m, z_m = np.linalg.norm(away_m, axis=1), np.maximum(own_m[:, 2], LEAST_Z_M)
    before = own_m[:, 2] > LEAST_Z_M
    uv = np.rint(geometry.project(camera, np.where(before[:, None], own_m, [0.0, 0.0, 1.0])))
    inside = before & np.all((uv >= 0) & (uv < (camera.width_px, camera.height_px)), axis=1)
    column, row = np.where(inside[:, None], uv, 0.0).astype(int).T
    height, width = compared.share.shape
    at = np.minimum(row // compared.every, height - 1), np.minimum(column // compared.every, width - 1)
    seen = inside & (compared.surface_m[at] >= z_m - _near_m(z_m, spacing_m))
    pixels = (spacing_m * camera.fx_px / z_m) ** 2
    share = np.where(seen & (compared.share[at] >= LEAST_MEASURED), compared.share[at], 0.0)
    return _Seen(
        inside,
        row,
        column,
        z_m,
        away_m / np.maximum(ranges_m, LEAST_Z_M)[:, None],
        ranges_m,
        pixels,
        share * pixels,
        compared.mean_m[at],
        np.sqrt(compared.square_m2[at]),
    )


def _near_m(z_m: FloatArray, spacing_m: float) -> FloatArray:
    """Return the distance within which depths are of one surface."""
    return np.maximum(SEEN_WITHIN * z_m, 2.0 * spacing_m)


def _compared(scene: o3d.t.geometry.RaycastingScene, view: View, spacing_m: float) -> _Compared:
    """Compare a surface with averaged depth at every few pixels, over a window around each."""
    every = max(1, view.frame.intrinsics.width_px // WIDTH_PX)
    directions = geometry.pixel_rays(view.frame.intrinsics)[::every, ::every]
    T = view.T_world_camera
    origins_m = np.broadcast_to(T[:3, 3], directions.shape)
    surface_m = first_hits(scene, origins_m, directions @ T[:3, :3].T)
    measured_m = view.measured_m[::every, ::every]
    both = np.isfinite(surface_m) & np.isfinite(measured_m)
    off_m = np.where(both, measured_m, 0.0) - np.where(both, surface_m, 0.0)
    both &= np.abs(off_m) <= _near_m(np.where(both, surface_m, 1.0), spacing_m)
    middle_m = float(np.median(surface_m[both])) if both.any() else 1.0
    sd_px = max(LEAST_WINDOW_PX, WINDOW * spacing_m * view.frame.intrinsics.fx_px / (every * middle_m))
    share, mean_m, square_m2 = (
        cv2.GaussianBlur((both * layer).astype(np.float32), (0, 0), sd_px, borderType=cv2.BORDER_CONSTANT)
        for layer in (1.0, off_m, off_m**2)
    )
    least = np.maximum(share, 1e-6)
    return _Compared(every, surface_m, share, mean_m / least, np.maximum(square_m2, 0.0) / least)


def _confidence(
    view: View, row: IntArray, column: IntArray, z_m: FloatArray, near_m: FloatArray
) -> FloatArray:
    """Return (V,) confidence of the guess at or next to a pixel that lies nearest to each depth z_m.

    NaN where no guess there is within ``near_m``: averaging and smoothing move vertices by some pixels.
    """
    height, width = view.guessed_m.shape
    found, least_m = np.full(len(z_m), np.nan), np.array(near_m)
    for down in (-GUESS_PX, 0, GUESS_PX):
        for right in (-GUESS_PX, 0, GUESS_PX):
            at = np.clip(row + down, 0, height - 1), np.clip(column + right, 0, width - 1)
            off_m = np.abs(np.nan_to_num(view.guessed_m[at], nan=np.inf) - z_m)
            better = off_m < least_m
            found[better], least_m[better] = view.confidence[at][better], off_m[better]
    return found


def _law_m(view: View, seen: _Seen) -> FloatArray:
    """Return (V,) standard deviation of one depth, m: of a recording's average, else by the sensor's law."""
    noise, averaging = view.frame.noise, view.frame.averaging
    law_m = depth_sigma_m(seen.z_m) if noise is None else noise.sd_m(seen.z_m)
    if averaging is None:
        return law_m
    own_m = averaging.sd_m[seen.row, seen.column]
    return np.where(np.isfinite(own_m), own_m, law_m)


def _steps_m(view: View, z_m: FloatArray) -> FloatArray:
    """Return (V,) standard deviation of the error that the sensor's steps leave after averaging.

    It is step / sqrt(12) where the noise is far below a step; noise of half a step and more moves a pixel
    over several steps, and the mean's error falls by exp(-2 pi^2 (noise / step)^2).
    """
    if view.frame.averaging is not None:
        return np.zeros_like(z_m)
    depth_m = view.frame.depth.z_m[::2, ::2]
    step_m = step_at(1.0 / z_m, 1.0 / depth_m[np.isfinite(depth_m)].astype(float)) * z_m**2
    law_m = depth_sigma_m(z_m) if view.frame.noise is None else view.frame.noise.sd_m(z_m)
    ratio = law_m / np.maximum(step_m, 1e-9)
    return step_m / np.sqrt(12.0) * np.exp(-2.0 * np.pi**2 * ratio**2)

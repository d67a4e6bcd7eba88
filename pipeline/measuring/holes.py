"""Area of a hole in a surface, with the interval that its ragged rim allows."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.guesses import relative_half
from pipeline.measuring.lookup import lookup_of
from pipeline.measuring.near import NEAR_M, NEAR_SPACINGS
from pipeline.measuring.planes import BORDER, guess_of
from pipeline.measuring.propagation import Z95
from pipeline.measuring.surface import MeasuredSurface
from pipeline.measuring.values import Measure, Value
from pipeline.surface.boundary import loop_areas_m2
from pipeline.types import FloatArray


def hole_area(surface: MeasuredSurface, point_m: FloatArray) -> Measure:
    """Return the area of the hole around a point, or else of the one with the nearest rim.

    A rim vertex ends up to half a spacing short of the true rim: this is the standard deviation of its place
    in the surface. To it is added the noise along the ray, which is taken as fully correlated among vertices
    that smoothing averaged together. The covariance of the nodes' poses is left out. The relative error of
    the area in a guessed rim is twice that of its range, as if the hole faced its camera.

    Raises:
        InputError: there is no hole near the point.
    """
    point_m = np.asarray(point_m, float)
    holes = lookup_of(surface).open_holes
    spacing_m = lookup_of(surface).spacing_m
    away_m = [_away_m(surface.vertices_m[hole.loop], hole.center_m, point_m) for hole in holes]
    nearest = int(np.argmin(away_m)) if holes else -1
    if not holes or away_m[nearest] > max(NEAR_M, NEAR_SPACINGS * spacing_m):
        where = "({:.3g}, {:.3g}, {:.3g})".format(*point_m)
        raise InputError(
            f"No hole of the surface is near the point {where} m; mark a point on the rim of a hole or in it"
        )
    loop = holes[nearest].loop
    rim_m = surface.vertices_m[loop]
    chord_m = np.roll(rim_m, -1, axis=0) - np.roll(rim_m, 1, axis=0)
    vector_m2 = loop_areas_m2(rim_m, np.roll(rim_m, -1, axis=0), np.array([0]))[0]
    area_m2 = float(np.linalg.norm(vector_m2))
    slopes_m = 0.5 * np.cross(chord_m, vector_m2 / max(area_m2, 1e-12))
    along_m2 = np.einsum("vi,vi->v", slopes_m, surface.rays[loop]) * surface.sigma_m[loop]
    shifts = range(-min(BORDER, (len(loop) - 1) // 2), min(BORDER, (len(loop) - 1) // 2) + 1)
    together_m4 = float(sum(np.abs(along_m2) @ np.abs(np.roll(along_m2, shift)) for shift in shifts))
    ragged_m4 = float(np.sum(slopes_m**2)) * (0.5 * spacing_m) ** 2
    variance = together_m4 + ragged_m4 + (2.0 * area_m2 * surface.scale_sd) ** 2
    guessed = bool(np.mean(surface.guessed[loop]) > 0.5)
    guess_m2 = 2.0 * area_m2 * relative_half(guess_of(surface, loop)[1]) if guessed else 0.0
    half_m2 = float(np.hypot(Z95 * np.sqrt(variance), guess_m2))
    value = Value("area", area_m2, "m2", (max(0.0, area_m2 - half_m2), area_m2 + half_m2), guessed)
    return Measure("hole", (value,), rim_m)


def _away_m(rim_m: FloatArray, center_m: FloatArray, point_m: FloatArray) -> float:
    """Return the distance of a point from a hole: 0 inside the ball of its rim, else to the rim."""
    to_rim_m = float(np.min(np.linalg.norm(rim_m - point_m, axis=1)))
    inner_m = float(np.min(np.linalg.norm(rim_m - center_m, axis=1)))
    return 0.0 if np.linalg.norm(point_m - center_m) <= inner_m else to_rim_m

"""Calibrated bias and noise of a depth sensor, stored in ``depth_correction.json`` (SPEC 1.5)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, read_json
from pipeline.types import AnyPath, DepthMap, DepthNoise, FloatArray, IntArray

DEPTH_CORRECTION = "depth_correction.json"
FORMAT = "packetmesh depth correction 1"
MAP_SHAPE = (3, 4)
"""Rows and columns of the map's coefficients."""
DEGREE = 2
Z95 = 1.959964
"""Half the width of a 95 % interval in standard deviations."""
MOST_SHARE = 0.5
"""A larger term, as a share of the depth or in metres, is implausible: the file has another unit."""


@dataclass(frozen=True, slots=True)
class DepthCorrection:
    """The true depth z* = a + b z + c z^2 + z s(u, v) of a measured depth z, and its remaining noise.

    The map s is a quadratic B-spline over the image with 3 x 4 coefficients, clamped at the edges. Its mean
    over the image is 0, so that b alone is the scale.
    """

    size_px: tuple[int, int]
    """Width and height of the depth images to which it applies."""
    offset_m: float = 0.0
    """Coefficient a."""
    scale: float = 1.0
    """Coefficient b."""
    curvature_per_m: float = 0.0
    """Coefficient c."""
    map_coefficients: FloatArray = field(default_factory=lambda: np.zeros(MAP_SHAPE))
    """(3, 4) coefficients of s, dimensionless, the first row at the top of the image."""
    noise: DepthNoise | None = None
    """Noise of the corrected depth; None if it is unknown."""
    range_m: tuple[float, float] = (0.0, float("inf"))
    """Nearest and farthest depth in the calibration; outside this range the correction is extrapolated."""
    ci95: Mapping[str, FloatArray] = field(default_factory=dict)
    """95 % intervals by the name of a field above or of the noise, (..., 2) for a field of shape (...)."""

    def apply(self, depth: DepthMap) -> DepthMap:
        """Return the corrected depth image.

        Raises:
            InputError: the image has another size, or relative depth.
        """
        height_px, width_px = depth.z_m.shape
        if (width_px, height_px) != self.size_px:
            raise InputError(
                f"The depth correction is for images of {self.size_px[0]} x {self.size_px[1]} pixels, and "
                f"this one has {width_px} x {height_px}; try the correction of this camera"
            )
        if depth.kind != "metric":
            raise InputError("Relative depth has no scale to correct; align it with a sensor's first")
        corrected_m = self._corrected_m(depth.z_m.astype(np.float64), self.map_over_image())
        return DepthMap(np.where(corrected_m > 0.0, corrected_m, np.nan).astype(np.float32))

    @property
    def scale_sd(self) -> float | None:
        """Standard deviation of the scale, by its 95 % interval; None if that is unknown."""
        if "scale" not in self.ci95:
            return None
        low, high = self.ci95["scale"]
        return float(high - low) / (2.0 * Z95)

    def corrected_m(self, z_m: FloatArray, pixels: FloatArray | IntArray) -> FloatArray:
        """Return (N,) true depths, metres, of (N,) measured depths, metres, at (N, 2) pixels."""
        rows, columns = map_basis(self.size_px, pixels)
        share = np.einsum("nr,rc,nc->n", rows, self.map_coefficients, columns)
        return self._corrected_m(np.asarray(z_m, float), share)

    def map_over_image(self) -> FloatArray:
        """Evaluate s(u, v) at all pixels, (H, W)."""
        rows, columns = _image_basis(self.size_px)
        return rows @ self.map_coefficients @ columns.T

    def _corrected_m(self, z_m: FloatArray, share: FloatArray) -> FloatArray:
        return self.offset_m + (self.scale + share + self.curvature_per_m * z_m) * z_m


def map_basis(size_px: tuple[int, int], pixels: FloatArray | IntArray) -> tuple[FloatArray, FloatArray]:
    """Evaluate the splines of the map's rows (N, 3) and columns (N, 4) at (N, 2) pixels."""
    u, v = (np.asarray(pixels, float) + 0.5).T / np.array(size_px, float)[:, None]
    return _splines(v, MAP_SHAPE[0]), _splines(u, MAP_SHAPE[1])


def map_means() -> FloatArray:
    """Return (3, 4) weights of the map's coefficients in its mean over the image."""
    rows, columns = (
        (knots[DEGREE + 1 :] - knots[: -DEGREE - 1]) / (DEGREE + 1) for knots in map(_knots, MAP_SHAPE)
    )
    return np.outer(rows, columns)


@lru_cache(4)
def _image_basis(size_px: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    width_px, height_px = size_px
    v, u = (np.arange(height_px) + 0.5) / height_px, (np.arange(width_px) + 0.5) / width_px
    return _splines(v, MAP_SHAPE[0]), _splines(u, MAP_SHAPE[1])


def _splines(share: FloatArray, count: int) -> FloatArray:
    """Evaluate ``count`` splines at (N,) positions from 0 to 1; returns (N, count)."""
    return BSpline.design_matrix(np.clip(share, 0.0, 1.0), _knots(count), DEGREE).toarray()


def _knots(count: int) -> FloatArray:
    return np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, count - DEGREE + 1), np.ones(DEGREE)])


def write_depth_correction(path: AnyPath, correction: DepthCorrection) -> None:
    """Write a correction so that reading it gives exactly the same numbers.

    Raises:
        InputError: the file cannot be written.
    """
    values = {
        "format": FORMAT,
        "width": correction.size_px[0],
        "height": correction.size_px[1],
        "offset_m": correction.offset_m,
        "scale": correction.scale,
        "curvature_per_m": correction.curvature_per_m,
        "map_coefficients": correction.map_coefficients.tolist(),
        "noise": None if correction.noise is None else asdict(correction.noise),
        "range_m": [value if np.isfinite(value) else None for value in correction.range_m],
        "ci95": {name: np.asarray(interval).tolist() for name, interval in correction.ci95.items()},
    }
    with atomic_path(path) as sibling:
        sibling.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n")


def read_depth_correction(path: AnyPath) -> DepthCorrection:
    """Read a correction from a file.

    Raises:
        InputError: the file is missing, no JSON, of another kind, or has implausible terms.
    """
    values = read_json(path, "depth correction")
    if values.get("format") != FORMAT:
        raise InputError(
            f"The file {path} is no depth correction ('format' is not '{FORMAT}'); try to calibrate again"
        )
    try:
        correction = _from_values(values)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError(
            f"The depth correction {path} lacks a term or has one that is no number; try to calibrate again"
        ) from None
    _check(path, correction)
    return correction


def _from_values(values: dict[str, Any]) -> DepthCorrection:
    noise, (near_m, far_m) = values["noise"], values["range_m"]
    if noise is not None:
        noise = DepthNoise(*(float(noise[name]) for name in ("s0_m", "s1_m", "p", "q")))
    return DepthCorrection(
        size_px=(int(values["width"]), int(values["height"])),
        offset_m=float(values["offset_m"]),
        scale=float(values["scale"]),
        curvature_per_m=float(values["curvature_per_m"]),
        map_coefficients=np.array(values["map_coefficients"], np.float64).reshape(MAP_SHAPE),
        noise=noise,
        range_m=(float(near_m), float("inf") if far_m is None else float(far_m)),
        ci95={name: np.array(interval, np.float64) for name, interval in dict(values["ci95"]).items()},
    )


def _check(path: AnyPath, correction: DepthCorrection) -> None:
    """Raise an InputError for implausible terms."""
    terms = [correction.offset_m, correction.scale, correction.curvature_per_m]
    noise = [] if correction.noise is None else list(asdict(correction.noise).values())
    finite = np.isfinite([*terms, *noise, *correction.map_coefficients.ravel()]).all()
    if not finite or min(correction.size_px) < 1 or any(value < 0.0 for value in noise):
        raise InputError(f"The depth correction {path} has impossible values; try to calibrate again")
    off = max(abs(correction.offset_m), abs(correction.scale - 1.0), abs(correction.curvature_per_m))
    if max(off, float(np.abs(correction.map_coefficients).max())) > MOST_SHARE:
        raise InputError(
            f"The depth correction {path} moves depth by more than {MOST_SHARE:.0%} or {MOST_SHARE:g} m, "
            "which is no sensor's bias; check the units of the depth images and calibrate again"
        )

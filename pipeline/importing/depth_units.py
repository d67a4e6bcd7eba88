"""What the values of a recording's depth images mean."""

from __future__ import annotations

from collections.abc import Sequence as Values
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.importing.colmap import read_depth_map
from pipeline.importing.sequence import Sequence
from pipeline.io.images import FARTHEST_M, likely_depth_scale, read_depth_units
from pipeline.types import DepthMap

ROOM_M = (0.2, 15.0)
"""Median depths between which nothing is said."""
_ROTATED_SHARE = 0.95


@dataclass(frozen=True, slots=True)
class ReadDepth:
    """A depth image and how it was understood."""

    depth: DepthMap
    units_per_metre: float
    median_m: float
    notes: tuple[str, ...]


def depth_in(path: Path, sequence: Sequence) -> ReadDepth:
    """One depth image of a recording.

    Raises:
        InputError: it cannot be read, or holds nothing within 65 m.
    """
    scale, notes = sequence.units_per_metre, list[str]()
    if path.suffix == ".bin":
        return _metres(path, read_depth_map(path), scale, notes)
    units = read_depth_units(path)
    if sequence.rotated_bits and has_rotated_bits(units):
        units, scale, notes = unrotated(units), 1000.0, ["The bits of the depth were turned back by three"]
    return _metres(path, units, scale, notes)


def _metres(path: Path, units: NDArray[Any], scale: float, notes: list[str]) -> ReadDepth:
    z_m = (units / scale).astype(np.float32)
    z_m[(units == 0) | (z_m > FARTHEST_M)] = np.nan
    if not np.isfinite(z_m).any():
        median = float(np.median(units[units > 0]))
        raise InputError(
            f"The depth image {path} is farther than {FARTHEST_M:.0f} m everywhere at depth scale {scale:g}; "
            f"try --depth-scale {likely_depth_scale(median):g}"
        )
    return ReadDepth(DepthMap(z_m), scale, float(np.nanmedian(z_m)), tuple(notes))


def has_rotated_bits(units: NDArray[np.uint16]) -> bool:
    """Whether (H, W) values look like millimetres rotated by three bits: below 8.192 m multiples of eight."""
    return bool((units[units > 0] % 8 == 0).mean() >= _ROTATED_SHARE)


def unrotated(units: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """(H, W) millimetres of SUN RGB-D's values."""
    return ((units >> 3) | (units << 13)).astype(np.uint16)


def scale_note(medians_m: Values[float], units_per_metre: float) -> list[str]:
    """The depth scale in words, with a doubt where it makes no room."""
    median_m = float(np.median(medians_m))
    said = f"Depth: {units_per_metre:g} units in a metre, which makes the median depth {median_m:.3g} m"
    nearest_m, farthest_m = ROOM_M
    if nearest_m <= median_m <= farthest_m:
        return [said]
    suggestion = likely_depth_scale(median_m * units_per_metre)
    return [f"{said}; no room is like that: try --depth-scale {suggestion:g}"]

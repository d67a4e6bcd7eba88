"""Depth images of recordings, converted to metres."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.importing.colmap import read_depth_map
from pipeline.importing.sequence import Candidate, Sequence
from pipeline.importing.stored import AnyImage, read_depth_of, read_levels_of
from pipeline.io.depth_scale import (
    FARTHEST_M,
    MILLIMETRES,
    doubts,
    known_in,
    likely_depth_scale,
    usual_scale,
)
from pipeline.io.images import NoDepthError, ReadDepth
from pipeline.types import DepthMap, FloatArray

MEDIUM_WEIGHT = 0.25
"""Factor of the weight in the map of depth with medium confidence, as if its standard deviation were twice as
large. It is assumed, not measured, because telephones state no deviation."""
_ROTATED_SHARE = 0.95
"""Least share of nonzero values that are multiples of 8 in an image with rotated bits."""


def depth_in(candidate: Candidate, sequence: Sequence) -> ReadDepth:
    """Read the depth image of a moment, without depth of low confidence.

    Raises:
        InputError: it cannot be read, or has no depth within 65 m; NoDepthError if no depth can be used.
    """
    return weighted_depth_in(candidate, sequence)[0]


def weighted_depth_in(candidate: Candidate, sequence: Sequence) -> tuple[ReadDepth, FloatArray | None]:
    """Read a depth image as ``depth_in``, and (H, W) the factor of each pixel's weight in the map.

    The factor, ``DepthView.weight``, is None without a confidence image.

    Raises:
        InputError: as ``depth_in``; NoDepthError if no depth can be used.
    """
    read = _depth_in(candidate.depth, sequence)
    if candidate.confidence is None:
        return read, None
    levels = _confidence(candidate.confidence, read.depth.z_m.shape)
    z_m = np.where(levels == 0, np.float32(np.nan), read.depth.z_m)
    if not np.isfinite(z_m).any():
        raise NoDepthError(
            f"All depth in {candidate.depth} has low confidence by {candidate.confidence}; try to "
            "remove the confidence images, so that all depth is kept"
        )
    weight = np.where(levels < sequence.highest_confidence, MEDIUM_WEIGHT, 1.0).astype(np.float32)
    return replace(read, depth=DepthMap(z_m)), weight


def _confidence(image: AnyImage, shape: tuple[int, ...]) -> NDArray[np.integer]:
    """Read the (H, W) levels of a confidence image."""
    levels = read_levels_of(image)
    if levels.shape != shape:
        raise InputError(
            f"The confidence image {image} has {levels.shape[1]} x {levels.shape[0]} pixels and its depth "
            f"image {shape[1]} x {shape[0]}; try to remove the confidence images, so that all depth is kept"
        )
    return levels


def _depth_in(image: AnyImage, sequence: Sequence) -> ReadDepth:
    if isinstance(image, Path) and image.suffix == ".bin":
        return depth_of(str(image), read_depth_map(image), sequence.units_per_metre, sequence.scale_stated)
    values = read_depth_of(image)
    if sequence.rotated_bits and has_rotated_bits(values):
        read = depth_of(str(image), unrotated(values), MILLIMETRES, stated=True)
        return replace(read, find_notes=lambda: ("Depth values were rotated back by three bits (SUN RGB-D)",))
    whole = values.dtype.kind in "iu"
    scale = sequence.units_per_metre if whole or sequence.scale_stated else usual_scale(values)
    return depth_of(str(image), values, scale, sequence.scale_stated)


def depth_of(name: str, values: NDArray[Any], units_per_metre: float, stated: bool) -> ReadDepth:
    """Convert (H, W) values to metres; depths that a rig's folder cannot store (``FARTHEST_M``) become NaN.

    Args:
        name: name of the image, for the error.
        values: depth values, some of them known.
        units_per_metre: depth units per metre.
        stated: whether the user gave the scale.

    Raises:
        InputError: there is no depth within 65 m.
    """
    known = known_in(values)
    with np.errstate(all="ignore"):
        z_m = (values / units_per_metre).astype(np.float32)
    z_m[~known | (z_m > FARTHEST_M)] = np.nan
    if not np.isfinite(z_m).any():
        raise InputError(
            f"The depth image {name} is farther than {FARTHEST_M:.0f} m everywhere at depth scale "
            f"{units_per_metre:g}; try --depth-scale {likely_depth_scale(float(np.median(values[known]))):g}"
        )
    return ReadDepth(DepthMap(z_m), units_per_metre, partial(doubts, values, units_per_metre, stated))


def has_rotated_bits(units: NDArray[Any]) -> bool:
    """Return whether (H, W) values look like millimetres rotated by 3 bits: multiples of 8 below 8.192 m."""
    return units.dtype == np.uint16 and bool((units[units > 0] % 8 == 0).mean() >= _ROTATED_SHARE)


def unrotated(units: NDArray[Any]) -> NDArray[np.uint16]:
    """Return (H, W) millimetres from SUN RGB-D's uint16 values."""
    return ((units >> 3) | (units << 13)).astype(np.uint16)

"""Interpretation of a depth image's numbers: units per metre, unknown values, and doubts about them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.types import AnyPath, BoolArray

MILLIMETRES = 1000.0
"""Depth units per metre of whole numbers if no scale is given."""
COMMON_DEPTH_SCALES = (1.0, 100.0, 256.0, 1000.0, 5000.0, 10000.0)
"""Units per metre that RGB-D data sets use."""
NO_VALUE = 65535
"""Value that some data sets (7-Scenes) use for unknown depth, in addition to 0."""
FARTHEST_M = 65.534
"""Largest depth that 16 bits store in millimetres, without ``NO_VALUE``."""
FARTHEST_FLOAT_M, MOST_FAR_SHARE = 1e6, 0.05
"""If a larger share of depths than MOST_FAR_SHARE is beyond FARTHEST_FLOAT_M, the file was misread."""
PLAUSIBLE_MEDIAN_M = (0.01, 100.0)
"""Range of plausible median depths; images outside it are rejected."""
ROOM_M = (0.2, 15.0)
"""Range of median depths that raise no doubt."""
STEPS = {5: "as TUM stores 5000 to the metre", 8: "as SUN RGB-D stores them with rotated bits"}
"""Steps of depth values that are stored as multiples of the real unit, and the data set that does so."""
_STEP_SHARE = 0.95
"""Share of the values that must be multiples: rotated bits are multiples of eight only up to 8.191 m."""
_TYPICAL_DEPTH_M = 2.0


def known_in(values: NDArray[Any]) -> BoolArray:
    """Return (H, W) True where the values of a depth image are known depths."""
    if values.dtype.kind == "f":
        return np.isfinite(values) & (values > 0)
    return (values > 0) & (values != NO_VALUE)


def usual_scale(values: NDArray[Any]) -> float:
    """Return the units per metre if no scale is given: floating-point depth is in metres, whole numbers in
    millimetres."""
    return 1.0 if values.dtype.kind == "f" else MILLIMETRES


def doubts(values: NDArray[Any], depth_scale: float, stated: bool) -> tuple[str, ...]:
    """Return doubts about a depth image read at a scale, one sentence each, with advice.

    Args:
        values: (H, W) as stored in the file; some are known.
        depth_scale: units per metre at which they are read.
        stated: True if the user gave the scale; then the step of the values raises no doubt.
    """
    known = values[known_in(values)]
    median_m = float(np.median(known)) / depth_scale
    step = None if stated or depth_scale != MILLIMETRES else step_of(known)
    found = []
    if step is not None:
        found.append(
            f"All depth values are multiples of {step}, {STEPS[step]}, but were read as millimetres: their "
            f"median is {median_m:.3g} m; try --depth-scale {step * MILLIMETRES:g}, which makes it "
            f"{median_m / step:.3g} m, or --depth-scale {MILLIMETRES:g} if they are millimetres"
        )
    elif not ROOM_M[0] <= median_m <= ROOM_M[1]:
        found.append(
            f"The median depth is {median_m:.3g} m at {depth_scale:g} units in a metre, which is "
            f"unlikely for a room: {_try(median_m * depth_scale)}"
        )
    far = float(np.mean(known / depth_scale > FARTHEST_M))
    if far > MOST_FAR_SHARE and median_m <= ROOM_M[1]:
        found.append(
            f"{far:.1%} of the depth values are farther than {FARTHEST_M:.0f} m, up to "
            f"{float(known.max()) / depth_scale:.3g} m; if nothing was seen there, try 0 in their place"
        )
    empty = float(np.mean(values == NO_VALUE)) if values.dtype.kind in "iu" else 0.0
    if empty:
        found.append(f"{empty:.1%} of the depth values are {NO_VALUE}, which is read as unknown")
    return tuple(found)


def step_of(known: NDArray[Any]) -> int | None:
    """Return the step of which nearly all (N,) values are multiples, both odd and even; else None."""
    if known.dtype.kind == "f":
        return None
    for step in STEPS:
        odd = float(np.mean(known % (2 * step) == step))
        if 0.1 <= odd <= 0.9 and np.mean(known % step == 0) >= _STEP_SHARE:
            return step
    return None


def check_median(path: AnyPath, values: NDArray[Any], depth_scale: float) -> None:
    """Check that the median depth, and nearly all depth, is plausible at this scale.

    Raises:
        InputError: the median is outside ``PLAUSIBLE_MEDIAN_M``, with a scale to try in the message, or more
            than ``MOST_FAR_SHARE`` of the depth is beyond ``FARTHEST_FLOAT_M``.
    """
    known = values[known_in(values)]
    median_units = float(np.median(known))
    nearest_m, farthest_m = PLAUSIBLE_MEDIAN_M
    if not nearest_m <= median_units / depth_scale <= farthest_m:
        raise InputError(
            f"The depth image {path} has a median depth of {median_units / depth_scale:.3g} m at "
            f"{depth_scale:g} units in a metre; {_try(median_units)}"
        )
    if np.mean(known / depth_scale > FARTHEST_FLOAT_M) > MOST_FAR_SHARE:
        share = np.mean(known / depth_scale > FARTHEST_FLOAT_M)
        raise InputError(
            f"Of the numbers in the depth image {path}, {share:.0%} are beyond {FARTHEST_FLOAT_M / 1000:g} "
            "km, as where nothing was seen, or where bytes are in another order; try 0 where there is no "
            "depth, or to export it again"
        )


def likely_depth_scale(median_units: float) -> float:
    """Return the common depth scale that brings the median nearest to 2 m, within room size.

    If none does, it is the scale, to one digit, that makes the median about 2 m.
    """
    nearest_m, farthest_m = ROOM_M
    rooms = [scale for scale in COMMON_DEPTH_SCALES if nearest_m <= median_units / scale <= farthest_m]
    typical_scale = median_units / _TYPICAL_DEPTH_M
    if not rooms:
        return float(f"{typical_scale:.0e}")
    return min(rooms, key=lambda scale: abs(np.log(scale / typical_scale)))


def _try(median_units: float) -> str:
    scale = likely_depth_scale(median_units)
    return f"try --depth-scale {scale:g}, which makes it {median_units / scale:.3g} m"

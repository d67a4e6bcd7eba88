"""Where the ray of a click enters what a cut has left in the picture."""

from __future__ import annotations

import numpy as np

from app.looking.look import Box, Cut, planes_of
from pipeline.types import FloatArray


def entering(cut: Cut, origin_m: FloatArray, direction: FloatArray) -> FloatArray | None:
    """Return the (3,) place from which a ray meets only what is kept; None if it meets nothing of it.

    A ray that starts on the kept side of a cut keeps its origin. If the inside of a box is left out, a ray
    keeps its origin unless that is in the box: then it starts where it leaves the box.

    Args:
        cut: the cut.
        origin_m: (3,) origin of the ray.
        direction: (3,) direction of the ray.
    """
    start, end = 0.0, np.inf
    for point_m, normal in planes_of(cut):
        away_m, slope = float((origin_m - point_m) @ normal), float(direction @ normal)
        if slope > 0.0:
            start = max(start, -away_m / slope)
        elif slope < 0.0:
            end = min(end, -away_m / slope)
        elif away_m < 0.0:
            end = -1.0
    if isinstance(cut, Box) and cut.inside:
        return origin_m + end * direction if start == 0.0 < end < np.inf else origin_m
    return origin_m + start * direction if start < end else None

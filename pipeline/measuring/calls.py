"""A length or an angle of a reconstruction by one call."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.marks import Snap, mark
from pipeline.measuring.measures import Measure, angle, distance
from pipeline.measuring.surface import MeasuredSurface, measured_surface
from pipeline.reconstruct import Reconstruction
from pipeline.types import FloatArray


def measure(
    result: Reconstruction | MeasuredSurface,
    points_m: Sequence[Sequence[float]] | FloatArray,
    snap: Snap = "surface",
) -> Measure:
    """Measure the length between two points, or the angle at the second of three, with its 95 % interval.

    Args:
        result: a reconstruction, or its ``measured_surface``, which many measures of one result share.
        points_m: (2, 3) or (3, 3) points on or near the surface, world frame, metres.
        snap: ``vertex``, ``edge`` or ``plane`` moves every point to what is nearest of that kind.

    Raises:
        InputError: nothing of the surface is near a point, or there are not two or three different points.

    >>> import numpy as np, packetmesh as pm
    >>> grid = np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0), [0.0]), axis=-1).reshape(-1, 3)
    >>> normals, sigma_m = np.tile([0.0, 0.0, 1.0], (81, 1)), np.full(81, 0.01)
    >>> cloud = pm.PointCloud(grid, normals=normals, sigma_m=sigma_m)
    >>> length = pm.measure(pm.measured_cloud(cloud, scale_sd=0.001), [(0, 0, 0), (3, 4, 0)]).values[0]
    >>> length.value, [round(end, 4) for end in length.ci95]
    (5.0, [4.9902, 5.0098])
    """
    surface = measured_surface(result) if isinstance(result, Reconstruction) else result
    places_m = np.asarray(points_m, float)
    if places_m.shape not in ((2, 3), (3, 3)):
        raise InputError(
            f"A measure takes two points for a length or three for an angle, not {places_m.shape}; try "
            "[(x, y, z), (x, y, z)] in metres"
        )
    marks = [mark(surface, place_m, snap) for place_m in places_m]
    if len(marks) == 2:
        return distance(surface, marks[0], marks[1])
    return angle(surface, marks[0], marks[1], marks[2])

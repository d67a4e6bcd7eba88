"""Photographs of a walk: the views that stay in memory, and the colours of the map by all keyframes."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.kernels.geometry import apply, inverse, project
from pipeline.recording.recording import Recording, spread
from pipeline.types import ByteArray, FloatArray, IntArray, PointCloud, RgbdFrame

MOST_COLORING = 96
"""Most keyframes that colour the map, evenly chosen."""
SAME_DEPTH = 0.02
"""Largest difference of a point's depth from the measured one, as a share, at a frame that measured it."""
NEAREST_M = 0.05
"""Points nearer to the camera's plane are not looked for in its image."""
UNKNOWN = 128
"""Grey value of points that no frame colours."""


@dataclass(frozen=True, slots=True)
class Photographs:
    """Chosen frames of a walk with their photographs, and the colours of the map."""

    views: tuple[RgbdFrame, ...]
    """The chosen frames, with their poses."""
    colors: ByteArray
    """(N, 3) RGB of the map's points."""


def iterate_photographs(
    recording: Recording,
    T_world_camera: Sequence[FloatArray | None],
    views: Sequence[int],
    keyframes: Sequence[int],
    points: PointCloud,
) -> Generator[Progress, None, Photographs]:
    """Read the photographs of a walk one by one, except those that cannot be read; the views are kept.

    Args:
        recording: the frames.
        T_world_camera: (4, 4) poses of all frames.
        views: numbers of the frames to keep, which have poses.
        keyframes: numbers of the frames that may colour the map, which have poses.
        points: the map, with normals.

    Raises:
        InputError: no view can be read.
    """
    numbers = sorted({*views, *spread(list(keyframes), MOST_COLORING)})
    blend, kept, errors = Blend(points), [], []
    for count, number in enumerate(numbers):
        yield Progress(f"colours by frame {number}", count / len(numbers))
        T = T_world_camera[number]
        assert T is not None
        try:
            frame = replace(recording.frame(number), T_world_camera=T, pose_known=True)
        except InputError as error:
            errors.append(f"frame {number} gives no colours: {error}")
            continue
        blend.add(frame)
        if number in views:
            kept.append(frame)
    if not kept:
        raise InputError(errors[0])
    return Photographs(tuple(kept), blend.colors)


def measured_in(frame: RgbdFrame, points_m: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which of (N, 3) world points a frame measured.

    Returns:
        Their (M,) rows, (M, 2) columns and rows in the image, and (M, 3) places in the camera's frame.
    """
    own_m = apply(inverse(frame.T_world_camera), points_m)
    ahead = np.flatnonzero(own_m[:, 2] > NEAREST_M)
    pixels = project(frame.intrinsics, own_m[ahead])
    nearest = np.nan_to_num(np.rint(pixels), nan=-1.0).astype(int)
    size_px = frame.intrinsics.width_px, frame.intrinsics.height_px
    inside = np.all((nearest >= 0) & (nearest < size_px), axis=1)
    rows, (u, v) = ahead[inside], nearest[inside].T
    z_m = own_m[rows, 2]
    seen = np.abs(frame.depth.z_m[v, u] - z_m) <= SAME_DEPTH * z_m
    return rows[seen], pixels[inside][seen], own_m[rows[seen]]


class Blend:
    """Mean colour of each point over the frames that measured it.

    A frame's weight is the cosine of incidence over the squared distance.
    """

    def __init__(self, points: PointCloud) -> None:
        """Prepare for points with normals."""
        self._points = points
        self._total, self._weights = np.zeros((len(points), 3)), np.zeros(len(points))

    def add(self, frame: RgbdFrame) -> None:
        """Add the colours that a frame shows of the points."""
        rows, pixels, own_m = measured_in(frame, self._points.points_m)
        u, v = np.rint(pixels).astype(int).T
        distance_m = np.linalg.norm(own_m, axis=1)
        normals = np.asarray(self._points.normals)[rows] @ frame.T_world_camera[:3, :3]
        facing = -np.einsum("ni,ni->n", normals, own_m) / distance_m
        weight = np.maximum(facing, 0.05) / distance_m**2
        self._total[rows] += weight[:, None] * frame.rgb[v, u]
        self._weights[rows] += weight

    @property
    def colors(self) -> ByteArray:
        """(N, 3) RGB of the points; grey where no frame measured them."""
        known = self._weights > 0.0
        colors = np.full((len(known), 3), UNKNOWN, np.uint8)
        colors[known] = np.rint(self._total[known] / self._weights[known, None]).astype(np.uint8)
        return colors

"""Photographs of a camera that moves while its shutter is open."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from lab.walks.path import RATE_HZ
from lab.worlds.film import Film
from lab.worlds.render import Renderer, View
from lab.worlds.scene import Rng
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

EXPOSURE_S = 1.0 / 60.0
PASSES_PX = ((0.125, 0.375), (-0.375, 0.125), (0.375, -0.125), (-0.125, -0.375))
"""Offsets (x, y), from the centre of a pixel, of the renderings that are averaged into one photograph."""
_MOMENTS = EXPOSURE_S * RATE_HZ * ((np.arange(len(PASSES_PX)) + 0.5) / len(PASSES_PX) - 0.5)
"""Moment of each of these renderings within the exposure, from its middle, in poses of the path."""


def photographs(
    renderer: Renderer,
    camera: CameraIntrinsics,
    poses: Sequence[FloatArray],
    every: int,
    film: Film,
    rng: Rng,
) -> Iterator[View]:
    """Yield the view of each ``every``-th pose of a path, with motion blur in its colours only.

    Args:
        renderer: the scene.
        camera: camera of all views.
        poses: T_world_camera of the path, ``RATE_HZ`` a second.
        every: step between the poses of the views.
        film: film of all views.
        rng: draws rays and noise.
    """
    between = _Between(poses)
    shifted = [_shifted(camera, offset_px) for offset_px in PASSES_PX]
    for k in range(0, len(poses), every):
        exposure = renderer.exposure(camera, poses[k], "fast", rng)
        light = [
            renderer.exposure(one, between.at(k + moment), "fast", rng).radiance
            for one, moment in zip(shifted, _MOMENTS, strict=True)
        ]
        yield replace(exposure, radiance=np.mean(light, axis=0)).developed(film, rng)


class _Between:
    """Interpolates the poses of a path: rotations at even speed (slerp), positions along straight lines."""

    def __init__(self, poses: Sequence[FloatArray]) -> None:
        self._poses = poses
        self._last = len(poses) - 1
        self._places_m = np.array([T[:3, 3] for T in poses])
        if self._last:
            self._turns = Slerp(np.arange(len(poses)), Rotation.from_matrix([T[:3, :3] for T in poses]))

    def at(self, moment: float) -> FloatArray:
        """Return the (4, 4) pose at a moment, counted in poses; beyond an end it is the pose at that end."""
        if not self._last:
            return self._poses[0]
        moment = float(np.clip(moment, 0.0, self._last))
        place_m = [np.interp(moment, np.arange(self._last + 1), axis) for axis in self._places_m.T]
        return rigid(self._turns(moment).as_matrix(), np.array(place_m))


def _shifted(camera: CameraIntrinsics, offset_px: tuple[float, float]) -> CameraIntrinsics:
    """Return the camera whose pixel centres are shifted by (x, y)."""
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= offset_px
    return replace(camera, matrix=matrix)

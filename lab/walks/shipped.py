"""``python -m lab.walks.shipped``: render the walk in assets/recordings again, to the same bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from lab.walks.path import RATE_HZ, walk_poses
from lab.walks.walk import depth_units, image_file, kinect, one_film, write_lists
from lab.worlds.living_room import living_room
from lab.worlds.render import Renderer
from lab.worlds.sensor import SensorConfig, sense_depth
from packetmesh.files import atomic_path, writable_folder
from pipeline.io.demos import DEMO_WALKS, RECORDINGS, TRUE_PATH
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_tum
from pipeline.kernels.geometry import rigid
from pipeline.types import AnyPath, ByteArray, CameraIntrinsics, FloatArray

NAME = "living-room-walk"
FRAMES = 200
EVERY = 3
"""Step along the path, whose poses are ``RATE_HZ``: 10 frames a second, so that 200 go once around."""
CAMERA = kinect(320)
EXPOSURE_S = 1.0 / 60.0
PASSES_PX = ((0.125, 0.375), (-0.375, 0.125), (0.375, -0.125), (-0.125, -0.375))
"""Positions in a pixel of the renderings that are averaged, at moments spread over the exposure."""
SENSOR = replace(SensorConfig(), disparity_step_px=0.25)
"""A sensor of half the usual width, which divides its own pixels into eight steps, too."""
JPEG = (cv2.IMWRITE_JPEG_QUALITY, 75, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
PNG = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE)
"""Without a filter, as the sensor's steps leave few different values."""


def path_poses() -> list[FloatArray]:
    """Return T_world_camera at ``RATE_HZ``; every ``EVERY``-th is that of a frame."""
    rng = np.random.default_rng([DEMO_WALKS[NAME].seed, 29])
    return walk_poses(living_room(), CAMERA, FRAMES * EVERY, rng)


def frames(poses: list[FloatArray]) -> Iterator[tuple[ByteArray, NDArray[np.uint16]]]:
    """Yield (H, W, 3) RGB with motion blur and (H, W) sensed depth in TUM's units, frame by frame."""
    renderer, rng = Renderer(living_room(), threads=1), np.random.default_rng([DEMO_WALKS[NAME].seed, 31])
    film, between = one_film(rng), _Between(poses)
    shutter = EXPOSURE_S * RATE_HZ * ((np.arange(len(PASSES_PX)) + 0.5) / len(PASSES_PX) - 0.5)
    for k in range(0, len(poses), EVERY):
        exposure = renderer.exposure(CAMERA, poses[k], "fast", rng)
        light = [
            renderer.exposure(_shifted(offset_px), between.at(k + moment), "fast", rng).radiance
            for offset_px, moment in zip(PASSES_PX, shutter, strict=True)
        ]
        view = replace(exposure, radiance=np.mean(light, axis=0)).developed(film, rng)
        yield view.rgb, depth_units(sense_depth(view, CAMERA, rng, SENSOR))


class _Between:
    """Poses between those of a path: turned evenly, and shifted along a straight line."""

    def __init__(self, poses: list[FloatArray]) -> None:
        self._last = len(poses) - 1
        self._turns = Slerp(np.arange(len(poses)), Rotation.from_matrix([T[:3, :3] for T in poses]))
        self._places_m = np.array([T[:3, 3] for T in poses])

    def at(self, moment: float) -> FloatArray:
        """Return the (4, 4) pose at a moment, counted in poses; the ends are held."""
        moment = float(np.clip(moment, 0.0, self._last))
        place_m = [np.interp(moment, np.arange(self._last + 1), axis) for axis in self._places_m.T]
        return rigid(self._turns(moment).as_matrix(), np.array(place_m))


def _shifted(offset_px: tuple[float, float]) -> CameraIntrinsics:
    """Return the camera whose pixel centres are shifted by (x, y)."""
    matrix = CAMERA.matrix.copy()
    matrix[:2, 2] -= offset_px
    return replace(CAMERA, matrix=matrix)


def write_shipped(out: AnyPath) -> None:
    """Write the walk's lists, camera, true path and images into a folder.

    Raises:
        InputError: the folder cannot be written.
    """
    folder, poses = writable_folder(out), path_poses()
    times_s = np.arange(FRAMES) * EVERY / RATE_HZ
    write_lists(folder, times_s, ".jpg")
    write_tum(folder / TRUE_PATH, times_s, poses[::EVERY])
    write_intrinsics(folder / "intrinsics.json", CAMERA)
    for k, (rgb, units) in enumerate(frames(poses)):
        _write(folder / image_file("rgb", k, ".jpg"), cv2.imencode(".jpg", rgb[..., ::-1], JPEG)[1])
        _write(folder / image_file("depth", k), cv2.imencode(".png", units, PNG)[1])


def _write(path: Path, data: NDArray[np.uint8]) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(data.tobytes())


if __name__ == "__main__":
    write_shipped(RECORDINGS / NAME)

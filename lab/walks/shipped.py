"""``python -m lab.walks.shipped``: render the walk in assets/recordings again, to the same bytes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.walks.path import RATE_HZ, walk_poses
from lab.walks.shutter import photographs
from lab.walks.walk import depth_units, image_file, kinect, one_film, write_lists
from lab.worlds.living_room import living_room
from lab.worlds.render import Renderer
from lab.worlds.sensor import SensorConfig, sense_depth
from packetmesh.files import atomic_path, writable_folder
from pipeline.io.demos import DEMO_WALKS, RECORDINGS, TRUE_PATH
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_tum
from pipeline.types import AnyPath, ByteArray, FloatArray

NAME = "living-room-walk"
FRAMES = 200
EVERY = 3
"""Step between frames along the path, which has ``RATE_HZ`` poses a second: 200 frames at 10 a second go once
around."""
CAMERA = kinect(320)
SENSOR = replace(SensorConfig(), disparity_step_px=0.25)
"""A sensor of half the usual width, whose disparity step is an eighth of its own, twice as wide pixels."""
JPEG = (cv2.IMWRITE_JPEG_QUALITY, 75, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
PNG = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_NONE)
"""No filter: the sensor's steps leave few different values, which compress better without."""


def path_poses() -> list[FloatArray]:
    """Return T_world_camera at ``RATE_HZ``; every ``EVERY``-th is that of a frame."""
    rng = np.random.default_rng([DEMO_WALKS[NAME].seed, 29])
    return walk_poses(living_room(), CAMERA, FRAMES * EVERY, rng)


def frames(poses: list[FloatArray]) -> Iterator[tuple[ByteArray, NDArray[np.uint16]]]:
    """Yield (H, W, 3) RGB with motion blur and (H, W) sensed depth in TUM's units, frame by frame."""
    renderer, rng = Renderer(living_room(), threads=1), np.random.default_rng([DEMO_WALKS[NAME].seed, 31])
    film = one_film(rng)
    for view in photographs(renderer, CAMERA, poses, EVERY, film, rng):
        yield view.rgb, depth_units(sense_depth(view, CAMERA, rng, SENSOR))


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

"""Depth views and frames of a recording, from images that were read and their cameras."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.importing.stored import AnyImage, read_depth_of
from pipeline.io.depth_to_color import register_depth
from pipeline.io.images import NoDepthError
from pipeline.kernels.geometry import LEVEL_POSE, is_pinhole
from pipeline.kernels.straight_view import maps_between
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, DepthNoise, FloatArray, RgbdFrame

KINECT = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)
"""Noise that is assumed for every sensor: within a tenth of ``acquisition.depth_sigma_m`` from 1.5 to 4 m."""
MOST_DAMAGED = 10
"""A recording is refused if so many damaged depth images come before the first one with depth."""
Read = TypeVar("Read")


@dataclass(frozen=True, slots=True)
class DepthView:
    """A depth image without distortion, with its camera."""

    depth: DepthMap
    """(H, W) metric."""
    camera: CameraIntrinsics
    """Pinhole camera of the same pixels."""
    T_color_depth: FloatArray
    """(4, 4) pose of this camera in the colour camera's frame, metres."""
    noise: DepthNoise
    """Law of the depth's standard deviation."""
    weight: FloatArray | None = None
    """(H, W) float32 factor of each pixel's weight in the map, 0 to 1, by the sensor's confidence; None if it
    states none."""


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """Camera of depth images."""

    camera: CameraIntrinsics
    """Camera, with its distortion."""
    T_color_depth: FloatArray
    """(4, 4) pose of this camera in the colour camera's frame, metres."""


def view_of(z_m: FloatArray, depth_camera: DepthCamera, weight: FloatArray | None = None) -> DepthView:
    """Return a depth image without its distortion.

    Args:
        z_m: (H, W) depth, metres; NaN where it is unknown.
        depth_camera: its camera.
        weight: (H, W) factor of its pixels' weights; None if there is none.
    """
    camera = depth_camera.camera
    if not is_pinhole(camera):
        values = camera.matrix.tobytes(), camera.distortion.tobytes()
        maps = _kept_maps(*values, camera.width_px, camera.height_px, camera.fisheye)
        z_m = cv2.remap(z_m, *maps, cv2.INTER_NEAREST, borderValue=np.nan)
        weight = None if weight is None else cv2.remap(weight, *maps, cv2.INTER_NEAREST)
        camera = replace(camera, distortion=np.zeros(5), fisheye=False)
    return DepthView(DepthMap(z_m), camera, depth_camera.T_color_depth, KINECT, weight)


def frame_of(
    index: int,
    rgb: ByteArray,
    camera: CameraIntrinsics,
    depth: DepthMap,
    depth_camera: DepthCamera | None,
    T_world_camera: FloatArray | None,
) -> RgbdFrame:
    """Return colour and depth on one pixel grid.

    Args:
        index: number of the frame.
        rgb: (H, W, 3) colours.
        camera: their camera.
        depth: (H, W), or (h, w) of another camera.
        depth_camera: that camera, whose depth is registered to colour; None if depth is on the colour's grid.
        T_world_camera: (4, 4) pose of the colour camera, metres; None if it is unknown.
    """
    if depth_camera is not None:
        depth = register_depth(depth, depth_camera.camera, camera, depth_camera.T_color_depth)
    T = LEVEL_POSE if T_world_camera is None else T_world_camera
    return RgbdFrame(f"frame_{index:05d}", rgb, depth, camera, T, pose_known=T_world_camera is not None)


def first_with_depth(reads: Iterable[Callable[[], Read]]) -> Read | None:
    """Return the first depth image that has depth; None if none has. A few damaged ones are skipped.

    Args:
        reads: functions that read the images of a recording, in order.

    Raises:
        InputError: ``MOST_DAMAGED`` damaged images come before it, or images are damaged and none has depth.
    """
    damaged: list[InputError] = []
    for read in reads:
        try:
            return read()
        except NoDepthError:
            continue
        except InputError as error:
            damaged.append(error)
            if len(damaged) == MOST_DAMAGED:
                break
    if damaged:
        raise damaged[0]
    return None


def first_depth_values(folder: Path, images: Iterable[AnyImage]) -> NDArray[Any]:
    """Return the (H, W) values of a recording's first depth image that has depth, as ``first_with_depth``.

    Raises:
        InputError: as for ``first_with_depth``; NoDepthError if no image has depth.
    """
    values = first_with_depth(partial(read_depth_of, image) for image in images)
    if values is None:
        raise NoDepthError(f"No frame of {folder} has depth; check the depth images")
    return values


class Unusable:
    """Errors of the images of a recording that could not be used, entered when these are read."""

    def __init__(self) -> None:
        """Begin without any."""
        self._errors: dict[str, dict[int, str]] = {"depth": {}, "colour": {}}

    @contextmanager
    def entered(self, what: Literal["depth", "colour"], index: int) -> Iterator[None]:
        """Enter the error of a frame's image and raise it again; an image without depth is no error."""
        try:
            yield
        except NoDepthError:
            raise
        except InputError as error:
            self._errors[what][index] = str(error)
            raise

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence on the depth images and one on the colour images, if there are any."""
        return tuple(self._note(what, errors) for what, errors in self._errors.items() if errors)

    @staticmethod
    def _note(what: str, errors: Mapping[int, str]) -> str:
        first = errors[min(errors)]
        if len(errors) == 1:
            return f"1 {what} image could not be used: {first}"
        return f"{len(errors)} {what} images could not be used, the first because: {first}"


@lru_cache(maxsize=2)
def _kept_maps(
    matrix: bytes, distortion: bytes, width_px: int, height_px: int, fisheye: bool
) -> tuple[FloatArray, FloatArray]:
    """Return ``maps_between`` a camera and itself without its distortion."""
    own = np.frombuffer(matrix).reshape(3, 3)
    camera = CameraIntrinsics(own, np.frombuffer(distortion), width_px, height_px, fisheye)
    return maps_between(camera, CameraIntrinsics(own, np.zeros(5), width_px, height_px))

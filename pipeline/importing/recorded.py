"""A recording of any kind that can be imported, as frames that are read when they are requested."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.bag import is_bag
from pipeline.importing.depth_units import depth_in
from pipeline.importing.kinds import kind_of
from pipeline.importing.reading import check_scale, read_sequence
from pipeline.importing.sequence import SAME_VIEW_REMEDY, Candidate, Sequence
from pipeline.io.depth_to_color import register_depth
from pipeline.io.images import NoDepthError, read_color
from pipeline.io.same_view import depth_camera_of
from pipeline.kernels.geometry import LEVEL_POSE, pixel_rays, project
from pipeline.types import AnyPath, CameraIntrinsics, DepthMap, DepthNoise, FloatArray, RgbdFrame

FRAMES_PER_S = 30.0
"""Frame rate that is assumed for a recording without times."""
KINECT = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)
"""Noise that is assumed for every sensor: within a tenth of ``acquisition.depth_sigma_m`` from 1.5 to 4 m."""


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


@dataclass(frozen=True)
class FolderRecording:
    """Frames of a recording's folder; implements ``recording.Recording``."""

    kind: str
    """Name of the kind of recording."""
    folder: Path
    sequence: Sequence
    unreadable: dict[int, str] = field(default_factory=dict, compare=False)
    """Error of each frame whose depth image could not be read, entered when it is read."""

    @property
    def name(self) -> str:
        return self.folder.name

    @cached_property
    def times_s(self) -> FloatArray:
        times = [candidate.time_s for candidate in self.sequence.candidates]
        if any(time is None for time in times):
            return np.arange(len(times)) / FRAMES_PER_S
        return np.array(times, float)

    @cached_property
    def T_world_camera(self) -> tuple[FloatArray, ...] | None:
        poses = [candidate.T_world_camera for candidate in self.sequence.candidates]
        known = tuple(pose for pose in poses if pose is not None)
        return known if len(known) == len(poses) else None

    @property
    def notes(self) -> tuple[str, ...]:
        if not self.unreadable:
            return self.sequence.notes
        count, first = len(self.unreadable), self.unreadable[min(self.unreadable)]
        return (*self.sequence.notes, f"{count} depth images were left out, the first because: {first}")

    def view(self, index: int) -> DepthView:
        """Read the depth of a frame; it is all NaN without any depth, or if the image cannot be read.

        ``notes`` says how many cannot be read.
        """
        candidate = self.sequence.candidates[index]
        try:
            z_m = depth_in(candidate, self.sequence).depth.z_m
            camera, T_color_depth = self._depth_camera_of(candidate, z_m.shape)
        except InputError as error:
            if not isinstance(error, NoDepthError):
                self.unreadable[index] = str(error)
            z_m = np.full(self._depth_shape, np.nan, np.float32)
            camera, T_color_depth = self._depth_camera_of(candidate, self._depth_shape)
        straight, pixels = _straight(camera)
        z_m = z_m if pixels is None else _moved(z_m, pixels)
        return DepthView(DepthMap(z_m), straight, T_color_depth, KINECT)

    def frame(self, index: int) -> RgbdFrame:
        """Read colour and depth of a frame; depth of another camera is registered to colour.

        Raises:
            InputError: an image cannot be read, or does not fit its camera.
        """
        candidate = self.sequence.candidates[index]
        rgb, camera = read_color(candidate.color), candidate.camera or self.sequence.camera
        if rgb.shape[:2] != (camera.height_px, camera.width_px):
            raise InputError(
                f"The colour image {candidate.color} has {rgb.shape[1]} x {rgb.shape[0]} pixels and its "
                f"camera {camera.width_px} x {camera.height_px}; try --intrinsics with the colour camera's"
            )
        depth = depth_in(candidate, self.sequence).depth
        if self.sequence.depth_camera is not None or depth.z_m.shape != rgb.shape[:2]:
            depth_camera, T_color_depth = self._depth_camera_of(candidate, depth.z_m.shape)
            depth = register_depth(depth, depth_camera, camera, T_color_depth)
        T = candidate.T_world_camera
        return RgbdFrame(
            f"frame_{index:05d}", rgb, depth, camera, LEVEL_POSE if T is None else T, pose_known=T is not None
        )

    def _depth_camera_of(
        self, candidate: Candidate, shape: tuple[int, ...]
    ) -> tuple[CameraIntrinsics, FloatArray]:
        """Return the camera of a frame's depth, with its distortion, and its pose in the colour camera's.

        Raises:
            InputError: depth of this height and width is of another camera.
        """
        camera, T_color_depth = self.sequence.depth_camera, self.sequence.T_color_depth
        if camera is None or T_color_depth is None:
            own = candidate.camera or self.sequence.camera
            files = candidate.depth, candidate.color
            return depth_camera_of(own, shape, *files, SAME_VIEW_REMEDY) or own, np.eye(4)
        if shape != (camera.height_px, camera.width_px):
            raise InputError(
                f"The depth image {candidate.depth} has {shape[1]} x {shape[0]} pixels and its camera "
                f"{camera.width_px} x {camera.height_px}; try a recording whose images are all of one size"
            )
        return camera, T_color_depth

    @cached_property
    def _depth_shape(self) -> tuple[int, ...]:
        """Height and width of the first depth image that has depth."""
        return depth_in(next(_with_depth(self.sequence)), self.sequence).depth.z_m.shape


def open_recording(
    path: AnyPath, depth_scale: float | None = None, intrinsics: AnyPath | None = None
) -> FolderRecording:
    """Open the recording in a folder; depth images are read until one has depth.

    Args:
        path: the recording's folder, or a folder with only this recording.
        depth_scale: depth units per metre; by default that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; by default the recording's, or those of its kind.

    Raises:
        InputError: the path is no usable recording, or no frame has depth.
    """
    place = Path(path)
    bags = [place] if is_bag(place) else [file for file in sorted(place.glob("*")) if is_bag(file)]
    if bags and (place in bags or kind_of(place) is None):
        raise InputError(
            f"{bags[0]} is a bag, which is not read frame by frame; try `packetmesh import {bags[0]} --out "
            "RIG` for some of its moments"
        )
    check_scale(depth_scale)
    kind, folder, sequence = read_sequence(place, depth_scale, intrinsics)
    if next(_with_depth(sequence), None) is None:
        raise NoDepthError(f"No frame of {folder} has depth; check the depth images and the depth scale")
    return FolderRecording(kind.name, folder, sequence)


def _with_depth(sequence: Sequence) -> Iterator[Candidate]:
    """Yield the candidates whose depth image has depth."""
    for candidate in sequence.candidates:
        try:
            depth_in(candidate, sequence)
        except NoDepthError:
            continue
        yield candidate


def _straight(camera: CameraIntrinsics) -> tuple[CameraIntrinsics, FloatArray | None]:
    """Return a camera without its distortion, and (H, W, 2) its pixels in the distorted image."""
    if not camera.fisheye and not np.any(camera.distortion):
        return camera, None
    straight = replace(camera, distortion=np.zeros(5), fisheye=False)
    values = camera.matrix.tobytes(), camera.distortion.tobytes()
    return straight, _distorted(*values, camera.width_px, camera.height_px, camera.fisheye)


@lru_cache(maxsize=2)
def _distorted(matrix: bytes, distortion: bytes, width_px: int, height_px: int, fisheye: bool) -> FloatArray:
    """Return (H, W, 2) float32 pixels in the distorted image of the pixels of the straight one."""
    own = np.frombuffer(matrix).reshape(3, 3)
    camera = CameraIntrinsics(own, np.frombuffer(distortion), width_px, height_px, fisheye)
    straight = CameraIntrinsics(own, np.zeros(5), width_px, height_px)
    pixels = project(camera, pixel_rays(straight).reshape(-1, 3))
    return np.nan_to_num(pixels, nan=-10.0).astype(np.float32).reshape(height_px, width_px, 2)


def _moved(z_m: FloatArray, pixels: FloatArray) -> FloatArray:
    """Return (H, W) depth at (H, W, 2) pixels of an image, each from the nearest pixel; NaN outside."""
    moved: FloatArray = cv2.remap(
        z_m,
        pixels[..., 0],
        pixels[..., 1],
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=np.nan,
    )
    return moved

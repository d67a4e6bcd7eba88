"""A recording of any kind that can be imported, as frames that are read when they are requested."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.bag import is_bag
from pipeline.importing.depth_units import depth_in
from pipeline.importing.kinds import recognise
from pipeline.importing.sequence import Candidate, Sequence, distinct
from pipeline.io.depth_to_color import register_depth
from pipeline.io.images import NoDepthError, read_color
from pipeline.io.same_view import depth_camera_of
from pipeline.kernels.geometry import LEVEL_POSE, pixel_rays, project
from pipeline.types import AnyPath, CameraIntrinsics, DepthMap, DepthNoise, FloatArray, RgbdFrame

FRAMES_PER_S = 30.0
"""Of a recording without times."""
KINECT = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)
"""Noise of a sensor without calibration: within a tenth of ``acquisition.depth_sigma_m`` from 1.5 to 4 m."""
REMEDY = "try a recording whose depth shows the view of its colour images"


@dataclass(frozen=True, slots=True)
class DepthView:
    """A depth image as a camera without distortion sees it."""

    depth: DepthMap
    """(H, W) metric."""
    camera: CameraIntrinsics
    """Pinhole camera of the same pixels."""
    T_color_depth: FloatArray
    """(4, 4) pose of this camera in the colour camera's frame, metres."""
    noise: DepthNoise


@dataclass(frozen=True)
class FolderRecording:
    """Frames of a recording's folder; has what ``recording.Recording`` has."""

    kind: str
    """Name of the kind of recording."""
    folder: Path
    sequence: Sequence

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
        return self.sequence.notes

    def view(self, index: int) -> DepthView:
        """Read the depth of a frame; one without any depth is all NaN.

        Raises:
            InputError: the image cannot be read, or does not fit its camera.
        """
        candidate = self.sequence.candidates[index]
        camera, T_color_depth = self._depth_camera
        shape = camera.height_px, camera.width_px
        try:
            depth = depth_in(candidate, self.sequence).depth
        except NoDepthError:
            depth = DepthMap(np.full(shape, np.nan, np.float32))
        if depth.z_m.shape != shape:
            raise InputError(
                f"The depth image {candidate.depth} has {depth.z_m.shape[1]} x {depth.z_m.shape[0]} pixels "
                f"and the first one {shape[1]} x {shape[0]}; try a recording whose images are all of one size"
            )
        if candidate.camera is not None and self.sequence.depth_camera is None:
            camera = depth_camera_of(candidate.camera, shape, candidate.depth, candidate.color, REMEDY) or (
                candidate.camera
            )
        straight, rows = self._straight
        z_m = depth.z_m if rows is None else _moved(depth.z_m, rows)
        return DepthView(DepthMap(z_m), straight if rows is not None else camera, T_color_depth, KINECT)

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
        own, T_color_depth = self._depth_camera
        if self.sequence.depth_camera is not None or depth.z_m.shape != rgb.shape[:2]:
            depth = register_depth(depth, own, camera, T_color_depth)
        T = candidate.T_world_camera
        return RgbdFrame(
            f"frame_{index:05d}", rgb, depth, camera, LEVEL_POSE if T is None else T, pose_known=T is not None
        )

    @cached_property
    def _depth_camera(self) -> tuple[CameraIntrinsics, FloatArray]:
        """The camera of the depth images, with its distortion, and its pose in the colour camera's frame."""
        sequence = self.sequence
        if sequence.depth_camera is not None and sequence.T_color_depth is not None:
            return sequence.depth_camera, sequence.T_color_depth
        first = next(_with_depth(sequence))
        camera = first.camera or sequence.camera
        shape = depth_in(first, sequence).depth.z_m.shape
        return depth_camera_of(camera, shape, first.depth, first.color, REMEDY) or camera, np.eye(4)

    @cached_property
    def _straight(self) -> tuple[CameraIntrinsics, FloatArray | None]:
        """The depth camera without distortion, and (H, W, 2) pixels of the distorted image; None if equal."""
        camera, _ = self._depth_camera
        if not camera.fisheye and not np.any(camera.distortion):
            return camera, None
        straight = replace(camera, distortion=np.zeros(5), fisheye=False)
        pixels = project(camera, pixel_rays(straight).reshape(-1, 3))
        pixels = np.nan_to_num(pixels, nan=-10.0).astype(np.float32)
        return straight, pixels.reshape(camera.height_px, camera.width_px, 2)


def open_recording(
    path: AnyPath, depth_scale: float | None = None, intrinsics: AnyPath | None = None
) -> FolderRecording:
    """Open the recording in a folder; its images are not read yet.

    Args:
        path: the recording's folder, or a folder with only this recording.
        depth_scale: depth units per metre; by default that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; by default the recording's, or those of its kind.

    Raises:
        InputError: the path is no usable recording, or no frame has depth.
    """
    if is_bag(Path(path)):
        raise InputError(f"{path} is a bag; try `packetmesh import {path} --out RIG` for some of its moments")
    if depth_scale is not None and not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale is {depth_scale}; try 1000 for images in millimetres")
    kind, folder = recognise(Path(path))
    sequence = kind.read(folder, None if intrinsics is None else Path(intrinsics))
    if depth_scale is not None:
        sequence = sequence.with_scale(depth_scale)
    candidates, repeated = distinct(sequence.candidates)
    sequence = replace(sequence, candidates=candidates, notes=(*sequence.notes, *repeated))
    if next(_with_depth(sequence), None) is None:
        raise NoDepthError(f"No frame of {folder} has depth; check the depth images and the depth scale")
    return FolderRecording(kind.name, folder, sequence)


def _with_depth(sequence: Sequence) -> Iterator[Candidate]:
    """Yield the moments whose depth image has depth."""
    for candidate in sequence.candidates:
        try:
            depth_in(candidate, sequence)
        except NoDepthError:
            continue
        yield candidate


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

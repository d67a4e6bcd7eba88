"""A recording of any kind that can be imported, as frames that are read when they are requested."""

from __future__ import annotations

from collections.abc import Callable, Generator
from collections.abc import Sequence as Listed
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, drain
from pipeline.importing.bag_reader import is_bag
from pipeline.importing.depth_units import depth_in, weighted_depth_in
from pipeline.importing.depth_views import (
    DepthCamera,
    DepthView,
    Unusable,
    first_with_depth,
    frame_of,
    view_of,
)
from pipeline.importing.kinds import kind_of
from pipeline.importing.reading import MOST_FRAMES, check_bag_intrinsics, check_scale, read_sequence
from pipeline.importing.recorded_bag import BagRecording, iterate_bag_recording
from pipeline.importing.sequence import SAME_VIEW_REMEDY, Candidate, Sequence
from pipeline.importing.stored import read_color_of
from pipeline.io.images import NoDepthError, ReadDepth
from pipeline.io.same_view import depth_camera_of
from pipeline.types import AnyPath, ByteArray, CameraIntrinsics, FloatArray, RgbdFrame

FRAMES_PER_S = 30.0
"""Frame rate that is assumed for a recording without times."""


@dataclass(frozen=True)
class FolderRecording:
    """Frames of a recording's folder; implements ``recording.Recording``."""

    kind: str
    """Name of the kind of recording."""
    folder: Path
    sequence: Sequence
    unusable: Unusable = field(default_factory=Unusable, compare=False)

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
    def T_world_camera(self) -> tuple[FloatArray | None, ...] | None:
        poses = tuple(candidate.T_world_camera for candidate in self.sequence.candidates)
        return None if all(pose is None for pose in poses) else poses

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes; none on missing poses, because poses can be tracked and a camera may stand still."""
        return (*self.sequence.notes, *self.unusable.notes)

    def view(self, index: int) -> DepthView:
        """Read the depth of a frame; it is all NaN without any depth, or if the image cannot be read.

        ``notes`` has the number of those that cannot be read.
        """
        candidate, weight = self.sequence.candidates[index], None
        try:
            with self.unusable.entered("depth", index):
                read, weight = weighted_depth_in(candidate, self.sequence)
                z_m = read.depth.z_m
                depth_camera = self._depth_camera_of(candidate, z_m.shape)
        except InputError:
            z_m, weight = np.full(self._depth_shape, np.nan, np.float32), None
            depth_camera = self._depth_camera_of(candidate, self._depth_shape)
        return view_of(z_m, depth_camera, weight)

    def frame(self, index: int) -> RgbdFrame:
        """Read colour and depth of a frame; depth of another camera is registered to colour.

        Raises:
            InputError: an image cannot be read, or does not fit its camera.
        """
        candidate = self.sequence.candidates[index]
        camera = candidate.camera or self.sequence.camera
        with self.unusable.entered("colour", index):
            rgb = _color_of(candidate, camera)
        depth = depth_in(candidate, self.sequence).depth
        depth_camera = None
        if self.sequence.depth_camera is not None or depth.z_m.shape != rgb.shape[:2]:
            depth_camera = self._depth_camera_of(candidate, depth.z_m.shape)
        return frame_of(index, rgb, camera, depth, depth_camera, candidate.T_world_camera)

    def _depth_camera_of(self, candidate: Candidate, shape: tuple[int, ...]) -> DepthCamera:
        """Return the camera of a frame's depth.

        Raises:
            InputError: depth of this height and width does not fit its camera.
        """
        camera, T_color_depth = self.sequence.depth_camera, self.sequence.T_color_depth
        if camera is None or T_color_depth is None:
            own = candidate.camera or self.sequence.camera
            files = str(candidate.depth), str(candidate.color)
            same_view = depth_camera_of(own, shape, *files, SAME_VIEW_REMEDY)
            return DepthCamera(same_view or own, np.eye(4))
        if shape != (camera.height_px, camera.width_px):
            raise InputError(
                f"The depth image {candidate.depth} has {shape[1]} x {shape[0]} pixels and its camera "
                f"{camera.width_px} x {camera.height_px}; try a recording whose images are all of one size"
            )
        return DepthCamera(camera, T_color_depth)

    @cached_property
    def _depth_shape(self) -> tuple[int, ...]:
        """Height and width of the first depth image that has depth."""
        first = first_depth(self.sequence)
        assert first is not None  # else it would not have been opened
        return first.depth.z_m.shape


Check = Callable[[FolderRecording | BagRecording], tuple[Listed[FloatArray | None] | None, tuple[str, ...]]]
"""Returns the poses of a recording as they are to be used, None if they cannot be, and notes on them."""


def open_recording(
    path: AnyPath, depth_scale: float | None = None, intrinsics: AnyPath | None = None
) -> FolderRecording | BagRecording:
    """Open a recording; see ``iterate_opening``."""
    return drain(iterate_opening(path, depth_scale, intrinsics))


def iterate_opening(
    path: AnyPath, depth_scale: float | None = None, intrinsics: AnyPath | None = None
) -> Generator[Progress, None, FolderRecording | BagRecording]:
    """Open a recording; depth images are read until one has depth. A bag is read once, for its index.

    Args:
        path: the recording's folder or file, a bag, or a folder with only this recording or bag.
        depth_scale: depth units per metre; by default that of the kind of recording.
        intrinsics: intrinsics file of the colour camera; by default the recording's, or those of its kind; a
            bag takes none.

    Raises:
        InputError: the path is no usable recording, or no frame has depth.
    """
    check_scale(depth_scale)
    place = Path(path)
    bag = _bag_in(place)
    if bag is not None:
        check_bag_intrinsics(bag, intrinsics)
        return (yield from iterate_bag_recording(bag, depth_scale))
    kind, folder, sequence = read_sequence(place, depth_scale, intrinsics, MOST_FRAMES)
    if first_depth(sequence) is None:
        raise NoDepthError(f"No frame of {folder} has depth; check the depth images and the depth scale")
    return FolderRecording(kind.name, folder, sequence)


def _color_of(candidate: Candidate, camera: CameraIntrinsics) -> ByteArray:
    """Read (H, W, 3) colours.

    Raises:
        InputError: the image cannot be read, or has another size than its camera.
    """
    rgb = read_color_of(candidate.color)
    if rgb.shape[:2] != (camera.height_px, camera.width_px):
        raise InputError(
            f"The colour image {candidate.color} has {rgb.shape[1]} x {rgb.shape[0]} pixels and its "
            f"camera {camera.width_px} x {camera.height_px}; try --intrinsics with the colour camera's"
        )
    return rgb


def _bag_in(place: Path) -> Path | None:
    """Return a bag, or the only bag in a folder that is no recording; None if there is none.

    Raises:
        InputError: there are several.
    """
    if is_bag(place):
        return place
    bags = [file for file in sorted(place.glob("*")) if is_bag(file)]
    if not bags or kind_of(place) is not None:
        return None
    if len(bags) > 1:
        names = ", ".join(bag.name for bag in bags[:6])
        raise InputError(f"{place} holds {len(bags)} bags; try one of them: {names}")
    return bags[0]


def first_depth(sequence: Sequence) -> ReadDepth | None:
    """Return the first depth image that has depth, as ``first_with_depth``."""
    return first_with_depth(partial(depth_in, candidate, sequence) for candidate in sequence.candidates)

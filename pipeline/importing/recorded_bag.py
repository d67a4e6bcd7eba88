"""A camera's images in a bag, as frames that are read when they are requested."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.importing.bag_depth import BagScale, place_of_depth
from pipeline.importing.bag_messages import color_of
from pipeline.importing.bag_reader import opened_bag, readable
from pipeline.importing.bag_stream import BagStream
from pipeline.importing.bag_times import moments_of, times_of
from pipeline.importing.bag_topics import Topic, iterate_scan, message_of, pairs_of
from pipeline.importing.bag_transforms import Transforms
from pipeline.importing.depth_views import (
    DepthCamera,
    DepthView,
    Unusable,
    first_with_depth,
    frame_of,
    view_of,
)
from pipeline.importing.reading import MOST_FRAMES, slice_of_frames
from pipeline.io.images import NoDepthError, ReadDepth
from pipeline.types import CameraIntrinsics, FloatArray, IntArray, RgbdFrame


@dataclass(frozen=True)
class BagRecording:
    """Frames of a bag; implements ``recording.Recording``."""

    path: Path
    color: BagStream
    depth: BagStream
    moments: IntArray
    """(N, 2) indices of the colour and the depth message of each frame."""
    times_s: FloatArray
    """(N,) time of each colour image, ascending."""
    T_world_camera: tuple[FloatArray | None, ...] | None
    """(4, 4) poses of the colour camera, metres, None where unknown; None if no pose is known."""
    camera: CameraIntrinsics
    depth_camera: DepthCamera | None
    """None if depth is on the colour image's pixels."""
    depth_shape: tuple[int, ...]
    """Height and width of the depth images."""
    scale: BagScale
    found: tuple[str, ...]
    """Notes on the whole bag, one sentence each."""
    unusable: Unusable = field(default_factory=Unusable, compare=False)

    kind = "bag"

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.found, *self.unusable.notes)

    def view(self, index: int) -> DepthView:
        """Read the depth of a frame; it is all NaN without any depth, or if the image cannot be read.

        ``notes`` has the number of those that cannot be read.
        """
        try:
            with self.unusable.entered("depth", index):
                z_m = self._depth(index).depth.z_m
        except InputError:
            z_m = np.full(self.depth_shape, np.nan, np.float32)
        return view_of(z_m, self.depth_camera or DepthCamera(self.camera, np.eye(4)))

    def frame(self, index: int) -> RgbdFrame:
        """Read colour and depth of a frame; depth of another camera is registered to colour.

        Raises:
            InputError: an image cannot be read, or does not fit its camera.
        """
        with self.unusable.entered("colour", index):
            rgb = color_of(self.color.message(int(self.moments[index, 0])), self.color.topic)
            _check_size(self.color.topic, rgb.shape, (self.camera.height_px, self.camera.width_px))
        T = None if self.T_world_camera is None else self.T_world_camera[index]
        return frame_of(index, rgb, self.camera, self._depth(index).depth, self.depth_camera, T)

    def _depth(self, index: int) -> ReadDepth:
        read = self.scale.read(self.depth.message(int(self.moments[index, 1])))
        shape = read.depth.z_m.shape
        _check_size(self.depth.topic, shape, self.depth_shape, "the first image of this topic with depth")
        return read


def iterate_bag_recording(path: Path, depth_scale: float | None) -> Generator[Progress, None, BagRecording]:
    """Open a bag as the recording of one camera; the bag is read once, and no image is kept.

    Of several cameras, that with the most frames is used.

    Args:
        path: the bag's file or folder.
        depth_scale: depth units per metre; None takes those of the SDK or of the images' encoding.

    Raises:
        InputError: the bag is unreadable, lacks colour, depth or camera_info, or no frame has depth.
    """
    with opened_bag(path) as reader:
        scanned = yield from iterate_scan(reader)
        pairs, left_out = pairs_of(path, reader, scanned.colors, scanned.depths)
        color, depth = max(pairs, key=lambda pair: min(len(own.recorded_ns) for own in pair))
        times_s, time_notes = times_of([color, depth])
        moments = moments_of(path, times_s)
        scale = BagScale.of(reader, depth.name, depth_scale)

        def depth_at(index: int) -> ReadDepth:
            with readable(path):
                return scale.read(message_of(reader, depth.name, depth.recorded_ns, index))

        read = first_with_depth(partial(depth_at, int(at)) for at in moments[:, 1])
    if read is None:
        raise NoDepthError(f"No frame of {path} has depth; check the depth images of {depth.name}")
    shape = read.depth.z_m.shape
    place, place_notes = place_of_depth(color, depth, shape, scanned.transforms)
    if place is not None:
        _check_size(depth.name, shape, (place.camera.height_px, place.camera.width_px))
    chosen, thinned = slice_of_frames(len(moments), MOST_FRAMES)
    moments = moments[chosen]
    frames_s = times_s[0][moments[:, 0]]
    poses, pose_notes = _poses(scanned.transforms, color, frames_s, bool(time_notes))
    notes = *scanned.notes, *left_out, *_others(pairs, color), *time_notes, *color.found.notes
    notes += *(f"{depth.name}: {note}" for note in (*read.notes, *place_notes)), *pose_notes, *thinned
    return BagRecording(
        path,
        BagStream(path, color.name, color.recorded_ns),
        BagStream(path, depth.name, depth.recorded_ns),
        moments,
        frames_s,
        poses,
        color.camera,
        place,
        shape,
        scale,
        tuple(dict.fromkeys(notes)),
    )


def _poses(
    transforms: Transforms, color: Topic, times_s: FloatArray, in_bag: bool
) -> tuple[tuple[FloatArray | None, ...] | None, tuple[str, ...]]:
    """Return the (4, 4) pose of a camera at each time, or None if none is known, and notes."""
    found = transforms.over_time(color.frame, times_s, in_bag)
    if found is None:
        return None, ()
    lost = int((~found.known).sum())
    if lost == len(times_s):
        return None, (f"No frame has a pose by {found.source} at its time",)
    poses = tuple(T if known else None for T, known in zip(found.T_world_frame, found.known, strict=True))
    note = f"{lost} of {len(times_s)} frames have no pose by {found.source} at their time"
    return poses, (f"The poses are those by {found.source}", *((note,) if lost else ()))


def _others(pairs: list[tuple[Topic, Topic]], used: Topic) -> tuple[str, ...]:
    """Return a sentence on the cameras that are not used."""
    others = [color.name for color, _ in pairs if color is not used]
    if not others:
        return ()
    return (f"{used.name} is used, and {', '.join(others)} left out: a recording is of one camera",)


def _check_size(
    topic: str, shape: tuple[int, ...], expected: tuple[int, ...], of: str = "its camera"
) -> None:
    if shape[:2] != tuple(expected):
        raise InputError(
            f"An image of {topic} has {shape[1]} x {shape[0]} pixels and {of} {expected[1]} x "
            f"{expected[0]}; try to record images of one size with their camera_info"
        )

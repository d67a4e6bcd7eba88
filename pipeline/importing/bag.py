"""Import of ROS 1 and ROS 2 bags (.bag, .db3, .mcap or a bag's folder): cameras and simultaneous images."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.importing.bag_cameras import sdk_stream
from pipeline.importing.bag_messages import color_of, depth_values_of
from pipeline.importing.bag_times import moments_of, times_of
from pipeline.importing.bag_topics import Topic, image_topics, message_of, of_separate_cameras, pairs_of
from pipeline.importing.bag_transforms import Transforms, sdk_units_per_metre, static_transforms
from pipeline.importing.depth_units import depth_of
from pipeline.importing.rig_folder import NodeImages
from pipeline.io.depth_scale import known_in, usual_scale
from pipeline.io.same_view import alike, depth_camera_of, same_view_note
from pipeline.types import CameraIntrinsics, FloatArray

SUFFIXES = (".bag", ".db3", ".mcap")


@dataclass(frozen=True, slots=True)
class BagNodes:
    """The nodes read from a bag."""

    nodes: tuple[tuple[float, NodeImages], ...]
    """Time in seconds, and images, of each node."""
    candidates: int
    """Number of colour images of the first camera."""
    units_per_metre: float
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Place:
    """Camera of a depth image that is not registered to its colour image."""

    camera: CameraIntrinsics
    T_color_depth: FloatArray
    """(4, 4) pose in the colour camera's frame, metres."""


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag's file or the folder of a ROS 2 bag."""
    return (path.is_file() and path.suffix in SUFFIXES) or (path / "metadata.yaml").is_file()


def iterate_bag(path: Path, frames: int, depth_scale: float | None) -> Generator[Progress, None, BagNodes]:
    """Read several cameras' images of one moment, or ``frames`` evenly spread moments of a single camera.

    Raises:
        InputError: the bag is unreadable, lacks colour, depth or camera_info, or has no images of one time.
    """
    with _opened(path) as reader:
        colors, depths, notes = yield from image_topics(reader)
        pairs, left_out = pairs_of(path, reader, colors, depths)
        pairs, smaller = of_separate_cameras(pairs)
        notes += [*left_out, *smaller]
        transforms = static_transforms(reader)
        topics = [topic for pair in pairs for topic in pair]
        times_s, time_notes = times_of(topics)
        moments = moments_of(path, times_s, frames, len(pairs) == 1)
        notes += [*time_notes, *(note for color, _ in pairs for note in color.found.notes)]
        poses, why = _poses(transforms, [color.frame for color, _ in pairs])
        notes += why
        nodes = []
        for chosen in moments:
            for index, (pair, T_world_color) in enumerate(zip(pairs, poses, strict=True)):
                at = chosen[2 * index : 2 * index + 2]
                node, units = _node(reader, pair, at, depth_scale, T_world_color, transforms)
                nodes.append((float(times_s[2 * index][at[0]]), node))
        notes += [f"{node.depth_name}: {note}" for _, node in nodes for note in node.notes]
        notes += _repeated([node for _, node in nodes])
        return BagNodes(tuple(nodes), len(times_s[0]), units, tuple(dict.fromkeys(notes)))


def _poses(transforms: Transforms, frames: list[str]) -> tuple[list[FloatArray | None], tuple[str, ...]]:
    """Return the (4, 4) T_world_camera of the cameras by their frames, or None for all and the reason."""
    unknown: list[FloatArray | None] = [None] * len(frames)
    if len(frames) == 1:
        return unknown, ("Moving transforms are not read; reconstruct looks for their poses",)
    poses = transforms.poses(frames)
    if any(pose is None for pose in poses):
        return unknown, (
            "No static transforms link the cameras, and moving transforms are not read; reconstruct looks "
            "for their poses",
        )
    if len(set(frames)) < len(frames):
        twice = next(frame for frame in frames if frames.count(frame) > 1)
        return unknown, (
            f"Several cameras have the frame {twice}, so that transforms do not tell their places; "
            "reconstruct looks for their poses",
        )
    return poses, ()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield reader
    except InputError:
        raise
    except Exception as error:  # a parser fails on damaged data in more ways than can be listed
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"The bag {path} cannot be read ({why}); "
            "try to copy it again, or rosbag reindex or ros2 bag reindex"
        ) from None


def _repeated(nodes: list[NodeImages]) -> list[str]:
    """Return a note if several nodes have the very same colour and depth images."""
    first = nodes[0]
    same = [
        np.array_equal(node.rgb, first.rgb)
        and np.array_equal(node.depth.z_m, first.depth.z_m, equal_nan=True)
        for node in nodes[1:]
    ]
    return [f"{sum(same)} other nodes have the very same images as node_00"] if any(same) else []


def _node(
    reader: Any,
    pair: tuple[Topic, Topic],
    at: FloatArray,
    depth_scale: float | None,
    T_world_color: FloatArray | None,
    transforms: Transforms,
) -> tuple[NodeImages, float]:
    """Return the images of a colour and a depth topic at two messages' indices, and the units per metre."""
    color, depth = pair
    values = depth_values_of(message_of(reader, depth, int(at[1])), depth.name)
    if not known_in(values).any():
        raise InputError(f"A depth image of {depth.name} has no depth anywhere; try another recording")
    recorded = sdk_units_per_metre(reader, depth.name)
    stated = depth_scale is not None or recorded is not None
    scale = depth_scale or recorded or usual_scale(values)
    read = depth_of(f"of {depth.name}", values, scale, stated)
    rgb = color_of(message_of(reader, color, int(at[0])), color.name)
    camera = color.camera
    place, notes = _place_of_depth(color, depth, values.shape, transforms)
    images = color.name, depth.name, rgb, read.depth, camera, T_world_color
    notes = (*read.notes, *notes)
    if place is None:
        return NodeImages(*images, notes=notes), scale
    return NodeImages(*images, place.camera, place.T_color_depth, notes), scale


def _place_of_depth(
    color: Topic, depth: Topic, shape: tuple[int, ...], transforms: Transforms
) -> tuple[_Place | None, tuple[str, ...]]:
    """Return the depth camera, None if depth is on the colour image's pixels, and notes."""
    if sdk_stream(depth.name):
        T_color_depth, notes = transforms.between_streams(color.name, depth.name)
        if depth.found.camera is None:
            raise InputError(f"{depth.name} has no camera that can be used: {depth.found.why_not}")
        registered = alike(depth.camera, color.camera) and np.allclose(T_color_depth, np.eye(4), atol=1e-6)
        notes = (*depth.found.notes, *notes)
        return None if registered else _Place(depth.camera, T_color_depth), notes
    if depth.frame == color.frame:
        return _in_one_frame(color, depth, shape)
    T = transforms.between(color.frame, depth.frame)
    missing = [] if depth.found.camera else ["its camera_info"]
    missing += [] if T is not None else [f"a static transform between {color.frame} and {depth.frame}"]
    if missing or T is None:
        raise InputError(
            f"{depth.name} is in the frame {depth.frame}, not registered to {color.name} in {color.frame}, "
            f"and the bag lacks {' and '.join(missing)}; try to record that, too"
        )
    return _Place(depth.camera, T), depth.found.notes


def _in_one_frame(
    color: Topic, depth: Topic, shape: tuple[int, ...]
) -> tuple[_Place | None, tuple[str, ...]]:
    """Return the camera of depth in the colour image's frame: its own camera_info's, or the same view's."""
    own = depth.found.camera if depth.found.by_name else None
    if own is not None and not alike(own, color.camera):
        note = (
            f"its camera_info is not that of {color.name}, so that it is registered to it from the same place"
        )
        return _Place(own, np.eye(4)), (*depth.found.notes, note)
    remedy = f"try to record the camera_info of {depth.name}, too"
    resized = depth_camera_of(color.camera, shape, f"of {depth.name}", f"of {color.name}", remedy)
    if resized is None:
        return None, ()
    return _Place(resized, np.eye(4)), (same_view_note(color.camera, resized),)

"""Import of ROS 1 and ROS 2 bags (.bag, .db3, .mcap or a bag's folder): cameras and simultaneous images."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from packetmesh.progress import Progress
from pipeline.importing.bag_depth import BagScale, place_of_depth
from pipeline.importing.bag_messages import color_of
from pipeline.importing.bag_reader import BagReader, opened_bag
from pipeline.importing.bag_times import moments_of, times_of
from pipeline.importing.bag_topics import Topic, iterate_scan, message_of, of_separate_cameras, pairs_of
from pipeline.importing.bag_transforms import Transforms
from pipeline.importing.rig_folder import NodeImages
from pipeline.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class BagNodes:
    """The nodes read from a bag."""

    nodes: tuple[tuple[float, NodeImages], ...]
    """Time in seconds, and images, of each node."""
    candidates: int
    """Number of colour images of the first camera."""
    units_per_metre: float
    """Depth units per metre of the last node's depth image."""
    notes: tuple[str, ...]


def iterate_bag(path: Path, frames: int, depth_scale: float | None) -> Generator[Progress, None, BagNodes]:
    """Read several cameras' images of one moment, or ``frames`` evenly spread moments of a single camera.

    Args:
        path: the bag's file or folder.
        frames: number of moments of a single camera.
        depth_scale: depth units per metre; None takes those of the SDK or of the images' encoding.

    Raises:
        InputError: the bag is unreadable, lacks colour, depth or camera_info, or has no images of one time;
            NoDepthError if a chosen image has no depth.
    """
    with opened_bag(path) as reader:
        scanned = yield from iterate_scan(reader)
        transforms = scanned.transforms
        pairs, left_out = pairs_of(path, reader, scanned.colors, scanned.depths)
        pairs, smaller = of_separate_cameras(pairs)
        notes = [*scanned.notes, *left_out, *smaller]
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
    """Return the (4, 4) T_world_camera, metres, of cameras by frame, or None for all and the reason."""
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


def _repeated(nodes: list[NodeImages]) -> list[str]:
    """Return a note if other nodes have the same colour and depth images as the first; else no note."""
    first = nodes[0]
    same = [
        np.array_equal(node.rgb, first.rgb)
        and np.array_equal(node.depth.z_m, first.depth.z_m, equal_nan=True)
        for node in nodes[1:]
    ]
    others = "1 other node has" if sum(same) == 1 else f"{sum(same)} other nodes have"
    return [f"{others} the very same images as node_00"] if any(same) else []


def _node(
    reader: BagReader,
    pair: tuple[Topic, Topic],
    at: IntArray,
    depth_scale: float | None,
    T_world_color: FloatArray | None,
    transforms: Transforms,
) -> tuple[NodeImages, float]:
    """Return the images of a colour and a depth topic at two messages' indices, and the units per metre."""
    color, depth = pair
    scale = BagScale.of(reader, depth.name, depth_scale)
    read = scale.read(message_of(reader, depth.name, depth.recorded_ns, int(at[1])))
    rgb = color_of(message_of(reader, color.name, color.recorded_ns, int(at[0])), color.name)
    place, notes = place_of_depth(color, depth, read.depth.z_m.shape, transforms)
    images = color.name, depth.name, rgb, read.depth, color.camera, T_world_color
    notes = (*read.notes, *notes)
    if place is None:
        return NodeImages(*images, notes=notes), read.units_per_metre
    return NodeImages(*images, place.camera, place.T_color_depth, notes), read.units_per_metre

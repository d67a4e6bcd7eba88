"""Import of ROS 1 and ROS 2 bags (.bag, .db3, .mcap or a bag's folder): cameras and simultaneous images."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from packetmesh.progress import Progress
from pipeline.importing.bag_depth import BagScale, place_of_depth
from pipeline.importing.bag_messages import color_of
from pipeline.importing.bag_reader import BagReader, opened_bag
from pipeline.importing.bag_times import moments_from_middle, moments_of, times_of
from pipeline.importing.bag_topics import Topic, iterate_scan, message_of, of_separate_cameras, pairs_of
from pipeline.importing.bag_transforms import Transforms
from pipeline.importing.rig_folder import NodeImages
from pipeline.io.images import NoDepthError
from pipeline.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class BagNode:
    """A camera's images of one moment."""

    time_s: float
    images: NodeImages
    units_per_metre: float
    """Depth units per metre of its depth image."""


@dataclass(frozen=True, slots=True)
class BagNodes:
    """The nodes read from a bag."""

    nodes: tuple[BagNode, ...]
    candidates: int
    """Number of colour images of the first camera."""
    notes: tuple[str, ...]


def iterate_bag(path: Path, frames: int, depth_scale: float | None) -> Generator[Progress, None, BagNodes]:
    """Read several cameras' images of one moment, or ``frames`` evenly spread moments of a single camera.

    A moment in which a depth image has no depth is left out, and others are chosen.

    Args:
        path: the bag's file or folder.
        frames: number of moments of a single camera.
        depth_scale: depth units per metre; None takes those of the SDK or of the images' encoding.

    Raises:
        InputError: the bag is unreadable, lacks colour, depth or camera_info, or has no images of one time;
            NoDepthError if every moment has a depth image without depth.
    """
    with opened_bag(path) as reader:
        scanned = yield from iterate_scan(reader)
        transforms = scanned.transforms
        pairs, left_out = pairs_of(path, reader, scanned.colors, scanned.depths)
        pairs, smaller = of_separate_cameras(pairs)
        notes = [*scanned.notes, *left_out, *smaller]
        topics = [topic for pair in pairs for topic in pair]
        times_s, time_notes = times_of(topics)
        notes += [*time_notes, *(note for color, _ in pairs for note in color.found.notes)]
        poses, why = _poses(transforms, [color.frame for color, _ in pairs])
        notes += why

        def nodes_at(moment: IntArray) -> list[BagNode]:
            nodes = []
            for index, (pair, T_world_color) in enumerate(zip(pairs, poses, strict=True)):
                at = moment[2 * index : 2 * index + 2]
                images, units = _node(reader, pair, at, depth_scale, T_world_color, transforms)
                nodes.append(BagNode(float(times_s[2 * index][at[0]]), images, units))
            return nodes

        if len(pairs) == 1:
            chosen = _iterate_moments(moments_of(path, times_s), frames, nodes_at)
        else:
            chosen = _iterate_moments(moments_from_middle(path, times_s), 1, nodes_at)
        nodes, blank = yield from chosen
        notes += [f"{node.images.depth_name}: {note}" for node in nodes for note in node.images.notes]
        notes += [*blank, *_repeated([node.images for node in nodes])]
        return BagNodes(tuple(nodes), len(times_s[0]), tuple(dict.fromkeys(notes)))


def _iterate_moments(
    moments: IntArray, count: int, nodes_at: Callable[[IntArray], list[BagNode]]
) -> Generator[Progress, None, tuple[list[BagNode], tuple[str, ...]]]:
    """Read the nodes of ``count`` evenly spread moments in which all depth images have depth, and a note.

    Args:
        moments: (N, topics) indices of messages; of one moment the first counts.
        count: number of moments; all if there are fewer.
        nodes_at: reads the nodes of a moment.

    Raises:
        InputError: an image cannot be read; NoDepthError if every moment has a depth image without depth.
    """
    total = len(moments)
    while True:
        nodes = []
        for at in np.linspace(0, len(moments) - 1, min(count, len(moments))).round().astype(int):
            try:
                nodes += nodes_at(moments[at])
            except NoDepthError:
                if len(moments) == 1:
                    raise
                moments = np.delete(moments, at, axis=0)
                yield Progress("depth", 1.0)
                break
        else:
            left_out = total - len(moments)
            note = f"{left_out} moments with a depth image without any depth were left out"
            return nodes, (note,) if left_out else ()


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
    return [f"{others} the same images as node_00"] if any(same) else []


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

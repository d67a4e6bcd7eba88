"""Import of ROS 1 and ROS 2 bags (.bag, .db3, .mcap or a bag's folder): cameras and simultaneous images."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from packetmesh.progress import Progress, part
from pipeline.importing.bag_depth import BagScale, place_of_depth
from pipeline.importing.bag_messages import color_of
from pipeline.importing.bag_reader import BagReader, opened_bag
from pipeline.importing.bag_times import moments_from_middle, moments_of, times_of
from pipeline.importing.bag_topics import Topic, iterate_scan, largest_of_each_camera, message_of, pairs_of
from pipeline.importing.bag_transforms import Transforms
from pipeline.importing.rig_folder import NodeImages
from pipeline.importing.sequence import left_out_note
from pipeline.io.images import NoDepthError
from pipeline.types import FloatArray, IntArray

MOST_BLANK = 300
"""Most moments without depth that are read before the search for others ends."""


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
        scanned = yield from part(iterate_scan(reader), "messages", 0.0, 0.8, detail=True)
        transforms = scanned.transforms
        pairs, left_out = pairs_of(path, reader, scanned.colors, scanned.depths)
        pairs, smaller = largest_of_each_camera(pairs)
        notes = [*scanned.notes, *left_out, *smaller]
        topics = [topic for pair in pairs for topic in pair]
        times_s, time_notes = times_of(topics)
        notes += [*time_notes, *(note for color, _ in pairs for note in color.found.notes)]
        poses, why = _poses(transforms, [color.frame for color, _ in pairs])
        notes += why

        def check_depth(moment: IntArray) -> None:
            for (_, depth), at in zip(pairs, moment[1::2].tolist(), strict=True):
                message = message_of(reader, depth.name, depth.recorded_ns, at)
                BagScale.of(reader, depth.name, depth_scale).read(message)

        if len(pairs) == 1:
            choosing = _iterate_moments(moments_of(path, times_s), frames, check_depth)
        else:
            choosing = _iterate_moments(moments_from_middle(path, times_s), 1, check_depth)
        chosen, blank = yield from part(choosing, "depth", 0.8, 1.0)
        nodes = []
        for moment in chosen:
            for index, (pair, T_world_color) in enumerate(zip(pairs, poses, strict=True)):
                at = moment[2 * index : 2 * index + 2]
                images, units = _node(reader, pair, at, depth_scale, T_world_color, transforms)
                nodes.append(BagNode(float(times_s[2 * index][at[0]]), images, units))
        notes += [f"{node.images.depth_name}: {note}" for node in nodes for note in node.images.notes]
        notes += [*blank, *_repeated([node.images for node in nodes])]
        return BagNodes(tuple(nodes), len(times_s[0]), tuple(dict.fromkeys(notes)))


def _iterate_moments(
    moments: IntArray, count: int, check_depth: Callable[[IntArray], None]
) -> Generator[Progress, None, tuple[IntArray, tuple[str, ...]]]:
    """Choose ``count`` evenly spread moments in which all depth images have depth; also returns a note.

    The depth of a moment is read once. After ``MOST_BLANK`` moments without, those known to have it remain.

    Args:
        moments: (N, topics) indices of messages; of one moment the first counts.
        count: number of moments; all if there are fewer.
        check_depth: raises a NoDepthError for a moment in which a depth image has no depth.

    Raises:
        InputError: an image cannot be read; NoDepthError if no moment that was tried has depth in all images.
    """
    left, good, blank = np.arange(len(moments)), set[int](), 0
    while True:
        chosen = left[np.linspace(0, len(left) - 1, min(count, len(left))).round().astype(int)]
        unknown = [at for at in chosen.tolist() if at not in good]
        if not unknown:
            note = left_out_note(blank, "moment", "with a depth image without any depth")
            return moments[chosen], note
        yield Progress(f"depth of moment {len(good) + blank}", (len(good) + blank) / len(moments))
        try:
            check_depth(moments[unknown[0]])
            good.add(unknown[0])
        except NoDepthError:
            blank += 1
            left = left[left != unknown[0]] if blank < MOST_BLANK else np.array(sorted(good))
            if not len(left):
                raise


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

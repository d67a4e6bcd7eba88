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
from pipeline.importing.bag_messages import (
    camera_in,
    color_of,
    depth_values_of,
    is_depth,
    stamp_s,
    transform_in,
)
from pipeline.importing.depth_units import depth_of
from pipeline.importing.rig_folder import NodeImages
from pipeline.io.depth_scale import known_in, usual_scale
from pipeline.kernels.geometry import inverse
from pipeline.types import MAX_NODES, CameraIntrinsics, FloatArray

PROGRESS_EVERY = 20
"""Number of images between progress reports."""
LARGEST_GAP_S = 0.05
"""Largest time difference of images that count as simultaneous: more than one frame at 30 Hz."""
_SUFFIXES = (".bag", ".db3", ".mcap")
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_TRANSPORTS = ("compressed", "compressedDepth")


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
class _Topic:
    """An image topic with its camera and the times of its images."""

    connection: Any
    frame: str
    camera: CameraIntrinsics | None
    times_s: FloatArray
    """(N,) time of each image, from its header."""
    recorded_ns: list[int]
    """(N,) time at which each image was recorded, which locates it in the bag."""

    @property
    def name(self) -> str:
        return str(self.connection.topic)


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag's file or the folder of a ROS 2 bag."""
    return (path.is_file() and path.suffix in _SUFFIXES) or (path / "metadata.yaml").is_file()


def iterate_bag(path: Path, frames: int, depth_scale: float | None) -> Generator[Progress, None, BagNodes]:
    """Read several cameras' images of one moment, or ``frames`` evenly spread moments of a single camera.

    Raises:
        InputError: the bag is unreadable, lacks colour, depth or camera_info, or has no images of one time.
    """
    with _opened(path) as reader:
        topics = yield from _image_topics(reader)
        pairs, notes = _pairs(path, *topics)
        transforms, parents = _static_transforms(reader)
        moments = _moments(path, pairs, frames)
        first = pairs[0][0]
        poses = [transforms.get(_root(first.frame, parents), {}).get(color.frame) for color, _ in pairs]
        if len(pairs) == 1 or any(pose is None for pose in poses):
            poses = [None] * len(pairs)
            notes.append("No static transforms place the cameras; reconstruct looks for their poses")
        nodes = []
        for chosen in moments:
            for (color, depth), T_world_color, (color_s, depth_s) in zip(pairs, poses, chosen, strict=True):
                messages = _message(reader, color, color_s), _message(reader, depth, depth_s)
                node = _node(color, depth, *messages, depth_scale, T_world_color, transforms)
                nodes.append((float(color_s), node))
        values = depth_values_of(messages[1], depth.name)
        scale = usual_scale(values) if depth_scale is None else depth_scale
        notes += [f"{node.depth_name}: {note}" for _, node in nodes for note in node.notes]
        return BagNodes(tuple(nodes), len(first.times_s), scale, tuple(notes))


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
        raise InputError(f"The bag {path} cannot be read ({why}); try to record or copy it again") from None


def _image_topics(reader: Any) -> Generator[Progress, None, tuple[list[_Topic], list[_Topic]]]:
    """Return the colour topics and the depth topics, sorted by name."""
    found: tuple[list[_Topic], list[_Topic]] = ([], [])
    connections = [own for own in reader.connections if own.msgtype in _IMAGES]
    images, seen = max(1, sum(connection.msgcount for connection in connections)), 0
    for connection in sorted(connections, key=lambda connection: connection.topic):
        first, times_s, recorded_ns = None, [], []
        for _, at_ns, raw in reader.messages([connection]):
            if seen % PROGRESS_EVERY == 0:
                yield Progress(f"images of {connection.topic}", min(1.0, seen / images))
            seen += 1
            first = reader.deserialize(raw, connection.msgtype) if first is None else first
            times_s.append(stamp_s(raw, reader.is2))
            recorded_ns.append(at_ns)
        if first is not None:
            camera = _camera_info(reader, connection.topic)
            frame = first.header.frame_id.lstrip("/")
            topic = _Topic(connection, frame, camera, np.array(times_s), recorded_ns)
            found[is_depth(first)].append(topic)
    return found


def _camera_info(reader: Any, topic: str) -> CameraIntrinsics | None:
    parts = [part for part in topic.split("/") if part not in _TRANSPORTS]
    wanted = "/".join([*parts[:-1], "camera_info"])
    connections = [own for own in reader.connections if own.topic == wanted]
    for connection, _, raw in reader.messages(connections) if connections else ():
        return camera_in(reader.deserialize(raw, connection.msgtype), wanted)
    return None


def _pairs(
    path: Path, colors: list[_Topic], depths: list[_Topic]
) -> tuple[list[tuple[_Topic, _Topic]], list[str]]:
    """Pair each depth topic with the colour topic of its frame, or else of the most similar name.

    Every colour topic is used once. Also returns a sentence for each topic that is left out.
    """
    for topics, what in ((colors, "colour"), (depths, "depth")):
        if not topics:
            known = ", ".join(topic.name for topic in [*colors, *depths]) or "no images at all"
            raise InputError(f"The bag {path} has no {what} images, but {known}; try to record both")
    usable = [color for color in colors if color.camera is not None]
    if not usable:
        raise InputError(f"The bag {path} has no camera_info of {colors[0].name}; try to record it, too")
    best: dict[str, tuple[tuple[bool, int], _Topic, _Topic]] = {}
    for depth in depths:
        scored = [((color.frame == depth.frame, _common(color.name, depth.name)), color) for color in usable]
        score, color = max(scored, key=lambda pair: pair[0])
        if color.name not in best or score > best[color.name][0]:
            best[color.name] = score, color, depth
    pairs = [best[name][1:] for name in sorted(best)]
    taken, used = pairs[:MAX_NODES], {depth.name for _, depth in pairs}
    notes = [f"{color.name} is left out: it has no camera_info" for color in colors if color.camera is None]
    notes += [f"{own.name} is left out: no depth belongs to it" for own in usable if own.name not in best]
    notes += [
        f"{own.name} is left out: it has no colour of its own" for own in depths if own.name not in used
    ]
    notes += [
        f"{color.name} is left out: a rig has at most {MAX_NODES} nodes" for color, _ in pairs[MAX_NODES:]
    ]
    return taken, notes


def _common(first: str, second: str) -> int:
    """Return the number of equal leading parts of two topics' names."""
    same = [a == b for a, b in zip(first.split("/"), second.split("/"), strict=False)]
    return same.index(False) if False in same else len(same)


def _moments(path: Path, pairs: list[tuple[_Topic, _Topic]], frames: int) -> list[FloatArray]:
    """Return the (cameras, 2) times of colour and depth for each chosen moment."""
    reference_s = pairs[0][0].times_s
    times_s = np.stack(
        [np.stack([_nearest(topic.times_s, reference_s) for topic in pair], axis=1) for pair in pairs], axis=1
    )
    gaps_s = np.ptp(times_s.reshape(len(reference_s), -1), axis=1)
    together = np.flatnonzero(gaps_s <= LARGEST_GAP_S)
    if not len(together):
        raise InputError(
            f"The images of the bag {path} are never less than {gaps_s.min():.3g} s apart, more than the "
            f"{LARGEST_GAP_S:g} s of one moment; try to record with the cameras' clocks set alike"
        )
    if len(pairs) > 1:
        middle = together[np.abs(together - len(reference_s) / 2).argmin()]
        return [times_s[middle]]
    spread = np.linspace(0, len(together) - 1, min(frames, len(together))).round().astype(int)
    return list(times_s[together[spread]])


def _nearest(times_s: FloatArray, wanted_s: FloatArray) -> FloatArray:
    times_s = np.sort(times_s)
    after = np.searchsorted(times_s, wanted_s).clip(1, max(1, len(times_s) - 1))
    around = times_s[np.stack([after - 1, after.clip(max=len(times_s) - 1)])]
    return around[np.abs(around - wanted_s).argmin(axis=0), np.arange(len(wanted_s))]


def _static_transforms(reader: Any) -> tuple[dict[str, dict[str, FloatArray]], dict[str, str]]:
    """Return T_a_b, metres, of all frames linked by static transforms, and the parent of each frame."""
    parents: dict[str, str] = {}
    links: dict[str, dict[str, FloatArray]] = {}
    connections = [own for own in reader.connections if own.topic.lstrip("/") == "tf_static"]
    for connection, _, raw in reader.messages(connections) if connections else ():
        for message in reader.deserialize(raw, connection.msgtype).transforms:
            parent, child = message.header.frame_id.lstrip("/"), message.child_frame_id.lstrip("/")
            T_parent_child, parents[child] = transform_in(message), parent
            links.setdefault(parent, {})[child] = T_parent_child
            links.setdefault(child, {})[parent] = inverse(T_parent_child)
    return {start: _reached(start, links) for start in links}, parents


def _root(frame: str, parents: dict[str, str]) -> str:
    """Return a frame's topmost ancestor, which by ROS's convention (REP 103) has z up."""
    above = [frame]
    while above[-1] in parents and parents[above[-1]] not in above:
        above.append(parents[above[-1]])
    return above[-1]


def _reached(start: str, links: dict[str, dict[str, FloatArray]]) -> dict[str, FloatArray]:
    found: dict[str, FloatArray] = {start: np.eye(4)}
    waiting = [start]
    while waiting:
        frame = waiting.pop()
        for neighbour, T in links[frame].items():
            if neighbour not in found:
                found[neighbour] = found[frame] @ T
                waiting.append(neighbour)
    return found


def _message(reader: Any, topic: _Topic, time_s: float) -> Any:
    at_ns = topic.recorded_ns[int(np.abs(topic.times_s - time_s).argmin())]
    for connection, _, raw in reader.messages([topic.connection], start=at_ns, stop=at_ns + 1):
        if stamp_s(raw, reader.is2) == time_s:
            return reader.deserialize(raw, connection.msgtype)
    raise InputError(f"The bag has lost an image of {topic.name}; try to record again")


def _node(
    color: _Topic,
    depth: _Topic,
    color_message: Any,
    depth_message: Any,
    depth_scale: float | None,
    T_world_color: FloatArray | None,
    transforms: dict[str, dict[str, FloatArray]],
) -> NodeImages:
    assert color.camera is not None
    values = depth_values_of(depth_message, depth.name)
    if not known_in(values).any():
        raise InputError(f"A depth image of {depth.name} is empty; try another recording of the scene")
    scale = usual_scale(values) if depth_scale is None else depth_scale
    read = depth_of(f"of {depth.name}", values, scale, depth_scale is not None)
    depth_camera = T_color_depth = None
    if depth.frame != color.frame:
        T_color_depth = transforms.get(color.frame, {}).get(depth.frame)
        depth_camera = depth.camera
        if depth_camera is None or T_color_depth is None:
            raise InputError(
                f"{depth.name} is not registered to {color.name} ({depth.frame}, {color.frame}), and its "
                "camera_info or a static transform between both is missing; try to record them, too"
            )
    rgb = color_of(color_message, color.name)
    images = color.name, depth.name, rgb, read.depth, color.camera
    return NodeImages(*images, T_world_color, depth_camera, T_color_depth, read.notes)

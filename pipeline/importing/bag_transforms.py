"""Transforms between the frames of a bag, and between the streams of the RealSense SDK.

The SDK's topics are those of librealsense's ``src/media/ros/ros_file_format.h``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.importing.bag_cameras import sdk_stream
from pipeline.importing.bag_links import Links
from pipeline.importing.bag_messages import transform_in
from pipeline.importing.bag_reader import BagReader
from pipeline.kernels.geometry import inverse
from pipeline.types import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class PosesOverTime:
    """Poses of a frame in the world."""

    T_world_frame: FloatArray
    """(N, 4, 4), metres."""
    known: BoolArray
    """(N,) whether each is known."""
    source: str
    """Description of the messages that they are from, for a note."""


@dataclass(frozen=True, slots=True)
class Transforms:
    """Transforms between frames."""

    links: Links
    """All of them, over time."""
    constant: Mapping[str, Mapping[str, FloatArray]]
    """(4, 4) T_a_b, metres, by the frames a and b that constant transforms link."""
    parents: Mapping[str, str]
    """Parent of each frame in a constant transform."""
    streams: Mapping[str, FloatArray]
    """(4, 4) T_stream_reference, metres, by streams of the RealSense SDK."""

    def between(self, frame: str, other: str) -> FloatArray | None:
        """Return the (4, 4) T_frame_other, metres; None if no constant transforms link the two."""
        return np.eye(4) if frame == other else self.constant.get(frame, {}).get(other)

    def poses(self, frames: Sequence[str]) -> list[FloatArray | None]:
        """Return the (4, 4) T_world_frame, metres, of each frame; None if no constant transforms link it.

        The world is the topmost ancestor of the first frame.
        """
        root = _root(frames[0], self.parents)
        return [self.constant.get(root, {}).get(frame) for frame in frames]

    def over_time(self, frame: str, times_s: FloatArray, in_bag: bool) -> PosesOverTime | None:
        """Return a frame's poses in the world; None if nothing moves it.

        The world is the frame's topmost ancestor, or else the parent frame of the odometry.

        Args:
            frame: name of the frame.
            times_s: (N,) times, seconds.
            in_bag: whether these are times in the bag, rather than those in headers.
        """
        chain = list(self.links.chain(frame))
        if any(not link.is_constant for link in chain):
            T: FloatArray = np.tile(np.eye(4), (len(times_s), 1, 1))
            known = np.ones(len(times_s), bool)
            for link in chain:
                T_link, known_link = link.at(times_s, in_bag)
                T, known = T_link @ T, known & known_link
            return PosesOverTime(T, known, f"the transforms from {chain[-1].parent} to {frame}")
        for topic, link in sorted(self.links.odometry.items()):
            T_child_frame = self.between(link.child, frame)
            if T_child_frame is not None and len(link.samples) and not link.is_constant:
                T, known = link.at(times_s, in_bag)
                return PosesOverTime(T @ T_child_frame, known, f"the odometry {topic}")
        return None

    def between_streams(self, color: str, depth: str) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the (4, 4) T_color_depth, metres, of two image topics of the RealSense SDK.

        If the bag does not have it, the identity is assumed, with a note.
        """
        streams = [sdk_stream(color), sdk_stream(depth)]
        missing = [stream for stream in streams if stream not in self.streams]
        if missing:
            topics = " and ".join(f"{stream}/tf/0" for stream in missing)
            return np.eye(4), (
                f"the bag has no {topics}: depth is taken to be seen from the colour camera's place, so that "
                "it may be shifted against the colour",
            )
        T_color_reference, T_depth_reference = (self.streams[str(stream)] for stream in streams)
        return T_color_reference @ inverse(T_depth_reference), ()


def transforms_of(reader: BagReader, links: Links) -> Transforms:
    """Return the transforms of a bag, from its links and what the RealSense SDK recorded."""
    fixed = [link for link in links.of_frames.values() if link.is_constant]
    neighbours: dict[str, dict[str, FloatArray]] = {}
    for link in fixed:
        neighbours.setdefault(link.parent, {})[link.child] = link.last
        neighbours.setdefault(link.child, {})[link.parent] = inverse(link.last)
    streams = {}
    for connection in reader.connections:
        stream, _, end = connection.topic.rpartition("/tf/")
        if stream.startswith("/device_") and end.isdigit():
            for message in _messages(reader, [connection]):
                streams[stream] = transform_in(message)
    constant = {start: _reached(start, neighbours) for start in neighbours}
    return Transforms(links, constant, {link.child: link.parent for link in fixed}, streams)


def sdk_units_per_metre(reader: BagReader, topic: str) -> float | None:
    """Return the depth units per metre that the RealSense SDK recorded for a depth topic, else None."""
    stream = sdk_stream(topic)
    name = f"{stream.rpartition('/')[0]}/option/Depth_Units/value" if stream else ""
    for message in _messages(reader, [own for own in reader.connections if own.topic == name]):
        if np.isfinite(message.data) and message.data > 0:
            return float(f"{1.0 / message.data:.6g}")  # 0.001 m is recorded as 0.0010000000475
    return None


def _messages(reader: BagReader, connections: list[Any]) -> list[Any]:
    if not connections:
        return []
    return [reader.deserialize(raw, own.msgtype) for own, _, raw in reader.messages(connections)]


def _root(frame: str, parents: Mapping[str, str]) -> str:
    """Return a frame's topmost ancestor, which by ROS's convention (REP 103) has z up."""
    above = [frame]
    while above[-1] in parents and parents[above[-1]] not in above:
        above.append(parents[above[-1]])
    return above[-1]


def _reached(start: str, neighbours: Mapping[str, Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    found: dict[str, FloatArray] = {start: np.eye(4)}
    waiting = [start]
    while waiting:
        frame = waiting.pop()
        for neighbour, T in neighbours[frame].items():
            if neighbour not in found:
                found[neighbour] = found[frame] @ T
                waiting.append(neighbour)
    return found

"""Static transforms of a bag, and what the RealSense SDK records in place of them.

The SDK's topics are those of librealsense's ``src/media/ros/ros_file_format.h``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.importing.bag_cameras import sdk_stream
from pipeline.importing.bag_messages import transform_in
from pipeline.kernels.geometry import inverse
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class Transforms:
    """Static transforms between frames."""

    by_frame: Mapping[str, Mapping[str, FloatArray]]
    """(4, 4) T_a_b, metres, by the frames a and b that are linked."""
    parents: Mapping[str, str]
    streams: Mapping[str, FloatArray]
    """(4, 4) T_stream_reference, metres, by streams of the RealSense SDK."""

    def between(self, frame: str, other: str) -> FloatArray | None:
        """Return the (4, 4) T_frame_other, metres; None if nothing links the two."""
        return self.by_frame.get(frame, {}).get(other)

    def poses(self, frames: Sequence[str]) -> list[FloatArray | None]:
        """Return the (4, 4) T_world_frame of frames; the world is the topmost ancestor of the first."""
        root = _root(frames[0], self.parents)
        return [self.between(root, frame) for frame in frames]

    def between_streams(self, color: str, depth: str) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the (4, 4) T_color_depth of two image topics of the RealSense SDK, and a note if assumed."""
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


def static_transforms(reader: Any) -> Transforms:
    """Read all static transforms of a bag."""
    parents: dict[str, str] = {}
    links: dict[str, dict[str, FloatArray]] = {}
    for message in _messages(reader, [own for own in _connections(reader) if _is_static(own.topic)]):
        for link in message.transforms:
            parent, child = link.header.frame_id.lstrip("/"), link.child_frame_id.lstrip("/")
            T_parent_child, parents[child] = transform_in(link.transform), parent
            links.setdefault(parent, {})[child] = T_parent_child
            links.setdefault(child, {})[parent] = inverse(T_parent_child)
    streams = {}
    for connection in _connections(reader):
        stream, _, end = connection.topic.rpartition("/tf/")
        if stream.startswith("/device_") and end.isdigit():
            for message in _messages(reader, [connection]):
                streams[stream] = transform_in(message)
    return Transforms({start: _reached(start, links) for start in links}, parents, streams)


def sdk_units_per_metre(reader: Any, topic: str) -> float | None:
    """Return the depth units per metre that the RealSense SDK recorded for a depth topic, else None."""
    stream = sdk_stream(topic)
    name = f"{stream.rpartition('/')[0]}/option/Depth_Units/value" if stream else ""
    for message in _messages(reader, [own for own in _connections(reader) if own.topic == name]):
        if np.isfinite(message.data) and message.data > 0:
            return float(f"{1.0 / message.data:.6g}")  # 0.001 m is recorded as 0.0010000000475
    return None


def _connections(reader: Any) -> Sequence[Any]:
    return list(reader.connections)


def _messages(reader: Any, connections: list[Any]) -> list[Any]:
    if not connections:
        return []
    return [reader.deserialize(raw, own.msgtype) for own, _, raw in reader.messages(connections)]


def _is_static(topic: str) -> bool:
    return topic.lstrip("/") == "tf_static"


def _root(frame: str, parents: Mapping[str, str]) -> str:
    """Return a frame's topmost ancestor, which by ROS's convention (REP 103) has z up."""
    above = [frame]
    while above[-1] in parents and parents[above[-1]] not in above:
        above.append(parents[above[-1]])
    return above[-1]


def _reached(start: str, links: Mapping[str, Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    found: dict[str, FloatArray] = {start: np.eye(4)}
    waiting = [start]
    while waiting:
        frame = waiting.pop()
        for neighbour, T in links[frame].items():
            if neighbour not in found:
                found[neighbour] = found[frame] @ T
                waiting.append(neighbour)
    return found

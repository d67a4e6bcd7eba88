"""Transforms of a bag between two frames, over time: /tf, /tf_static, odometry."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from pipeline.types import BoolArray, FloatArray

TRANSFORMS, ODOMETRY = "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Odometry"
LONGEST_GAP_S, BEYOND_S = 1.0, 0.05
"""Longest time between two samples that are interpolated, and longest time before the first and after the
last sample at which this sample is still used."""
_SAME = 1e-6
"""Largest difference between the samples of a constant transform, metres or quaternion units."""
_COLUMNS = 9


@dataclass(frozen=True)
class TransformLink:
    """Transforms from one frame to another, over time."""

    parent: str
    child: str
    is_static: bool
    """Whether it was in the topic tf_static."""
    samples: array[float] = field(default_factory=lambda: array("d"), compare=False)
    """Nine numbers a sample: time in the header and in the bag, s, position, m, quaternion (x, y, z, w)."""

    @property
    def table(self) -> FloatArray:
        """(N, 9) samples."""
        return np.frombuffer(self.samples, np.float64).reshape(-1, _COLUMNS)

    @property
    def is_constant(self) -> bool:
        """Whether it is static or all its samples are equal."""
        table = self.table
        return self.is_static or bool((np.ptp(table[:, 2:], axis=0) <= _SAME).all())

    @property
    def last(self) -> FloatArray:
        """(4, 4) T_parent_child of the last sample, metres."""
        return _matrices(self.table[-1:])[0]

    def at(self, times_s: FloatArray, in_bag: bool) -> tuple[FloatArray, BoolArray]:
        """Return (N, 4, 4) T_parent_child at times, and (N,) whether it is known there.

        Args:
            times_s: (N,) times, seconds.
            in_bag: whether these are times in the bag, rather than those in headers.
        """
        if self.is_constant:
            return np.tile(self.last, (len(times_s), 1, 1)), np.ones(len(times_s), bool)
        own_s, first = np.unique(self.table[:, 1 if in_bag else 0], return_index=True)
        table = self.table[first]
        if len(own_s) == 1:
            return np.tile(self.last, (len(times_s), 1, 1)), np.zeros(len(times_s), bool)
        after = np.searchsorted(own_s, times_s).clip(1, len(own_s) - 1)
        inside = (times_s >= own_s[0] - BEYOND_S) & (times_s <= own_s[-1] + BEYOND_S)
        clipped_s = times_s.clip(own_s[0], own_s[-1])
        gaps_s = own_s[after] - own_s[after - 1]
        at_sample = (clipped_s == own_s[after - 1]) | (clipped_s == own_s[after])
        known = inside & (at_sample | (gaps_s <= LONGEST_GAP_S))
        share = ((clipped_s - own_s[after - 1]) / gaps_s)[:, None]
        T = np.tile(np.eye(4), (len(times_s), 1, 1))
        T[:, :3, 3] = (1.0 - share) * table[after - 1, 2:5] + share * table[after, 2:5]
        T[:, :3, :3] = Slerp(own_s, Rotation.from_quat(table[:, 5:]))(clipped_s).as_matrix()
        return T, known


class Links:
    """Links of a bag, in the order in which they were found."""

    def __init__(self) -> None:
        self.of_frames: dict[tuple[str, str], TransformLink] = {}
        """Links by parent and child."""
        self.parents: dict[str, str] = {}
        """The last parent of each frame."""
        self.odometry: dict[str, TransformLink] = {}
        """Links from odometry by topic."""

    def add(self, message: Any, msgtype: str, topic: str, at_ns: int) -> None:
        """Add the transforms of a message that came into the bag at ``at_ns``; invalid ones are left out."""
        if msgtype == ODOMETRY:
            parent, child = message.header.frame_id.lstrip("/"), message.child_frame_id.lstrip("/")
            if child:
                link = self.odometry.setdefault(topic, TransformLink(parent, child, False))
                pose = message.pose.pose
                link.samples.extend(_sample(message.header.stamp, at_ns, pose.position, pose.orientation))
            return
        is_static = topic.strip("/") == "tf_static"
        for own in message.transforms:
            parent, child = own.header.frame_id.lstrip("/"), own.child_frame_id.lstrip("/")
            values = _sample(own.header.stamp, at_ns, own.transform.translation, own.transform.rotation)
            if values and parent != child:
                link = self.of_frames.setdefault((parent, child), TransformLink(parent, child, is_static))
                link.samples.extend(values)
                self.parents[child] = parent

    def chain(self, frame: str) -> Iterator[TransformLink]:
        """Yield the links from a frame up to its topmost ancestor."""
        above = [frame]
        while above[-1] in self.parents and self.parents[above[-1]] not in above:
            parent = self.parents[above[-1]]
            yield self.of_frames[parent, above[-1]]
            above.append(parent)


def _sample(stamp: Any, at_ns: int, position: Any, rotation: Any) -> tuple[float, ...]:
    """Return the nine numbers of a sample; empty if one is not finite or the quaternion is near 0."""
    values = (position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w)
    if not np.isfinite(values).all() or np.linalg.norm(values[3:]) < 0.5:
        return ()
    return (stamp.sec + 1e-9 * stamp.nanosec, 1e-9 * at_ns, *values)


def _matrices(table: FloatArray) -> FloatArray:
    """Return (N, 4, 4) transforms of (N, 9) samples."""
    T = np.tile(np.eye(4), (len(table), 1, 1))
    T[:, :3, 3], T[:, :3, :3] = table[:, 2:5], Rotation.from_quat(table[:, 5:]).as_matrix()
    return T

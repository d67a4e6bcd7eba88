"""Image topics of a bag with their cameras and times, pairs of colour and depth topics, and transforms."""

from __future__ import annotations

from array import array
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, spaced
from pipeline.importing.bag_cameras import FoundCamera, camera_of_topic, common_parts, sdk_stream
from pipeline.importing.bag_links import ODOMETRY, TRANSFORMS, Links
from pipeline.importing.bag_messages import is_brightness, is_depth, size_of
from pipeline.importing.bag_reader import BagReader
from pipeline.importing.bag_transforms import Transforms, transforms_of
from pipeline.io.same_view import alike
from pipeline.kernels.geometry import scaled_to
from pipeline.types import MAX_NODES, CameraIntrinsics, FloatArray, IntArray

_RESIZED_WITHIN_PX = 1.0
"""Tolerance for the matrix of a resized camera: drivers differ in where the first pixel's centre is."""
_IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")


@dataclass(frozen=True, slots=True)
class Topic:
    """An image topic with its camera and the times of its images."""

    name: str
    frame: str
    found: FoundCamera
    stamps_s: FloatArray
    """(N,) time of each image, from its header."""
    recorded_ns: IntArray
    """(N,) time at which each image came into the bag, which locates it there."""

    @property
    def camera(self) -> CameraIntrinsics:
        """The camera; the topic must have one."""
        assert self.found.camera is not None
        return self.found.camera


@dataclass(frozen=True, slots=True)
class Scanned:
    """Image topics and transforms of a bag."""

    colors: list[Topic]
    """Colour topics, sorted by name."""
    depths: list[Topic]
    """Depth topics, sorted by name."""
    transforms: Transforms
    notes: list[str]
    """A sentence on each image topic that is left out because it has brightness."""


@dataclass(slots=True)
class _Seen:
    """First message and message times of one image topic."""

    first: Any
    stamps_s: array[float] = field(default_factory=lambda: array("d"))
    recorded_ns: array[int] = field(default_factory=lambda: array("q"))


def iterate_scan(reader: BagReader) -> Generator[Progress, None, Scanned]:
    """Read the times and cameras of all images of a bag, and its transforms; one image a topic is kept."""
    wanted = [own for own in reader.connections if own.msgtype in (*_IMAGES, TRANSFORMS, ODOMETRY)]
    images: dict[str, _Seen] = {}
    links = Links()
    total = max(1, sum(own.msgcount for own in wanted))
    every = spaced(total, 20)
    for number, (own, at_ns, raw) in enumerate(reader.messages(wanted) if wanted else ()):
        if number % every == 0:
            yield Progress(f"message {number} of {total}", min(1.0, number / total))
        if own.msgtype in _IMAGES:
            if own.topic not in images:
                images[own.topic] = _Seen(reader.deserialize(raw, own.msgtype))
            images[own.topic].stamps_s.append(reader.stamp_s(raw))
            images[own.topic].recorded_ns.append(at_ns)
        else:
            links.add(reader.deserialize(raw, own.msgtype), own.msgtype, own.topic, at_ns)
    found: tuple[list[Topic], list[Topic]] = ([], [])
    notes = []
    for name, seen in sorted(images.items()):
        if is_brightness(seen.first, name):
            notes.append(f"{name} is left out: by its name, its 16 bits are brightness and not depth")
        else:
            found[is_depth(seen.first, name)].append(_topic(reader, name, seen))
    return Scanned(*found, transforms_of(reader, links), notes)


def _topic(reader: BagReader, name: str, seen: _Seen) -> Topic:
    frame = seen.first.header.frame_id.lstrip("/")
    camera = camera_of_topic(reader, name, frame, size_of(seen.first, name))
    return Topic(name, frame, camera, np.array(seen.stamps_s), np.array(seen.recorded_ns, np.int64))


def pairs_of(
    path: Path, reader: BagReader, colors: list[Topic], depths: list[Topic]
) -> tuple[list[tuple[Topic, Topic]], list[str]]:
    """Pair each depth topic with the colour topic of its frame, or else of the most similar name.

    Every colour topic is used at most once. Also returns a sentence for each topic that is left out.

    Raises:
        InputError: there is no colour, no depth, or no camera of the colour images.
    """
    for topics, what in ((colors, "colour"), (depths, "depth")):
        if not topics:
            known = [topic.name for topic in [*colors, *depths]]
            others = sorted({f"{own.topic} ({own.msgtype})" for own in reader.connections})[:8]
            has = (
                f"but {', '.join(known)}"
                if known
                else f"and no images at all but {', '.join(others) or 'nothing'}"
            )
            raise InputError(f"The bag {path} has no {what} images {has}; try to record both")
    usable = [color for color in colors if color.found.camera is not None]
    if not usable:
        why = colors[0].found.why_not
        raise InputError(f"The colour images of the bag {path} have no camera that can be used: {why}")
    best: dict[str, tuple[tuple[bool, bool, int], Topic, Topic]] = {}
    for depth in depths:
        score, color = max(((_fit(color, depth), color) for color in usable), key=lambda pair: pair[0])
        if color.name not in best or score > best[color.name][0]:
            best[color.name] = score, color, depth
    pairs = [best[name][1:] for name in sorted(best)]
    used = {depth.name for _, depth in pairs}
    notes = [
        f"{color.name} is left out: {color.found.why_not}" for color in colors if color.found.camera is None
    ]
    notes += [f"{own.name} is left out: no depth belongs to it" for own in usable if own.name not in best]
    notes += [
        f"{own.name} is left out: no colour topic belongs to it alone"
        for own in depths
        if own.name not in used
    ]
    notes += [
        f"{color.name} is left out: a rig has at most {MAX_NODES} nodes" for color, _ in pairs[MAX_NODES:]
    ]
    return pairs[:MAX_NODES], notes


def largest_of_each_camera(
    pairs: list[tuple[Topic, Topic]],
) -> tuple[list[tuple[Topic, Topic]], list[str]]:
    """Return the pairs without those whose camera another pair has in more pixels, and notes on these."""
    largest = sorted(pairs, key=lambda pair: -pair[0].camera.width_px)
    kept: list[tuple[Topic, Topic]] = []
    notes = []
    for pair in largest:
        own = next((one for one, _ in kept if _is_resized(pair[0], one)), None)
        if own is None:
            kept.append(pair)
        else:
            notes.append(f"{pair[0].name} is left out: it shows the same as {own.name} in fewer pixels")
    return [pair for pair in pairs if pair in kept], notes


def _is_resized(small: Topic, large: Topic) -> bool:
    """Return whether two topics have the same frame and the same camera, in different sizes."""
    if small.frame != large.frame or small.camera.width_px == large.camera.width_px:
        return False
    resized = scaled_to(large.camera, small.camera.width_px, small.camera.height_px)
    return resized is not None and alike(resized, small.camera, within_px=_RESIZED_WITHIN_PX)


def message_of(reader: BagReader, name: str, recorded_ns: IntArray, index: int) -> Any:
    """Return the message of an image topic by its index in the order of recording.

    Raises:
        InputError: the bag does not have it.
    """
    at_ns = int(recorded_ns[index])
    before = int((recorded_ns[:index] == at_ns).sum())
    for connection, _, raw in reader.messages(connections_of(reader, name), at_ns, at_ns + 1):
        if not before:
            return reader.deserialize(raw, connection.msgtype)
        before -= 1
    raise InputError(f"The bag has lost an image of {name}; try to record again")


def connections_of(reader: BagReader, name: str) -> Sequence[Any]:
    """Return the connections of an image topic."""
    return [own for own in reader.connections if own.topic == name and own.msgtype in _IMAGES]


def _fit(color: Topic, depth: Topic) -> tuple[bool, bool, int]:
    """Return how well a depth topic fits to a colour topic, larger being better.

    All images of the RealSense SDK have one frame; there, a colour stream fits better than an infrared one.
    """
    stream = sdk_stream(color.name)
    same_frame = color.frame == depth.frame and stream is None
    return same_frame, stream is not None and "/Color_" in stream, common_parts(color.name, depth.name)

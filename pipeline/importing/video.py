"""Tracks of video files: encoded packets of Matroska by their number, and decoded frames of a film."""

from __future__ import annotations

from bisect import bisect_right
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import ByteArray, FloatArray

_FORMATS = {".mkv": "matroska", ".mp4": "mov"}
"""FFmpeg's names of the formats that are read; others may refer to further files and addresses."""
KEPT = 4
"""Number of images of a file that are kept after they were read."""
NEAR = 60
"""An image at most this many images ahead is reached by reading on, not by a jump."""


@dataclass(frozen=True, slots=True)
class Track:
    """A video track and the times of its images."""

    index: int
    """Number of its stream in the file."""
    title: str
    """Name of the track; empty without one."""
    codec: str
    """FFmpeg's name of the codec, such as mjpeg or rawvideo; empty if it knows none."""
    tag: str
    """Four characters of the codec; empty without any."""
    width_px: int
    height_px: int
    time_base_s: float
    """Seconds in a unit of ``stamps``."""
    stamps: tuple[int, ...]
    """Times of the images, in units of ``time_base_s``, ascending."""
    jumps: tuple[int, ...]
    """Those of the images from which decoding can begin, ascending."""

    @property
    def times_s(self) -> FloatArray:
        """(N,) times of the images, seconds."""
        return self.time_base_s * np.array(self.stamps, np.float64)


@dataclass(frozen=True, slots=True)
class Contents:
    """Tracks and attachments of a video file."""

    tracks: tuple[Track, ...]
    attachments: dict[str, bytes]
    """Attached files by name."""
    duration_s: float
    """Duration that the file states; 0 if it states none."""


def contents_of(file: Path) -> Contents:
    """Read the times of all images of a video file, in one pass, and its attachments.

    Raises:
        InputError: it is no video file or is damaged, or PyAV is missing.
    """
    with _opened(file) as container:
        streams = list(container.streams.video)
        stamps: dict[int, list[int]] = {stream.index: [] for stream in streams}
        jumps: dict[int, list[int]] = {stream.index: [] for stream in streams}
        for packet in container.demux(streams):
            if packet.pts is not None and packet.size and not packet.is_discard:
                stamps[packet.stream_index].append(packet.pts)
                if packet.is_keyframe:
                    jumps[packet.stream_index].append(packet.pts)
        tracks = tuple(_track(stream, stamps[stream.index], jumps[stream.index]) for stream in streams)
        attached = {stream.name: bytes(stream.data) for stream in container.streams.attachments}
        duration_s = 1e-6 * (container.duration or 0)
    return Contents(tracks, attached, duration_s)


def _track(stream: Any, stamps: list[int], jumps: list[int]) -> Track:
    codec = stream.codec_context  # None if FFmpeg does not know the codec
    return Track(
        stream.index,
        stream.metadata.get("title", ""),
        codec.name if codec else "",
        codec.codec_tag.strip("\0") if codec else "",
        codec.width if codec else 0,
        codec.height if codec else 0,
        float(stream.time_base),
        tuple(sorted(set(stamps))),
        tuple(sorted(jumps or stamps[:1])),
    )


class TrackReader:
    """Reads the images of some tracks in any order; reading on from the last one is fast.

    Several threads may read. At most ``KEPT`` images of a track stay in memory.
    """

    def __init__(self, file: Path, tracks: tuple[Track, ...], decoded: bool) -> None:
        """Store the file and the tracks; the file is opened when the first image is read.

        Args:
            file: the video file.
            tracks: the tracks to read.
            decoded: whether to decode the images; otherwise their packets are returned.
        """
        self._file, self._decoded = file, decoded
        self._tracks = {track.index: track for track in tracks}
        self._kept: dict[int, OrderedDict[int, Any]] = {track.index: OrderedDict() for track in tracks}
        self._images: Iterator[tuple[int, int, Any]] = iter(())
        self._passed: dict[int, int] = {}
        """Number of the last image of each track that was read since the last jump."""
        self._lock = Lock()

    def packet(self, track: Track, number: int) -> bytes:
        """Return the bytes of an image as they are stored.

        Raises:
            InputError: the file ends before it, or is damaged.
        """
        return bytes(self._image(track, number))

    def frame(self, track: Track, number: int) -> ByteArray:
        """Return (H, W, 3) RGB of an image as it is stored; a rotation for display is not applied.

        Raises:
            InputError: the file ends before it, or is damaged.
        """
        found: ByteArray = self._image(track, number).to_ndarray(format="rgb24")
        return found

    def _image(self, track: Track, number: int) -> Any:
        stamp = track.stamps[number]
        with self._lock:
            if stamp in self._kept[track.index]:
                return self._kept[track.index][stamp]
            passed = self._passed.get(track.index)
            starts = [0, track.jumps[max(0, bisect_right(track.jumps, stamp) - 1)]]
            if passed is not None and passed < number <= passed + NEAR:
                found = self._read_to(track, stamp)
            else:
                found = None
            while found is None and starts:
                self._images, self._passed = self._from(track, starts.pop()), {}
                found = self._read_to(track, stamp)
            if found is None:
                raise InputError(
                    f"Image {number} of {self._file} is truncated or damaged; try to copy the file again"
                )
            return found

    def _read_to(self, track: Track, stamp: int) -> Any:
        """Read on until the image with a time; returns it, or None if the track does not have it."""
        for index, at, image in self._images:
            kept = self._kept[index]
            kept[at] = image
            if len(kept) > KEPT:
                kept.popitem(last=False)
            self._passed[index] = bisect_right(self._tracks[index].stamps, at) - 1
            if index == track.index and at >= stamp:
                return image if at == stamp else None
        return None

    def _from(self, track: Track, start: int) -> Iterator[tuple[int, int, Any]]:
        """Yield track, time and image, from the last place before ``start`` where decoding can begin."""
        with _opened(self._file) as container:
            streams = [container.streams[index] for index in self._tracks]
            container.seek(start, stream=container.streams[track.index])
            for packet in container.demux(streams):
                for image in packet.decode() if self._decoded else (packet,):
                    if image.pts is not None:
                        yield packet.stream_index, image.pts, image


@contextmanager
def _opened(file: Path) -> Iterator[Any]:
    try:
        import av
    except ImportError:
        raise InputError(f"Reading {file} needs PyAV; try pip install 'packetmesh[video]'") from None
    try:
        with av.open(str(file.resolve()), format=_FORMATS[file.suffix.lower()]) as container:
            yield container
    except (av.FFmpegError, OSError) as error:
        raise InputError(
            f"{file} cannot be read as a video file ({error.strerror}); try to copy it again"
        ) from None

"""Images of one topic of a bag, each read when it is requested."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.bag_reader import BagReader, enter_bag, readable
from pipeline.importing.bag_topics import connections_of
from pipeline.types import IntArray

_SKIPPED = 16
"""Most messages that are skipped by reading on; farther messages are looked up by their time."""


class BagStream:
    """Messages of an image topic by their index; reading on is fast. Threads may share it."""

    def __init__(self, path: Path, topic: str, recorded_ns: IntArray) -> None:
        """Store the times of the messages; the bag is opened when the first one is read.

        Args:
            path: the bag.
            topic: name of the image topic.
            recorded_ns: (N,) times at which its messages came into the bag, ns.
        """
        self.topic = topic
        self._path, self._recorded_ns = path, recorded_ns
        self._stack, self._lock = ExitStack(), threading.Lock()
        weakref.finalize(self, self._stack.close)
        self._reader: BagReader | None = None
        self._ahead: Iterator[tuple[int, tuple[Any, int, Any]]] = iter(())
        """The messages that are read next, with their indices."""
        self._next = -1
        """Index of the first of these; -1 if there are none."""

    def message(self, index: int) -> Any:
        """Read a message by its index.

        Raises:
            InputError: the bag cannot be opened, or is damaged there.
        """
        with self._lock, readable(self._path):
            if not 0 <= self._next <= index <= self._next + _SKIPPED:
                self._look_up(index)
            self._next = -1  # until a message was read
            for at, (connection, _, raw) in self._ahead:
                if at >= index:
                    assert self._reader is not None
                    message = self._reader.deserialize(raw, connection.msgtype)
                    self._next = index + 1
                    return message
        raise InputError(f"The bag {self._path} has lost an image of {self.topic}; try to record again")

    def _look_up(self, index: int) -> None:
        """Start reading at the time of a message."""
        if self._reader is None:
            self._reader = enter_bag(self._path, self._stack)
        begin_ns = int(self._recorded_ns[index])
        following = np.flatnonzero(self._recorded_ns >= begin_ns).tolist()
        messages = self._reader.messages(connections_of(self._reader, self.topic), begin_ns)
        self._ahead = zip(following, messages, strict=False)

"""Readers of bags of ROS and of Foxglove: their connections, and their messages in order of time."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol

from packetmesh.errors import InputError
from pipeline.importing.bag_messages import stamp_s
from pipeline.importing.stored import is_file

SUFFIXES = (".bag", ".db3", ".mcap")
_MAGIC, _PROFILE_AT = b"\x89MCAP0\r\n", 17
"""First bytes of an MCAP file, and the offset of its profile: after the header's opcode and length."""
_ROS2 = struct.pack("<I", 4) + b"ros2"


class _Lower(type(Path())):  # type: ignore[misc]
    """A path with its suffix in lower case, which rosbags expects."""

    @property
    def suffix(self) -> str:
        return str(super().suffix).lower()


class BagReader(Protocol):
    """An open bag."""

    @property
    def connections(self) -> Sequence[Any]:
        """Connections with ``topic``, ``msgtype`` as ROS 2 names it, and ``msgcount``."""
        ...

    def messages(
        self, connections: Iterable[Any] = (), start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[Any, int, Any]]:
        """Yield the connection, time in the bag in ns, and data of messages from ``start`` to before
        ``stop``."""
        ...

    def deserialize(self, raw: Any, msgtype: str) -> Any:
        """Decode the data of a message."""
        ...

    def stamp_s(self, raw: Any) -> float:
        """Return the time in the header of a message, seconds."""
        ...


class RosReader:
    """A bag of ROS 1 or ROS 2, read by rosbags."""

    def __init__(self, reader: Any) -> None:
        self._reader = reader
        self.connections: Sequence[Any] = reader.connections
        self.messages = reader.messages
        self.deserialize = reader.deserialize

    def stamp_s(self, raw: bytes) -> float:
        return stamp_s(raw, self._reader.is2)


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag's file or the folder of a ROS 2 bag."""
    return is_file(path, SUFFIXES) or (path / "metadata.yaml").is_file()


@contextmanager
def opened_bag(path: Path) -> Iterator[BagReader]:
    """Open a bag.

    Raises:
        InputError: it cannot be read, which includes each error of a parser while the bag is open.
    """
    with readable(path), ExitStack() as stack:
        yield enter_bag(path, stack)


def enter_bag(path: Path, stack: ExitStack) -> BagReader:
    """Open a bag that ``stack`` closes; a damaged one raises an error of any kind."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    if is_file(path, (".mcap",)) and _is_of_another_profile(path):
        from pipeline.importing.mcap_reader import McapReader

        return stack.enter_context(McapReader(path))
    reader = AnyReader([_Lower(path)], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
    return RosReader(stack.enter_context(reader))


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Turn every error of a parser into an ``InputError`` that names the bag."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # a parser fails on damaged data in more ways than can be listed
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        tool = "mcap recover" if path.suffix.lower() == ".mcap" else "rosbag reindex or ros2 bag reindex"
        raise InputError(f"The bag {path} cannot be read ({why}); try to copy it again, or {tool}") from None


def _is_of_another_profile(path: Path) -> bool:
    """Return whether a file is MCAP, but not with the profile of ROS 2."""
    with path.open("rb") as file:
        head = file.read(_PROFILE_AT + len(_ROS2))
    return head.startswith(_MAGIC) and head[_PROFILE_AT:] != _ROS2

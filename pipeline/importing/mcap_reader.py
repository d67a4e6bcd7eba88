"""MCAP files of any profile: messages in protocol buffers, JSON, and the two encodings of ROS."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from mcap.reader import SeekingReader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pipeline.importing.bag_messages import stamp_s
from pipeline.importing.foxglove import SCHEMAS, from_json

RECORD_LIMIT_BYTES = 1 << 30
"""Largest record that is read; a larger one is damaged, or holds no image."""
Decoder = Callable[[bytes], Any]


@dataclass(frozen=True, slots=True)
class Connection:
    """A topic with messages of one schema."""

    topic: str
    msgtype: str
    """Type of the messages as ROS 2 names it; the schema's name if ROS has none."""
    msgcount: int
    channels: tuple[int, ...]
    """Numbers of its channels."""


@dataclass(frozen=True, slots=True)
class Raw:
    """Data of a message, with what is needed to decode it."""

    data: bytes
    encoding: str
    decode: Decoder


class McapReader:
    """An MCAP file; implements ``bag_reader.BagReader``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.connections: list[Connection] = []

    def __enter__(self) -> McapReader:
        self._file = self._path.open("rb")
        self._decoders: dict[int, Decoder] = {}
        self._protobuf = DecoderFactory()
        try:
            self._reader = SeekingReader(self._file, record_size_limit=RECORD_LIMIT_BYTES)
            summary = self._reader.get_summary()
            self._indexed = summary is not None and len(summary.chunk_indexes) > 0
            if summary is not None and summary.statistics is not None and summary.channels:
                counts = dict(summary.statistics.channel_message_counts)
                self._schemas, self._channels = summary.schemas, summary.channels
            else:
                counts = self._scan()
        except BaseException:
            self._file.close()
            raise
        self.connections = self._connections(counts)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def messages(
        self, connections: Iterable[Connection] = (), start: int | None = None, stop: int | None = None
    ) -> Iterator[tuple[Connection, int, Raw]]:
        """Yield messages in order of time; in that of the file if it has no index."""
        by_channel = {channel: own for own in connections or self.connections for channel in own.channels}
        topics = {own.topic for own in by_channel.values()}
        found = self._reader.iter_messages(
            topics, log_time_order=self._indexed, starting_at=start, ending_before=stop
        )
        for _, channel, message in found:
            if channel.id in by_channel:
                raw = Raw(message.data, channel.message_encoding, self._decoder(channel))
                yield by_channel[channel.id], message.log_time, raw

    def deserialize(self, raw: Raw, msgtype: str) -> Any:
        """Decode the data of a message."""
        return raw.decode(raw.data)

    def stamp_s(self, raw: Raw) -> float:
        """Return the time in the header of a message, seconds."""
        if raw.encoding in ("ros1", "cdr"):
            return stamp_s(raw.data, raw.encoding == "cdr")
        stamp = raw.decode(raw.data).header.stamp
        return float(stamp.sec + 1e-9 * stamp.nanosec)

    def _scan(self) -> dict[int, int]:
        """Find schemas and channels in the whole file; returns the number of messages of each channel."""
        self._schemas, self._channels = dict[int, Schema](), dict[int, Channel]()
        counts: dict[int, int] = defaultdict(int)
        self._file.seek(0)
        for record in StreamReader(self._file, record_size_limit=RECORD_LIMIT_BYTES).records:
            if isinstance(record, Schema):
                self._schemas[record.id] = record
            elif isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, Message):
                counts[record.channel_id] += 1
        return counts

    def _connections(self, counts: dict[int, int]) -> list[Connection]:
        channels: dict[tuple[str, str], list[int]] = defaultdict(list)
        for number, channel in self._channels.items():
            channels[channel.topic, self._type_of(channel)].append(number)
        return [
            Connection(topic, type_, sum(counts.get(own, 0) for own in numbers), tuple(numbers))
            for (topic, type_), numbers in channels.items()
        ]

    def _type_of(self, channel: Channel) -> str:
        schema = self._schemas.get(channel.schema_id)
        name = "" if schema is None else schema.name
        if channel.message_encoding in ("protobuf", "json"):
            return SCHEMAS[name][0] if name in SCHEMAS else name
        package, _, last = name.partition("/")
        return name if "/" in last or not last else f"{package}/msg/{last}"

    def _decoder(self, channel: Channel) -> Decoder:
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._new_decoder(channel)
        return self._decoders[channel.id]

    def _new_decoder(self, channel: Channel) -> Decoder:
        schema, encoding = self._schemas[channel.schema_id], channel.message_encoding
        if encoding in ("protobuf", "json"):
            read = from_json if encoding == "json" else self._protobuf.decoder_for(encoding, schema)
            if read is None:
                raise ValueError(f"{channel.topic} has messages in protocol buffers without their schema")
            converted = SCHEMAS[schema.name][1]
            return lambda data: converted(read(data))
        store, name = get_typestore(Stores.EMPTY), self._type_of(channel)
        store.register(get_types_from_msg(schema.data.decode(), name))
        read_ros = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
        return lambda data: read_ros(data, name)

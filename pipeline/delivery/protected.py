"""Packets with two kinds of bytes: a protected base, and a body of which any part may be lost.

The base is divided into k symbols, from which repair symbols are computed; any k of all these symbols
restore it (``erasure``). Its own symbols come first, so that a transfer that stops early includes it; the
repair symbols are spread over the stream at equal intervals, so that a burst hits few of them. Each of these
packets starts with the number of its symbol and the length of the base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipeline.types import BoolArray, ByteArray

BASE_LOSS = 0.3
"""Share of its packets that a base may lose (SPEC 6.5)."""
_LEAST_UNIT_BYTES = 64
MOST_UNIT_BYTES = 8192
"""Most bytes of a symbol with its header; a larger packet holds several."""
_LEAST_CERTAIN = 6  # with a loss of three in ten, all of these are lost once in a thousand times
_NUMBER_BYTES = 2
_LENGTH_BYTES = 3
_HEADER_BYTES = _NUMBER_BYTES + _LENGTH_BYTES
_WORD_BYTES = 2


@dataclass(frozen=True, slots=True)
class Unprotected:
    """Received part of a stream."""

    base: bytes | None
    """The complete base, if enough of its packets arrived."""
    body: ByteArray
    """(B,) bytes of the body, zero where they have not arrived; empty without the base."""
    arrived: BoolArray
    """(B,) True for bytes that have arrived."""


def protect(base: bytes, body: bytes, packet_bytes: int, repair_every: int) -> bytes:
    """Combine a base, its repair symbols and the body to a stream of whole packets, padded with zeros.

    Args:
        base: at least one byte, less than 16 MiB.
        body: bytes of any number.
        packet_bytes: bytes per packet of the network.
        repair_every: interval of repair symbols in packets; ``BASE_LOSS`` may need more of them.
    """
    from pipeline.delivery.erasure import repair_symbols

    unit = _unit_bytes(packet_bytes)
    symbol_bytes = _symbol_bytes(unit)
    source_count = -(-len(base) // symbol_bytes)
    body_count = -(-len(body) // unit)
    count = source_count + body_count
    while (free := count - int(_of_base(source_count, count, repair_every).sum())) < body_count:
        count += body_count - free
    of_base = _of_base(source_count, count, repair_every)

    source = np.frombuffer(base.ljust(source_count * symbol_bytes, b"\0"), ">u2").astype(np.uint16)
    source = source.reshape(source_count, -1)
    numbers = np.arange(np.count_nonzero(of_base))
    symbols = np.concatenate([source, repair_symbols(source, numbers[source_count:])])
    units = np.zeros((count, unit), np.uint8)
    packed = np.zeros((len(numbers), unit), np.uint8)
    packed[:, :_NUMBER_BYTES] = _big_endian(numbers, _NUMBER_BYTES)
    packed[:, _NUMBER_BYTES:_HEADER_BYTES] = _big_endian(np.full(len(numbers), len(base)), _LENGTH_BYTES)
    packed[:, _HEADER_BYTES : _HEADER_BYTES + symbol_bytes] = symbols.astype(">u2").view(np.uint8)
    units[of_base] = packed
    padded = body.ljust((count - len(numbers)) * unit, b"\0")
    units[~of_base] = np.frombuffer(padded, np.uint8).reshape(-1, unit)
    return units.tobytes()


def first_bytes(base: bytes, packet_bytes: int) -> int:
    """Return the bytes at the start of a stream of ``protect`` that suffice to recover the base."""
    unit = _unit_bytes(packet_bytes)
    return -(-len(base) // _symbol_bytes(unit)) * unit


def ends_in_stream(
    base: bytes, stream_bytes: int, packet_bytes: int, repair_every: int, body_bytes: int
) -> int:
    """Return the bytes of a stream of ``protect`` until the first bytes of its body are sent.

    Args:
        base: as in ``protect``.
        stream_bytes: bytes of the stream.
        packet_bytes: as in ``protect``.
        repair_every: as in ``protect``.
        body_bytes: number of bytes of the body, at least one.
    """
    unit = _unit_bytes(packet_bytes)
    source_count = -(-len(base) // _symbol_bytes(unit))
    of_body = np.flatnonzero(~_of_base(source_count, stream_bytes // unit, repair_every))
    return int(of_body[(body_bytes - 1) // unit] + 1) * unit


def unprotect(data: ByteArray, arrived: BoolArray, packet_bytes: int, repair_every: int) -> Unprotected:
    """Recover the base and the received part of the body from a stream of ``protect``.

    Args:
        data: (S,) all bytes of a stream, zero where they have not arrived.
        arrived: (S,) True for bytes that have arrived.
        packet_bytes: as in ``protect``.
        repair_every: as in ``protect``.
    """
    from pipeline.delivery.erasure import recover

    unit = _unit_bytes(packet_bytes)
    symbol_bytes = _symbol_bytes(unit)
    units, whole = data.reshape(-1, unit), arrived.reshape(-1, unit).all(axis=1)
    nothing = Unprotected(None, data[:0], arrived[:0])
    certain = np.flatnonzero(_certainly_of_base(len(units), repair_every) & whole)
    if certain.size == 0:
        return nothing
    base_bytes = int.from_bytes(units[certain[0], _NUMBER_BYTES:_HEADER_BYTES].tobytes(), "big")
    source_count = -(-base_bytes // symbol_bytes)
    of_base = _of_base(source_count, len(units), repair_every)
    packed = units[of_base & whole]
    numbers = packed[:, 0].astype(np.int64) << 8 | packed[:, 1]
    symbols = np.ascontiguousarray(packed[:, _HEADER_BYTES : _HEADER_BYTES + symbol_bytes])
    source = recover(source_count, numbers, symbols.view(">u2").astype(np.uint16))
    if source is None:
        return nothing
    base = source.astype(">u2").tobytes()[:base_bytes]
    body_arrived = arrived.reshape(-1, unit)[~of_base].reshape(-1)
    return Unprotected(base, units[~of_base].reshape(-1), body_arrived)


def _unit_bytes(packet_bytes: int) -> int:
    """Return the bytes of a symbol with its header: one packet if possible, else several or a part of one."""
    return min(packet_bytes * max(1, -(-_LEAST_UNIT_BYTES // packet_bytes)), MOST_UNIT_BYTES)


def _symbol_bytes(unit_bytes: int) -> int:
    return (unit_bytes - _HEADER_BYTES) // _WORD_BYTES * _WORD_BYTES


def _certainly_of_base(count: int, repair_every: int) -> BoolArray:
    """Return (count,) True for units that belong to a base of any length; its length is read from them."""
    every = min(repair_every, -(-count // _LEAST_CERTAIN))
    certain = np.zeros(count, np.bool_)
    certain[every - 1 :: every] = True
    certain[[0, -1]] = True
    return certain


def _of_base(source_count: int, count: int, repair_every: int) -> BoolArray:
    """Return (count,) True for units of a base with ``source_count`` symbols; more at the end if needed."""
    of_base = _certainly_of_base(count, repair_every)
    of_base[:source_count] = True
    lacking = _enough(source_count) - np.count_nonzero(of_base)
    if lacking > 0:
        of_base[np.flatnonzero(~of_base)[-lacking:]] = True
    return of_base


def _enough(source_count: int) -> int:
    """Return the number of symbols of which ``source_count`` nearly always arrive, even with bursts."""
    return math.ceil((source_count + 2 * math.sqrt(source_count) + 1) / (1 - BASE_LOSS))


def _big_endian(numbers: np.ndarray, byte_count: int) -> ByteArray:
    return numbers.astype(">u4").view(np.uint8).reshape(-1, 4)[:, 4 - byte_count :]

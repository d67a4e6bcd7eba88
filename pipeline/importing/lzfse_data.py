"""Data compressed with LZFSE: the unpacked size that its blocks state, and the unpacked data.

The layout of the blocks is that of https://github.com/lzfse/lzfse (``lzfse_internal.h``).
"""

from __future__ import annotations

import struct

BLOCK = b"bvx"
"""First bytes of every block."""
_END, _COPY, _SHORT, _LONG = b"bvx$", b"bvx-", b"bvxn", b"bvx2"
_HEADER_BYTES = 32
"""Smallest header of a long block."""
_MOST_BYTES = 2 << 30
"""Largest bound (``_sizes``) of data that is unpacked: twice that of Record3D's largest depth, 960 x 720."""
_MOST_OF_A_MATCH = 315 + 2359
"""Bytes that a match of a long block gives at most: literals and copied bytes."""
_MOST_OF_A_BYTE = 136
"""Bytes that a byte of a short block (LZVN) gives at most: two of them copy 271."""


def stated_size(data: bytes) -> int:
    """Return the unpacked size in bytes that the blocks state; 0 if one of them is damaged."""
    return _sizes(data)[0]


def unpack_lzfse(data: bytes) -> bytes:
    """Return the unpacked data; empty if it is damaged or may be too large.

    The decoder ignores the sizes that blocks state, so that a small file could fill the memory: data that
    could exceed ``_MOST_BYTES`` is not unpacked.
    """
    import lzfse

    if not 0 < _sizes(data)[1] <= _MOST_BYTES:
        return b""
    try:
        unpacked: bytes = lzfse.decompress(data)
    except lzfse.error:
        return b""
    return unpacked


def _sizes(data: bytes) -> tuple[int, int]:
    """Return the unpacked size that the blocks state, and a bound on the real one, bytes; 0, 0 if damaged."""
    try:
        return _added_sizes(data)
    except struct.error:
        return 0, 0


def _added_sizes(data: bytes) -> tuple[int, int]:
    at = stated_bytes = most_bytes = 0
    while (kind := data[at : at + 4]) != _END:
        (own_bytes,) = struct.unpack_from("<I", data, at + 4)
        stated_bytes += own_bytes
        if kind == _LONG:
            first, second, third = struct.unpack_from("<3Q", data, at + 8)
            header_bytes, matches = third & 0xFFFFFFFF, first >> 40 & 0xFFFFF
            if header_bytes < _HEADER_BYTES:
                raise struct.error
            most_bytes += matches * _MOST_OF_A_MATCH
            at += header_bytes + (first >> 20 & 0xFFFFF) + (second >> 40 & 0xFFFFF)
        elif kind == _SHORT:
            (packed_bytes,) = struct.unpack_from("<I", data, at + 8)
            most_bytes += packed_bytes * _MOST_OF_A_BYTE
            at += 12 + packed_bytes
        elif kind == _COPY:
            most_bytes += own_bytes
            at += 8 + own_bytes
        else:
            raise struct.error
    return stated_bytes, most_bytes

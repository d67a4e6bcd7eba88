"""LZFSE: sizes by the headers of the blocks, and small data that would fill the memory."""

import struct

import lzfse
import numpy as np
import pytest

from pipeline.importing import lzfse_data
from pipeline.importing.lzfse_data import stated_size, unpack_lzfse


def depth(height_px, width_px):
    """Depth in whole millimetres with noise, whose blocks have the most matches of a real image."""
    rng, row = np.random.default_rng(3), np.arange(height_px)[:, None]
    z_mm = np.round(2000.0 + row + rng.normal(0.0, 4.0, (height_px, width_px)))
    return (z_mm / 1000.0).astype("<f4").tobytes()


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        (b"bvx-", np.random.default_rng(1).bytes(5000)),
        (b"bvxn", b"abc" * 400),
        (b"bvx2", bytes(3_000_000)),
        (b"bvx2", depth(960, 720)),
    ],
)
def test_data_of_every_kind_of_block_is_unpacked(kind, data):
    packed = lzfse.compress(data)
    assert packed.startswith(kind)
    assert stated_size(packed) == len(data)
    assert unpack_lzfse(packed) == data


def test_data_is_not_unpacked_that_could_exceed_the_limit(monkeypatch):
    """The decoder ignores the stated size: a block may give more."""
    packed = bytearray(lzfse.compress(bytes(4_000_000)))
    struct.pack_into("<I", packed, 4, 100)
    assert len(lzfse.decompress(bytes(packed))) > stated_size(bytes(packed))
    monkeypatch.setattr(lzfse_data, "_MOST_BYTES", 1_000_000)
    assert unpack_lzfse(bytes(packed)) == b""


@pytest.mark.parametrize(
    "data", [b"", b"bvx2", b"bvx2" + bytes(60), b"bvx1" + bytes(60), lzfse.compress(depth(40, 30))[:-9]]
)
def test_damaged_blocks_state_no_size_and_do_not_stop_the_program(data):
    assert stated_size(data) == 0
    assert unpack_lzfse(data) == b""

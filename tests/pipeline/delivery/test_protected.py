"""A base survives whatever loss leaves enough of it; the body keeps what arrived."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.delivery.erasure import recover, repair_symbols
from pipeline.delivery.protected import BASE_LOSS, ends_in_stream, protect, unprotect


@given(st.integers(1, 40), st.integers(0, 40), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_any_k_symbols_give_the_source_and_fewer_do_not(source_count, repair_count, words, seed):
    rng = np.random.default_rng(seed)
    source = rng.integers(0, 1 << 16, (source_count, words)).astype(np.uint16)
    repair = repair_symbols(source, np.arange(source_count, source_count + repair_count))
    ids = rng.permutation(source_count + repair_count)
    symbols = np.concatenate([source, repair])[ids]
    np.testing.assert_array_equal(recover(source_count, ids[:source_count], symbols[:source_count]), source)
    assert recover(source_count, ids[: source_count - 1], symbols[: source_count - 1]) is None


def test_a_repair_symbol_worked_out_by_hand():
    """One source symbol: repair symbol 1 is the source divided by x^0 = 1, symbol 2 by x.

    1 / x = x^15 + x^11 + x^2 + 1, as x times that is the polynomial x^16 + x^12 + x^3 + x, which is 1.
    """
    repair = repair_symbols(np.array([[1, 2]], np.uint16), np.array([1, 2]))
    np.testing.assert_array_equal(repair, [[1, 2], [0b1000_1000_0000_0101, 1]])


def stream_of(base_bytes, body_bytes, packet_bytes, every):
    rng = np.random.default_rng(base_bytes + body_bytes)
    base, body = rng.bytes(base_bytes), rng.bytes(body_bytes)
    return base, body, np.frombuffer(protect(base, body, packet_bytes, every), np.uint8)


SIZES = (st.integers(1, 2000), st.integers(0, 8000), st.sampled_from([1, 7, 64, 108, 1464, 9000]))


@given(*SIZES, st.integers(2, 70))
def test_all_of_it_comes_back(base_bytes, body_bytes, packet_bytes, every):
    base, body, data = stream_of(base_bytes, body_bytes, packet_bytes, every)
    parts = unprotect(data, np.ones(data.size, bool), packet_bytes, every)
    assert parts.base == base
    assert parts.body[: len(body)].tobytes() == body
    assert parts.arrived.all()


@given(*SIZES, st.integers(2, 70), st.floats(0, 1), st.integers(0, 2**32 - 1))
def test_what_is_told_of_a_damaged_stream_is_true(base_bytes, body_bytes, packet_bytes, every, share, seed):
    base, body, data = stream_of(base_bytes, body_bytes, packet_bytes, every)
    lost = np.random.default_rng(seed).random(-(-data.size // packet_bytes)) < share
    arrived = ~np.repeat(lost, packet_bytes)[: data.size]
    parts = unprotect(np.where(arrived, data, 0).astype(np.uint8), arrived, packet_bytes, every)
    assert parts.base in (None, base)
    if parts.base is not None:
        known = parts.arrived[: len(body)]
        np.testing.assert_array_equal(parts.body[: len(body)][known], np.frombuffer(body, np.uint8)[known])


@pytest.mark.parametrize("packet_bytes", [108, 1464])
@pytest.mark.parametrize("body_bytes", [280_000, 20_000, 100])
def test_the_base_survives_the_loss_it_is_made_for(packet_bytes, body_bytes):
    """Also where the body is too short for the repair symbols that it would hold by itself."""
    _, _, data = stream_of(9000, body_bytes, packet_bytes, 24)
    rng = np.random.default_rng(7)
    survived = 0
    for _ in range(200):
        arrived = np.repeat(rng.random(data.size // packet_bytes) >= BASE_LOSS, packet_bytes)
        survived += unprotect(data, arrived, packet_bytes, 24).base is not None
    assert survived >= 198


def test_the_base_is_there_before_the_body_when_a_transfer_stops():
    base, _, data = stream_of(9000, 280_000, 108, 24)
    arrived = np.arange(data.size) < 108 * 100
    assert unprotect(data, arrived, 108, 24).base == base


@pytest.mark.parametrize("packet_bytes", [108, 1464])
@pytest.mark.parametrize("body_bytes", [1, 700, 5000])
def test_a_stream_until_its_first_bytes_of_the_body_has_these_and_one_packet_less_has_not(
    packet_bytes, body_bytes
):
    base, body, data = stream_of(900, 5000, packet_bytes, 24)
    end = ends_in_stream(base, data.size, packet_bytes, 24, body_bytes)
    parts = unprotect(data, np.arange(data.size) < end, packet_bytes, 24)
    assert parts.base == base
    assert parts.body[:body_bytes].tobytes() == body[:body_bytes]
    assert parts.arrived[:body_bytes].all()
    less = unprotect(data, np.arange(data.size) < end - packet_bytes, packet_bytes, 24)
    assert less.base is None or not less.arrived[:body_bytes].all()

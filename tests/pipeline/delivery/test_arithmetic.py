"""The arithmetic coder beside streams worked out by hand, entropies, and cuts anywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.delivery import arithmetic
from pipeline.delivery.arithmetic import (
    BIT,
    ONE,
    READ,
    WRITE,
    code_bit,
    code_digits,
    code_number,
    counts_of,
    finish,
    reader,
    writer,
)

SLOTS = 2 * arithmetic.LONGEST


def even(slots=SLOTS, trust=1):
    return counts_of(np.full(slots, ONE // 2), trust)


def written(write):
    coder, words = writer(), np.zeros(10_000, np.int64)
    write(coder, words)
    return finish(coder, words)


@pytest.mark.parametrize(
    ("bits", "expected"),
    [
        ("", ""),
        ("1", "00"),  # a one is the lower half
        ("0", "80"),
        ("00", "c0"),
        ("10", "40"),
        ("01010101", "aa"),
        ("010101010", "aa80"),
        ("11111111", "00"),
    ],
)
def test_even_digits_are_written_as_they_are_with_ones_as_zeros(bits, expected):
    count, number = len(bits), int(bits or "0", 2)
    stream = written(lambda coder, stream: code_digits(WRITE, coder, stream, count, number))
    assert bytes(stream).hex() == expected


def test_a_bit_narrows_the_interval_by_its_chance():
    """Three of four: a one is the lower three quarters, a zero after it a quarter of that."""
    counts, coder, stream = counts_of(np.array([3 * ONE // 4]), 4), writer(), np.zeros(8, np.int64)
    code_bit(WRITE, coder, stream, counts, 0, True)
    assert coder[arithmetic.LOW] == 0
    assert coder[arithmetic.LENGTH] == pytest.approx(0.75 * 2**48)
    np.testing.assert_array_equal(counts, [[BIT, 4 * BIT]])
    code_bit(WRITE, coder, stream, counts, 0, False)  # now four of five are ones
    assert coder[arithmetic.LOW] == pytest.approx(0.8 * 0.75 * 2**48, rel=1e-4)
    assert coder[arithmetic.LOW] + coder[arithmetic.LENGTH] == pytest.approx(0.75 * 2**48)


@pytest.mark.parametrize("chance", [0.5, 0.9, 0.02])
def test_bits_take_as_many_bytes_as_their_information(chance):
    bits = np.random.default_rng(3).random(20_000) < chance

    def write(coder, stream):
        counts = even(1, trust=2)
        for bit in bits:
            code_bit(WRITE, coder, stream, counts, 0, bit)

    share = bits.mean()
    information = -len(bits) * (share * np.log2(share) + (1 - share) * np.log2(1 - share)) / 8
    assert information < written(write).size < 1.15 * information + 4


def test_a_slot_learns_the_share_of_ones_and_forgets_slowly():
    counts, coder, stream = even(1), writer(), np.zeros(10_000, np.int64)
    for _ in range(500):
        code_bit(WRITE, coder, stream, counts, 0, True)
    assert counts[0, 1] / counts.sum() > 0.97
    assert counts.sum() <= 42 * BIT
    for _ in range(60):
        code_bit(WRITE, coder, stream, counts, 0, False)
    assert counts[0, 1] / counts.sum() < 0.25


@given(st.lists(st.integers(1, 2**18 - 1), max_size=40))
def test_numbers_come_back(numbers):
    def write(coder, stream):
        counts = even()
        for number in numbers:
            assert code_number(WRITE, coder, stream, counts, 0, number) == number

    stream, counts = written(write), even()
    coder = reader(stream)
    assert [code_number(READ, coder, stream, counts, 0, 0) for _ in numbers] == numbers
    assert not coder[arithmetic.STOPPED]


@given(st.lists(st.booleans(), max_size=200), st.integers(1, ONE - 1), st.data())
def test_a_cut_stream_gives_bits_that_are_right_until_it_stops(bits, chance, data):
    def write(coder, stream):
        counts = counts_of(np.array([chance]))
        for bit in bits:
            code_bit(WRITE, coder, stream, counts, 0, bit)

    stream = written(write)
    found = []
    for size in sorted({data.draw(st.integers(0, stream.size)), stream.size}):
        coder, counts, read = reader(stream[:size]), counts_of(np.array([chance])), []
        for _ in bits:
            bit = code_bit(READ, coder, stream[:size], counts, 0, False)
            if coder[arithmetic.STOPPED]:
                break
            read.append(bit)
        assert read == bits[: len(read)]
        found.append(len(read))
    assert found == sorted(found)
    assert found[-1] == len(bits)

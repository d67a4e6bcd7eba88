"""The arithmetic coder beside streams worked out by hand, entropies, and cuts anywhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.delivery import arithmetic
from pipeline.delivery.arithmetic import (
    BIT,
    BODY,
    COUNTS,
    LENGTH,
    LOW,
    ONE,
    POSITION,
    READ,
    STOPPED,
    WRITE,
    code_bit,
    code_digits,
    code_number,
    counts_of,
    finish,
    reader,
    writer,
)

EVEN = counts_of(np.full(2 * arithmetic.LONGEST, ONE // 2), trust=1)
MOST_WORDS = 10_000


def written(write, counts=EVEN):
    coder = writer(counts, MOST_WORDS)
    write(coder)
    return finish(coder)


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
    stream = written(lambda coder: code_digits(WRITE, coder, count, number))
    assert bytes(stream).hex() == expected


def test_a_bit_narrows_the_interval_by_its_chance():
    """Three of four: a one is the lower three quarters, a zero after it a quarter of that."""
    coder = writer(counts_of(np.array([3 * ONE // 4]), 4), 8)
    code_bit(WRITE, coder, 0, True)
    assert coder[LOW] == 0
    assert coder[LENGTH] == pytest.approx(0.75 * 2**48)
    np.testing.assert_array_equal(coder[COUNTS : coder[BODY]], [BIT, 4 * BIT])
    code_bit(WRITE, coder, 0, False)  # now four of five are ones
    assert coder[LOW] == pytest.approx(0.8 * 0.75 * 2**48, rel=1e-4)
    assert coder[LOW] + coder[LENGTH] == pytest.approx(0.75 * 2**48)


@pytest.mark.parametrize("chance", [0.5, 0.9, 0.02])
def test_bits_take_as_many_bytes_as_their_information(chance):
    bits = np.random.default_rng(3).random(20_000) < chance

    def write(coder):
        for bit in bits:
            code_bit(WRITE, coder, 0, bit)

    share = bits.mean()
    information = -len(bits) * (share * np.log2(share) + (1 - share) * np.log2(1 - share)) / 8
    assert information < written(write).size < 1.15 * information + 4


def test_carries_pass_through_full_words():
    """1234 ffff 1|0005: the third word's carry fills the second, whose carry goes on to the first."""
    coder = writer(EVEN, 8)
    first = coder[BODY] + 1
    coder[first : first + 3] = 0x1234, 0xFFFF, 0x10005
    coder[POSITION] = coder[BODY] + 3
    assert bytes(finish(coder)).hex() == "123500000005"


def test_the_last_bytes_may_carry_as_well():
    """From ffff ffff 0001, of length 2 ** 36: all that begin with the carry and two zeros lie within."""
    coder = writer(EVEN, 8)
    coder[coder[BODY] + 1] = 0x00FF
    coder[POSITION] = coder[BODY] + 1
    coder[LOW], coder[LENGTH] = 0xFFFFFFFF0001, 1 << 36
    assert bytes(finish(coder)).hex() == "01000000"


def test_a_slot_learns_the_share_of_ones_and_forgets_slowly():
    coder = writer(EVEN, MOST_WORDS)

    def share():
        zeros, ones = coder[COUNTS], coder[COUNTS + 1]
        return ones / (zeros + ones)

    for _ in range(500):
        code_bit(WRITE, coder, 0, True)
    assert share() > 0.97
    assert coder[COUNTS] + coder[COUNTS + 1] <= 42 * BIT
    for _ in range(60):
        code_bit(WRITE, coder, 0, False)
    assert share() < 0.25


@given(st.lists(st.integers(1, 2**18 - 1), max_size=40))
def test_numbers_come_back(numbers):
    def write(coder):
        for number in numbers:
            assert code_number(WRITE, coder, 0, number) == number

    coder = reader(EVEN, written(write))
    assert [code_number(READ, coder, 0, 0) for _ in numbers] == numbers
    assert not coder[STOPPED]


@given(st.lists(st.booleans(), max_size=200), st.integers(1, ONE - 1), st.data())
def test_a_cut_stream_gives_bits_that_are_right_until_it_stops(bits, chance, data):
    counts = counts_of(np.array([chance]))

    def write(coder):
        for bit in bits:
            code_bit(WRITE, coder, 0, bit)

    stream = written(write, counts)
    found = []
    for size in sorted({data.draw(st.integers(0, stream.size)), stream.size}):
        coder, read = reader(counts, stream[:size]), []
        for _ in bits:
            bit = code_bit(READ, coder, 0, False)
            if coder[STOPPED]:
                break
            read.append(bit)
        assert read == bits[: len(read)]
        found.append(len(read))
    assert found == sorted(found)
    assert found[-1] == len(bits)


@given(st.integers(0, 2**32 - 1))
def test_what_the_missing_bytes_could_give_never_exceeds_the_interval(seed):
    """Thousands of likely bits after the end of a stream: none is taken for known that is not."""
    rng = np.random.default_rng(seed)
    chance = int(rng.integers(ONE // 2, ONE))
    counts, bits = counts_of(np.array([chance])), rng.random(3000) < chance / ONE

    def write(coder):
        for bit in bits:
            code_bit(WRITE, coder, 0, bit)

    stream = written(write, counts)
    coder = reader(counts, stream[: int(rng.integers(0, stream.size))])
    for bit in bits:
        found = code_bit(READ, coder, 0, False)
        if coder[STOPPED]:
            break
        assert found == bit
        assert coder[arithmetic.LEAST] <= coder[arithmetic.MOST] < coder[LENGTH]

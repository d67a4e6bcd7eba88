"""RVL against streams worked out by hand from the paper's rules, and round trips."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from packetmesh.errors import InputError
from pipeline.delivery import rvl

DEPTHS = hnp.arrays(
    np.uint16,
    st.integers(0, 300),
    elements=st.one_of(st.just(0), st.integers(1000, 1010), st.integers(0, 65535)),
)


def stream(text: str) -> np.ndarray:
    return np.frombuffer(bytes.fromhex(text), np.uint8)


@pytest.mark.parametrize(
    ("values", "nibbles"),
    [
        ([], ""),
        # No zeros, one other; +1 is 2.
        ([1], "0 1 2 0"),
        # Three zeros, no other.
        ([0, 0, 0], "3 0"),
        # No zeros, three others; +3 is 6, -1 is 1, +0 is 0.
        ([3, 2, 2], "0 3 6 1 0 0"),
        # Two zeros, one other: 5 is 10 = 2 + 8, lower group first and more to come; one zero; one other: +1.
        ([0, 0, 5, 0, 6], "2 1 a1 1 1 2 0"),
        # Nine zeros are 1 + 8; one other: 1000 is 2000 = 0o3720, groups 0, 2, 7, 3.
        ([0] * 9 + [1000], "91 1 8af3"),
        # The largest step up and down: 65535 is 131070 = 0o377776; -65534 is 131067 = 0o377773.
        ([65535, 1], "0 2 effff3 bffff3"),
    ],
)
def test_known_streams(values, nibbles):
    digits = nibbles.replace(" ", "")
    expected = bytes.fromhex(digits + "0" * (len(digits) % 2))
    assert rvl.encode(np.array(values, np.uint16)) == expected
    np.testing.assert_array_equal(rvl.decode(stream(expected.hex()), len(values)), values)


@given(DEPTHS)
def test_nothing_changes_on_the_way(values):
    coded = np.frombuffer(rvl.encode(values), np.uint8)
    np.testing.assert_array_equal(rvl.decode(coded, values.size), values)


@given(DEPTHS, st.data())
def test_the_start_of_a_stream_tells_the_start_of_the_image(values, data):
    coded = np.frombuffer(rvl.encode(values), np.uint8)
    cut = data.draw(st.integers(0, coded.size))
    start = rvl.decode_start(coded[:cut], values.size)
    np.testing.assert_array_equal(start, values[: start.size])
    assert start.size >= rvl.decode_start(coded[: max(cut - 1, 0)], values.size).size


@given(DEPTHS.filter(lambda values: values.size > 0), st.data())
def test_a_stream_without_its_end_is_refused(values, data):
    coded = np.frombuffer(rvl.encode(values), np.uint8)
    with pytest.raises(InputError, match="no RVL stream"):
        rvl.decode(coded[: data.draw(st.integers(0, coded.size - 1))], values.size)


@pytest.mark.parametrize(
    "text",
    [
        "40",  # four zeros where three values are meant
        "04",  # four others
        "0000",  # neither zeros nor others, and no end
        "0310",  # a first depth of -1
        "03a191a1",  # a second depth of 0, which is none
        "03fffffff0",  # a difference of more than 17 bits
        "03fffff700",  # a depth above 65535
        "3000",  # a whole stream, and a byte behind it
        "ffffffffffffffffffff",  # a run without end
    ],
)
def test_what_is_no_stream_is_refused(text):
    with pytest.raises(InputError, match="no RVL stream of 3 depths"):
        rvl.decode(stream(text), 3)


@given(st.binary(max_size=40), st.integers(0, 100))
def test_any_bytes_are_read_or_refused(junk, count):
    try:
        values = rvl.decode(np.frombuffer(junk, np.uint8), count)
    except InputError:
        return
    assert values.size == count

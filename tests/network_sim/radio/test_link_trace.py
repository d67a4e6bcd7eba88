"""Recorded links: what a file may hold, and what a packet meets that is sent over one again."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.radio.link_file import read_link_trace
from network_sim.radio.link_trace import LinkTrace, Replay, constant_link
from network_sim.types import NS_PER_S
from packetmesh.errors import InputError

GOOD = """# a recording
0.5  8.0 20 0

1.0  0   40 0.25  # nothing is sent
1.5  16  10 1
"""


def trace_of(*rows: tuple[float, float, float, float]) -> LinkTrace:
    return LinkTrace(*np.array(rows).T)


def written(tmp_path, text):
    path = tmp_path / "link.txt"
    path.write_text(text)
    return path


def test_a_file_is_read_in_its_units_from_its_first_time(tmp_path):
    trace = read_link_trace(written(tmp_path, GOOD))
    np.testing.assert_allclose(trace.t_s, [0.0, 0.5, 1.0])
    np.testing.assert_allclose(trace.rate_bps, [8e6, 0.0, 16e6])
    np.testing.assert_allclose(trace.round_trip_s, [0.020, 0.040, 0.010])
    np.testing.assert_allclose(trace.loss, [0.0, 0.25, 1.0])
    assert trace.edges_ns.tolist() == [0, 500_000_000, 1_000_000_000, 1_500_000_000]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("", "is empty"),
        ("# only a comment\n\n", "has no rows"),
        ("0 1 2\n", "line 1 has 3 columns; try 4"),
        ("0 1 2 0 9\n", "line 1 has 5 columns"),
        ("t speed rtt loss\n0 1 2 0\n", "line 1 does not name the four columns"),
        ("t rate rtt loss\n", "no rows below its header"),
        ("0 1 2 0\n1 nan 2 0\n", "line 2 has nan as rate"),
        ("0 1 inf 0\n", "line 1 has inf as round trip"),
        ("-0.015 1 2 0\n0 1 2 0\n", "line 1 has -0.015 as time"),
        ("0 -1 2 0\n", "line 1 has -1 as rate"),
        ("0 1 -2 0\n", "line 1 has -2 as round trip"),
        ("0 1 2 -1.5\n", "line 1 has -1.5 as loss in share"),
        ("0 1 2 107.5\n", "line 1 has 107.5 as loss in per cent; try 0 to 100"),
        ("t rate rtt loss_share\n0 1 2 7.5\n", "line 2 has 7.5 as loss in share; try 0 to 1"),
        ("0 1 2 0\n\n1 1 2 0\n0.5 1 2 0\n", "line 4 is 0.5 s before the row above"),
        ("0 1 2 0\n1 1 2 0\n1 1 2 0\n", "line 3 has the time of the row above"),
        ("".join(f"{t} 1 2 0\n" for t in (0, 1, 2, 3, 60, 61, 62)), "line 5 comes 57 s after"),
        ("".join(f"{0.01 * t} 1 2 0\n" for t in (0, 1, 2, 3, 104, 105)), "line 5 comes 1.01 s after"),
        ("0 0 2 0\n1 0 2 0\n", "a rate of 0 throughout"),
    ],
)
def test_what_cannot_be_a_recording_is_one_sentence(tmp_path, text, names):
    with pytest.raises(InputError) as error:
        read_link_trace(written(tmp_path, text))
    assert names in str(error.value)
    assert "link.txt" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "said"), [(None, "does not exist"), (b"\x80binary\x80", "is not a text file")]
)
def test_what_is_no_text_file_is_one_sentence(tmp_path, content, said):
    path = tmp_path / "link.bin"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=rf"link\.bin {said}"):
        read_link_trace(path)


def test_a_row_in_which_more_came_than_was_sent_loses_nothing(tmp_path):
    trace = read_link_trace(written(tmp_path, "0 1 2 -0.5\n1 1 2 0.5\n"))
    assert trace.loss.tolist() == [0.0, 0.5]


def test_steps_may_differ_where_rows_are_rare(tmp_path):
    trace = read_link_trace(written(tmp_path, "0 1 2 0\n3 1 2 0\n4 1 2 0\n5 1 2 1\n14 1 2 0\n"))
    assert trace.edges_ns[-1] == 16 * NS_PER_S
    assert trace.mean_loss == pytest.approx(9 / 16)


def carried(trace: LinkTrace, from_ns: int, until_ns: int, start_ns: int) -> float:
    """Bytes that a link carries in a span, row by row and turn by turn."""
    edges, total, turn = trace.edges_ns.tolist(), 0.0, 0
    while (base := turn * edges[-1] - start_ns) < until_ns:
        for row, rate_bps in enumerate(trace.rate_bps.tolist()):
            begin, end = max(base + edges[row], from_ns), min(base + edges[row + 1], until_ns)
            total += max(end - begin, 0) * rate_bps / (8 * NS_PER_S)
        turn += 1
    return total


rates = st.one_of(st.just(0.0), st.floats(1e4, 1e8))
recordings = st.lists(
    st.tuples(st.integers(1, 200), rates, st.floats(0.0, 0.2), st.floats(0.0, 1.0)), min_size=1, max_size=8
).filter(lambda rows: any(row[1] for row in rows))


@given(rows=recordings, now_ms=st.integers(0, 5_000), size_bytes=st.integers(1, 200_000), data=st.data())
def test_a_packet_ends_when_the_link_has_carried_it(rows, now_ms, size_bytes, data):
    steps, *values = zip(*rows, strict=True)
    t_s = np.append(0.0, np.cumsum(np.array(steps[:-1])) * 1e-3)
    trace = LinkTrace(t_s, *(np.array(column) for column in values))
    from_share = data.draw(st.floats(0.0, 0.999))
    replay, now_ns = Replay(trace, from_share), now_ms * 1_000_000
    span_ns = int(trace.edges_ns[-1])
    start_ns = int(from_share * span_ns) if len(rows) > 1 else 0
    if len(rows) > 1 and carried(trace, now_ns, now_ns + 50 * span_ns, start_ns) < size_bytes:
        return  # so slow that counting turn by turn takes too long
    ends_ns = replay.ends_ns(now_ns, size_bytes)
    byte_ns = 8 * NS_PER_S / trace.rate_bps[trace.rate_bps > 0.0].min()
    assert carried(trace, now_ns, ends_ns, start_ns) == pytest.approx(
        size_bytes, rel=1e-9, abs=1.0 / byte_ns + 1e-2
    )
    opens_ns = replay.opens_ns(now_ns)
    assert now_ns <= opens_ns < ends_ns + 1
    assert carried(trace, now_ns, opens_ns, start_ns) == 0.0
    assert carried(trace, opens_ns, opens_ns + 1000, start_ns) > 0.0
    assert replay.ends_ns(opens_ns, size_bytes) == pytest.approx(ends_ns, abs=1)


def test_a_packet_waits_while_the_rate_is_0_and_the_recording_begins_again():
    """Rows of 10 ms: 1 Mbit/s, nothing, 2 Mbit/s, nothing."""
    replay = Replay(trace_of(*((0.01 * row, rate, 0.1, 0.0) for row, rate in enumerate((1e6, 0, 2e6, 0)))))
    ms = 1_000_000
    assert replay.ends_ns(0, 125) == 1 * ms
    assert replay.ends_ns(5 * ms, 1250) == 5 * ms + 5 * ms + 10 * ms + 2_500_000
    assert replay.opens_ns(5 * ms) == 5 * ms
    assert replay.opens_ns(15 * ms) == 20 * ms
    assert replay.opens_ns(33 * ms) == 40 * ms
    assert replay.ends_ns(33 * ms, 125) == 41 * ms
    assert replay.ends_ns(0, 3750) == 30 * ms
    assert replay.ends_ns(0, 3750 * 1_000_000) == (40 * 999_999 + 30) * ms


def test_rows_hold_until_the_next_and_come_again():
    replay = Replay(trace_of((0.0, 1e6, 0.2, 0.1), (1.0, 1e6, 0.4, 0.2), (2.0, 1e6, 0.6, 0.3)), 0.5)
    seconds = np.arange(8) + 0.25
    found = [(replay.latency_ns(int(t * NS_PER_S)), replay.loss(int(t * NS_PER_S))) for t in seconds]
    rows = [(100_000_000, 0.1), (200_000_000, 0.2), (300_000_000, 0.3)]
    assert found == [rows[int(t + 1.5) % 3] for t in seconds]


def test_a_link_that_never_changes_has_no_end():
    replay = Replay(constant_link(8e6, 0.1, 0.5), 0.7)
    year_ns = 365 * 86_400 * NS_PER_S
    assert replay.ends_ns(year_ns, 1000) == year_ns + 1_000_000
    assert replay.opens_ns(year_ns) == year_ns
    assert (replay.latency_ns(year_ns), replay.loss(year_ns)) == (50_000_000, 0.5)
    assert constant_link(8e6, 0.1, 0.5).mean_loss == 0.5


@pytest.mark.parametrize(
    ("name", "rows", "loss"),
    [
        ("wifi_14", 8000, 0.076),
        ("wifi_10", 8000, 0.023),
        ("wifi_13", 1806, 0.002),
        ("cell_4", 8000, 0.028),
        ("cell_3", 8000, 0.008),
        ("eth_3", 8000, 0.010),
    ],
)
def test_recordings_of_others_lose_what_their_readme_says(shared_data, name, rows, loss):
    path = shared_data / "link_traces" / f"{name}.txt"
    if not path.is_file():
        pytest.skip(f"no {path}")
    trace = read_link_trace(path)
    assert len(trace.t_s) == rows
    assert round(trace.mean_loss, 3) == loss
    assert trace.edges_ns[-1] == pytest.approx(0.015 * rows * NS_PER_S, abs=2)
    assert 1e6 < trace.rate_bps.min() < trace.rate_bps.max() < 2e8
    assert 0.0 < trace.round_trip_s.min() < trace.round_trip_s.max() < 0.1

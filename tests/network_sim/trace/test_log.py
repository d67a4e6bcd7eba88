"""The recorder, its log and its counters."""

from __future__ import annotations

import struct
from dataclasses import asdict
from itertools import pairwise

import numpy as np
import pytest

from network_sim.config import Keep
from network_sim.trace.conservation import recount
from network_sim.trace.log import IMAGE_EVENTS, Recorder
from network_sim.trace.states import State, StateTimes, disjoint
from network_sim.types import Cause, EventKind, PacketKind, to_ns
from tests.network_sim.by_hand import HORIZON_S, NAMES, ROLES, config_of, random_run, small_run, trace_of

E = EventKind


def test_events_are_sorted_by_time_and_then_by_order_of_recording() -> None:
    def story(recorder: Recorder) -> None:
        for packet, t_s in enumerate((5, 3, 5, 3, 4)):
            recorder.add(to_ns(t_s), E.LOSS, 0, packet=packet)

    events = trace_of(story).events
    assert events.packet.tolist() == [1, 3, 4, 0, 2]
    assert events.t_ns.tolist() == [to_ns(t_s) for t_s in (3, 3, 4, 5, 5)]


def test_every_column_keeps_what_was_recorded() -> None:
    recorded = (17, E.AIR, 1, 2, 3, 4, 921_600, 921_615, Cause.NOISE, 160 * 10**9, PacketKind.STATUS)

    def story(recorder: Recorder) -> None:
        recorder.add(*recorded)

    events = trace_of(story).events
    first = ("t_ns", "kind", "node", "peer", "packet", "image", "first_byte", "size_bytes")
    names = (*first, "cause", "duration_ns", "packet_kind")
    assert tuple(getattr(events, name)[0] for name in names) == recorded


def test_a_number_too_large_for_its_column_is_refused() -> None:
    with pytest.raises(struct.error):
        Recorder("all", 3).add(0, E.AIR, 40_000)


def test_many_events_at_once_are_the_same_as_one_by_one() -> None:
    def single(recorder: Recorder) -> None:
        for image in range(5):
            recorder.add(to_ns(image), E.CAPTURE, 1, image % 2, image=image, size_bytes=1000)

    def many(recorder: Recorder) -> None:
        image = np.arange(5)
        t_ns = image * to_ns(1)
        recorder.add_many(t_ns, E.CAPTURE, 1, peer=image % 2, image=image, size_bytes=1000)

    one, other = trace_of(single), trace_of(many)
    for left, right in zip(one.events.columns(), other.events.columns(), strict=True):
        np.testing.assert_array_equal(left, right)
    assert one.counters.images.created == other.counters.images.created == 0  # within the warm-up
    assert one.counters.captured == other.counters.captured == 5


def test_each_way_of_keeping_counts_the_same() -> None:
    for story in (small_run, random_run(1)):
        full, images, counters = (trace_of(story, keep) for keep in ("all", "images", "counters"))
        assert len(counters.events) == 0
        wanted = full.events.of(*IMAGE_EVENTS)
        for left, right in zip(images.events.columns(), wanted.columns(), strict=True):
            np.testing.assert_array_equal(left, right)
        for trace in (images, counters):
            np.testing.assert_equal(asdict(trace.counters), asdict(full.counters))


@pytest.mark.parametrize("warmup_s", [0.0, 0.5, 60.0, 100.0])
def test_counters_are_what_the_log_says(warmup_s: float) -> None:
    trace = trace_of(random_run(2), "all", warmup_s)
    events, counters = trace.events, trace.counters
    edges_ns = counters.edges_ns
    assert (edges_ns[0], edges_ns[-1]) == (0, to_ns(HORIZON_S))
    assert edges_ns[counters.warmup_minutes] == to_ns(warmup_s)
    assert (np.diff(edges_ns) <= to_ns(60)).all()
    for minute, (start_ns, end_ns) in enumerate(pairwise(edges_ns)):
        for kind in (E.ENQUEUE, E.DELIVER, E.DROP, E.ARRIVE):
            t_ns = events.t_ns[events.kind == kind]
            t_ns = t_ns[(t_ns >= start_ns) & (t_ns < end_ns)]
            assert counters.count[minute, kind].sum() == len(t_ns)
            assert counters.until_end_ns[minute, kind].sum() == (end_ns - t_ns).sum()
    arrived = {int(i) for i in events.of(E.ARRIVE).image}
    taken = events.of(E.CAPTURE)
    late = [int(i) for i, t in zip(taken.image, taken.t_ns, strict=True) if t >= to_ns(warmup_s)]
    assert counters.images.created == len(late)
    assert counters.images.arrived == len(arrived & set(late))


def test_what_happens_at_the_horizon_belongs_to_the_last_minute() -> None:
    def story(recorder: Recorder) -> None:
        recorder.add(to_ns(HORIZON_S), E.LOSS, 0)

    counters = trace_of(story).counters
    assert counters.count[:, E.LOSS].sum(axis=(1, 2)).tolist() == [0, 0, 1]
    assert counters.until_end_ns[:, E.LOSS].sum() == 0


def test_blocks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = trace_of(small_run)
    monkeypatch.setattr("network_sim.trace.log._BLOCK_BYTES", 1)
    pieces = trace_of(small_run)
    np.testing.assert_equal(asdict(pieces.counters), asdict(whole.counters))
    for left, right in zip(whole.events.columns(), pieces.events.columns(), strict=True):
        np.testing.assert_array_equal(left, right)


def test_the_same_story_gives_the_same_bytes() -> None:
    one, other = (trace_of(random_run(3)) for _ in range(2))
    for left, right in zip(one.events.columns(), other.events.columns(), strict=True):
        assert left.tobytes() == right.tobytes()


def test_a_recorder_for_another_warm_up_is_refused() -> None:
    with pytest.raises(ValueError, match="warm-up"):
        Recorder("all", 3, 0).trace(config_of("all"), NAMES, None, to_ns(HORIZON_S), ROLES)


def test_state_times_of_the_small_run() -> None:
    states_s = trace_of(small_run).counters.states_ns[1:].sum(axis=0) / 1e9
    sending, asleep, receiving = (states_s[:, state].tolist() for state in State)
    assert sending == [9.5, 4.0, 0.1]  # the last frame counts up to the horizon only
    assert asleep == [10.0, 10.0, 0.0]
    assert receiving == [2.1 + 2.0, 0.0, 9.5]  # the frame out of range was on the air, too


def test_state_times_against_a_clock_that_ticks() -> None:
    """Random frames, overlaps and sleep, second by second."""
    rng, ticks = np.random.default_rng(4), 300
    clock = np.zeros((3, len(State), ticks), bool)
    recorder = Recorder("counters", 3, to_ns(60))
    rows = []
    for node, cycle in ((0, 7), (1, 11), (2, 13)):
        for start in range(0, ticks - 12, cycle):
            length, peer = int(rng.integers(1, cycle)), int((node + rng.integers(1, 3)) % 3)
            rows.append((to_ns(start), E.AIR, node, peer, to_ns(length)))
            clock[node, State.SENDING, start : start + length] = True
            clock[peer, State.RECEIVING, start : start + length] = True
    for start in range(20, ticks - 30, 50):
        rows += [(to_ns(start), E.DOWN, 1, -1, 0), (to_ns(start + 15), E.UP, 1, -1, 0)]
        clock[1, State.ASLEEP, start : start + 15] = True
    for t_ns, kind, node, peer, duration_ns in sorted(rows):
        recorder.add(t_ns, kind, node, peer, duration_ns=duration_ns)
    clock[:, State.ASLEEP] &= ~clock[:, State.SENDING]
    clock[:, State.RECEIVING] &= ~clock[:, State.SENDING] & ~clock[:, State.ASLEEP]
    trace = recorder.trace(config_of("counters"), NAMES, None, to_ns(ticks), ROLES)
    found_s = np.moveaxis(trace.counters.states_ns, 0, -1) / 1e9
    np.testing.assert_array_equal(found_s, clock.reshape(3, len(State), -1, 60).sum(axis=-1))
    assert trace.counters.faults == ()


def test_a_frame_that_is_recorded_late_is_named() -> None:
    def story(recorder: Recorder) -> None:
        recorder.add(to_ns(5), E.AIR, 0, 2, duration_ns=1)
        recorder.add_many([to_ns(90)] * 70_000, E.AIR, 1, peer=2)
        recorder.add(to_ns(5), E.AIR, 0, 2, duration_ns=1)

    assert trace_of(story).counters.faults == ("1 frames or failures were recorded more than a second late",)


def test_disjoint_spans() -> None:
    spans = np.array([[1, 5, 9], [0, 0, 4], [1, 6, 7], [0, 3, 6], [1, 9, 10], [0, 8, 8]])
    assert disjoint(spans).tolist() == [[0, 0, 4], [0, 4, 6], [1, 5, 9], [1, 9, 10]]
    assert len(disjoint(np.zeros((0, 3), np.int64))) == 0


def test_a_node_that_never_wakes_sleeps_until_the_end() -> None:
    times = StateTimes(1, 0)
    rows = np.array([(to_ns(50), 0, 0, -1, E.DOWN)], _dtype())
    times.take(rows)
    assert times.sums(to_ns(130), 3)[:, 0, State.ASLEEP].tolist() == [to_ns(10), to_ns(60), to_ns(10)]


def _dtype() -> np.dtype:
    return np.dtype([(name, "i8") for name in ("t_ns", "duration_ns", "node", "peer", "kind")])


@pytest.mark.parametrize("keep", ["all", "images", "counters"])
def test_an_empty_run(keep: Keep) -> None:
    trace = trace_of(lambda recorder: None, keep)
    assert len(trace.events) == 0
    assert not trace.counters.count.any()
    assert trace.counters.faults == ()


def test_a_complete_log_gives_the_counters_again() -> None:
    trace = trace_of(random_run(5))
    np.testing.assert_equal(asdict(recount(trace)), asdict(trace.counters))

"""A trace that loses something without saying so is found out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from network_sim.config import Keep
from network_sim.trace.conservation import Balance, InternalError, balance, check, image_balance
from network_sim.trace.log import NetworkTrace, Recorder
from network_sim.types import Cause, EventKind, to_ns
from tests.network_sim.by_hand import Story, hop, random_run, small_run, trace_of

E = EventKind
KEEPS: tuple[Keep, ...] = ("all", "images", "counters")


@pytest.mark.parametrize("keep", KEEPS)
def test_the_balance_of_the_small_run(keep: Keep) -> None:
    trace = trace_of(small_run, keep)
    packets, images = balance(trace), image_balance(trace)
    assert packets == Balance(created=7, received=5, dropped={Cause.RETRIES: 1}, in_flight=1)
    assert images == Balance(created=5, received=3, dropped={Cause.DEADLINE: 1}, in_flight=1)
    check(trace)


@pytest.mark.parametrize("keep", KEEPS)
def test_random_runs_balance(keep: Keep) -> None:
    for seed in range(3):
        trace = trace_of(random_run(seed), keep)
        packets = balance(trace)
        assert packets.created == 1200 == packets.accounted
        assert min(packets.received, packets.dropped[Cause.RETRIES], packets.in_flight) > 0
        check(trace)


def queued(recorder: Recorder, packet: int = 0) -> None:
    recorder.add(to_ns(70), E.ENQUEUE, 0, 2, packet)


def vanished(recorder: Recorder) -> None:
    queued(recorder)
    hop(recorder, 70, 0, 2, 0)


def from_nowhere(recorder: Recorder) -> None:
    recorder.add(to_ns(hop(recorder, 70, 0, 2, 0)), E.RECEIVE, 0, 2, 0)


def received_twice(recorder: Recorder) -> None:
    queued(recorder)
    for _ in range(2):
        recorder.add(to_ns(hop(recorder, 70, 0, 2, 0)), E.RECEIVE, 0, 2, 0)


def given_up_after_arrival(recorder: Recorder) -> None:
    queued(recorder)
    recorder.add(to_ns(hop(recorder, 70, 0, 2, 0)), E.RECEIVE, 0, 2, 0)
    recorder.add(to_ns(80), E.DROP, 0, 2, 0, cause=Cause.RETRIES)


def received_without_a_frame(recorder: Recorder) -> None:
    queued(recorder)
    recorder.add(to_ns(80), E.RECEIVE, 0, 2, 0)


def in_two_buffers(recorder: Recorder) -> None:
    queued(recorder)
    recorder.add(to_ns(71), E.ENQUEUE, 1, 2, 0)


def sent_again_with_the_same_id(recorder: Recorder) -> None:
    queued(recorder)
    recorder.add(to_ns(71), E.DROP, 0, 2, 0, cause=Cause.RETRIES)
    queued(recorder)
    recorder.add(to_ns(hop(recorder, 75, 0, 2, 0)), E.RECEIVE, 0, 2, 0)


def one_lost_for_one_found(recorder: Recorder) -> None:
    """The sums agree; the packets do not."""
    queued(recorder, 0)
    queued(recorder, 1)
    hop(recorder, 70, 0, 2, 0)
    recorder.add(to_ns(72), E.RECEIVE, 0, 2, 1)


def before_it_was_created(recorder: Recorder) -> None:
    queued(recorder)
    recorder.add(to_ns(50), E.DELIVER, 0, 2, 0)
    recorder.add(to_ns(50), E.RECEIVE, 0, 2, 0)


def image_ends_twice(recorder: Recorder) -> None:
    recorder.add(to_ns(70), E.CAPTURE, 0, image=0, size_bytes=9)
    recorder.add(to_ns(75), E.ARRIVE, 0, 2, image=0, size_bytes=9)
    recorder.add(to_ns(80), E.EXPIRE, 0, image=0, cause=Cause.DEADLINE)


def image_taken_twice(recorder: Recorder) -> None:
    for _ in range(2):
        recorder.add(to_ns(70), E.CAPTURE, 0, image=0, size_bytes=9)
        recorder.add(to_ns(80), E.EXPIRE, 0, image=0, cause=Cause.BUFFER)


@pytest.mark.parametrize("keep", KEEPS)
@pytest.mark.parametrize(
    ("story", "fault"),
    [
        (vanished, "packet 0 vanished between two nodes"),
        (from_nowhere, "packet 0 has an end but no beginning"),
        (received_twice, "packet 0 arrived more than once"),
        (given_up_after_arrival, "packet 0 arrived and was given up"),
        (received_without_a_frame, "packet 0 arrived and is still held"),
        (in_two_buffers, "packet 0 is held by more than one node"),
        (sent_again_with_the_same_id, "1 packets were created, but 1 were received, 1 given up"),
        (one_lost_for_one_found, "packet 0 vanished"),
        (before_it_was_created, "packet 0 arrived before it was created"),
        (image_ends_twice, "image 0 arrived and was given up"),
        (image_taken_twice, "1 images were created, but 0 were received, 2 given up"),
    ],
)
def test_a_forged_story_is_found_out(story: Story, fault: str, keep: Keep) -> None:
    with pytest.raises(InternalError, match=fault):
        check(trace_of(story, keep))


def without(kind: EventKind) -> Callable[[NetworkTrace], NetworkTrace]:
    """Takes the last event of a kind out of the log."""

    def forge(trace: NetworkTrace) -> NetworkTrace:
        keep = np.ones(len(trace.events), bool)
        keep[np.flatnonzero(trace.events.kind == kind)[-1]] = False
        return replace(trace, events=trace.events.where(keep))

    return forge


@pytest.mark.parametrize(
    "kind", [E.ENQUEUE, E.DELIVER, E.RECEIVE, E.DROP, E.CAPTURE, E.ARRIVE, E.AIR, E.LOSS]
)
def test_a_log_with_a_line_removed_is_found_out(kind: EventKind) -> None:
    with pytest.raises(InternalError, match="the log gives other counters"):
        check(without(kind)(trace_of(small_run)))


def test_a_log_with_a_number_changed_is_found_out() -> None:
    trace = trace_of(small_run)
    t_ns = trace.events.t_ns.copy()
    t_ns[-1] += 1
    with pytest.raises(InternalError, match="until_end_ns"):
        check(replace(trace, events=replace(trace.events, t_ns=t_ns)))


def test_a_node_cannot_be_busier_than_the_run_is_long() -> None:
    trace = trace_of(small_run)
    states_ns = trace.counters.states_ns * 100
    with pytest.raises(InternalError, match="node 0 was busy for longer"):
        check(replace(trace, counters=replace(trace.counters, states_ns=states_ns)))


def test_an_event_without_its_id_is_refused() -> None:
    with pytest.raises(ValueError, match="packet is recorded without its id"):
        trace_of(lambda recorder: recorder.add(0, E.ENQUEUE, 0))

"""Runs over recorded links: known times, known losses, and packets that are all accounted for."""

import numpy as np
import pytest
from scipy import stats

from network_sim.config import NetworkConfig
from network_sim.radio.link_file import read_link_trace
from network_sim.simulate import simulate
from network_sim.trace.conservation import balance, image_balance
from network_sim.trace.frames import fates
from network_sim.trace.log import NetworkTrace
from network_sim.types import NS_PER_S, Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

STEADY = "".join(f"{0.015 * row:.3f} 1 0 0\n" for row in range(100))
"""1 Mbit/s, no latency, no loss."""


def run(*changes: str) -> NetworkTrace:
    return simulate(with_settings(NetworkConfig(), list(changes)))


def columns(trace: NetworkTrace) -> bytes:
    return b"".join(column.tobytes() for column in trace.events.columns())


@pytest.fixture
def link(tmp_path):
    """Writes a recording; its path."""

    def write(text):
        path = tmp_path / "link.txt"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("rows", [1, 100])
def test_a_steady_recording_is_an_ideal_link(link, rows):
    path = link("".join(STEADY.splitlines(keepends=True)[:rows]))
    small = ["nodes.image_bytes=100000", "nodes.images=2"]
    recorded = run(*small, "mac.kind=replay", f"mac.trace={path}").events
    ideal = run(*small, "mac.kind=ideal", "mac.link_bps=1e6").events
    for kind in (EventKind.CAPTURE, EventKind.AIR, EventKind.DELIVER, EventKind.RECEIVE, EventKind.ARRIVE):
        one, other = recorded.of(kind), ideal.of(kind)
        for name in ("t_ns", "node", "image", "first_byte", "size_bytes", "duration_ns"):
            mine, theirs = (
                np.sort(getattr(events, name) + 0) if kind is EventKind.CAPTURE else getattr(events, name)
                for events in (one, other)
            )
            np.testing.assert_array_equal(mine, theirs)


def test_the_next_packet_does_not_wait_for_the_answer_to_the_last(link):
    """1,000 bytes at 8 Mbit/s take 1 ms, and 500 ms to travel: more are under way than a buffer holds."""
    path = link("0 8 1000 0\n")
    trace = run(
        "nodes.count=1",
        "nodes.image_bytes=300000",
        "nodes.payload_bytes=1000",
        "mac.kind=replay",
        f"mac.trace={path}",
    )
    began_ns = trace.events.of(EventKind.CAPTURE).t_ns[0]
    ms = 1_000_000
    sent_ns, arrived_ns = (
        trace.events.of(kind).t_ns - began_ns for kind in (EventKind.AIR, EventKind.DELIVER)
    )
    assert sent_ns.tolist() == [n * ms for n in range(300)]
    assert arrived_ns.tolist() == [(501 + n) * ms for n in range(300)]


@pytest.mark.parametrize(("ack", "known_ms"), [("true", 101), ("false", 2101)])
def test_a_loss_is_known_a_round_trip_later_or_by_a_status(link, ack, known_ms):
    """The first seed that loses one of two packets. Without an answer the sink has to ask, 2 s later."""
    path = link("0 8 100 0.4\n")
    for seed in range(40):
        trace = run(
            "nodes.count=1",
            "nodes.image_bytes=2000",
            "nodes.payload_bytes=1000",
            "mac.kind=replay",
            f"mac.trace={path}",
            f"mac.ack={ack}",
            f"run.seed={seed}",
        )
        sent, lost = trace.events.of(EventKind.AIR), trace.events.of(EventKind.LOSS)
        sent = sent.where(sent.node == 0)
        if len(lost) == 1 and len(sent) == 3:
            break
    assert image_balance(trace).received == 1
    assert lost.cause.tolist() == [Cause.LINK]
    sent_ns = sent.t_ns[sent.first_byte == lost.first_byte[0]]
    assert sent_ns[1] - sent_ns[0] == pytest.approx(known_ms * 1_000_000, abs=3_000_000)


def test_without_retransmission_a_link_loses_its_share(link):
    path = link("0 8 20 0.2\n")
    trace = run(
        "nodes.retransmit=false",
        "nodes.image_bytes=100000",
        "mac.kind=replay",
        f"mac.trace={path}",
    )
    sums = balance(trace)
    assert set(sums.dropped) == {Cause.LINK}
    assert sums.created == 3 * -(-100_000 // 116)
    assert stats.binomtest(sums.dropped[Cause.LINK], sums.created, 0.2).pvalue > 1e-3
    assert image_balance(trace).dropped == {Cause.LINK: 3}


def test_each_loss_marks_the_frame_that_was_lost_though_others_left_since(link):
    path = link("0 8 100 0.2\n")
    trace = run("nodes.retransmit=false", "nodes.image_bytes=20000", "mac.kind=replay", f"mac.trace={path}")
    sent, lost = trace.events.of(EventKind.AIR), trace.events.of(EventKind.LOSS)
    marked = sent.where(fates(sent, lost) == Cause.LINK)
    assert sorted(zip(marked.node, marked.packet, strict=True)) == sorted(
        zip(lost.node, lost.packet, strict=True)
    )
    assert len(lost) > 10


def test_nodes_play_the_recording_from_places_of_their_own(link):
    """A tenth of the recording loses all: nodes that send at once meet it at different times."""
    path = link("".join(f"{0.1 * row:.1f} 1 0 {int(row < 10)}\n" for row in range(100)))
    trace = run(
        "nodes.count=6",
        "nodes.image_bytes=1250000",
        "nodes.payload_bytes=1000",
        "nodes.retransmit=false",
        "mac.kind=replay",
        f"mac.trace={path}",
    )
    lost = trace.events.of(EventKind.LOSS)
    np.testing.assert_allclose(np.bincount(lost.node), 125, atol=3)
    middle_s = [np.median(lost.t_ns[lost.node == node]) / NS_PER_S for node in range(6)]
    assert np.ptp(middle_s) > 2.0


def test_nothing_is_sent_while_the_rate_is_0(link):
    path = link("0 1 0 0\n0.5 0 0 0\n1 0 0 0\n1.5 1 0 0\n")
    trace = run("nodes.count=2", "nodes.image_bytes=300000", "mac.kind=replay", f"mac.trace={path}")
    assert image_balance(trace).received == 2
    frames = trace.events.of(EventKind.AIR)
    for node in range(2):
        began_ns = frames.t_ns[frames.node == node]
        turns = np.unique((began_ns[1:] - began_ns[0]) // (2 * NS_PER_S))
        assert len(turns) >= 2
        gaps_s = np.diff(began_ns) / NS_PER_S
        assert gaps_s.max() == pytest.approx(1.0, abs=0.002)


@pytest.mark.parametrize(
    "changes",
    [
        ["mac.ack=false"],
        ["nodes.duty_cycle=0.5", "nodes.duty_period_s=1", "nodes.count=4"],
        ["nodes.failures_per_h=400", "nodes.recovery_s=1", "nodes.count=4"],
        ["nodes.deadline_s=0.6", "nodes.images=3"],
        ["loss.share=0.2", "loss.burst_packets=8"],
        ["uplink.rate_bps=3e5", "uplink.loss=0.2"],
        ["nodes.images=0", "nodes.interval_s=1", "run.horizon_s=4.9"],
    ],
)
def test_every_packet_is_accounted_for_and_runs_repeat(link, changes):
    """The balances are checked by every run itself."""
    path = link(
        "".join(f"{0.1 * row:.1f} {row % 4} {30 * (row % 3)} {0.3 * (row % 2)}\n" for row in range(37))
    )
    common = ["nodes.image_bytes=40000", "mac.kind=replay", f"mac.trace={path}", "run.horizon_s=60"]
    first, again = run(*common, *changes), run(*common, *changes)
    assert columns(first) == columns(again)
    assert len(first.events.of(EventKind.DELIVER)) > 500
    assert balance(first).created == balance(first).accounted


@pytest.mark.parametrize("kind", ["node", "uplink"])
def test_loss_over_a_long_run_is_that_of_the_recording(shared_data, kind):
    """Small images that come evenly in time meet every row equally often; the sums of whole turns of the
    recording are independent, their spread gives the interval.
    """
    path = shared_data / "link_traces" / "wifi_14.txt"
    if not path.is_file():
        pytest.skip(f"no {path}")
    recorded = read_link_trace(path)
    where = ["mac.kind=replay", f"mac.trace={path}"] if kind == "node" else ["mac.kind=ideal"]
    uplink = [f"uplink.trace={path}"] if kind == "uplink" else []
    turns = 6
    trace = run(
        "nodes.count=1",
        "nodes.images=0",
        "nodes.interval_s=0.1003",
        "nodes.image_bytes=100",
        "nodes.retransmit=false",
        f"run.horizon_s={turns * recorded.edges_ns[-1] / NS_PER_S}",
        *where,
        *uplink,
    )
    lost, taken = trace.events.of(EventKind.LOSS), trace.events.of(EventKind.CAPTURE)
    assert set(lost.cause.tolist()) == {Cause.LINK if kind == "node" else Cause.UPLINK}
    edges_ns = np.arange(turns + 1) * recorded.edges_ns[-1]
    shares = np.histogram(lost.t_ns, edges_ns)[0] / np.histogram(taken.t_ns, edges_ns)[0]
    half = stats.t.ppf(0.9995, turns - 1) * shares.std(ddof=1) / np.sqrt(turns)
    assert abs(shares.mean() - recorded.mean_loss) <= half
    assert half < 0.5 * recorded.mean_loss


def test_a_recorded_uplink_replaces_rate_latency_and_loss(link):
    path = link("0 1 40 0\n")
    one = ["nodes.count=1", "nodes.image_bytes=100", "mac.kind=ideal"]
    recorded = run(*one, f"uplink.trace={path}", "uplink.loss=1", "uplink.latency_s=9")
    set_so = run(*one, "uplink.rate_bps=1e6", "uplink.latency_s=0.02")
    assert recorded.names == ("node 1", "sink", "cloud")
    assert columns(recorded) == columns(set_so)


def test_packets_do_not_overtake_each_other_as_a_round_trip_falls(link):
    path = link("".join(f"{0.01 * row:.2f} 10 {200 - 190 * (row % 2)} 0\n" for row in range(40)))
    for changes in (["mac.kind=replay", f"mac.trace={path}"], ["mac.kind=ideal", f"uplink.trace={path}"]):
        trace = run("nodes.count=1", "nodes.image_bytes=200000", "mac.link_bps=1e7", *changes)
        arrived = trace.events.of(EventKind.RECEIVE)
        assert (np.diff(arrived.t_ns) >= 0).all()
        assert (np.diff(arrived.packet) > 0).all()


def test_a_kinect_sized_image_crosses_every_recording(shared_data):
    paths = sorted((shared_data / "link_traces").glob("*.txt"))
    if not paths:
        pytest.skip(f"no link_traces in {shared_data}")
    for path in paths:
        trace = run(
            "nodes.count=1",
            "nodes.image_bytes=500000",
            "nodes.payload_bytes=1400",
            "mac.kind=replay",
            f"mac.trace={path}",
        )
        arrived_s = trace.events.of(EventKind.ARRIVE).t_ns[0] / NS_PER_S
        rates = read_link_trace(path).rate_bps
        assert 8 * 500_000 / rates.max() < arrived_s < 8 * 500_000 / rates.min() * 1.5


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        (["mac.kind=replay"], "mac.trace=FILE"),
        (["scenario=street-grid", "mac.kind=replay", "mac.trace=x"], "vehicles have no link"),
        (["mac.kind=replay", "mac.trace=/nowhere/link.txt"], "/nowhere/link.txt does not exist"),
        (["mac.kind=ideal", "uplink.trace=/nowhere/link.txt"], "/nowhere/link.txt does not exist"),
    ],
)
def test_a_recording_that_is_not_there_is_one_sentence(changes, names):
    with pytest.raises(InputError, match=names):
        run(*changes)

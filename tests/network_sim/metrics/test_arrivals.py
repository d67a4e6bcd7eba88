"""What arrived when, and what was spent until then, against the metrics and the trace itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.config import NetworkConfig
from network_sim.metrics.arrivals import arrivals, energy_by_node_j, until
from network_sim.metrics.metrics import camera_nodes, metrics
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.states import State
from network_sim.types import NS_PER_S, EventKind, to_ns
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.by_hand import small_run, trace_of

SHORT = {
    "thesis-link": ["run.horizon_s=20", "nodes.image_bytes=20000"],
    "street-grid": ["run.horizon_s=200", "run.warmup_s=0", "street.vehicles=15", "run.keep=all"],
    "greenhouse": ["run.horizon_s=400", "nodes.failures_per_h=30"],
    "office": ["run.horizon_s=12", "uplink.loss=0.1"],
    "lora": ["run.horizon_s=3600", "nodes.image_bytes=3000", "nodes.depth_bytes=0"],
    "ble": ["run.horizon_s=12", "uplink.loss=0.1"],
    "lte-m": ["run.horizon_s=12", "nodes.failures_per_h=100"],
    "nb-iot": ["run.horizon_s=30"],
    **{key: ["run.horizon_s=20"] for key in ("wifi-n", "wifi-ax", "wifi-ah")},
}


def run(preset, *changes):
    return simulate(with_settings(PRESETS[preset], [*SHORT[preset], *changes]))


@pytest.mark.parametrize("changes", [[], ["mac.ack=false", "loss.share=0.2"], ["nodes.header_bytes=8"]])
def test_the_fragments_of_an_image_are_all_its_bytes_once(changes):
    trace = run("thesis-link", *changes)
    came = arrivals(trace)
    assert len(trace.events.of(EventKind.ARRIVE)) == 3
    assert (np.diff(came.t_ns) >= 0).all()
    for image, node in enumerate(trace.events.of(EventKind.CAPTURE).node.tolist()):
        own = came.image == image
        assert set(came.node[own].tolist()) == {node}
        order = np.argsort(came.first_byte[own])
        starts, ends = came.first_byte[own][order], (came.first_byte + came.byte_count)[own][order]
        assert starts[0] == 0
        assert ends[-1] == 20_000
        np.testing.assert_array_equal(starts[1:], ends[:-1])
        complete_ns = trace.events.of(EventKind.ARRIVE)
        assert came.t_ns[own].max() == complete_ns.t_ns[complete_ns.image == image][0]


def test_over_several_hops_fragments_belong_to_the_camera_that_took_the_image():
    trace = run("greenhouse")
    came, taken = arrivals(trace), trace.events.of(EventKind.CAPTURE)
    relays = trace.events.of(EventKind.DELIVER)
    assert len(np.unique(came.node)) > len(np.unique(relays.node[relays.peer == 12]))
    owner = dict(zip(taken.image.tolist(), taken.node.tolist(), strict=True))
    assert came.node.tolist() == [owner[image] for image in came.image.tolist()]


def test_only_the_first_arrival_of_a_fragment_counts():
    trace = run("thesis-link", "mac.ack=false", "nodes.count=6")
    delivered = trace.events.of(EventKind.DELIVER)
    delivered = delivered.where((delivered.peer == 6) & (delivered.packet_kind == 0))
    came = arrivals(trace)
    keys = list(zip(delivered.image.tolist(), delivered.first_byte.tolist(), strict=True))
    first = dict(reversed(list(zip(keys, delivered.t_ns.tolist(), strict=True))))
    assert len(keys) > len(first) == len(came)
    found = zip(came.image.tolist(), came.first_byte.tolist(), came.t_ns.tolist(), strict=True)
    assert {(image, byte): t for image, byte, t in found} == first


def test_fragments_reach_the_cloud_later_than_the_sink():
    trace = run("office", "nodes.images=1", "nodes.deadline_s=none", "run.horizon_s=60")
    sink, cloud = arrivals(trace), arrivals(trace, at="cloud")
    assert len(sink) == len(cloud) > 100
    for came in (sink, cloud):
        assert came.byte_count.sum() == 3 * 252_000
    at_sink = {
        (image, byte): t for image, byte, t in zip(sink.image, sink.first_byte, sink.t_ns, strict=True)
    }
    later_ns = [
        t - at_sink[image, byte]
        for image, byte, t in zip(cloud.image, cloud.first_byte, cloud.t_ns, strict=True)
    ]
    assert min(later_ns) >= 50_000_000


@pytest.mark.parametrize("preset", PRESETS)
def test_all_that_was_spent_is_what_the_metrics_say(preset):
    trace = run(preset)
    spent, known = until(trace, trace.horizon_ns), metrics(trace)
    assert spent.radio_j == pytest.approx(known["energy_radio"].value, rel=1e-9)
    assert spent.radio_j + spent.platform_j == pytest.approx(known["energy_total"].value, rel=1e-9)
    assert spent.lost == known["attempts_lost"].value
    assert spent.sent_bytes == trace.counters.size_bytes[:, EventKind.AIR].sum()


@pytest.mark.parametrize("preset", ["office", "greenhouse"])
def test_the_nodes_energies_add_up_to_that_of_all(preset):
    trace = run(preset)
    times_ns = [0, trace.horizon_ns // 3, trace.horizon_ns]
    spent, by_node_j = until(trace, times_ns), energy_by_node_j(trace, times_ns)
    np.testing.assert_allclose(by_node_j.sum(axis=1), spent.radio_j + spent.platform_j, rtol=1e-9)
    assert (np.diff(by_node_j, axis=0)[:, camera_nodes(trace)] > 0.0).all()
    assert not by_node_j[:, ~camera_nodes(trace)].any()


@pytest.mark.parametrize("preset", ["thesis-link", "greenhouse"])
def test_after_the_warm_up_as_much_was_spent_as_the_metrics_say(preset):
    trace = run(preset, "run.warmup_s=4.321", "nodes.images=0")
    spent, known = until(trace, [to_ns(4.321), trace.horizon_ns]), metrics(trace)
    assert np.diff(spent.radio_j)[0] == pytest.approx(known["energy_radio"].value, rel=1e-9)
    assert np.diff(spent.radio_j + spent.platform_j)[0] == pytest.approx(
        known["energy_total"].value, rel=1e-9
    )


def test_minutes_are_those_of_the_counters():
    trace = run("greenhouse")
    counters = trace.counters
    spent = until(trace, counters.edges_ns)
    platform_s = np.diff(spent.platform_j)
    asleep_s = counters.states_ns[:, :12, State.ASLEEP].sum(axis=1) / NS_PER_S
    whole_s = 12 * np.diff(counters.edges_ns) / NS_PER_S
    power = trace.config.energy
    expected = power.platform_w * (whole_s - asleep_s) + power.platform_sleep_w * asleep_s
    np.testing.assert_allclose(platform_s, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("t_s", "sent_bytes", "lost", "radio_j", "platform_j"),
    [
        (72.0, 1500, 1, (4 + 4 * 68) + 4 * 72, 16 * 2 * 72),
        (76.05, 2000, 1, (8 + 2 * 0.05 + 4 * 68) + 4 * 76.05, 16 * 2 * 76.05),
        (155.0, 3540, 2, (10.5 + 2 * 4.1 + 4 * 140.4) + (4 + 8 * 10 + 4 * 141), 16 * (155 + 145) + 32 * 10),
    ],
)
def test_what_the_small_run_spent_is_what_paper_says(t_s, sent_bytes, lost, radio_j, platform_j):
    """When a frame fails and the next begins, in the middle of an acknowledgement, and after a sleep; sending
    takes 1 W, receiving 2, listening 4, sleeping 8, and the rest of a node 16 and 32.
    """
    spent = until(trace_of(small_run), to_ns(t_s))
    assert (spent.sent_bytes, spent.lost) == (sent_bytes, lost)
    assert spent.radio_j == pytest.approx(radio_j, rel=1e-12)
    assert spent.platform_j == pytest.approx(platform_j, rel=1e-12)


@given(st.lists(st.floats(0.0, 200.0), min_size=1, max_size=20))
def test_any_moments_can_be_asked_for(moments_s):
    """Whether asked for one by one or together; nothing spent is ever taken back."""
    trace = trace_of(small_run)
    spent = until(trace, [to_ns(t_s) for t_s in moments_s])
    order = np.argsort(moments_s)
    for column in (spent.sent_bytes, spent.lost, spent.radio_j, spent.platform_j):
        assert column.shape == (len(moments_s),)
        assert (np.diff(column[order]) >= 0).all()
    one = [until(trace, to_ns(t_s)) for t_s in moments_s]
    assert [float(s.radio_j) for s in one] == spent.radio_j.tolist()
    frames = trace.events.of(EventKind.AIR)
    for t_s, sent, lost in zip(moments_s, spent.sent_bytes, spent.lost, strict=True):
        t_ns = to_ns(t_s)
        assert sent == frames.size_bytes[frames.t_ns <= t_ns].sum()
        assert lost == np.count_nonzero(trace.events.of(EventKind.LOSS).t_ns <= t_ns)


def test_power_is_that_of_the_state_at_every_instant():
    """Steps of the energy are the powers of the states, which a brute count in milliseconds knows."""
    trace = run("thesis-link", "nodes.duty_cycle=0.5", "nodes.duty_period_s=1", "run.horizon_s=3")
    step_ns = 250_000
    moments = np.arange(0, trace.horizon_ns, step_ns)
    frames = trace.events.of(EventKind.AIR, EventKind.ACK)
    state = np.full((3, len(moments) - 1), 3)
    middle = moments[:-1] + step_ns // 2
    inside = (frames.t_ns[:, None] <= middle) & (middle < (frames.t_ns + frames.duration_ns)[:, None])
    for node in range(3):
        state[node, inside[frames.peer == node].any(axis=0)] = State.RECEIVING
        changes = trace.events.of(EventKind.DOWN, EventKind.UP)
        changes = changes.where(changes.node == node)
        last = np.searchsorted(changes.t_ns, middle, side="right") - 1
        down = (last >= 0) & (changes.kind[np.maximum(last, 0)] == EventKind.DOWN)
        state[node, down] = State.ASLEEP
        state[node, inside[frames.node == node].any(axis=0)] = State.SENDING
    power = trace.config.energy
    watts = np.array([power.tx_w, power.sleep_w, power.rx_w, power.idle_w])
    expected_j = np.cumsum(watts[state].sum(axis=0)) * step_ns / NS_PER_S
    np.testing.assert_allclose(until(trace, moments[1:]).radio_j, expected_j, rtol=0.02, atol=1e-3)


@pytest.mark.parametrize("keep", ["images", "counters"])
def test_without_a_log_there_is_one_sentence(keep):
    trace = run("thesis-link", f"run.keep={keep}", "nodes.image_bytes=500")
    for ask in (lambda: arrivals(trace), lambda: until(trace, 0)):
        with pytest.raises(InputError, match=f"run.keep={keep}"):
            ask()


def test_a_place_that_is_not_there_is_one_sentence():
    with pytest.raises(InputError, match="no cloud; try sink"):
        arrivals(run("thesis-link", "nodes.image_bytes=500"), at="cloud")
    with pytest.raises(InputError, match="not a street grid"):
        arrivals(run("street-grid"))


def test_nothing_arrives_where_nothing_is_sent():
    trace = simulate(with_settings(NetworkConfig(), ["nodes.spacing_m=500"]))
    assert len(arrivals(trace)) == 0
    spent = until(trace, [0, trace.horizon_ns])
    assert spent.sent_bytes.tolist() == spent.lost.tolist() == [0, 0]

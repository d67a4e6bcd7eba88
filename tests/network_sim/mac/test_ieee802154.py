"""Unslotted IEEE 802.15.4: scenes whose answer is known to the nanosecond, and saturated nodes."""

from __future__ import annotations

from collections.abc import Generator
from itertools import islice
from typing import Any

import numpy as np
import pytest
import simpy

from network_sim.config import MacConfig, NetworkConfig, NodesConfig, RadioConfig
from network_sim.mac.context import MacContext, random_below
from network_sim.mac.ieee802154 import Ieee802154
from network_sim.mac.medium import Medium
from network_sim.mac.saturation import saturation
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio
from network_sim.trace.log import Recorder
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet, PacketKind
from tests.network_sim.fixed_backoffs import FixedBackoffs

US = 1000
SLOT = 320 * US
CCA = 128 * US
TURN = 192 * US
ACK = 352 * US
ACK_WAIT = 864 * US
LIFS = 640 * US
FRAME = (6 + 11 + 100) * 32 * US
"""Of a payload of 100 bytes."""
FIRST = CCA + TURN
"""When a node without backoff starts to send."""
SINK, NODE, OTHER = 0, 1, 2
AROUND_M = [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0], [-20.0, 0.0], [0.0, -20.0], [14.0, 14.0]]


class Scene:
    """Nodes around a sink, everyone hears everyone; ``run`` it and look at ``events``."""

    def __init__(self, *slots: int, ack: bool = True, drawn: np.random.Generator | None = None) -> None:
        self.env = simpy.Environment()
        self.config = NetworkConfig(mac=MacConfig(ack=ack))
        rng = np.random.default_rng(0)
        radio = Radio(self.config.radio, self.config.mac, rng)
        self.medium = Medium(self.env, radio, FixedPlaces(np.array(AROUND_M)), rng)
        self.recorder = Recorder("all", len(AROUND_M))
        self.down: set[int] = set()
        self.received: list[tuple[int, int]] = []
        self.deliveries: list[tuple[int, Delivery]] = []
        backoffs = FixedBackoffs(*slots) if drawn is None else drawn
        self.mac = Ieee802154(
            MacContext(
                self.env, self.medium, self.config, self.recorder, backoffs, self._is_up, self._receive
            )
        )

    def _is_up(self, node: int) -> bool:
        return node not in self.down

    def _receive(self, packet: Packet, receiver: int) -> None:
        self.received.append((packet.id, receiver))

    def send(
        self, sender: int, at_ns: int = 0, receiver: int = SINK, count: int = 1, size_bytes: int = 100
    ) -> None:
        """A node with ``count`` packets that it sends one after the other."""

        def sending() -> Generator[simpy.Event, Any, None]:
            yield self.env.timeout(at_ns)
            for number in range(count):
                packet = Packet(10 * sender + number, PacketKind.IMAGE, sender, receiver, size_bytes)
                delivery = yield from self.mac.send(packet, sender, receiver)
                self.deliveries.append((self.env.now, delivery))

        self.env.process(sending())

    def jam(self, start_ns: int, duration_ns: int, node: int = OTHER) -> None:
        """A transmission of a node that respects nobody."""

        def jamming() -> Generator[simpy.Event, Any, None]:
            yield self.env.timeout(start_ns)
            transmission = self.medium.start(node, duration_ns, SINK)
            yield self.env.timeout(duration_ns)
            self.medium.finish(transmission)

        self.env.process(jamming())

    def run(self) -> dict[EventKind, list[tuple[int, int, Cause]]]:
        """(time, node, cause) of each kind."""
        self.env.run()
        names = tuple("abcdef")
        events = self.recorder.trace(
            self.config, names, np.array(AROUND_M), self.env.now, ("sink",) * 6
        ).events
        lines: dict[EventKind, list[tuple[int, int, Cause]]] = {kind: [] for kind in EventKind}
        for t_ns, kind, node, cause in zip(events.t_ns, events.kind, events.node, events.cause, strict=True):
            lines[EventKind(kind)].append((int(t_ns), int(node), Cause(cause)))
        return lines


def test_exchange_takes_its_times_and_is_followed_by_the_interframe_space() -> None:
    scene = Scene(5, 2)
    scene.send(NODE, count=2)
    lines = scene.run()
    sent = 5 * SLOT + FIRST
    done = sent + FRAME + TURN + ACK
    again = done + LIFS + 2 * SLOT + FIRST
    assert lines[EventKind.AIR] == [(sent, NODE, Cause.NONE), (again, NODE, Cause.NONE)]
    assert lines[EventKind.DELIVER][0] == (sent + FRAME, NODE, Cause.NONE)
    assert lines[EventKind.ACK][0] == (sent + FRAME + TURN, SINK, Cause.NONE)
    assert lines[EventKind.LOSS] == []
    assert scene.received == [(10, SINK), (11, SINK)]
    ended = again + FRAME + TURN + ACK
    assert scene.deliveries == [(done, Delivery(True, Cause.NONE, 1)), (ended, Delivery(True, Cause.NONE, 1))]


@pytest.mark.parametrize(("size_bytes", "space"), [(7, 192 * US), (8, LIFS)])
def test_short_frames_have_a_shorter_interframe_space(size_bytes: int, space: int) -> None:
    scene = Scene()
    scene.send(NODE, count=2, size_bytes=size_bytes)
    (first, _, _), (second, _, _) = scene.run()[EventKind.AIR]
    assert second - first == (6 + 11 + size_bytes) * 32 * US + TURN + ACK + space + FIRST


def test_backoff_exponent_grows_to_its_maximum_and_five_busy_looks_are_a_failure() -> None:
    scene = Scene(31, 31, 31, 31, 31)
    scene.jam(0, NS_PER_S)
    scene.send(NODE)
    lines = scene.run()
    given_up = (7 + 15 + 31 + 31 + 31) * SLOT + 5 * CCA
    assert scene.deliveries == [(given_up, Delivery(False, Cause.CHANNEL, 0))]
    assert lines[EventKind.LOSS] == [(given_up, NODE, Cause.CHANNEL)]
    assert lines[EventKind.AIR] == []


def assert_even(numbers: np.ndarray, most: int) -> None:
    """All numbers below ``most`` and no others, each as often, within five standard deviations."""
    assert set(numbers) == set(range(most))
    expected = len(numbers) / most
    assert (np.abs(np.bincount(numbers) - expected) < 5.0 * np.sqrt(expected)).all()


def test_the_first_backoff_is_drawn_evenly_from_eight_numbers_of_slots() -> None:
    """0 to 2^BE - 1 with BE = 3."""
    scene = Scene(drawn=np.random.default_rng(0))
    scene.send(NODE, count=6000, size_bytes=8)
    begins_ns = np.array([t_ns for t_ns, _, _ in scene.run()[EventKind.AIR]])
    exchange = (6 + 11 + 8) * 32 * US + TURN + ACK + LIFS + FIRST
    slots, rest_ns = np.divmod(np.diff(begins_ns) - exchange, SLOT)
    assert not rest_ns.any()
    assert_even(slots, 8)


def test_numbers_for_backoffs_are_drawn_evenly_from_those_below_the_window() -> None:
    draws = np.fromiter(islice(random_below(32, np.random.default_rng(0)), 32_000), int)
    for window in (8, 16, 32):
        assert_even(draws & (window - 1), window)


@pytest.mark.parametrize(("late_ns", "sent"), [(-1, 4 * SLOT + FIRST), (0, 13 * SLOT + CCA + FIRST)])
def test_a_frame_that_lasts_to_the_end_of_the_assessment_makes_it_busy(late_ns: int, sent: int) -> None:
    scene = Scene(4, 9)
    scene.jam(0, 4 * SLOT + CCA + late_ns)
    scene.send(NODE)
    assert scene.run()[EventKind.AIR] == [(sent, NODE, Cause.NONE)]


@pytest.mark.parametrize("late_ns", [0, 1])
def test_a_sender_that_turns_round_is_deaf_and_not_yet_heard(late_ns: int) -> None:
    scene = Scene(0, 0, 15, 0)
    second_ns = TURN + late_ns
    scene.send(NODE)
    scene.send(OTHER, at_ns=second_ns)
    lines = scene.run()
    if late_ns == 0:
        assert lines[EventKind.AIR][:2] == [(FIRST, NODE, Cause.NONE), (FIRST + TURN, OTHER, Cause.NONE)]
        assert (FIRST + TURN + FRAME, OTHER, Cause.COLLISION) in lines[EventKind.LOSS]
    else:
        assert lines[EventKind.LOSS] == []
        assert lines[EventKind.AIR][1][0] == second_ns + CCA + 15 * SLOT + FIRST


@pytest.mark.parametrize(
    ("after_frame_ns", "later_ns"),
    [(10 * US, 0), (TURN + ACK - CCA, 3 * SLOT + CCA), (TURN + ACK - CCA + 1, 0)],
)
def test_the_gap_before_an_acknowledgement_is_idle_and_itself_is_busy(
    after_frame_ns: int, later_ns: int
) -> None:
    scene = Scene(0, 0, 3)
    asks_ns = FIRST + FRAME + after_frame_ns
    scene.send(NODE)
    scene.send(OTHER, at_ns=asks_ns)
    lines = scene.run()
    assert bool(lines[EventKind.LOSS]) == (after_frame_ns < TURN)
    assert lines[EventKind.AIR][1] == (asks_ns + later_ns + FIRST, OTHER, Cause.NONE)


def test_retries_end_after_four_frames() -> None:
    scene = Scene()
    period = FIRST + FRAME + ACK_WAIT
    frames = [(turn * period + FIRST, NODE, Cause.NONE) for turn in range(4)]
    for t_ns, _, _ in frames:
        scene.jam(t_ns - 1, 2)  # the receiver stays with what came first
    scene.send(NODE)
    lines = scene.run()
    assert lines[EventKind.AIR] == frames
    assert lines[EventKind.LOSS] == [(t_ns + FRAME, NODE, Cause.COLLISION) for t_ns, _, _ in frames]
    assert scene.deliveries == [(4 * period, Delivery(False, Cause.RETRIES, 4))]
    assert scene.received == []


def test_a_frame_whose_acknowledgement_is_lost_is_sent_again_and_delivered_once() -> None:
    scene = Scene(0, 3)
    scene.jam(FIRST + FRAME + TURN - 1, 2)
    scene.send(NODE)
    lines = scene.run()
    again = FIRST + FRAME + ACK_WAIT + 3 * SLOT + FIRST
    assert [t for t, _, _ in lines[EventKind.AIR]] == [FIRST, again]
    assert lines[EventKind.LOSS] == [(FIRST + FRAME + TURN + ACK, NODE, Cause.ACK_LOST)]
    assert lines[EventKind.DELIVER] == [(FIRST + FRAME, NODE, Cause.NONE)]
    assert len(lines[EventKind.ACK]) == 2
    assert scene.received == [(10, SINK)]
    assert scene.deliveries == [(again + FRAME + TURN + ACK, Delivery(True, Cause.NONE, 2))]


def test_a_packet_that_arrived_but_was_never_acknowledged_is_told_apart() -> None:
    scene = Scene()
    period = FIRST + FRAME + ACK_WAIT
    for turn in range(4):
        scene.jam(turn * period + FIRST + FRAME + TURN - 1, 2)
    scene.send(NODE)
    lines = scene.run()
    assert scene.deliveries == [(4 * period, Delivery(False, Cause.ACK_LOST, 4))]
    assert scene.received == [(10, SINK)]
    assert len(lines[EventKind.DELIVER]) == 1
    assert [cause for _, _, cause in lines[EventKind.LOSS]] == [Cause.ACK_LOST] * 4


def test_a_node_that_has_to_acknowledge_does_not_send_meanwhile() -> None:
    """It hears nothing during its own turnaround, yet its assessment is busy."""
    scene = Scene(0, 0, 5)
    scene.send(NODE)
    asks_ns = FIRST + FRAME + 10 * US
    scene.send(SINK, at_ns=asks_ns, receiver=OTHER)
    lines = scene.run()
    assert lines[EventKind.LOSS] == []
    assert (asks_ns + CCA + 5 * SLOT + FIRST, SINK, Cause.NONE) in lines[EventKind.AIR]


def test_a_node_that_is_down_neither_sends_nor_receives() -> None:
    asleep = Scene()
    asleep.down = {SINK}
    asleep.send(NODE)
    lines = asleep.run()
    assert [cause for _, _, cause in lines[EventKind.LOSS]] == [Cause.NODE_DOWN] * 4
    assert asleep.deliveries[0][1] == Delivery(False, Cause.RETRIES, 4)
    assert lines[EventKind.ACK] == []
    silent = Scene()
    silent.down = {NODE}
    silent.send(NODE)
    assert silent.run()[EventKind.AIR] == []
    assert silent.deliveries == [(CCA, Delivery(False, Cause.NODE_DOWN, 0))]


def test_without_acknowledgements_the_sender_does_not_know_of_a_loss() -> None:
    scene = Scene(ack=False)
    scene.jam(FIRST - 1, 2)
    scene.send(NODE, count=2)
    lines = scene.run()
    again = FIRST + FRAME + LIFS + FIRST
    assert scene.deliveries == [
        (FIRST + FRAME, Delivery(True, Cause.COLLISION, 1)),
        (again + FRAME, Delivery(True, Cause.NONE, 1)),
    ]
    assert lines[EventKind.LOSS] == [(FIRST + FRAME, NODE, Cause.COLLISION)]
    assert lines[EventKind.ACK] == []
    assert scene.received == [(11, SINK)]


def latre_s(payload_bytes: int, address_bytes: int = 0, ack: bool = False) -> float:
    """Mean time for a packet of one undisturbed sender (Latré et al. 2005): without channel assessment."""
    frame_bytes = payload_bytes + address_bytes + 5
    exchange = (TURN + ACK if ack else 0) + (192 * US if frame_bytes <= 18 else LIFS)
    return (3.5 * SLOT + (6 + frame_bytes) * 32 * US + exchange) / NS_PER_S


def saturated_bps(payload_bytes: int, ack: bool) -> float:
    """The same with short addresses, channel assessment and the turnaround after it."""
    return 8 * payload_bytes / (latre_s(payload_bytes, 6, ack) + FIRST / NS_PER_S)


def test_the_closed_form_is_latre_s_and_the_thesis_link_s() -> None:
    assert round(8 * 122 / latre_s(122) / 1000, 1) == 162.2
    assert round(8 * 122 / latre_s(122, ack=True) / 1000, 1) == 148.8
    assert round(saturated_bps(116, ack=True) / 1000, 1) == 134.9


@pytest.mark.parametrize("ack", [True, False])
@pytest.mark.parametrize("payload_bytes", [116, 82])
def test_one_saturated_node_reaches_the_closed_form(payload_bytes: int, ack: bool) -> None:
    config = NetworkConfig(mac=MacConfig(ack=ack), nodes=NodesConfig(payload_bytes=payload_bytes))
    result = saturation(config, 1, 30.0, seed=1)
    assert result.throughput_bps == pytest.approx(saturated_bps(payload_bytes, ack), rel=0.01)
    assert result.delivery_ratio == 1.0
    assert result.losses == {}


@pytest.mark.parametrize(
    ("count", "kbps", "delivered"),
    [(1, 136.1, 1.00), (2, 138.7, 0.88), (3, 140.8, 0.75), (4, 141.1, 0.64), (5, 139.1, 0.55)],
)
def test_saturated_nodes_share_the_channel_as_in_ns3(count: int, kbps: float, delivered: float) -> None:
    """Rates by ns-3 3.44 (tests/benchmarks/ns3_saturation.py), shares of delivered packets by SPEC 6.1."""
    result = saturation(NetworkConfig(radio=RadioConfig(capture_db=-5.0)), count, 60.0, seed=2)
    assert result.throughput_bps / 1000 == pytest.approx(kbps, rel=0.02)
    assert result.delivery_ratio == pytest.approx(delivered, abs=0.05)
    fair = sum(result.packets_by_node) / count
    assert max(result.packets_by_node) < 1.15 * fair


def test_nodes_of_equal_power_share_less_than_in_ns3_because_no_overlapping_frame_survives() -> None:
    """Of n nodes that contend, ns-3 saves most first frames of a collision; here both are lost."""
    strict, as_ns3 = (
        saturation(NetworkConfig(radio=RadioConfig(capture_db=capture_db)), 3, 60.0, seed=2)
        for capture_db in (None, -5.0)
    )
    lost, saved = (run.losses[Cause.COLLISION] / run.attempts for run in (strict, as_ns3))
    assert 1.25 < lost / saved < 2.0  # both frames of a pair, or the later one only and some of the first
    assert 0.85 < strict.throughput_bps / as_ns3.throughput_bps < 0.95


def test_the_same_seed_gives_the_same_result() -> None:
    first, again, other = (saturation(NetworkConfig(), 3, 5.0, seed) for seed in (3, 3, 4))
    assert first == again != other

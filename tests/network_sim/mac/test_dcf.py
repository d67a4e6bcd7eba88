"""IEEE 802.11b DCF: scenes whose answer is known to the nanosecond."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
import simpy

from network_sim.config import MacConfig, NetworkConfig, RadioConfig
from network_sim.mac import make_wlan, physical_layer
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio
from network_sim.trace.log import Recorder
from network_sim.types import Cause, Delivery, EventKind, Packet, PacketKind
from tests.network_sim.fixed_backoffs import FixedBackoffs

US = 1000
SLOT = 20 * US
GAP = 12 * US
DIFS = 50 * US
EIFS = 364 * US
ACK = 248 * US
RTS = 272 * US
LOST = 224 * US + DIFS
"""From the end of a frame that is not answered until its sender counts again."""
DATA = 965_818
EXCHANGE = DATA + GAP + ACK
A, B, C, D, SINK = range(5)
TOGETHER_M = ((20, 0), (0, 20), (-20, 0), (0, -20), (0, 0))
HIDDEN_M = ((90, 0), (-90, 0), (0, 50), (0, -50), (0, 0))
"""With a carrier sense of 110 m, A and B sense only the others."""


class Scene:
    """Nodes that send packets of 1000 bytes over UDP; ``run`` it and look at what happened."""

    def __init__(
        self,
        *slots: int,
        at_m: tuple[tuple[int, int], ...] = TOGETHER_M,
        rts: bool = False,
        sense_m: float = 220,
        rate_bps: float = 11e6,
    ) -> None:
        self.env = simpy.Environment()
        self.config = config = NetworkConfig(
            radio=RadioConfig(sense_range_m=sense_m),
            mac=MacConfig(kind="ieee80211b", rts=rts, rate_bps=rate_bps),
        )
        rng = np.random.default_rng(0)
        self.medium = Medium(self.env, Radio(config.radio, config.mac, rng), FixedPlaces(np.array(at_m)), rng)
        self.recorder = Recorder("all", len(at_m))
        self.down: set[int] = set()
        self.received: list[tuple[int, int]] = []
        self.deliveries: dict[int, list[Delivery]] = {node: [] for node in range(len(at_m))}
        self.ended: dict[int, int] = {}
        context = MacContext(
            self.env,
            self.medium,
            config,
            self.recorder,
            FixedBackoffs(*slots),
            lambda node: node not in self.down,
            lambda packet, node: self.received.append((packet.id, node)),
        )
        self.mac = make_wlan(context)

    def send(self, sender: int, *starts_ns: int, receiver: int = SINK) -> None:
        """Packets that are ready at these times, or when the one before is done."""

        def process() -> Generator[simpy.Event, Any, None]:
            for index, start_ns in enumerate(starts_ns):
                yield self.env.timeout(max(start_ns - self.env.now, 0))
                packet = Packet(10 * sender + index, PacketKind.IMAGE, sender, receiver, 1028)
                delivery = yield from self.mac.send(packet, sender, receiver)
                self.deliveries[sender].append(delivery)
                self.ended[sender] = int(self.env.now)

        self.env.process(process())

    def at(self, t_ns: int, do: Any) -> None:
        self.env.timeout(t_ns).callbacks.append(lambda _: do())

    def run(self) -> None:
        self.env.run()
        self.events = self.recorder.trace(
            self.config, ("",) * 5, None, int(self.env.now) + 1, ("node",) * 5
        ).events

    def times(self, kind: EventKind, node: int) -> list[int]:
        mask = (self.events.kind == kind) & (self.events.node == node)
        return self.events.t_ns[mask].tolist()

    def losses(self, node: int) -> list[tuple[int, Cause]]:
        events = self.events.where((self.events.kind == EventKind.LOSS) & (self.events.node == node))
        return [
            (t, Cause(cause)) for t, cause in zip(events.t_ns.tolist(), events.cause.tolist(), strict=True)
        ]


def test_a_data_frame_lasts_what_the_standard_says() -> None:
    assert (
        physical_layer(MacConfig(kind="ieee80211b")).data_ns(1028)
        == DATA
        == round(192e3 + 8 * 1064 * 1000 / 11)
    )


@pytest.mark.parametrize(
    ("rate_bps", "data_us", "reply_us"),
    [(1e6, 192 + 8 * 1064, 304), (2e6, 192 + 4 * 1064, 248), (5.5e6, 192 + 8 * 1064 / 5.5, 248)],
)
def test_slower_frames_last_longer_and_are_answered_at_a_rate_no_faster(
    rate_bps: float, data_us: float, reply_us: int
) -> None:
    it = Scene(5, 0, rts=True, rate_bps=rate_bps)
    it.send(A, 0)
    it.run()
    cts = round(192e3 + 8e9 * 20 / min(rate_bps, 2e6)) + GAP
    data = cts + reply_us * US + GAP
    assert it.times(EventKind.AIR, A) == [data]
    assert it.times(EventKind.DELIVER, A) == [data + round(data_us * US)]
    assert it.ended[A] == data + round(data_us * US) + GAP + reply_us * US


def test_a_slower_rate_reaches_farther() -> None:
    at_m = ((150, 0), (0, 20), (-20, 0), (0, -20), (0, 0))
    ways = {}
    for rate_bps in (1e6, 2e6, 5.5e6, 11e6):
        it = Scene(*range(7), at_m=at_m, rate_bps=rate_bps)
        it.send(A, 0)
        it.run()
        ways[rate_bps] = it.deliveries[A][0].ok
    assert ways == {1e6: True, 2e6: True, 5.5e6: False, 11e6: False}


def test_a_lone_station_sends_at_once_and_backs_off_after_it() -> None:
    it = Scene(5, 0, 31)
    it.send(A, 0, 0, 0)
    it.run()
    second = EXCHANGE + DIFS + 5 * SLOT
    third = second + EXCHANGE + DIFS
    assert it.times(EventKind.AIR, A) == [0, second, third]
    assert it.times(EventKind.ACK, SINK) == [start + DATA + GAP for start in (0, second, third)]
    assert it.times(EventKind.DELIVER, A) == [start + DATA for start in (0, second, third)]
    assert it.deliveries[A] == [Delivery(True, Cause.NONE, 1)] * 3
    assert it.received == [(0, SINK), (1, SINK), (2, SINK)]
    assert it.ended[A] == third + EXCHANGE


def test_the_backoff_goes_on_without_a_packet() -> None:
    it = Scene(5, 5)
    over = EXCHANGE + DIFS + 5 * SLOT
    it.send(A, 0, EXCHANGE + 100 * US, over + 5000 * US)
    it.run()
    assert it.times(EventKind.AIR, A) == [0, over, over + 5000 * US]


def test_a_busy_channel_freezes_the_countdown() -> None:
    it = Scene(3, 1, 31)
    it.send(A, 0, 0)
    it.send(B, 100 * US)
    it.run()
    second = EXCHANGE + DIFS + 1 * SLOT
    assert it.times(EventKind.AIR, A) == [0, second]
    assert it.times(EventKind.AIR, B) == [second + EXCHANGE + DIFS + 2 * SLOT]


def test_a_slot_counts_only_when_it_was_idle_to_its_end() -> None:
    it = Scene(4, 31, 63, at_m=((90, 0), (500, 0), (0, 10), (195, 0), (0, 0)), sense_m=110)
    it.send(C, 0)
    it.send(A, 100 * US)  # counts 4 slots from a DIFS after the exchange
    start = EXCHANGE + DIFS + 2 * SLOT + 19 * US
    it.send(D, start, receiver=B)  # senses only A, which cannot read it
    it.run()
    assert it.times(EventKind.AIR, D)[0] == start
    assert it.times(EventKind.AIR, A)[0] == start + DATA + EIFS + 2 * SLOT


def test_the_same_slot_is_a_collision_and_the_window_doubles() -> None:
    it = Scene(3, 3, 7, 63, 40)
    it.send(A, 0)
    it.send(B, 100 * US)
    it.send(C, 200 * US)
    it.run()
    first = EXCHANGE + DIFS + 3 * SLOT
    # The fixed backoffs: B 3, C 3, A's backoff after its packet 7, and after the collision B 63, C 40 of 64.
    assert it.losses(B) == it.losses(C) == [(first + DATA, Cause.COLLISION)]
    second = first + DATA + LOST + 40 * SLOT
    assert it.times(EventKind.AIR, C) == [first, second]
    assert it.times(EventKind.AIR, B) == [first, second + EXCHANGE + DIFS + 23 * SLOT]
    assert it.deliveries[B] == it.deliveries[C] == [Delivery(True, Cause.NONE, 2)]


def test_after_a_success_the_backoff_is_of_the_smallest_window_again() -> None:
    it = Scene(3, 3, 7, 63, 40, 63)
    it.send(A, 0)
    it.send(B, 100 * US)
    it.send(C, 200 * US, 200 * US)
    it.run()
    second = EXCHANGE + DIFS + 3 * SLOT + DATA + LOST + 40 * SLOT
    of_b = second + EXCHANGE + DIFS + 23 * SLOT
    # As above; then C draws 63, which is 31 of 32, and counts 23 of them before B's frame.
    assert it.times(EventKind.AIR, C)[2] == of_b + EXCHANGE + DIFS + 8 * SLOT


def test_who_could_not_read_a_frame_waits_for_an_eifs() -> None:
    it = Scene(3, 3, 7, 2, 63, 50)
    it.send(A, 0)
    it.send(B, 100 * US)
    it.send(C, 200 * US)
    first = EXCHANGE + DIFS + 3 * SLOT
    it.send(D, first + 10 * US)
    it.run()
    # D draws 2 during the collision; B and C wait for their answers and draw 63 and 50.
    assert it.losses(B) == [(first + DATA, Cause.COLLISION)]
    assert it.times(EventKind.AIR, D) == [first + DATA + EIFS + 2 * SLOT]


def test_after_seven_attempts_a_packet_is_given_up() -> None:
    it = Scene(*[1023] * 6, 3, at_m=((0, 0), (5, 0), (6, 0), (7, 0), (101, 0)))
    it.send(A, 0, 0)
    it.run()
    starts = [0]
    for window in (64, 128, 256, 512, 1024, 1024):
        starts.append(starts[-1] + DATA + LOST + (window - 1) * SLOT)
    assert it.losses(A)[:7] == [(start + DATA, Cause.RANGE) for start in starts]
    next_packet = starts[-1] + DATA + LOST + 3 * SLOT  # from the smallest window again
    assert it.times(EventKind.AIR, A)[:8] == [*starts, next_packet]
    assert it.deliveries[A][0] == Delivery(False, Cause.RETRIES, 7)
    assert it.received == []


def test_hidden_stations_collide() -> None:
    it = Scene(10, 40, at_m=HIDDEN_M, sense_m=110)
    it.send(A, 0)
    it.send(B, 500 * US)
    it.run()
    assert it.losses(A)[0] == (DATA, Cause.COLLISION)
    assert it.losses(B)[0] == (500 * US + DATA, Cause.COLLISION)
    assert it.times(EventKind.AIR, A)[:2] == [0, DATA + LOST + 10 * SLOT]
    assert it.times(EventKind.AIR, B)[0] == 500 * US


@pytest.mark.parametrize("start_us", [500, 600, 1500])
def test_a_clear_to_send_keeps_hidden_stations_silent(start_us: int) -> None:
    it = Scene(2, at_m=HIDDEN_M, sense_m=110, rts=True)
    it.send(A, 0)
    it.send(B, start_us * US)  # while the CTS is on the air, or while it reserves the channel
    it.run()
    end = RTS + GAP + ACK + GAP + EXCHANGE
    assert it.times(EventKind.ACK, A) == [0]
    assert it.times(EventKind.ACK, SINK)[:2] == [RTS + GAP, end - ACK]
    assert it.times(EventKind.AIR, A) == [RTS + GAP + ACK + GAP]
    assert it.times(EventKind.ACK, B) == [end + DIFS + 2 * SLOT]
    assert it.losses(A) == it.losses(B) == []


def test_the_stronger_of_two_hidden_stations_is_captured() -> None:
    it = Scene(at_m=((-25, 0), (90, 0), (0, 50), (0, -50), (0, 0)), sense_m=110)  # 11.1 dB
    it.send(A, 0)
    it.send(B, 500 * US)
    it.run()
    assert it.losses(A) == []
    assert it.losses(B)[0] == (500 * US + DATA, Cause.COLLISION)
    assert it.deliveries[A] == [Delivery(True, Cause.NONE, 1)]


def test_a_lost_acknowledgement_repeats_the_frame_but_not_the_packet() -> None:
    it = Scene(4)
    it.send(A, 0)

    def jam() -> None:
        frame = it.medium.start(B, 50 * US, C)
        it.at(50 * US, lambda: it.medium.finish(frame))

    it.at(DATA + GAP + 10 * US, jam)
    it.run()
    assert it.losses(A) == [(EXCHANGE, Cause.ACK_LOST)]
    # What A heard last was the damaged acknowledgement.
    assert it.times(EventKind.AIR, A) == [0, EXCHANGE + EIFS + 4 * SLOT]
    assert it.times(EventKind.DELIVER, A) == [DATA]
    assert it.received == [(0, SINK)]
    assert it.deliveries[A] == [Delivery(True, Cause.NONE, 2)]


def test_a_sink_that_is_down_does_not_answer_and_a_sender_that_is_down_does_not_send() -> None:
    it = Scene(at_m=TOGETHER_M)
    it.down.add(SINK)
    it.at(DATA + US, lambda: it.down.discard(SINK))
    it.send(A, 0)
    it.run()
    assert it.losses(A) == [(DATA, Cause.NODE_DOWN)]
    assert it.deliveries[A] == [Delivery(True, Cause.NONE, 2)]
    it = Scene()
    it.down.add(A)
    it.send(A, 0)
    it.send(B, 10)
    it.run()
    assert it.deliveries[A] == [Delivery(False, Cause.NODE_DOWN, 0)]
    assert it.times(EventKind.AIR, B) == [10]


def test_the_sink_can_send_too() -> None:
    it = Scene(2, 5)
    it.send(A, 0)
    it.send(SINK, 100 * US, receiver=B)  # it is receiving, and then answers
    it.run()
    assert it.times(EventKind.AIR, SINK) == [EXCHANGE + DIFS + 2 * SLOT]
    assert it.received == [(0, SINK), (10 * SINK, B)]

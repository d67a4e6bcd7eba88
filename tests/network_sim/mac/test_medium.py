"""The shared channel: who senses whom, and which frames survive."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import simpy

from network_sim.config import MacConfig, MacKind, RadioConfig
from network_sim.mac.medium import MEMORY_NS, REFRESH_NS, Medium
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio, oqpsk_bit_error_rate
from network_sim.types import Cause

US = 1000


@dataclass
class Scene:
    """Nodes on a line, and frames (start, duration, sender, receiver) between them."""

    env: simpy.Environment
    medium: Medium
    outcomes: dict[tuple[int, int], Cause]

    def frame(self, start_us: int, duration_us: int, sender: int, receiver: int, **options: Any) -> None:
        def process() -> Generator[simpy.Event, Any, None]:
            yield self.env.timeout(start_us * US)
            frame = self.medium.start(sender, duration_us * US, receiver, **options)
            yield self.env.timeout(frame.end_ns - self.env.now)
            self.outcomes[sender, start_us] = self.medium.finish(frame)

        self.env.process(process())

    def run(self) -> dict[tuple[int, int], Cause]:
        self.env.run()
        return self.outcomes


def scene(*x_m: float, seed: int = 0, kind: MacKind = "ieee80211b", **radio: Any) -> Scene:
    env, rng = simpy.Environment(), np.random.default_rng(seed)
    places = FixedPlaces(np.array([[x, 0.0] for x in x_m]))
    return Scene(env, Medium(env, Radio(RadioConfig(**radio), MacConfig(kind=kind), rng), places, rng), {})


def spread(*x_m: float, **radio: Any) -> Scene:
    """A scene of IEEE 802.15.4."""
    return scene(*x_m, kind="ieee802154", **radio)


def test_alone_within_range() -> None:
    it = scene(0, 100, 101)
    it.frame(0, 100, 0, 1)
    it.frame(200, 100, 0, 2)
    assert it.run() == {(0, 0): Cause.NONE, (0, 200): Cause.RANGE}


def test_equal_frames_that_overlap_collide_and_those_that_touch_do_not() -> None:
    it = scene(-50, 0, 50)
    it.frame(0, 100, 0, 1)
    it.frame(99, 100, 2, 1)
    it.frame(199, 100, 0, 1)
    assert it.run() == {(0, 0): Cause.COLLISION, (2, 99): Cause.COLLISION, (0, 199): Cause.NONE}


@pytest.mark.parametrize(("far_m", "first"), [(64, 0), (64, 50), (62, 0)])
def test_the_stronger_frame_is_captured_from_ten_decibels_on(far_m: float, first: int) -> None:
    it = scene(-20, 0, far_m)  # 20 log10(64 / 20) = 10.1 dB, 20 log10(62 / 20) = 9.8 dB
    it.frame(first, 100, 0, 1)
    it.frame(50 - first, 100, 2, 1)
    near = Cause.NONE if far_m == 64 else Cause.COLLISION
    assert it.run() == {(0, first): near, (2, 50 - first): Cause.COLLISION}


def overlap(it: Scene, later_us: int = 100) -> dict[tuple[int, int], Cause]:
    """Two frames of 125 bytes to node 1: node 0's, and node 2's that begins later."""
    it.frame(0, 4000, 0, 1, size_bytes=125, modulation="oqpsk")
    it.frame(later_us, 4000, 2, 1, size_bytes=125, modulation="oqpsk")
    return it.run()


@pytest.mark.parametrize("later_us", [0, 1, 160, 3999])
def test_spread_frames_of_equal_power_are_both_lost(later_us: int) -> None:
    assert set(overlap(spread(0, 20, 40), later_us).values()) == {Cause.COLLISION}


def test_as_in_ns3_the_first_of_two_equal_spread_frames_has_the_bit_errors_of_0_db() -> None:
    survived = 0
    for later_us in range(1, 400):
        outcomes = overlap(spread(0, 20, 40, seed=later_us, capture_db=-5.0), later_us)
        assert outcomes[2, later_us] == Cause.COLLISION
        survived += outcomes[0, 0] == Cause.NONE
    # IEEE 802.15.4-2006, E.4.1.8: each of the overlapped bits is wrong as at 0 dB.
    overlapped_bits = 1000 * (1.0 - np.arange(1, 400) / 4000)
    expected = np.mean((1.0 - oqpsk_bit_error_rate(1.0)) ** overlapped_bits)
    assert survived / 399 == pytest.approx(expected, abs=3 * np.sqrt(expected * (1 - expected) / 399))


@pytest.mark.parametrize(
    ("settings", "least_db"), [({}, 3.0), ({"capture_db": 3.0}, 3.0), ({"capture_db": 6.0}, 6.0)]
)
def test_the_first_spread_frame_survives_from_the_capture_ratio_on(
    settings: dict[str, float], least_db: float
) -> None:
    for more_db, expected in ((0.01, Cause.NONE), (-0.01, Cause.COLLISION)):
        far_m = 20.0 * 10.0 ** ((least_db + more_db) / 20.0)  # 20 log10(far / 20) is the ratio of the powers
        assert overlap(spread(0, 20, 20 + far_m, **settings))[0, 0] == expected


def test_a_stronger_spread_frame_that_begins_later_is_lost_too() -> None:
    outcomes = overlap(spread(0, 60, 61))
    assert set(outcomes.values()) == {Cause.COLLISION}


def test_noise_and_a_weaker_frame_together_make_bit_errors() -> None:
    """The noise is as strong as the frame: alone it spoils one in seven, with interference nearly all."""
    lost = {}
    for far_m in (32.0, 400.0):  # 4.1 dB and 26 dB below the frame
        lost[far_m] = sum(
            overlap(spread(0, 20, 20 + far_m, seed=seed, noise_dbm=-51.1))[0, 0] != Cause.NONE
            for seed in range(60)
        )
    assert lost[400.0] < 20 < 50 < lost[32.0]


@pytest.mark.parametrize(
    ("second_us", "expected"), [(60, Cause.NONE), (50, Cause.NONE), (49, Cause.COLLISION)]
)
def test_what_counts_is_the_largest_sum_of_interference(second_us: int, expected: Cause) -> None:
    it = scene(-20, 0, 75, -75)  # one of them is 11.5 dB weaker, both at a time 8.5 dB
    it.frame(0, 200, 0, 1)
    it.frame(10, 40, 2, 1)
    it.frame(second_us, 40, 3, 1)
    assert it.run()[0, 0] is expected


def test_who_sends_hears_nothing() -> None:
    it = scene(0, 95, 100)
    it.frame(0, 100, 0, 1)
    it.frame(99, 50, 1, 2)
    assert it.run() == {(0, 0): Cause.COLLISION, (1, 99): Cause.NONE}


def test_noise_and_fading() -> None:
    for noise_dbm, expected in ((-140.0, Cause.NONE), (-40.0, Cause.NOISE)):
        it = scene(0, 50, noise_dbm=noise_dbm)
        it.frame(0, 1000, 0, 1, size_bytes=1000, modulation="cck11")
        assert it.run() == {(0, 0): expected}
    it = scene(0, 100, nakagami_m=1.0)
    for start_us in range(0, 200_000, 100):
        it.frame(start_us, 50, 0, 1)
    outcomes = list(it.run().values())
    share = outcomes.count(Cause.NONE) / len(outcomes)
    assert share == pytest.approx(np.exp(-1), abs=0.04)  # Rayleigh, at the distance where the mean is enough
    assert set(outcomes) == {Cause.NONE, Cause.RANGE}


def test_senses_up_to_now() -> None:
    it = scene(0, 50, 220, 221)
    it.frame(100, 100, 0, 1)
    looks: dict[int, Any] = {}

    def look() -> Generator[simpy.Event, Any, None]:
        for t_us in (99, 100, 101, 150, 200, 201, 300):
            yield it.env.timeout(t_us * US - it.env.now)
            looks[t_us] = [it.medium.busy_until(node, int(it.env.now)) for node in range(4)]

    it.env.process(look())
    it.run()
    nobody, those_near = [False] * 4, [False, True, True, False]
    assert looks[99] == looks[100] == nobody  # a frame that begins now was not there before
    assert looks[101] == looks[150] == looks[200] == those_near  # one that ends now was
    assert looks[201] == looks[300] == nobody


def test_listeners_learn_of_busy_and_idle() -> None:
    it = scene(0, 50, 99, 160, 300)
    calls: list[tuple[int, str, int]] = []
    for node in range(5):
        it.medium.subscribe(
            node,
            lambda t_ns, node=node: calls.append((t_ns // US, "busy", node)),
            lambda t_ns, damaged, node=node: calls.append((t_ns // US, "bad" if damaged else "good", node)),
        )
    it.frame(10, 100, 0, 1, reserve_ns=40 * US)
    it.run()
    assert calls == [
        (10, "busy", 1),
        (10, "busy", 2),
        (10, "busy", 3),
        (150, "good", 1),  # the frame can be read: it reserves the channel
        (150, "good", 2),
        (110, "bad", 3),  # it is too weak to be read, and nobody at 300 m senses it
    ]
    assert it.medium.last_heard(1) == (150 * US, False)
    assert it.medium.last_heard(3) == (110 * US, True)
    assert it.medium.last_heard(4) == (-MEMORY_NS, False)


def test_overlapping_frames_are_one_busy_time_and_damaged() -> None:
    it = scene(-50, 0, 50, 0)
    calls: list[tuple[int, Any]] = []
    it.medium.subscribe(
        3, lambda t_ns: calls.append((t_ns // US, None)), lambda t_ns, bad: calls.append((t_ns // US, bad))
    )
    it.frame(0, 100, 0, 1)
    it.frame(50, 100, 2, 1)
    it.frame(200, 100, 0, 1)
    it.run()
    assert calls == [(0, None), (150, True), (200, None), (300, False)]


@pytest.mark.parametrize(("far_m", "damaged"), [(64, False), (62, True)])
def test_an_overheard_frame_is_read_from_ten_decibels_above_the_others_on(
    far_m: float, damaged: bool
) -> None:
    it = scene(-20, 0, far_m, -60)
    ends: list[tuple[int, bool]] = []
    it.medium.subscribe(1, lambda t_ns: None, lambda t_ns, bad: ends.append((t_ns // US, bad)))
    it.frame(0, 50, 2, 1)
    it.frame(10, 100, 0, 3)
    it.run()
    assert ends == [(110, damaged)]


def test_a_late_listener_joins_what_is_on_the_air_and_can_leave() -> None:
    it = scene(0, 50)
    calls: list[int] = []

    def join() -> Generator[simpy.Event, Any, None]:
        yield it.env.timeout(50 * US)
        assert it.medium.subscribe(1, calls.append, lambda t_ns, bad: calls.append(t_ns)).busy == 1
        yield it.env.timeout(200 * US)
        it.medium.unsubscribe(1)

    it.frame(0, 100, 0, 1)
    it.frame(300, 100, 0, 1)
    it.env.process(join())
    it.run()
    assert calls == [100 * US]


class Leaving:
    """Node 1 drives away from node 0 at 10 m/s."""

    static = False
    count = 2

    def distance_m(self, a: int, b: int, now_ns: int) -> float:
        return 90.0 + 10.0 * now_ns / 1e9


def test_moving_nodes_get_out_of_range() -> None:
    env, rng = simpy.Environment(), np.random.default_rng(0)
    it = Scene(env, Medium(env, Radio(RadioConfig(), MacConfig(), rng), Leaving(), rng), {})
    for start_us in range(0, 2_000_000, 50_000):
        it.frame(start_us, 100, 0, 1)
    outcomes = it.run()
    lost_us = [start_us for (_, start_us), cause in outcomes.items() if cause]
    assert {cause for cause in outcomes.values() if cause} == {Cause.RANGE}
    assert 1_000_000 < min(lost_us) <= 1_000_000 + REFRESH_NS // US
    assert len(lost_us) == (2_000_000 - min(lost_us)) // 50_000

"""Bianchi's throughput model of saturated stations that all hear one another (SPEC 6.3).

G. Bianchi, "Performance analysis of the IEEE 802.11 distributed coordination function", IEEE JSAC 18(3),
2000. Every station always has a packet, retries for ever and collides in each attempt with the same
probability.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.optimize import brentq

from network_sim.mac.phy import PhysicalLayer


@dataclass(frozen=True, slots=True)
class Timing:
    """Times and sizes of a medium access; all frames of one kind have the same length."""

    payload_bits: float
    header_us: float
    """MAC and PHY header of a data frame, PHY preamble included."""
    payload_us: float
    ack_us: float
    rts_us: float
    cts_us: float
    slot_us: float
    sifs_us: float
    difs_us: float
    delay_us: float
    """Propagation delay between two stations."""


DSSS_11 = Timing(
    8000,
    192 + 8 * 64 / 11,
    8000 / 11,
    ack_us=248,
    rts_us=272,
    cts_us=248,
    slot_us=20,
    sifs_us=10,
    difs_us=50,
    delay_us=1,
)
"""IEEE 802.11b at 11 Mb/s, 1000 bytes over UDP, long preambles."""


def timing_of(layer: PhysicalLayer, payload_bytes: int, header_bytes: int, packets: int = 1) -> Timing:
    """Return the timing of frames that each carry a number of equal packets.

    Args:
        layer: physical layer of an IEEE 802.11 network.
        payload_bytes: payload of the medium access in each packet.
        header_bytes: bytes of the payload that are headers of higher layers, which are no throughput.
        packets: packets in a frame, 1 or more; the frame of several is answered by a block acknowledgement.
    """
    return Timing(
        payload_bits=8.0 * packets * (payload_bytes - header_bytes),
        header_us=layer.data.preamble_ns / 1e3,
        payload_us=(layer.frame_ns([payload_bytes] * packets) - layer.data.preamble_ns) / 1e3,
        ack_us=layer.answer(packets).duration_ns / 1e3,
        rts_us=layer.rts_ns / 1e3,
        cts_us=layer.cts.duration_ns / 1e3,
        slot_us=layer.slot_ns / 1e3,
        sifs_us=layer.sifs_ns / 1e3,
        difs_us=layer.difs_ns / 1e3,
        delay_us=layer.propagation_ns / 1e3,
    )


@dataclass(frozen=True, slots=True)
class Saturated:
    """Saturation throughput and the probabilities from which it follows."""

    throughput_bps: float
    """Payload throughput of all stations together."""
    collision_probability: float
    """Probability p that an attempt collides."""
    attempt_probability: float
    """Probability tau that a station transmits in a slot."""


def bianchi(
    stations: int,
    timing: Timing = DSSS_11,
    window: int = 32,
    stages: int = 5,
    rts: bool = False,
    silence_us: float | None = None,
) -> Saturated:
    """Compute the saturation throughput of n stations.

    Args:
        stations: number of stations n, at least 1.
        timing: times and sizes of the medium access.
        window: contention window W of the first attempt, slots.
        stages: number m of doublings of the window.
        rts: True for RTS/CTS, False for basic access.
        silence_us: interframe space after a collision; None is a DIFS, as Bianchi assumes. Stations that
            follow the standard wait for an EIFS (364 us in IEEE 802.11b).

    Returns:
        Throughput and probabilities from Bianchi's equations 7 to 13, without a limit of retries.
    """

    p, tau = _attempts(stations, window, stages)
    idle = (1.0 - tau) ** stations
    success = stations * tau * (1.0 - tau) ** (stations - 1)
    data_us, answer_us = timing.header_us + timing.payload_us, timing.sifs_us + timing.delay_us
    success_us = data_us + answer_us + timing.ack_us + timing.difs_us + timing.delay_us
    rest_us = (timing.difs_us if silence_us is None else silence_us) + timing.delay_us
    collision_us = data_us + rest_us
    if rts:
        success_us += timing.rts_us + answer_us + timing.cts_us + answer_us
        collision_us = timing.rts_us + rest_us
    slot_us = idle * timing.slot_us + success * success_us + (1.0 - idle - success) * collision_us
    return Saturated(
        throughput_bps=success * timing.payload_bits / slot_us * 1e6,
        collision_probability=p,
        attempt_probability=tau,
    )


def _attempts(stations: int, window: int, stages: int) -> tuple[float, float]:
    """Solve for the probabilities p that an attempt collides and tau that a station transmits in a slot."""

    def attempts(p: float) -> float:
        # Bianchi's closed form divides by 1 - 2p; the sum of (2p)^i is also defined at p = 1/2.
        growth = sum((2.0 * p) ** stage for stage in range(stages))
        return 2.0 / (window + 1.0 + p * window * growth)

    def excess(p: float) -> float:
        return p - 1.0 + (1.0 - attempts(p)) ** (stations - 1)

    p = float(brentq(excess, 0.0, 1.0, xtol=1e-12))
    return p, attempts(p)

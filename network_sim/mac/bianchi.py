"""Bianchi's model of saturated stations that all hear one another (SPEC 6.3).

G. Bianchi, "Performance analysis of the IEEE 802.11 distributed coordination function", IEEE JSAC 18(3),
2000. Every station always has a packet, retries for ever and collides in each attempt with the same
probability.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.optimize import brentq


@dataclass(frozen=True, slots=True)
class Timing:
    """Times and sizes of a medium access; every frame of one kind is equally long."""

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
    """Propagation from one station to another."""


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


@dataclass(frozen=True, slots=True)
class Saturated:
    """Saturation throughput and the probabilities behind it."""

    throughput_bps: float
    """Payload, of all stations together."""
    collision_probability: float
    """Of an attempt (p)."""
    attempt_probability: float
    """Of a station in a slot (tau)."""


def bianchi(
    stations: int,
    timing: Timing = DSSS_11,
    window: int = 32,
    stages: int = 5,
    rts: bool = False,
    silence_us: float | None = None,
) -> Saturated:
    """Saturation throughput.

    Args:
        stations: n, at least 1.
        timing: of the medium access.
        window: W, backoffs of the first attempt to choose from.
        stages: m, doublings of the window.
        rts: with RTS/CTS, or basic access.
        silence_us: interframe space after a collision; None is a DIFS, as Bianchi assumes. Stations of the
            standard wait for an EIFS (364 us in IEEE 802.11b).

    Returns:
        Bianchi's equations 7 to 13, without a limit of retries.
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
    """Probabilities that an attempt collides, and that a station attempts in a slot."""

    def attempts(p: float) -> float:
        # The sum of (2p)^i, which his closed form divides by 1 - 2p, has no gap at p = 1/2.
        growth = sum((2.0 * p) ** stage for stage in range(stages))
        return 2.0 / (window + 1.0 + p * window * growth)

    def excess(p: float) -> float:
        return p - 1.0 + (1.0 - attempts(p)) ** (stations - 1)

    p = float(brentq(excess, 0.0, 1.0, xtol=1e-12))
    return p, attempts(p)

"""OFDM of IEEE 802.11n, 802.11ax and 802.11ah: bits per symbol, sensitivity and bit errors of each MCS.

One table serves all three standards: the MCS of one spatial stream have the same constellations and code
rates in each, and a receiver needs the same ratio of signal to noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

OfdmModulation = Literal[
    "2 x bpsk 1/2",
    "bpsk 1/2",
    "qpsk 1/2",
    "qpsk 3/4",
    "16-qam 1/2",
    "16-qam 3/4",
    "64-qam 2/3",
    "64-qam 3/4",
    "64-qam 5/6",
    "256-qam 3/4",
    "256-qam 5/6",
    "1024-qam 3/4",
    "1024-qam 5/6",
]
"""Constellation and code rate; ``2 x`` sends every bit twice."""


@dataclass(frozen=True, slots=True)
class Scheme:
    """One way to put bits on a subcarrier."""

    bits: int
    """Coded bits of a subcarrier in one symbol."""
    code: tuple[int, int]
    """Code rate as numerator and denominator."""
    needed_db: float
    """Ratio of signal to noise at the standard's least sensitivity."""
    copies: int = 1
    """How often every bit is sent."""

    def bits_per_symbol(self, subcarriers: int) -> int:
        """Return the data bits of a symbol (N_DBPS) on this many data subcarriers."""
        return subcarriers * self.bits * self.code[0] // (self.code[1] * self.copies)


SCHEMES: dict[str, Scheme] = {
    "2 x bpsk 1/2": Scheme(1, (1, 2), 1.0, copies=2),
    "bpsk 1/2": Scheme(1, (1, 2), 4.0),
    "qpsk 1/2": Scheme(2, (1, 2), 7.0),
    "qpsk 3/4": Scheme(2, (3, 4), 9.0),
    "16-qam 1/2": Scheme(4, (1, 2), 12.0),
    "16-qam 3/4": Scheme(4, (3, 4), 16.0),
    "64-qam 2/3": Scheme(6, (2, 3), 20.0),
    "64-qam 3/4": Scheme(6, (3, 4), 21.0),
    "64-qam 5/6": Scheme(6, (5, 6), 22.0),
    "256-qam 3/4": Scheme(8, (3, 4), 27.0),
    "256-qam 5/6": Scheme(8, (5, 6), 29.0),
    "1024-qam 3/4": Scheme(10, (3, 4), 32.0),
    "1024-qam 5/6": Scheme(10, (5, 6), 34.0),
}
"""Schemes by name. The ratios follow from the least sensitivities of a 20 MHz channel (IEEE 802.11-2020,
Table 19-23: -82, -79, -77, -74, -70, -66, -65, -64 dBm; IEEE 802.11ax-2021, Table 27-51, further: -59, -57,
-54, -52) over noise of -86 dBm: -174 dBm/Hz, a noise figure of 10 dB and a margin of 5 dB. Those of IEEE
802.11ah (Table 23-35: -92 to -74 dBm in 2 MHz, 3 dB less in 1 MHz, -98 dBm with every bit sent twice) give
the same ratios."""
NOISE_DBM_PER_MHZ = -99.0
"""Noise in 1 MHz with the noise figure and the margin."""

BY_MCS: tuple[OfdmModulation, ...] = get_args(OfdmModulation)[1:]
"""Names by MCS, 0 to 11."""
MCS_TWICE = 10
"""MCS of IEEE 802.11ah at 1 MHz that sends every bit twice; in IEEE 802.11ax, 10 is 1024-QAM."""


def sensitivity_dbm(name: OfdmModulation, bandwidth_hz: float) -> float:
    """Return the least sensitivity that the standards demand in a channel of this width."""
    return NOISE_DBM_PER_MHZ + 10.0 * math.log10(bandwidth_hz / 1e6) + SCHEMES[name].needed_db


_SPECTRA: dict[tuple[int, int], tuple[float, dict[int, float]]] = {
    (1, 2): (
        1 / 2,
        dict(
            zip(
                range(10, 27, 2),
                (36, 211, 1404, 11633, 77433, 502690, 3322763, 21292910, 134365911),
                strict=True,
            )
        ),
    ),
    (2, 3): (
        1 / 4,
        dict(
            enumerate((3, 70, 285, 1276, 6160, 27128, 117019, 498860, 2103891, 8784123), start=6),
        ),
    ),
    (3, 4): (
        1 / 6,
        dict(
            enumerate((42, 201, 1492, 10469, 62935, 379644, 2253373, 13073811, 75152755, 428005675), start=5),
        ),
    ),
    (5, 6): (
        1 / 10,
        dict(
            enumerate(
                (92, 528, 8694, 79453, 792114, 7375573, 67884974, 610875423, 5427275376, 47664215639), start=4
            ),
        ),
    ),
}
"""By code rate: the factor and the numbers of wrong bits by distance d of the convolutional code of length 7
with 133 and 171 (octal), punctured (Frenger et al. 1998; rate 5/6: Haccoun and Begin 1989)."""


def bit_error_rate(sinr: float, scheme: Scheme) -> float:
    """Return the bit error rate after decoding, for white noise and hard decisions.

    The union bound over the distances of the code, ``k sum_d c_d (4 p (1 - p))^(d/2)`` with the rate p of
    wrong bits before decoding, as in ns-3's NistErrorRateModel (Pei and Henderson 2010). Of MCS decoded by
    LDPC it is an upper estimate.

    Args:
        sinr: ratio of signal to noise and interference in the channel, as a factor.
        scheme: constellation and code rate.
    """
    wrong = _raw_error_rate(sinr * scheme.copies, 1 << scheme.bits)
    factor, spectrum = _SPECTRA[scheme.code]
    spread = math.sqrt(4.0 * wrong * (1.0 - wrong))
    return min(0.5, factor * sum(count * spread**distance for distance, count in spectrum.items()))


def _raw_error_rate(sinr: float, points: int) -> float:
    """Return the bit error rate before decoding of a constellation of 2, 4, 16, 64, 256 or 1024 points, Gray
    coded (Proakis 2001, 5.2: BPSK exactly, square QAM to nearest neighbours)."""
    if points == 2:
        return 0.5 * math.erfc(math.sqrt(sinr))
    side = math.isqrt(points)
    return (1.0 - 1.0 / side) / math.log2(side) * math.erfc(math.sqrt(1.5 * sinr / (points - 1)))

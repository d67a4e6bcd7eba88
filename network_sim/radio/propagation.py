"""Propagation and reception: mean power over distance, shadowing, fading, bit errors (SPEC 6.3).

Powers are in watts and distances in metres; only names that end in ``_db`` or ``_dbm`` are in decibels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from network_sim.config import OFDM_KINDS, MacConfig, NetworkConfig, RadioConfig
from network_sim.radio import ofdm
from network_sim.radio.ofdm import OfdmModulation
from network_sim.radio.places import Places

Modulation = Literal["dbpsk", "dqpsk", "cck5.5", "cck11", "oqpsk", "lora", "gfsk", OfdmModulation]
"""Modulations: IEEE 802.11b at 1, 2, 5.5 and 11 Mb/s, IEEE 802.15.4 at 250 kb/s, LoRa, Bluetooth LE, and
those of IEEE 802.11n, 802.11ax and 802.11ah."""
IEEE80211B: dict[float, tuple[Modulation, float]] = {
    1e6: ("dbpsk", 9.0),
    2e6: ("dqpsk", 6.0),
    5.5e6: ("cck5.5", 3.0),
    11e6: ("cck11", 0.0),
}
"""Modulation by rate in bit/s, and the decibels by which it needs less power than 11 Mb/s. The data sheet of
Acer's MPCI-101 has -91, -88, -85 and -82 dBm, at which 8 % of frames of 1024 bytes are lost."""
LORA: dict[int, tuple[float, float]] = {
    7: (0.0, -7.5),
    8: (3.0, -10.0),
    9: (6.0, -12.5),
    10: (9.0, -15.0),
    11: (10.0, -17.5),
    12: (13.0, -20.0),
}
"""By spreading factor at 125 kHz: the decibels by which LoRa needs less power than with 7, from the SX1276's
sensitivities (-123, -126, -129, -132, -133, -136 dBm; data sheet Rev. 7, RFS_L125_HF), and the least ratio of
signal to noise in dB at which it can be read (Table 13 there)."""
OQPSK_CAPTURE_DB = 3.0
"""Capture ratio of IEEE 802.15.4 if ``radio.capture_db`` is None: the co-channel rejection of a CC2420 (SPEC
6.3)."""
DSSS_CAPTURE_DB = 10.0
"""The same for IEEE 802.11b (SPEC 6.3)."""
LORA_CAPTURE_DB = 6.0
"""The same for frames of LoRa with one spreading factor, as in LoRaSim (Bor et al. 2016)."""

SPEED_OF_LIGHT_MPS = 299_792_458.0
_ROUNDING = 1e-9  # nodes exactly range_m apart hear each other, however their distance was computed
_BLOCK = 1024


def wavelength_m(frequency_hz: float) -> float:
    """Return the wavelength of a carrier in vacuum."""
    return SPEED_OF_LIGHT_MPS / frequency_hz


def crossover_m(antenna_height_m: float, wavelength_m: float) -> float:
    """Return ``4 pi h^2 / lambda``, where the ground reflection begins to dominate (Rappaport 2002, 4.6)."""
    return 4.0 * math.pi * antenna_height_m**2 / wavelength_m


@dataclass(frozen=True, slots=True)
class PathLoss:
    """Mean received power over distance: one power law near the sender, another one far away."""

    near_w: float
    """Power of the near law at 1 m."""
    near_exponent: float
    far_w: float
    """Power of the far law at 1 m."""
    far_exponent: float
    break_m: float
    """Distance from which the far law applies; infinite if it never does."""
    least_m: float
    """Distance below which the power is constant: the law would exceed the transmitted power."""

    def power_w(self, distance_m: float) -> float:
        """Return the mean received power at a distance."""
        held_m = distance_m if distance_m > self.least_m else self.least_m
        if held_m < self.break_m:
            return self.near_w * held_m**-self.near_exponent
        return self.far_w * held_m**-self.far_exponent

    def distance_m(self, power_w: float) -> float:
        """Return the largest distance at which the mean received power is at least ``power_w``, which must be
        below the power at ``least_m``."""
        far_m = (self.far_w / power_w) ** (1.0 / self.far_exponent)
        return far_m if far_m >= self.break_m else (self.near_w / power_w) ** (1.0 / self.near_exponent)


def free_space(tx_power_w: float, wavelength_m: float, gain: float = 1.0, loss: float = 1.0) -> PathLoss:
    """Return Friis' law (1946): ``Pr = Pt G^2 lambda^2 / ((4 pi d)^2 L)``, gain G per antenna, loss L."""
    least_m = wavelength_m / (4.0 * math.pi)
    near_w = tx_power_w * gain**2 * least_m**2 / loss
    return PathLoss(near_w, 2.0, near_w, 2.0, math.inf, least_m)


def ground_reflection(
    tx_power_w: float, wavelength_m: float, height_m: float, gain: float = 1.0, loss: float = 1.0
) -> PathLoss:
    """Return the two-ray law: free space up to the crossover, then ``Pr = Pt G^2 h^4 / (d^4 L)`` (Rappaport
    2002, 4.6)."""
    near = free_space(tx_power_w, wavelength_m, gain, loss)
    far_w = tx_power_w * gain**2 * height_m**4 / loss
    return PathLoss(near.near_w, 2.0, far_w, 4.0, crossover_m(height_m, wavelength_m), near.least_m)


def power_law(
    tx_power_w: float,
    wavelength_m: float,
    exponent: float,
    reference_m: float,
    gain: float = 1.0,
    loss: float = 1.0,
) -> PathLoss:
    """Return the log-distance law: free space up to ``reference_m``, then a fall with
    ``(d / reference_m)^-exponent`` (Rappaport 2002, 4.9)."""
    near = free_space(tx_power_w, wavelength_m, gain, loss)
    break_m = max(reference_m, near.least_m)
    far_w = near.power_w(break_m) * break_m**exponent
    return PathLoss(near.near_w, 2.0, far_w, exponent, break_m, near.least_m)


def path_loss(config: RadioConfig) -> PathLoss:
    """Return the path loss of the model ``config.model``."""
    tx_power_w, length_m = watts(config.tx_power_dbm), wavelength_m(config.frequency_hz)
    gain, loss = config.antenna_gain, config.system_loss
    if config.model == "friis":
        return free_space(tx_power_w, length_m, gain, loss)
    if config.model == "two-ray":
        return ground_reflection(tx_power_w, length_m, config.antenna_height_m, gain, loss)
    return power_law(tx_power_w, length_m, config.path_loss_exponent, config.reference_m, gain, loss)


def watts(power_dbm: float) -> float:
    """Convert a power in dBm to watts."""
    return 1e-3 * ratio(power_dbm)


def ratio(decibels: float) -> float:
    """Convert decibels to a factor."""
    return 10.0 ** (decibels / 10.0)


_STEP = 0.01
_LARGEST = 13.0  # errors are below 1e-16 there


@cache
def _biorthogonal_table() -> list[float]:
    """Tabulate the log of the error rate of 16 biorthogonal signals, over steps of b = ``sqrt(2 Es/N0)``.

    The rate is ``Q(b) + integral from 0 of (1 - (1 - 2 Q(u))^7) phi(u - b) du`` (Proakis 2001, 5.2, as the
    complement of his probability).
    """
    nodes, weights = np.polynomial.legendre.leggauss(256)
    u = 11.0 * (nodes + 1.0)
    q = np.array([0.5 * math.erfc(value / math.sqrt(2.0)) for value in u])
    wrong = 11.0 * weights * -np.expm1(7.0 * np.log1p(-2.0 * q))
    b = np.arange(0.0, _LARGEST + 2 * _STEP, _STEP)
    density = np.exp(-0.5 * (u - b[:, None]) ** 2) / math.sqrt(2.0 * math.pi)
    tail = np.array([0.5 * math.erfc(value / math.sqrt(2.0)) for value in b])
    return [float(value) for value in np.log(tail + density @ wrong)]


@cache
def _dqpsk_table() -> list[float]:
    """Tabulate the log of the bit error rate of DQPSK, over steps of b = ``sqrt(2 Eb/N0)``.

    The rate is ``Q1(x, y) - I0(x y) exp(-(x^2 + y^2) / 2) / 2`` with Marcum's Q and x, y = b sqrt(1 -+ 1/2^½)
    (Proakis 2001, 5.2).
    """
    from scipy.special import i0e  # imported here: other uses of this module do not need it
    from scipy.stats import ncx2

    b = np.arange(_STEP, _LARGEST + 2 * _STEP, _STEP)
    x, y = b * math.sqrt(1.0 - math.sqrt(0.5)), b * math.sqrt(1.0 + math.sqrt(0.5))
    rate = ncx2.sf(y**2, 2, x**2) - 0.5 * i0e(x * y) * np.exp(-0.5 * (y - x) ** 2)
    return [math.log(0.5), *np.log(rate).tolist()]


def _rate(table: list[float], b: float) -> float:
    """Interpolate a table of log rates at b; 0 beyond its end."""
    place = b / _STEP
    if place >= len(table) - 1:
        return 0.0
    index = int(place)
    below = table[index]
    return math.exp(below + (place - index) * (table[index + 1] - below))


def cck11_symbol_error_rate(sinr: float) -> float:
    """Error rate of an 8-bit symbol of 802.11b at 11 Mb/s (Pei and Henderson 2009, as in ns-3).

    A symbol (1 of 256) is sent as two of 16 biorthogonal signals. ``sinr`` is a factor, for the noise in the
    22 MHz of the channel.
    """
    one = _rate(_biorthogonal_table(), math.sqrt(8.0 * sinr))
    return one * (2.0 - one)


def cck5_symbol_error_rate(sinr: float) -> float:
    """Error rate of a 4-bit symbol of 802.11b at 5.5 Mb/s (Pei and Henderson 2009, as in ns-3)."""
    return _rate(_biorthogonal_table(), math.sqrt(16.0 * sinr))


def dqpsk_bit_error_rate(sinr: float) -> float:
    """Bit error rate of 802.11b at 2 Mb/s, for noise in 22 MHz. ns-3 approximates it for strong signals."""
    return _rate(_dqpsk_table(), math.sqrt(22.0 * sinr))


def dbpsk_bit_error_rate(sinr: float) -> float:
    """Bit error rate of 802.11b at 1 Mb/s: ``exp(-Eb/N0) / 2`` (Proakis 2001, 5.2), for noise in 22 MHz."""
    return 0.5 * math.exp(-22.0 * sinr)


_OQPSK_TERMS = tuple(((-1) ** k * math.comb(16, k) / 30.0, 20.0 * (1.0 / k - 1.0)) for k in range(2, 17))


def oqpsk_bit_error_rate(sinr: float) -> float:
    """Bit error rate of 802.15.4 at 2.4 GHz (IEEE 802.15.4-2006, E.4.1.8).

    It is ``8/15 1/16 sum_k (-1)^k C(16, k) exp(20 sinr (1/k - 1))`` for k from 2 to 16.
    """
    return min(0.5, max(0.0, sum(factor * math.exp(power * sinr) for factor, power in _OQPSK_TERMS)))


def walls_crossed(walls_m: NDArray[np.float64], a_m: tuple[float, float], b_m: tuple[float, float]) -> int:
    """Count the walls (W, 2, 2), given by their two ends, that the line from ``a_m`` to ``b_m`` crosses."""
    link_m, walls = np.subtract(b_m, a_m), walls_m[:, 1] - walls_m[:, 0]

    def side(of: NDArray[np.float64], point_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sign(of[..., 0] * point_m[..., 1] - of[..., 1] * point_m[..., 0])

    apart = side(link_m, walls_m[:, 0] - a_m) * side(link_m, walls_m[:, 1] - a_m) < 0
    between = side(walls, a_m - walls_m[:, 0]) * side(walls, b_m - walls_m[:, 0]) < 0
    return int((apart & between).sum())


def modulation(mac: MacConfig) -> Modulation:
    """Return the modulation of a medium access's data frames."""
    if mac.kind == "ieee80211b":
        return IEEE80211B[mac.rate_bps][0]
    if mac.kind in OFDM_KINDS:
        return ofdm_modulation(mac)
    return "lora" if mac.kind == "lora" else "gfsk" if mac.kind == "ble" else "oqpsk"


def ofdm_modulation(mac: MacConfig) -> OfdmModulation:
    """Return the modulation of the MCS of IEEE 802.11n, 802.11ax or 802.11ah."""
    twice = mac.kind == "ieee80211ah" and mac.mcs == ofdm.MCS_TWICE
    return "2 x bpsk 1/2" if twice else ofdm.BY_MCS[mac.mcs]


def _ofdm_less_db(mac: MacConfig) -> float:
    """Return the decibels by which an MCS needs less power than the fastest of its standard at its full
    width."""
    fastest: OfdmModulation = "1024-qam 5/6" if mac.kind == "ieee80211ax" else "64-qam 5/6"
    widest_hz = 2e6 if mac.kind == "ieee80211ah" else 20e6
    own_hz = mac.bandwidth_hz if mac.kind == "ieee80211ah" else 20e6
    own_dbm = ofdm.sensitivity_dbm(ofdm_modulation(mac), own_hz)
    return ofdm.sensitivity_dbm(fastest, widest_hz) - own_dbm


def _threshold_w(config: RadioConfig, mac: MacConfig) -> float:
    """Return the power at the nominal range, or less for slower rates of IEEE 802.11 and LoRa."""
    less_db = IEEE80211B[mac.rate_bps][1] if mac.kind == "ieee80211b" else 0.0
    if mac.kind in OFDM_KINDS:
        less_db = _ofdm_less_db(mac)
    if mac.kind == "lora":
        less_db = LORA[mac.spreading_factor][0]
    return path_loss(config).power_w(config.range_m) * ratio(-less_db)


def reach_m(config: NetworkConfig) -> float:
    """Return the reach of a frame without shadowing: the nominal range, or more at a slower rate."""
    return path_loss(config.radio).distance_m(_threshold_w(config.radio, config.mac))


class Radio:
    """The radio of every node: thresholds, received power over each link, bit errors."""

    def __init__(self, config: RadioConfig, mac: MacConfig, rng: np.random.Generator) -> None:
        """Draw only the seed of the shadowing, so that shadowing does not depend on the order of frames."""
        law = path_loss(config)
        self.config = config
        """Config of the radio."""
        self.mean_power_w = law.power_w
        """Mean received power at a distance."""
        self.rx_threshold_w = _threshold_w(config, mac) * (1.0 - _ROUNDING)
        """Receive threshold: the mean power at the reach."""
        sensed_w = law.power_w(config.sense_range_m) * (1.0 - _ROUNDING)
        self.cs_threshold_w = min(sensed_w, self.rx_threshold_w)
        """Carrier-sense threshold; never above the receive threshold."""
        capture_db = config.capture_db
        if capture_db is None:
            capture_db = _capture_db(mac)
        self.capture_ratio = ratio(capture_db)
        """Least ratio of a frame's power to the sum of overlapping powers with which it survives."""
        noise_dbm = None if mac.kind == "ble" else config.noise_dbm
        self.noise_w = None if noise_dbm is None else watts(noise_dbm)
        """Power of the noise; None if there are no bit errors, as in Bluetooth LE, where only the receive
        threshold counts."""
        self._lora_sinr = ratio(LORA[mac.spreading_factor][1])
        self._shadowing_db = config.shadowing_db
        self._shadowing_seed = int(rng.integers(2**63))
        self._shadowing: dict[tuple[int, int], float] = {}
        self._nakagami_m = config.nakagami_m
        self.fades = config.nakagami_m is not None
        """Whether frames have fading."""
        self._walls_m = np.reshape(config.walls_m, (-1, 2, 2))
        self._wall_gain = ratio(-config.wall_db)
        self._rng = rng
        self._fading: list[float] = []

    def link_power_w(self, sender: int, receiver: int, distance_m: float) -> float:
        """Return the mean power over a link with its shadowing, which is the same in both directions."""
        power_w = self.mean_power_w(distance_m)
        if self._shadowing_db == 0.0:
            return power_w
        pair = (sender, receiver) if sender < receiver else (receiver, sender)
        gain = self._shadowing.get(pair)
        if gain is None:
            draw = np.random.default_rng((self._shadowing_seed, *pair)).standard_normal()
            gain = self._shadowing[pair] = ratio(self._shadowing_db * float(draw))
        return power_w * gain

    def between_w(self, places: Places, sender: int, receiver: int, now_ns: int) -> float:
        """Return the mean power between two nodes at ``now_ns``, through the walls in between."""
        power_w = self.link_power_w(sender, receiver, places.distance_m(sender, receiver, now_ns))
        if not len(self._walls_m):
            return power_w
        ends_m = places.position_m(sender, now_ns), places.position_m(receiver, now_ns)
        return power_w * self._wall_gain ** walls_crossed(self._walls_m, *ends_m)

    def faded_w(self, power_w: float) -> float:
        """Draw the power of one frame: Nakagami-m fading gives a gamma distribution with mean ``power_w``."""
        if self._nakagami_m is None:
            return power_w
        if not self._fading:
            shape = self._nakagami_m
            self._fading = self._rng.gamma(shape, 1.0 / shape, _BLOCK).tolist()
        return power_w * self._fading.pop()

    def error_rate(self, sinr: float, size_bytes: float, kind: Modulation) -> float:
        """Return the probability that at least one bit of a frame is wrong.

        Args:
            sinr: ratio of signal to noise and interference, as a factor.
            size_bytes: bytes sent with this modulation.
            kind: modulation of these bytes. A frame of LoRa is received if ``sinr`` is at least what
                its spreading factor needs, and lost otherwise.
        """
        if kind == "lora":
            return 0.0 if sinr >= self._lora_sinr else 1.0
        if kind == "cck11":
            return _one_wrong(cck11_symbol_error_rate(sinr), size_bytes)
        if kind == "cck5.5":
            return _one_wrong(cck5_symbol_error_rate(sinr), 2 * size_bytes)
        if kind in ofdm.SCHEMES:
            return _one_wrong(ofdm.bit_error_rate(sinr, ofdm.SCHEMES[kind]), 8 * size_bytes)
        return _one_wrong(_BIT_ERROR_RATES[kind](sinr), 8 * size_bytes)


_CAPTURE_DB: dict[Modulation, float] = {"oqpsk": OQPSK_CAPTURE_DB, "lora": LORA_CAPTURE_DB}


def _capture_db(mac: MacConfig) -> float:
    """Return the capture ratio if ``radio.capture_db`` is None; OFDM needs the same ratio as over noise."""
    if mac.kind in OFDM_KINDS:
        return ofdm.SCHEMES[ofdm_modulation(mac)].needed_db
    return _CAPTURE_DB.get(modulation(mac), DSSS_CAPTURE_DB)


_BIT_ERROR_RATES: dict[Modulation, Callable[[float], float]] = {
    "dbpsk": dbpsk_bit_error_rate,
    "dqpsk": dqpsk_bit_error_rate,
    "oqpsk": oqpsk_bit_error_rate,
}


def _one_wrong(rate: float, count: float) -> float:
    """Return the probability that at least one of ``count`` independent symbols is wrong."""
    return -math.expm1(count * math.log1p(-rate))

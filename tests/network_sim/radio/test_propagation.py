"""Power over distance, shadowing, fading and bit errors against values from elsewhere."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from scipy import integrate, stats

from network_sim.config import MacConfig, NetworkConfig, Propagation, RadioConfig
from network_sim.radio import propagation as r
from network_sim.radio.places import FixedPlaces
from packetmesh.errors import InputError

# The ns-2 simulator's WaveLAN card; ns-2 rounds the speed of light.
NS2_TX_W = 0.28183815
NS2_WAVELENGTH_M = 3e8 / 914e6
NS2_HEIGHT_M = 1.5

CONFIGS = [
    RadioConfig(),
    RadioConfig(model="friis"),
    RadioConfig(model="log-distance", path_loss_exponent=2.7, reference_m=3.0),
    RadioConfig(frequency_hz=914e6, antenna_gain=2.0, system_loss=1.5),
]


def radio(seed: int = 0, **changes: object) -> r.Radio:
    return r.Radio(replace(RadioConfig(), **changes), MacConfig(), np.random.default_rng(seed))


def test_two_ray_gives_the_values_of_ns_2() -> None:
    power_w = r.ground_reflection(NS2_TX_W, NS2_WAVELENGTH_M, NS2_HEIGHT_M).power_w
    assert r.crossover_m(NS2_HEIGHT_M, NS2_WAVELENGTH_M) == pytest.approx(86.14, rel=1e-4)
    assert power_w(100.0) == pytest.approx(1.42681e-8, rel=1e-4)
    assert power_w(250.0) == pytest.approx(3.65262e-10, rel=1e-4)
    assert power_w(550.0) == pytest.approx(1.55924e-11, rel=1e-4)
    assert power_w(220.0) == pytest.approx(6.0908e-10, rel=1e-4)
    assert power_w(50.0) == r.free_space(NS2_TX_W, NS2_WAVELENGTH_M).power_w(50.0)


def test_inside_its_range_the_default_radio_is_free_space() -> None:
    default = radio()
    dbm = 10.0 * math.log10(default.mean_power_w(100.0) / 1e-3)
    assert dbm == pytest.approx(-65.05, abs=0.01)
    assert dbm == pytest.approx(
        15.0 - 20.0 * math.log10(100.0) - 20.0 * math.log10(2.4e9) + 147.552, abs=1e-3
    )
    assert r.crossover_m(1.5, r.wavelength_m(2.4e9)) == pytest.approx(226.35, abs=0.01)


def test_two_ray_is_continuous_and_falls_with_the_fourth_power_beyond_the_crossover() -> None:
    law = r.ground_reflection(1.0, 0.125, 1.5, gain=2.0, loss=1.5)
    crossover_m = r.crossover_m(1.5, 0.125)
    before, after = math.nextafter(crossover_m, 0.0), math.nextafter(crossover_m, math.inf)
    assert law.power_w(before) == pytest.approx(law.power_w(after), rel=1e-12)
    assert law.power_w(4.0 * crossover_m) == pytest.approx(law.power_w(2.0 * crossover_m) / 16.0)
    assert law.power_w(crossover_m / 2.0) == pytest.approx(law.power_w(crossover_m / 4.0) / 4.0)


def test_log_distance_with_exponent_two_is_free_space() -> None:
    distances_m = np.geomspace(0.1, 1e4, 50)
    laws = [r.free_space(0.1, 0.125, 1.2, 1.1)]
    laws += [r.power_law(0.1, 0.125, exponent, 7.0, 1.2, 1.1) for exponent in (2.0, 3.5)]
    free, square, steep = np.array([[law.power_w(d) for d in distances_m.tolist()] for law in laws])
    np.testing.assert_allclose(square, free, rtol=1e-12)
    near = distances_m <= 7.0
    np.testing.assert_allclose(steep[near], free[near], rtol=1e-12)
    np.testing.assert_allclose(steep[~near], (free * (distances_m / 7.0) ** -1.5)[~near], rtol=1e-12)


def test_a_power_law_never_gives_more_than_is_sent() -> None:
    """A reference too near for free space is moved to lambda / (4 pi), where all of it arrives."""
    least_m = 0.125 / (4.0 * np.pi)
    law = r.power_law(0.1, 0.125, 3.0, 0.1 * least_m, 1.2, 1.1)
    all_of_it_w = 0.1 * 1.2**2 / 1.1
    found_w = [law.power_w(times * least_m) for times in (0.01, 1.0, 10.0)]
    np.testing.assert_allclose(found_w, [all_of_it_w, all_of_it_w, 1e-3 * all_of_it_w], rtol=1e-12)


@pytest.mark.parametrize("config", CONFIGS)
def test_power_falls_from_what_is_sent(config: RadioConfig) -> None:
    law = r.path_loss(config)
    powers_w = [law.power_w(d) for d in (0.0, 1e-3, *np.geomspace(0.01, 1e5, 400).tolist())]
    assert np.all(np.diff(powers_w) <= 0.0)
    gain = config.antenna_gain**2 / config.system_loss
    assert powers_w[0] == pytest.approx(r.watts(config.tx_power_dbm) * gain)


@pytest.mark.parametrize("config", CONFIGS)
def test_thresholds_are_met_exactly_up_to_the_ranges(config: RadioConfig) -> None:
    here = r.Radio(config, MacConfig(), np.random.default_rng(0))
    for range_m, threshold_w in (
        (config.range_m, here.rx_threshold_w),
        (config.sense_range_m, here.cs_threshold_w),
    ):
        assert here.mean_power_w(range_m) >= threshold_w
        assert here.mean_power_w(math.hypot(0.6 * range_m, 0.8 * range_m)) >= threshold_w
        assert here.mean_power_w(range_m * 1.000001) < threshold_w


def test_the_capture_ratio_is_that_of_the_standard_or_as_set() -> None:
    ratios = {
        (kind, capture_db): r.Radio(
            RadioConfig(capture_db=capture_db), MacConfig(kind=kind), np.random.default_rng(0)
        ).capture_ratio
        for kind in ("ieee802154", "ieee80211b")
        for capture_db in (None, 0.0, 20.0)
    }
    assert ratios["ieee802154", None] == pytest.approx(10.0**0.3)
    assert ratios["ieee80211b", None] == pytest.approx(10.0)
    for kind in ("ieee802154", "ieee80211b"):
        assert (ratios[kind, 0.0], ratios[kind, 20.0]) == (pytest.approx(1.0), pytest.approx(100.0))


def test_noise_is_in_watts_or_absent() -> None:
    assert radio().noise_w is None
    assert radio(noise_dbm=-100.0).noise_w == pytest.approx(1e-13)


def test_shadowing_is_symmetric_constant_and_free_of_the_order_of_use() -> None:
    pairs = list(itertools.combinations(range(12), 2))
    one, other = radio(3, shadowing_db=6.0), radio(3, shadowing_db=6.0)
    forth = [one.link_power_w(a, b, 40.0) for a, b in pairs]
    back = [other.link_power_w(b, a, 40.0) for a, b in reversed(pairs)][::-1]
    assert forth == back
    assert forth == [one.link_power_w(a, b, 40.0) for a, b in pairs]
    different = radio(4, shadowing_db=6.0)
    assert all(
        different.link_power_w(a, b, 40.0) != power for (a, b), power in zip(pairs, forth, strict=True)
    )
    assert one.link_power_w(0, 1, 80.0) / forth[0] == pytest.approx(
        one.mean_power_w(80.0) / one.mean_power_w(40.0)
    )


def test_shadowing_is_normal_in_decibels() -> None:
    here = radio(5, shadowing_db=6.0)
    mean_w = here.mean_power_w(40.0)
    powers_w = [here.link_power_w(a, b, 40.0) for a, b in itertools.combinations(range(64), 2)]
    decibels = 10.0 * np.log10(np.array(powers_w) / mean_w)
    assert stats.kstest(decibels, stats.norm(0.0, 6.0).cdf).pvalue > 0.01
    plain = radio()
    assert plain.link_power_w(1, 2, 40.0) == plain.mean_power_w(40.0)


@pytest.mark.parametrize("shape", [0.5, 1.0, 3.0])
def test_nakagami_power_has_the_mean_and_variance_of_its_gamma(shape: float) -> None:
    here = radio(6, nakagami_m=shape)
    powers = np.array([here.faded_w(2.0) for _ in range(40_000)])
    assert powers.mean() == pytest.approx(2.0, rel=4.0 / math.sqrt(shape * powers.size))
    assert powers.var() == pytest.approx(4.0 / shape, rel=0.06)
    assert stats.kstest(powers, stats.gamma(shape, scale=2.0 / shape).cdf).pvalue > 0.01
    again = radio(6, nakagami_m=shape)
    assert [again.faded_w(2.0) for _ in range(3000)] == powers[:3000].tolist()


def test_without_fading_power_is_what_it_was() -> None:
    assert radio().faded_w(3.0) == 3.0


@pytest.mark.parametrize("sinr", [0.05, 0.4, 1.5, 3.0, 5.0, 8.0])
def test_cck_is_two_biorthogonal_symbols(sinr: float) -> None:
    """The integral of Proakis 2001, 5.2, with the argument of Pei and Henderson 2009."""
    b = math.sqrt(8.0 * sinr)

    def right(v: float) -> float:
        return (2.0 * stats.norm.cdf(v + b) - 1.0) ** 7 * stats.norm.pdf(v)

    one = integrate.quad(right, -b, 12.0, epsabs=1e-13, epsrel=1e-12, limit=400)[0]
    assert r.cck11_symbol_error_rate(sinr) == pytest.approx(1.0 - one**2, rel=1e-4)


def test_cck_without_a_signal_is_a_guess_among_256() -> None:
    assert r.cck11_symbol_error_rate(0.0) == pytest.approx(255.0 / 256.0, rel=1e-12)
    assert r.cck11_symbol_error_rate(math.inf) == 0.0


@pytest.mark.parametrize("sinr", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_oqpsk_is_a_noncoherent_choice_among_16(sinr: float) -> None:
    """Right if 15 exponentials stay below the noncentral one; else 8/15 of the bits are wrong."""
    es = 20.0 * sinr

    def wrong(y: float) -> float:
        return -math.expm1(15.0 * math.log1p(-math.exp(-0.5 * y))) * stats.ncx2.pdf(y, 2, 2.0 * es)

    symbols = integrate.quad(
        wrong, 1e-12, 200.0, epsabs=0.0, epsrel=1e-9, limit=400, points=[1.0, 10.0, 40.0]
    )
    assert r.oqpsk_bit_error_rate(sinr) == pytest.approx(8.0 / 15.0 * symbols[0], rel=1e-6)


def test_oqpsk_without_a_signal_is_a_coin() -> None:
    assert r.oqpsk_bit_error_rate(0.0) == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize("kind", sorted(set(get_args(r.Modulation)) - {"gfsk"}))  # its noise is not modelled
def test_packet_errors_fall_with_the_signal_and_grow_with_the_size(kind: r.Modulation) -> None:
    here = radio()
    sinrs = np.concatenate([[0.0], np.geomspace(1e-3, 1e6, 400)]).tolist()
    sizes = (1, 14, 127, 1064)
    rates = np.array([[here.error_rate(sinr, size, kind) for sinr in sinrs] for size in sizes])
    assert np.all((rates >= 0.0) & (rates <= 1.0))
    assert np.all(np.diff(rates, axis=1) <= 0.0)
    assert np.all(np.diff(rates, axis=0) >= 0.0)
    assert rates[0, 0] > 0.99
    assert rates[-1, -1] < 1e-12
    assert here.error_rate(1.0, 0, kind) == 0.0


def test_frame_errors_are_independent_per_bit_or_symbol() -> None:
    here = radio()
    assert here.error_rate(0.3, 50, "oqpsk") == pytest.approx(
        1.0 - (1.0 - r.oqpsk_bit_error_rate(0.3)) ** 400
    )
    assert here.error_rate(3.0, 50, "cck11") == pytest.approx(
        1.0 - (1.0 - r.cck11_symbol_error_rate(3.0)) ** 50
    )


WALL_M = np.array([[[1.0, -1.0], [1.0, 1.0]]])


@pytest.mark.parametrize(
    ("a_m", "b_m", "crossed"),
    [
        ((0.0, 0.0), (2.0, 0.0), 1),
        ((2.0, 0.0), (0.0, 0.5), 1),
        ((0.0, 0.0), (2.0, 2.5), 0),  # past its end
        ((0.0, 0.0), (0.9, 0.0), 0),  # ends before it
        ((0.0, 3.0), (0.0, -3.0), 0),  # along it
    ],
)
def test_a_link_crosses_a_wall_between_its_ends_only(a_m, b_m, crossed) -> None:
    assert r.walls_crossed(WALL_M, a_m, b_m) == crossed
    assert r.walls_crossed(np.concatenate([WALL_M, WALL_M + 0.01]), a_m, b_m) == 2 * crossed


def test_each_wall_takes_its_decibels_both_ways() -> None:
    places = FixedPlaces(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]))
    walls = (1.0, -1.0, 1.0, 1.0, 1.5, -1.0, 1.5, 1.0)
    open_air, walled = radio(), radio(walls_m=walls, wall_db=6.0)
    for a, b, decibels in ((0, 1, 12.0), (1, 0, 12.0), (0, 2, 0.0)):
        lost = open_air.between_w(places, a, b, 0) / walled.between_w(places, a, b, 0)
        assert 10.0 * math.log10(lost) == pytest.approx(decibels)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"walls_m": (0.0, 0.0, 1.0)}, "4 for each wall"),
        ({"walls_m": (0.0, 0.0, 1.0, math.inf)}, "try metres"),
        ({"wall_db": -1.0}, "radio.wall_db"),
    ],
)
def test_walls_that_cannot_be_are_refused(changes, sentence) -> None:
    with pytest.raises(InputError, match=sentence):
        RadioConfig(**changes)


@pytest.mark.parametrize("sinr", [0.0, 0.02, 0.1, 0.3, 0.7])
def test_dqpsk_is_gray_coded_and_compared_with_the_symbol_before(sinr: float) -> None:
    """The phase between two noisy signals, integrated numerically (Proakis 2001, app. C)."""
    rng = np.random.default_rng(1)
    es = 22.0 * sinr  # two bits
    signal = np.sqrt(es) + rng.standard_normal((2, 2_000_000)) * math.sqrt(0.5)
    noise = rng.standard_normal((2, 2_000_000)) * math.sqrt(0.5)
    first, second = signal + 1j * noise
    turn = np.exp(0.25j * math.pi) * second * first.conj()  # the sent phase lies between the two axes
    wrong = 0.5 * (np.mean(turn.real < 0.0) + np.mean(turn.imag < 0.0))
    assert r.dqpsk_bit_error_rate(sinr) == pytest.approx(wrong, abs=4.0 * math.sqrt(max(wrong, 1e-6) / 4e6))


def test_strong_dqpsk_errs_as_rarely_as_its_limit_says() -> None:
    """Ferrari and Corazza 2004, the form that ns-3 has."""
    sinr = 3.0
    x = 11.0 * sinr
    root = math.sqrt(2.0)
    limit = (root + 1.0) / math.sqrt(8.0 * math.pi * root) / math.sqrt(x) * math.exp(-(2.0 - root) * x)
    assert r.dqpsk_bit_error_rate(sinr) == pytest.approx(limit, rel=0.03)


def test_slower_rates_take_less_power_and_err_less() -> None:
    sinrs = np.geomspace(0.05, 3.0, 30).tolist()
    here = radio()
    rates = [[here.error_rate(sinr, 1024, kind) for sinr in sinrs] for kind, _ in r.IEEE80211B.values()]
    assert (np.diff(rates, axis=0) >= -1e-12).all()
    by_rate = {}
    for rate_bps in r.IEEE80211B:
        mac = MacConfig(kind="ieee80211b", rate_bps=rate_bps)
        network = NetworkConfig(mac=mac)
        by_rate[rate_bps] = r.reach_m(network)
        here = r.Radio(network.radio, mac, np.random.default_rng(0))
        assert here.mean_power_w(by_rate[rate_bps]) == pytest.approx(here.rx_threshold_w)
        assert here.cs_threshold_w <= here.rx_threshold_w
    assert by_rate[11e6] == pytest.approx(100.0)
    crossover_m = r.crossover_m(1.5, r.wavelength_m(2.4e9))
    assert by_rate[1e6] == pytest.approx(math.sqrt(100.0 * 10.0 ** (9.0 / 20.0) * crossover_m))
    assert r.reach_m(NetworkConfig()) == pytest.approx(100.0)


@pytest.mark.parametrize("model", ["friis", "two-ray", "log-distance"])
def test_the_distance_of_a_power_is_the_power_of_that_distance(model: Propagation) -> None:
    law = r.path_loss(RadioConfig(model=model))
    for distance_m in (0.5, 5.0, 60.0, 300.0, 2000.0):
        assert law.distance_m(law.power_w(distance_m)) == pytest.approx(distance_m)

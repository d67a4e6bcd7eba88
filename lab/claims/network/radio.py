"""C32: radio and medium access of the street grid, compared with theory and ns-2's numbers (SPEC 6.3)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path

from lab.claims.claim import Claim, Outcome
from lab.claims.exhibits import Chart, Table, plain_curve
from lab.claims.network.intervals import curve, interval
from lab.claims.network.tasks import Crowd, saturated
from lab.trials import iterate_trials
from network_sim.config import NodesConfig
from network_sim.mac.bianchi import bianchi
from network_sim.mac.ieee80211b import EIFS_NS
from network_sim.presets import PRESETS
from network_sim.radio.propagation import crossover_m, ground_reflection, wavelength_m
from packetmesh.progress import Progress

STREET = PRESETS["street-grid"]
STATIONS = (1, 2, 3, 5, 10, 20, 50)
RUNS = 3
DURATION_S = 10.0
MOST_ERROR, MOST_ERROR_ALONE = 0.03, 0.01

NS2_HZ, NS2_TX_W, NS2_HEIGHT_M = 914e6, 0.28183815, 1.5
NS2_POWERS_W = {100.0: 1.42681e-8, 250.0: 3.65262e-10, 550.0: 1.55924e-11}
"""Received power by distance in metres; the last two are ns-2's thresholds for receiving and sensing."""
NS2_CROSSOVER_M = 86.14
MOST_POWER_ERROR = 1e-4
PLACES = 4
"""Number of access points in the thesis."""


@dataclass(frozen=True, slots=True)
class Throughputs:
    """Saturated throughputs of simulation and model, bit/s."""

    runs: tuple[tuple[float, ...], ...]
    """Simulated, by number of stations and run."""
    theory: tuple[float, ...]
    """Bianchi's model, by number of stations."""

    @property
    def errors(self) -> list[float]:
        """Relative errors of the runs' means, by number of stations."""
        return [interval(runs)[0] / bps - 1.0 for runs, bps in zip(self.runs, self.theory, strict=True)]

    @property
    def close(self) -> bool:
        """Whether the errors are within 1 % for one station and 3 % for more."""
        limits = [MOST_ERROR_ALONE if n == 1 else MOST_ERROR for n in STATIONS]
        return all(abs(error) <= limit for error, limit in zip(self.errors, limits, strict=True))


def crowd(stations: int, seed: int, wait_after_loss: bool, duration_s: float = DURATION_S) -> Crowd:
    """Return the task of a crowd with the street grid's MAC, 1000-byte images and 28-byte headers."""
    headers_bytes = STREET.scheme.headers_bytes
    nodes = NodesConfig(
        payload_bytes=STREET.scheme.image_bytes + headers_bytes, header_bytes=headers_bytes, spacing_m=10.0
    )
    config = replace(STREET, scenario="collection", nodes=nodes)
    return Crowd(config, stations, duration_s, seed, wait_after_loss)


def crowd_runs(
    folder: Path, scheduler: str | None
) -> Generator[Progress, None, tuple[Throughputs, Throughputs]]:
    """Return the throughputs with an EIFS after collisions (the standard), and without (Bianchi)."""
    tasks = [crowd(n, seed, wait) for wait in (True, False) for n in STATIONS for seed in range(RUNS)]
    found = yield from iterate_trials("C32, saturated stations", saturated, tasks, folder, scheduler)
    bps = [float(values["throughput_bps"] or 0.0) for values in found]
    groups = [tuple(bps[first : first + RUNS]) for first in range(0, len(bps), RUNS)]
    count = len(STATIONS)
    eifs_us = EIFS_NS / 1000.0
    return (
        Throughputs(
            tuple(groups[:count]), tuple(bianchi(n, silence_us=eifs_us).throughput_bps for n in STATIONS)
        ),
        Throughputs(tuple(groups[count:]), tuple(bianchi(n).throughput_bps for n in STATIONS)),
    )


def _c32(runs: tuple[Throughputs, Throughputs]) -> Outcome:
    powers = {
        d: ground_reflection(NS2_TX_W, wavelength_m(NS2_HZ), NS2_HEIGHT_M).power_w(d) / ns2_w - 1.0
        for d, ns2_w in NS2_POWERS_W.items()
    }
    worst_power = max(abs(error) for error in powers.values())
    setup = _setup_rows()
    as_stated = all(thesis == ours for _, thesis, ours in setup)
    ours = {"power_error": worst_power, "crossover_m": crossover_m(NS2_HEIGHT_M, wavelength_m(NS2_HZ))}
    ci95: dict[str, tuple[float, float]] = {}
    for name, found in zip(("standard", "as_assumed"), runs, strict=True):
        for n, bps, error in zip(STATIONS, found.runs, found.errors, strict=True):
            mean, low, high = interval(bps)
            ours |= {f"throughput_bps_{name}_{n}": mean, f"error_{name}_{n}": error}
            ci95[f"throughput_bps_{name}_{n}"] = (low, high)
    standard, assumed = (max(map(abs, found.errors[1:])) for found in runs)
    return Outcome(
        ours,
        ci95,
        as_stated and all(found.close for found in runs) and worst_power <= MOST_POWER_ERROR,
        f"saturated throughput is off Bianchi's by {runs[1].errors[0]:+.2%} for one station and by "
        f"{assumed:.2%} at most for {STATIONS[1]} to {STATIONS[-1]}; with the EIFS of the standard, "
        f"in the model too, by {standard:.2%}; two-ray powers are off ns-2's by {worst_power:.1e} at most",
        _exhibits(runs, powers, setup),
    )


def _setup_rows() -> list[tuple[str, str | float, str | float]]:
    """Return rows of a parameter's name, the thesis's value and the preset's."""
    return [
        ("medium access", "ieee80211b", STREET.mac.kind),
        ("data rate, Mbit/s", 11.0, STREET.mac.rate_bps / 1e6),
        ("RTS/CTS", "no", "yes" if STREET.mac.rts else "no"),
        ("nominal range, m", 100.0, STREET.radio.range_m),
        ("propagation", "two-ray", STREET.radio.model),
        ("access points", PLACES, STREET.street.access_points),
    ]


def _exhibits(
    runs: tuple[Throughputs, Throughputs],
    powers: dict[float, float],
    setup: list[tuple[str, str | float, str | float]],
) -> tuple[Table | Chart, ...]:
    power_rows = tuple((d, NS2_POWERS_W[d], NS2_POWERS_W[d] * (1.0 + e), e) for d, e in powers.items())
    crossover = crossover_m(NS2_HEIGHT_M, wavelength_m(NS2_HZ))
    own_m = crossover_m(STREET.radio.antenna_height_m, wavelength_m(STREET.radio.frequency_hz))
    power_note = (
        f"914 MHz, {NS2_TX_W} W, antennas at {NS2_HEIGHT_M} m; the crossover is at {crossover:.2f} m (ns-2: "
        f"{NS2_CROSSOVER_M} m). At our own 2.4 GHz it is at {own_m:.0f} m: within the range of "
        f"{STREET.radio.range_m:g} m two-ray is free space."
    )
    names = ("as Bianchi assumes", "with an EIFS after collisions")
    curves = []
    for label, found in zip(("", ", EIFS"), reversed(runs), strict=True):
        curves.append(plain_curve(f"Bianchi{label}", STATIONS, [bps / 1e6 for bps in found.theory]))
        curves.append(curve(f"simulated{label}", STATIONS, [[bps / 1e6 for bps in r] for r in found.runs]))
    return (
        Table("Radio and medium access of the street grid", ("parameter", "thesis", "ours"), tuple(setup)),
        *(_throughput_table(name, found) for name, found in zip(names, reversed(runs), strict=True)),
        Chart("Saturated throughput", "stations", "Mbit/s", tuple(curves)),
        Table("Power received", ("m", "ns-2, W", "ours, W", "relative error"), power_rows, power_note),
    )


def _throughput_table(name: str, found: Throughputs) -> Table:
    rows = []
    for n, runs, bps, error in zip(STATIONS, found.runs, found.theory, found.errors, strict=True):
        mean, low, high = interval(runs)
        rows.append((n, bps / 1e6, mean / 1e6, low / 1e6, high / 1e6, 100.0 * error))
    header = ("stations", "Bianchi, Mbit/s", "simulated, Mbit/s", "95 % from", "to", "error, %")
    note = (
        f"1000-byte datagrams at 11 Mbit/s without RTS/CTS; {RUNS} runs of {DURATION_S:g} s. Bianchi's "
        "stations try for ever, ours seven times."
    )
    return Table(f"Saturated throughput, {name}", header, tuple(rows), note)


CLAIMS = (
    Claim(
        id="C32",
        claim="The vehicles' radios: IEEE 802.11 without RTS/CTS, 11 Mbps, 100 m, two-ray ground, four APs",
        thesis="4.4: these parameters",
        tolerance=(
            "the preset's own; saturated throughput within 3 % of Bianchi's model for 1 to 50 stations (1 % "
            "for one), with and without an EIFS after collisions, received powers within 1e-4 of ns-2's"
        ),
        experiment=_c32,
        prepare=crowd_runs,
    ),
)

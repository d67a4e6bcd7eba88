"""C24: time and storage of ball pivoting grow linearly with the number of points (SPEC 5)."""

from __future__ import annotations

import tracemalloc
from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import linregress
from scipy.stats import t as student_t

from lab.benchmarks.surface import OURS, TERRAIN, SurfaceRun, roll_ours, terrain, time_alone
from lab.claims.claim import Claim, Outcome
from lab.claims.exhibits import Chart, Table, plain_curve
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.types import PointCloud

SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
OPEN3D_SIZES = (10_000, 30_000, 100_000)
"""Sizes at which Open3D is fast enough."""
BALLS = (1.0, 1.25, 1.5, 2.0)
"""Radii over the mean nearest-neighbour distance."""
SLOPE = (0.9, 1.2)


@dataclass(frozen=True, slots=True)
class Slope:
    """A power law fitted through (n, value) pairs."""

    exponent: float
    ci95: tuple[float, float]
    factor: float
    """Value at n = 1."""

    @property
    def is_linear(self) -> bool:
        """Whether the exponent is within ``SLOPE``."""
        return SLOPE[0] <= self.exponent <= SLOPE[1]


@dataclass(frozen=True, slots=True)
class Growth:
    """Measurements, by ascending number of points."""

    ours: tuple[SurfaceRun, ...]
    open3d: tuple[SurfaceRun, ...]
    storage_bytes: tuple[int, ...]
    """Peak memory of our arrays."""


def fit_slope(counts: Sequence[float], values: Sequence[float]) -> Slope:
    """Fit at least three pairs by least squares in logarithms, with the exponent's 95 % interval."""
    fit = linregress(np.log(counts), np.log(values))
    reach = float(student_t.ppf(0.975, len(counts) - 2) * fit.stderr)
    exponent = float(fit.slope)
    return Slope(exponent, (exponent - reach, exponent + reach), float(np.exp(fit.intercept)))


def storage_bytes(cloud: PointCloud, radii_m: Sequence[float]) -> int:
    """Return the peak memory of our ball's arrays, with the result and without the cloud."""
    assert cloud.normals is not None
    roll_ours(cloud.points_m[:1000], cloud.normals[:1000], radii_m)  # loading compiled code would count
    tracemalloc.start()
    try:
        roll_ours(cloud.points_m, cloud.normals, radii_m)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def size_trial(size: int) -> dict[str, Any]:
    """Return, for a terrain of one size: our time and Open3D's, each in a fresh process, and our memory."""
    cloud = terrain(size)
    ours = time_alone(OURS, cloud, TERRAIN, "four", BALLS)
    open3d = time_alone("open3d", cloud, TERRAIN, "four", BALLS) if size in OPEN3D_SIZES else None
    return {
        "ours": asdict(ours),
        "open3d": open3d and asdict(open3d),
        "storage_bytes": storage_bytes(cloud, ours.radii_m),
    }


def study(folder: Path, scheduler: str | None) -> Generator[Progress, None, Growth]:
    """Run terrains of one density one after the other on this machine: other work would disturb the times.

    ``scheduler`` is not used.
    """
    found = yield from iterate_trials("C24, growth", size_trial, SIZES, folder, processes=1)
    return Growth(
        tuple(SurfaceRun(**entry["ours"]) for entry in found),
        tuple(SurfaceRun(**entry["open3d"]) for entry in found if entry["open3d"]),
        tuple(entry["storage_bytes"] for entry in found),
    )


def judge(growth: Growth) -> Outcome:
    """Return C24's numbers and verdict."""
    counts = [run.points for run in growth.ours]
    time = fit_slope(counts, [run.elapsed_s for run in growth.ours])
    storage = fit_slope(counts, growth.storage_bytes)
    largest, most_bytes = growth.ours[-1], growth.storage_bytes[-1]
    ours = {
        "time_slope": time.exponent,
        "storage_slope": storage.exponent,
        "largest_points": float(largest.points),
        "largest_elapsed_s": largest.elapsed_s,
        "largest_storage_bytes": float(most_bytes),
        "largest_peak_memory_bytes": float(largest.peak_memory_bytes),
    }
    ci95 = {"time_slope": time.ci95, "storage_slope": storage.ci95}
    comparison = ""
    if len(growth.open3d) > 2:
        peer = fit_slope([run.points for run in growth.open3d], [run.elapsed_s for run in growth.open3d])
        ours["time_slope_open3d"], ci95["time_slope_open3d"] = peer.exponent, peer.ci95
        comparison = (
            f"; Open3D's time grows with {peer.exponent:.2f} up to {growth.open3d[-1].points:,} points"
        )
    return Outcome(
        ours,
        ci95,
        time.is_linear and storage.is_linear,
        f"from {counts[0]:,} to {counts[-1]:,} points of one density, time grows with the power "
        f"{time.exponent:.2f} and storage with {storage.exponent:.2f} of their number; the largest cloud "
        f"takes {largest.elapsed_s:.1f} s and {most_bytes / largest.points:.0f} bytes a point{comparison}",
        (_chart(growth, time), _table(growth)),
    )


def _chart(growth: Growth, time: Slope) -> Chart:
    curves = [
        plain_curve(label, (run.points for run in runs), (run.elapsed_s for run in runs))
        for label, runs in (("packetmesh", growth.ours), ("Open3D", growth.open3d))
        if runs
    ]
    x = curves[0].x
    fitted = (time.factor * count**time.exponent for count in x)
    curves.append(plain_curve(f"power {time.exponent:.2f}", x, fitted))
    return Chart(
        "Time against the number of points",
        "points",
        "seconds",
        tuple(curves),
        "Balls of 1, 1.25, 1.5 and 2 mean nearest-neighbour distances, one after the other; medians of the "
        "rounds. Both axes are logarithmic.",
        logarithmic=True,
    )


def _table(growth: Growth) -> Table:
    peers = {run.points: run for run in growth.open3d}
    rows: list[tuple[str | float | int | None, ...]] = []
    for run, held in zip(growth.ours, growth.storage_bytes, strict=True):
        peer = peers.get(run.points)
        rows.append(
            (
                f"{run.points:,}",
                run.elapsed_s,
                run.rounds,
                None if peer is None else peer.elapsed_s,
                held / 1e6,
                run.peak_memory_bytes / 1e6,
                run.triangles,
                None if peer is None else peer.triangles,
            )
        )
    return Table(
        "Time and storage by number of points",
        (
            "points",
            "seconds",
            "rounds",
            "Open3D, seconds",
            "arrays (MB)",
            "whole process (MB)",
            "triangles",
            "Open3D, triangles",
        ),
        tuple(rows),
        "A wavy terrain with points 1 cm apart, whose area grows. Seconds are medians of the rounds, after "
        "a first small surface; the arrays are the most that our ball holds at once, without the cloud and "
        "without what its grid allocates (at most 28 bytes a point); the process holds its libraries too.",
    )


C24 = Claim(
    id="C24",
    claim="Ball pivoting takes time and storage linear in the number of points",
    thesis="“linear”, without a number",
    tolerance="slopes of log time and log storage over log n from 0.9 to 1.2, for 10,000 to 1,000,000 points",
    experiment=judge,
    prepare=study,
)

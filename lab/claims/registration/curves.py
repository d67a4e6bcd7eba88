"""The benchmark's charts: convergence (Fig. 4.9) and capture range."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from lab.claims.claim import mean_curve
from lab.claims.exhibits import Chart, HeatMap
from lab.claims.registration.cases import CONDITIONS
from lab.claims.registration.results import Results
from lab.claims.registration.setup import CURVED, FIXED_GATE
from lab.claims.registration.trials import CURVE_ITERATIONS
from pipeline.types import FloatArray

LAST_ITERATION = 60
SECONDS = np.linspace(0.0, 0.4, 21)
GROWING_GATE = (
    f"T_d is twice the translation, at least {CONDITIONS['easy'].gate_m:g} m (ICP and FICP have none)"
)
"""Gate of the capture maps whose gate depends on the start."""


def convergence_charts(results: Results, condition: str) -> tuple[Chart, ...]:
    """Chart point error and average Hausdorff distance over iterations, and point error over seconds."""
    label = CONDITIONS[condition].label
    iterations = np.arange(LAST_ITERATION + 1.0)
    sampled = np.array(CURVE_ITERATIONS, float)
    kinds: tuple[tuple[str, str, str, FloatArray, Callable[[dict], FloatArray]], ...] = (
        (
            "point error",
            "iterations",
            "cm",
            iterations,
            lambda trial: extended(trial["curve_error_cm"], len(iterations)),
        ),
        (
            "average Hausdorff distance",
            "iterations",
            "cm",
            sampled[sampled <= LAST_ITERATION],
            lambda trial: np.array(trial["curve_ahd_cm"])[sampled <= LAST_ITERATION],
        ),
        ("point error", "seconds", "cm", SECONDS, error_by_time),
    )
    return tuple(
        Chart(
            f"{quantity} against {over}, {label}",
            over,
            unit,
            tuple(
                mean_curve(entrant, x, np.array([of(trial) for trial in trials]).T, resamples=400)
                for entrant in CURVED
                if (trials := results.trials(entrant, (condition,)))
            ),
            "Mean over the rooms and its 95 % bootstrap interval; a run that has ended keeps its last value. "
            + ("Times are of this machine, with a trial on each of its cores." if over == "seconds" else ""),
        )
        for quantity, over, unit, x, of in kinds
    )


def extended(values: Sequence[float], length: int) -> FloatArray:
    """Return the first ``length`` values; if there are fewer, the last one is repeated."""
    return np.array(values)[np.minimum(np.arange(length), len(values) - 1)]


def error_by_time(trial: dict) -> FloatArray:
    """Return (T,) point error in cm that a run has reached at each of ``SECONDS``."""
    errors_cm = np.array(trial["curve_error_cm"])
    return errors_cm[np.searchsorted(trial["elapsed_s"], SECONDS, side="right")]


def capture_maps(results: Results) -> tuple[HeatMap, ...]:
    """Return, for every entrant, the share of captured rooms by the start's rotation and translation."""
    maps = []
    for entrant in dict.fromkeys(cell["entrant"] for cell in results.cells):
        captured = captured_rooms(results, entrant)
        rotations = tuple(sorted({rotation for rotation, _ in captured}))
        translations = tuple(sorted({translation for _, translation in captured}))
        shares = tuple(tuple(float(np.mean(captured[r, t])) for t in translations) for r in rotations)
        rooms = len(next(iter(captured.values())))
        maps.append(
            HeatMap(
                f"capture range, {entrant}",
                "start moved by, metres",
                translations,
                "start turned by, degrees",
                rotations,
                shares,
                f"Share of {rooms} rooms that end within 1.5 degrees and 5 cm, on the clouds of “easy”"
                + ("." if entrant == FIXED_GATE else f"; {GROWING_GATE}."),
            )
        )
    return tuple(maps)


def captured_rooms(results: Results, entrant: str) -> dict[tuple[float, float], list[bool]]:
    """Return by start, (rotation in degrees, translation in metres), whether each room is captured."""
    found: dict[tuple[float, float], list[bool]] = {}
    for cell in results.cells:
        if cell["entrant"] == entrant:
            found.setdefault((cell["rotation_deg"], cell["translation_m"]), []).append(cell["captured"])
    return found

"""Equal tuning: one parameter per method, equally many values and the same rooms for each (SPEC 4.7)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from lab.claims.registration.cases import CONDITIONS
from lab.claims.registration.entrants import GATE_SCALE, Entrant, Lineup
from lab.claims.registration.results import Results
from lab.claims.registration.setup import MAX_POINTS, methods, peers
from lab.claims.registration.trials import CaseTask, run_case
from lab.trials import iterate_trials
from packetmesh.files import atomic_path
from packetmesh.progress import Progress
from pipeline.config import Direction

ROOMS = range(1000, 1004)
"""Seeds of ``box_room`` that are used for nothing else."""
TUNING_CONDITIONS = ("easy", "holes-x3", "large-start", "nodes-sensor")
GATES = (0.25, 0.5, 1.0, 2.0)
SMALLEST_M = (0.01, 0.02, 0.03, 0.04)
CANDIDATES: dict[str, tuple[str, tuple[float, ...]]] = {
    "icp-gated": (GATE_SCALE, GATES),
    "trimmed-icp": ("trim", (0.6, 0.7, 0.8, 0.9)),
    "picp": ("level", (1, 2, 3, 4)),
    "ricp": (GATE_SCALE, (*GATES[1:], 1e3)),
    "mricp": ("most_steps", (5, 10, 25, 50)),
    "ficp": ("exponent", (0.6, 0.95, 1.3, 2.0)),
    "hicp": ("hue_weight_m", (0.05, 0.1, 0.3, 0.5)),
    "ceicp-literal": (GATE_SCALE, GATES),
    "ceicp-n": (GATE_SCALE, GATES),
    "ceicp-a": (GATE_SCALE, GATES),
    "ceicp-r": ("sigma_min_m", SMALLEST_M),
    "ceicp-ml": ("sigma_min_m", SMALLEST_M),
    "kernel-correlation": (GATE_SCALE, GATES),
    "fast-robust-icp": ("nu_min_m", SMALLEST_M),
}
"""By method: its most important parameter and the values to try. Plain ICP has none; other programs get
``gate_scale``."""

HEADER = '''"""What tuning chose; written by ``python -m lab.claims.registration``."""

from __future__ import annotations

TUNED: dict[str, tuple[str, float, dict[float, float]]] = {
'''
FOOTER = '''}
"""By entrant: the parameter, the chosen value, and the score of every value that was tried: the geometric
mean of the point error over the tuning cases, centimetres."""
'''


def tune(
    folder: Path, scheduler: str | None = None
) -> Generator[Progress, None, dict[str, tuple[str, float, dict[float, float]]]]:
    """Try every value of every entrant in the tuning rooms.

    Returns:
        By entrant: the parameter, the value with the lowest score, and all scores, centimetres.
    """
    lineup = tuning_lineup()
    tasks = [
        CaseTask(CONDITIONS[name], room, lineup, MAX_POINTS) for room in ROOMS for name in TUNING_CONDITIONS
    ]
    trials = yield from iterate_trials("tuning", run_case, tasks, folder, scheduler)
    results = Results(chain(*trials))
    scores: dict[str, tuple[str, dict[float, float]]] = {}
    for _, entrant in lineup:
        ((parameter, value),) = entrant.settings
        errors_cm = results.values(entrant.label, TUNING_CONDITIONS)
        score = round(float(np.exp(np.mean(np.log(errors_cm)))), 4)
        scores.setdefault(replace(entrant, label="").name, (parameter, {}))[1][float(value)] = score
    return {
        name: (parameter, min(tried, key=lambda value: (tried[value], value)), tried)
        for name, (parameter, tried) in scores.items()
    }


def tuning_lineup() -> Lineup:
    """Return every entrant once for each value of its parameter."""
    lineup: list[tuple[Direction, Entrant]] = []
    for entrant in (*methods(), *methods("plane"), *peers()):
        parameter, values = CANDIDATES.get(entrant.method, (GATE_SCALE, GATES))
        if entrant.method != "icp":
            lineup += [
                ("q2p", replace(entrant, label=f"{entrant.name} {value}", settings=((parameter, value),)))
                for value in values
            ]
    return tuple(lineup)


def write_tuned(chosen: dict[str, tuple[str, float, dict[float, float]]], path: Path) -> None:
    """Write the chosen values as the module ``tuned``."""
    lines = []
    for name, (parameter, value, tried) in chosen.items():
        scores = ", ".join(f"{key:g}: {score}" for key, score in tried.items())
        lines.append(f'    "{name}": ("{parameter}", {value:g}, {{{scores}}}),\n')
    with atomic_path(path) as temporary:
        temporary.write_text(HEADER + "".join(lines) + FOOTER, encoding="utf-8")

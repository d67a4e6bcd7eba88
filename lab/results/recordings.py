"""The tables and the picture of docs/results.md about recordings."""

from __future__ import annotations

from lab.results.markdown import Cell, Row, percent, table
from lab.results.scatter import Mark, scatter

COLUMNS = (
    "program",
    "walks lost",
    "ATE, cm",
    "of the path",
    "RPE over 1 s, cm",
    "frames without a pose",
    "frames a second",
    "MB",
    "map, mm off",
    "F-score at 2 cm",
    "at 5 cm",
    "rays without a surface",
)


EVERY = "recording: every frame"
"""Case of the benchmark in its record."""
PICTURE = "recordings.svg"
"""File of the picture, next to the page."""


def pictures(numbers: Row) -> dict[str, str]:
    """Return the record's picture as SVG by file name."""
    marks = [
        Mark(run["program"], run["frames_s"], 100.0 * run["ate_m"], _worst_cm(run), hollow=run["every"] > 1)
        for result in numbers.values()
        for run in result["runs"]
        if run["ate_m"] is not None and run["frames_s"] is not None
    ]
    y_label = "ATE, cm: median, bar to the worst walk"
    return {PICTURE: scatter("frames a second (hollow: every fifth frame)", y_label, marks)}


def _worst_cm(run: Row) -> float | None:
    return None if run["worst_ate_m"] is None else 100.0 * run["worst_ate_m"]


def recordings(numbers: Row) -> str:
    """Return the text of the section: introduction, picture, and a table for each case of the record."""
    parts = [
        "Rendered walks through rooms on which no constant was fitted, with a Kinect's noise; each ends "
        "where it began. Walks 6,000,001, 6,000,002, 6,000,003, 6,000,006 and 6,000,007 revealed faults that "
        "were then corrected; the other five were not used for development. Median (worst) of the walks, "
        "whose images are in memory. OMP_NUM_THREADS=1 and NUMBA_NUM_THREADS=1 give each program one core, "
        "but for threads that Open3D still starts. A walk is lost if its ATE is over 20 cm or half of its "
        "frames have no pose. F-scores compare the surface with the part of the room that the walk looks at "
        "within 4 m; rays without a surface are those from viewpoints 25 cm to the camera's side."
    ]
    parts += [f"![Error of the trajectory over frames a second, by program]({PICTURE})"]
    for case, result in numbers.items():
        rows = [_row(run) for run in result["runs"]]
        parts += [f"{case.removeprefix('recording: ').capitalize()}:", table(COLUMNS, rows)]
    return "\n\n".join(parts)


def _row(run: Row) -> tuple[Cell, ...]:
    return (
        run["program"],
        f"{run['lost']} of {run['walks']}{_crashes(run)}",
        _both(run, "ate_m", 100.0, 2),
        _shares(run, "ate_share", 2),
        _both(run, "rpe_m", 100.0, 2),
        _both(run, "without_pose", 1.0, 0),
        _both(run, "frames_s", 1.0, 0),
        f"{run['peak_memory_bytes'] / 1e6:.0f}",
        _both(run, "map_median_m", 1000.0, 1),
        _shares(run, "f_2cm", 1),
        _shares(run, "f_5cm", 1),
        _shares(run, "without_surface", 1),
    )


def _crashes(run: Row) -> str:
    return f" ({run['crashed']} by a crash)" if run.get("crashed") else ""


def _both(run: Row, name: str, factor: float, digits: int) -> str | None:
    """Return median and worst of a measure; None if it was not measured."""
    if run[name] is None and run[f"worst_{name}"] is None:
        return None
    values = (run[name], run[f"worst_{name}"])
    median, worst = ("–" if value is None else f"{factor * value:.{digits}f}" for value in values)
    return f"{median} ({worst})"


def _shares(run: Row, name: str, digits: int) -> str | None:
    if run[name] is None and run[f"worst_{name}"] is None:
        return None
    values = (run[name], run[f"worst_{name}"])
    median, worst = ("–" if value is None else percent(value, digits) for value in values)
    return f"{median} ({worst})"

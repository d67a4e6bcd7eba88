"""The table of docs/results.md about measuring."""

from __future__ import annotations

from lab.measuring.clicks import EDGE_PX, FLAT_M, FLAT_PX
from lab.measuring.judging import UNITS
from lab.measuring.rooms import FOCAL_SD, POINTS
from lab.results.markdown import Cell, Row, percent, table

COLUMNS = (
    "measure",
    "ends",
    "number",
    "intervals that hold the truth",
    "median error",
    "over single measurements",
    "median half width",
    "ms, 95th percentile",
)
NAMES = {
    "distance": "length",
    "point-plane": "height over a plane",
    "plane-plane": "gap of two planes",
    "angle": "angle of two planes",
    "corner": "angle of three points",
    "box": "side of a box",
    "hole": "area of a hole",
}


def measuring(numbers: Row) -> str:
    """Return the table of the record."""
    runs = numbers["measuring"]["runs"]
    rooms = max(run["rooms"] for run in runs)
    text = (
        f"Clicks at random pixels of two cameras in {rooms} rendered rooms on which nothing was fitted, at "
        f"least {EDGE_PX} pixels from a depth edge; the truth is between the true points of the same pixels. "
        "The intervals' constants were fitted on other rooms, whose furniture is drawn from the same stock. "
        f"Planes are clicked where the true surface is flat within {1000.0 * FLAT_M:g} mm for {FLAT_PX} "
        "pixels around, which leaves out most clicks: elsewhere no true plane is known. "
        f"Surfaces of {POINTS:,} points, focal lengths wrong by {100.0 * FOCAL_SD:g} % (standard deviation), "
        "the second pose registered from 3° and 6 cm off. Intervals of the shares resample rooms. Over "
        "single measurements: median error over that of the sensor's own depth at both pixels, with the true "
        "cameras and poses. Boxes are things with a level rectangular top that one camera sees whole; the "
        "true area of a hole is that in the true points of its rim. Times: of a length, casting the rays of "
        "both clicks and computing the interval; of an angle of three points, computing the interval; of a "
        "measure with planes, growing one plane; of a box, casting the ray and measuring the box; of a hole, "
        "measuring it."
    )
    return f"{text}\n\n{table(COLUMNS, [_row(run) for run in runs])}"


def _row(run: Row) -> tuple[Cell, ...]:
    low, high = run["coverage_ci95"]
    unit, times = UNITS.get(run["kind"], (" mm", 1000.0))
    return (
        NAMES[run["kind"]],
        "guessed" if run["guessed"] else "measured",
        run["measures"],
        f"{percent(run['coverage'])} [{percent(low)}, {percent(high)}]",
        f"{times * run['median_error']:.2f}{unit}",
        run["error_over_raw"],
        f"{times * run['median_half_width']:.2f}{unit}",
        f"{1000.0 * run['p95_s']:.0f}",
    )

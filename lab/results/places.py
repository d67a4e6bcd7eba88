"""The tables and pictures of docs/results.md about views placed without a start."""

from __future__ import annotations

from collections.abc import Sequence

from lab.benchmarks.places import NOTHING
from lab.places.judging import RIGHT_DEG, RIGHT_M, wilson
from lab.places.ours import OURS
from lab.places.views import TOLERANCE
from lab.results.chart import Series, chart
from lab.results.markdown import Cell, Row, percent, table

BY_OVERLAP, ANY_OVERLAP, LISTS = "places: by overlap", "places: any overlap", "places: lists of bare clouds"
"""Cases of the benchmark in its record."""
RECALL, VERDICT = "places_recall.svg", "places_verdict.svg"
"""Files of the pictures, next to the page."""


def places(numbers: Row) -> str:
    """Return all tables and pictures of the record."""
    runs = numbers[BY_OVERLAP]["runs"]
    pairs = sum(run["pairs"] for run in runs if run["program"] == OURS)
    parts = [
        f"{pairs} pairs of rendered RGB-D views, 320 x 240, of rooms on which nothing was fitted; no program "
        "gets a start. Overlap: each view shares at least this part of its measured surface with the other. "
        f"Right: within {RIGHT_DEG:g}° and {100.0 * RIGHT_M:g} cm; intervals are 95 % (Wilson). Other "
        "programs' answers are refined by Open3D's ICP; they give no verdict. Every program has one core "
        "(OMP_NUM_THREADS=1, NUMBA_NUM_THREADS=1).",
        f"![Share of right answers over the overlap, by program]({RECALL})",
        _recalls(runs),
    ]
    if ANY_OVERLAP in numbers:
        verdicts = numbers[ANY_OVERLAP]["runs"]
        parts += [
            "Verdicts of ours on pairs with any overlap, one in ten of them of two different rooms:",
            f"![Share right, called sure, and called sure but wrong]({VERDICT})",
            _verdicts(verdicts),
        ]
    if LISTS in numbers:
        parts += ["Bare clouds in the form of a public benchmark:", _lists(numbers[LISTS]["runs"])]
    return "\n\n".join(parts)


def pictures(numbers: Row) -> dict[str, str]:
    """Return the record's pictures as SVG by file name."""
    found = {RECALL: recall_picture(numbers[BY_OVERLAP]["runs"])}
    if ANY_OVERLAP in numbers:
        found[VERDICT] = verdict_picture(numbers[ANY_OVERLAP]["runs"])
    return found


def recall_picture(runs: list[Row]) -> str:
    """Return a chart of the share of right answers over the overlap, with a line for each program."""
    overlaps = sorted({run["overlap"] for run in runs})
    series = []
    for program in dict.fromkeys(run["program"] for run in runs):
        own = {run["overlap"]: run for run in runs if run["program"] == program}
        series.append(_series(program, [own.get(overlap) for overlap in overlaps], "right"))
    return chart("overlap", "right answers", [percent(overlap, 0) for overlap in overlaps], series)


def verdict_picture(runs: list[Row]) -> str:
    """Return a chart of our shares over the overlap: right, called sure, and called sure but wrong."""
    own = [run for run in runs if run["program"] == OURS and run["overlap"] != "all" and run["pairs"]]
    kinds = {"right": "right", "called sure": "sure", "called sure but wrong": "sure_wrong"}
    names = [_overlap(run).partition(" (")[0].replace(" to ", "–") for run in own]
    series = [_series(label, own, key) for label, key in kinds.items()]
    return chart("overlap", "share of the pairs", [name.removesuffix(" %") for name in names], series)


def _series(label: str, runs: Sequence[Row | None], key: str) -> Series:
    shares = tuple(None if run is None else run[key] / run["pairs"] for run in runs)
    bars = tuple(None if run is None else wilson(run[key], run["pairs"]) for run in runs)
    return Series(label, shares, bars)


def _recalls(runs: list[Row]) -> str:
    rows = [(run["program"], percent(run["overlap"], 0), *_counts(run)) for run in runs]
    return table(("program", "overlap", *_COUNTED), rows)


def _verdicts(runs: list[Row]) -> str:
    rows = []
    for run in runs:
        missed = run["right"] - ((run["sure"] or 0) - (run["sure_wrong"] or 0))
        share = percent(missed / run["right"]) if run["right"] else None
        rows.append((run["program"], _overlap(run), *_counts(run), share))
    return table(("program", "overlap", *_COUNTED, "right but not sure"), rows)


def _lists(runs: list[Row]) -> str:
    rows = [(run["list"].removesuffix("_local"), run["program"], *_counts(run)) for run in runs]
    return table(("list", "program", *_COUNTED), rows)


def _overlap(run: Row) -> str:
    """Return the text of a group's overlap; views that should have none may share ``TOLERANCE``."""
    overlap: str = run["overlap"]
    return f"none (at most {percent(TOLERANCE, 0)})" if overlap == NOTHING else overlap


_COUNTED = ("pairs", "right", "95 %", "called sure", "of these wrong", "seconds, median")


def _counts(run: Row) -> tuple[Cell, ...]:
    low, high = run["recall_ci95"]
    right = percent(run["right"] / run["pairs"]) if run["pairs"] else None
    wrong = f"{run['sure_wrong']} ({percent(run['sure_wrong'] / run['sure'])})" if run["sure"] else None
    interval = f"{100.0 * low:.0f} to {percent(high, 0)}"
    return run["pairs"], right, interval, run["sure"], wrong, run["median_s"]

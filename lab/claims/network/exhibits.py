"""Tables and charts of the street grid's study."""

from __future__ import annotations

from lab.claims.exhibits import Chart, Exhibit, Table
from lab.claims.network.intervals import curve, interval
from lab.claims.network.study import (
    CAPPED_OBJECTS,
    CAPS,
    OBJECTS,
    RUNS,
    SCHEMES,
    STREET,
    Case,
    Found,
    values,
)

ORIGIN = (
    "The schemes' formulas are our reconstruction of Bruno & Nurchis (arXiv 1311.6013), of which only the "
    "abstract and the first lines could be read."
)
COLUMNS = {
    "images_per_minute": "images/min",
    "coverage": "covered windows",
    "redundancy": "redundant",
    "summary_bytes": "summaries, B/min",
    "request_bytes": "requests, B/min",
    "image_delivery_ratio": "delivered",
    "image_delay_mean": "delay, s",
    "airtime_share": "airtime",
    "energy_per_image": "J per image",
}
UNLIMITED_AT = 40.0
"""Abscissa of the unlimited case in a chart over k."""

Row = tuple[str | float | int | None, ...]


def figure_4_10(found: Found) -> tuple[Exhibit, ...]:
    """Return charts of images, coverage and requests over the vehicles, and a table of all metrics."""
    rows = [(scheme, n, *_cells(found, Case(scheme, n))) for n in OBJECTS for scheme in SCHEMES]
    return (
        _over_objects(found, "images_per_minute", "Images received (Fig. 4.10)", "images/min"),
        _over_objects(
            found, "coverage", "Covered pairs of a road cell and a span of 10 s", "share of those seen"
        ),
        _over_objects(found, "request_bytes", "Requests", "B/min"),
        Table(
            "Figure 4.10 in numbers",
            ("scheme", "vehicles", "± images/min", *COLUMNS.values()),
            tuple(rows),
            f"Means of {RUNS} runs of {STREET.run.horizon_s / 3600.0:g} h, greedy without a cap. {ORIGIN}",
        ),
    )


def caps_exhibits(found: Found) -> tuple[Exhibit, ...]:
    """Return charts of images and requests over k, and a table of all metrics."""
    x = [UNLIMITED_AT if k is None else float(k) for k in CAPS]
    cases = [Case("greedy", CAPPED_OBJECTS, k) for k in CAPS]
    note = f"The point at {UNLIMITED_AT:g} has no cap. {ORIGIN}"
    charts = [
        Chart(title, "k, ids in a request", unit, (curve("greedy", x, _runs(found, cases, metric)),), note)
        for metric, title, unit in (
            ("images_per_minute", f"Images received, {CAPPED_OBJECTS} vehicles", "images/min"),
            ("request_bytes", f"Requests, {CAPPED_OBJECTS} vehicles", "B/min"),
        )
    ]
    rows = tuple(("no cap" if case.k is None else case.k, *_cells(found, case)) for case in cases)
    header = ("k", "± images/min", *COLUMNS.values())
    return (*charts, Table(f"GREEDY with {CAPPED_OBJECTS} vehicles", header, rows, ORIGIN))


def sizes_table(found: Found, objects: int, horizon_s: float) -> Table:
    """Return a table of the schemes with small and with large images."""
    rows = tuple((case.scheme, case.image_bytes, *_cells(found, case)) for case in found)
    note = (
        f"{objects} vehicles, means of {RUNS} runs of {horizon_s / 60.0:g} min, the first 30 left "
        f"out. {ORIGIN}"
    )
    header = ("scheme", "image, bytes", "± images/min", *COLUMNS.values())
    return Table("Images of 1 kB and of 30 kB", header, rows, note)


def _over_objects(found: Found, metric: str, title: str, unit: str) -> Chart:
    curves = tuple(
        curve(scheme, OBJECTS, _runs(found, [Case(scheme, n) for n in OBJECTS], metric)) for scheme in SCHEMES
    )
    return Chart(title, "vehicles", unit, curves, f"Mean and 95 % interval of {RUNS} runs. {ORIGIN}")


def _runs(found: Found, cases: list[Case], metric: str) -> list[list[float]]:
    return [values(found, case, metric) for case in cases]


def _cells(found: Found, case: Case) -> Row:
    """Return half the interval of images per minute, then the mean of every column."""
    mean, _, high = interval(values(found, case, "images_per_minute"))
    runs = {metric: values(found, case, metric) for metric in COLUMNS}
    return (high - mean, *(interval(group)[0] if group else None for group in runs.values()))

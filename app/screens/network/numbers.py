"""Tables of the numbers of one or two runs, with units and definitions, and sentences on the runs."""

from __future__ import annotations

from collections.abc import Sequence

from app.screens.network.view import NetworkView
from app.web.markup import Markdown, Markup
from app.window.tables import Row, table
from network_sim.metrics.metrics import Metric

FIRST = (
    "image_delivery_ratio",
    "packet_delivery_ratio",
    "image_delay_mean",
    "image_delay_p95",
    "packet_delay_mean",
    "throughput",
    "images_per_minute",
    "coverage",
    "coverage_pieces",
    "redundancy",
    "airtime_share",
    "attempts_lost",
    "attempts_lost_collision",
    "energy_radio",
    "energy_total",
)
"""Metrics of the first table, if the run has them; all others are in the second."""
LOST_TO = "attempts_lost_"
LOST_WORDS = {
    "collision": "collisions",
    "noise": "bit errors",
    "range": "distance",
    "channel": "a busy channel",
    "ack_lost": "lost acknowledgements",
    "link": "set or recorded losses",
    "uplink": "the uplink",
    "node_down": "nodes that were down",
    "no_route": "missing routes",
}
TITLES = {"images_per_minute": "images that arrived", "images_taken_per_minute": "images that were taken"}
"""Titles of metrics whose name contains their unit."""
SHARES = ("ratio", "share", "coverage", "redundancy")
"""Words in the names of metrics that are shown in per cent."""


def metric_tables(views: Sequence[NetworkView]) -> tuple[Markup, Markup]:
    """Return two HTML tables: the main metrics, and the others except those that are zero in all runs."""
    by_name: dict[str, list[Metric | None]] = {}
    for index, view in enumerate(views):
        for name, metric in view.metrics.items():
            by_name.setdefault(name, [None] * len(views))[index] = metric
    first = [name for name in FIRST if name in by_name]
    others = [
        name
        for name, metrics in by_name.items()
        if name not in FIRST and any(metric is not None and metric.value != 0.0 for metric in metrics)
    ]
    heads = tuple(view.label for view in views) if len(views) > 1 else ()
    one, other = (table([_row(name, by_name[name]) for name in names], heads) for names in (first, others))
    return one, other


def verdict(views: Sequence[NetworkView]) -> Markdown:
    """Return a sentence that compares images and coverage of two runs; empty unless both runs have both.

    Coverage is that of whole cells, or of pieces of road if a run's images arrive in pieces.
    """
    nothing = Markdown("")
    if len(views) != 2:
        return nothing
    one, two = ({name: metric.value for name, metric in view.metrics.items()} for view in views)
    images = "images_per_minute"
    coverage = "coverage" if all("coverage" in run for run in (one, two)) else "coverage_pieces"
    if not all(run.get(name) for run in (one, two) for name in (images, coverage)):
        return nothing
    first, second = (view.label.partition(":")[0] for view in views)
    brings = Markdown(
        "**{} delivers {:.0%} of the images that {} delivers, and keeps {:.0%} of the coverage**"
    ).format(second, two[images] / one[images], first, two[coverage] / one[coverage])
    seen = f": {two[coverage]:.1%} of what the cameras saw instead of {one[coverage]:.1%}."
    return brings + seen


def _row(name: str, metrics: Sequence[Metric | None]) -> Row:
    definition = next(metric.definition for metric in metrics if metric is not None)
    title = TITLES.get(name, name.replace("_", " "))
    if name.startswith(LOST_TO):
        title = f"attempts lost to {LOST_WORDS.get(cause := name.removeprefix(LOST_TO), cause)}"
    return (title[0].upper() + title[1:], f"{definition}.", *(value_text(name, metric) for metric in metrics))


def value_text(name: str, metric: Metric | None) -> str:
    """Return the value with its unit; a dash if a run has no such metric."""
    if metric is None:
        return "–"
    if metric.unit == "1" and any(word in name for word in SHARES):
        return f"{100.0 * metric.value:.3g} %"
    value, unit = metric.value, metric.unit
    if unit == "s" and abs(value) < 0.1:
        value, unit = 1000.0 * value, "ms"
    if unit in ("bit/s", "B/min", "J") and abs(value) >= 1e4:
        value, unit = value / 1e3, f"k{unit}"
    digits = f"{value:,.0f}" if abs(value) >= 100 or value == int(value) else f"{value:,.3g}"
    if unit == "1/min":
        return f"{digits} images a minute"
    return digits if unit == "1" else f"{digits} {unit}"


def runs_summary(views: Sequence[NetworkView]) -> Markdown:
    """Return sentences on what was simulated and, if a timeline is cut, on the part that it shows."""
    sentences: list[str] = []
    for view in views:
        name = Markdown("**{}**: ").format(view.label) if len(views) > 1 else Markdown("")
        shown_s = (view.end_ns - view.start_ns) / 1e9
        sentences.append(
            name + f"{shown_s:,.1f} s of the network's time, {view.packets:,} packets in all, simulated in "
            f"{view.elapsed_s:.1f} s."
        )
        if view.kept_until_ns < view.end_ns:
            sentences.append(
                f"The timeline shows the first {(view.kept_until_ns - view.start_ns) / 1e9:,.1f} s, "
                "numbers and curves the whole run."
            )
        if not len(view.pieces):
            sentences.append("The timeline is empty: no event was kept.")
    return Markdown(" ").join(sentences)

"""Tables and pictures that belong to a verdict, as data: whoever shows them decides how."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of a name and values; None where there is no value."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a chart, all sequences equally long."""

    label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    low: tuple[float, ...]
    """Lower edge of its band."""
    high: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Chart:
    """Lines with bands over one axis."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class HeatMap:
    """Shares, 0 to 1, over two quantities."""

    title: str
    x_label: str
    x: tuple[float, ...]
    y_label: str
    y: tuple[float, ...]
    shares: tuple[tuple[float, ...], ...]
    """One row for each ``y``."""
    note: str = ""


Exhibit = Table | Chart | HeatMap

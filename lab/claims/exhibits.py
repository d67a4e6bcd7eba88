"""Tables and pictures of a verdict, as data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from pipeline.types import ByteArray


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of a name and values; None for a missing value."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a chart; all sequences have the same length."""

    label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    low: tuple[float, ...]
    """Lower edge of the band."""
    high: tuple[float, ...]


def plain_curve(label: str, x: Iterable[float], y: Iterable[float]) -> Curve:
    """Return a line without a band."""
    values = tuple(float(value) for value in y)
    return Curve(label, tuple(float(value) for value in x), values, values, values)


@dataclass(frozen=True, slots=True)
class Chart:
    """Lines with bands over one axis."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    note: str = ""
    logarithmic: bool = False
    """Whether both axes are logarithmic; then all values are positive."""


@dataclass(frozen=True, slots=True)
class HeatMap:
    """Shares, 0 to 1, over two quantities."""

    title: str
    x_label: str
    x: tuple[float, ...]
    y_label: str
    y: tuple[float, ...]
    shares: tuple[tuple[float, ...], ...]
    """One row per ``y``."""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Picture:
    """Images side by side."""

    title: str
    images: tuple[tuple[str, ByteArray], ...]
    """Captions and (H, W, 3) RGB images."""
    note: str = ""


Exhibit = Table | Chart | HeatMap | Picture


def exhibit_record(exhibit: Exhibit) -> dict[str, Any]:
    """Return an exhibit as plain values; for images only their captions and sizes."""
    if not isinstance(exhibit, Picture):
        return asdict(exhibit)
    images = [
        {"caption": caption, "width_px": rgb.shape[1], "height_px": rgb.shape[0]}
        for caption, rgb in exhibit.images
    ]
    return {"title": exhibit.title, "images": images, "note": exhibit.note}

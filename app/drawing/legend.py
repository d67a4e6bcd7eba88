"""The legend of a picture as plain values, which HTML, pages and pictures show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from app.compute.records import ColorBar
from app.drawing.colors import css


@dataclass(frozen=True, slots=True)
class Legend:
    """A legend: a sentence, named single colours, or a colour bar; or empty."""

    text: str = ""
    swatches: tuple[tuple[str, tuple[int, int, int]], ...] = ()
    """Names and colours."""
    bar: ColorBar | None = None

    def record(self) -> dict[str, Any]:
        """Return the legend as JSON values for a page."""
        bar = self.bar and {"stops": [css(stop) for stop in self.bar.stops], "labels": self.bar.labels}
        swatches = [{"text": text, "color": css(color)} for text, color in self.swatches]
        return {"text": self.text, "swatches": swatches, "bar": bar}

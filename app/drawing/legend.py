"""What the colours of a picture mean: plain values that HTML, pages and pictures show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from app.compute.records import ColorBar
from app.drawing.colors import css


@dataclass(frozen=True, slots=True)
class Legend:
    """One of three, or nothing: a sentence, single colours in words, or a bar of colours."""

    text: str = ""
    swatches: tuple[tuple[str, tuple[int, int, int]], ...] = ()
    """What each colour means."""
    bar: ColorBar | None = None

    def record(self) -> dict[str, Any]:
        """As a page reads it."""
        bar = self.bar and {"stops": [css(stop) for stop in self.bar.stops], "labels": self.bar.labels}
        swatches = [{"text": text, "color": css(color)} for text, color in self.swatches]
        return {"text": self.text, "swatches": swatches, "bar": bar}

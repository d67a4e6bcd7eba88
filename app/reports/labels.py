"""Places of labels on a drawing, next to what they name and not on each other."""

from __future__ import annotations

from collections.abc import Iterator

from app.reports.paper import Area, Color, Shape, Words, box

GROUND = (255, 255, 255)
LETTER_SHARE = 0.54
"""Mean width of a letter of Helvetica, as a share of its size; digits have 0.556."""


class Labels:
    """Places labels inside a frame, each where it covers no earlier one as long as there is such a place."""

    def __init__(self, left_mm: float, top_mm: float, right_mm: float, bottom_mm: float) -> None:
        self._frame = left_mm, top_mm, right_mm, bottom_mm
        self._taken: list[tuple[float, float, float, float]] = []

    def keep_free(self, x_mm: float, y_mm: float, radius_mm: float) -> None:
        """Put no label on the square around a mark."""
        self._taken.append((x_mm - radius_mm, y_mm - radius_mm, x_mm + radius_mm, y_mm + radius_mm))

    def beside(
        self, x_mm: float, y_mm: float, away_mm: float, text: str, size_mm: float, color: Color
    ) -> Iterator[Shape]:
        """Yield a label on a light ground: to the right of a mark, else to the left, above, below, or
        farther away. If no place near it is free, the label is to the right, over others and without ground.
        """
        width_mm = LETTER_SHARE * size_mm * len(text)
        lefts = x_mm + away_mm, x_mm - away_mm - width_mm, x_mm - 0.5 * width_mm
        for step in range(6):
            off_mm = away_mm + step * 1.2 * size_mm
            level, above, below = y_mm + 0.35 * size_mm, y_mm - off_mm, y_mm + off_mm + 0.7 * size_mm
            spots = [(lefts[2], above), (lefts[2], below), (lefts[0], above), (lefts[1], above)]
            spots += [(lefts[0], below), (lefts[1], below)]
            if step == 0:
                spots = [(lefts[0], level), (lefts[1], level), *spots]
            for left_mm, base_mm in spots:
                area = left_mm, base_mm - 0.8 * size_mm, left_mm + width_mm, base_mm + 0.25 * size_mm
                if self._free(area):
                    self._taken.append(area)
                    yield Area((box(*area),), GROUND, 0.75)
                    yield Words(left_mm, base_mm, text, size_mm, color)
                    return
        yield Words(lefts[0], y_mm, text, size_mm, color)

    def _free(self, area: tuple[float, float, float, float]) -> bool:
        left, top, right, bottom = self._frame
        if area[0] < left or area[1] < top or area[2] > right or area[3] > bottom:
            return False
        return all(
            area[2] < other[0] or area[0] > other[2] or area[3] < other[1] or area[1] > other[3]
            for other in self._taken
        )

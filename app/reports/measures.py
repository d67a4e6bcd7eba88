"""The part of a report that lists the measures on the surface."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from app.compute.measures import Quantity
from app.drawing.colors import INFERRED, css
from app.drawing.quantities import quantity_text
from app.reports.html import table
from app.web.markup import Markup
from pipeline.measuring.values import HELD


def measured_sections(measures: dict[str, Any]) -> Iterator[Markup]:
    """Yield a heading, the list of measures, and what the intervals contain."""
    yield Markup("<h2>Measured on the surface</h2>")
    yield table(("measure", "kind", "with 95 % interval"), (_row(one) for one in measures["measures"]))
    yield Markup(
        '<p class="note">The intervals contain the noise of the sensor, the fit of planes, the place of the '
        "click, the scale and, but for boxes and holes, the poses of the nodes. {}. {}.</p>"
    ).format(measures["scale"].rstrip("."), HELD)
    if measures["scaled_by"] is not None:
        yield Markup(
            "<p><b>One length was entered; all others are multiplied by {} because of it.</b></p>"
        ).format(f"{measures['scaled_by']:.4f}")


def measured_sentence(measures: dict[str, Any]) -> str:
    """Return the measures in one sentence, without those that have no number; empty if none has one."""
    texts = []
    for one in measures["measures"]:
        values = [_quantity(value) for value in one["values"]]
        guessed = " (guessed)" if any(value.guessed for value in values) else ""
        texts += [f"{one['name']} {', '.join(_lines(values))}{guessed}"] if values else []
    return f"Measured, with 95 % intervals: {'; '.join(texts)}." if texts else ""


def _row(one: dict[str, Any]) -> tuple[str, str, str]:
    kind = one["kind"].replace("-", " to ")
    if one["trouble"]:
        return one["name"], kind, one["trouble"]
    values = [_quantity(value) for value in one["values"]]
    text = Markup("<br>").join(_lines(values))
    if any(value.guessed for value in values):
        text = Markup('{}<br><b style="color: {}">● guessed</b>').format(text, css(INFERRED))
    return one["name"], kind, text


def _lines(values: list[Quantity]) -> list[str]:
    """Return each number with its interval, and with its name if there are several."""
    named = len(values) > 1
    return [f"{value.name} {quantity_text(value)}" if named else quantity_text(value) for value in values]


def _quantity(value: dict[str, Any]) -> Quantity:
    low, high = value["ci95"]
    return Quantity(value["name"], value["value"], value["unit"], low, high, value["guessed"])

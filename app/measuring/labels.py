"""Texts of the folder *Measure*."""

from __future__ import annotations

from collections.abc import Iterable

from app.compute.measures import Made, MeasureAnswer, Quantity, Scale, ScaleView, Taken
from app.drawing.colors import INFERRED, css
from app.drawing.quantities import quantity_text
from app.measuring.kinds import KIND_NAMES, SNAP_NAMES, Step, steps_of
from app.web.markup import Markdown, Markup
from app.window.tables import WAITING, table
from pipeline.measuring.values import HELD, HELD_IN_SHORT

TEXT = Markdown(
    """Turn on **Clicks measure** and click in the picture. Every number has a 95 % interval, written as
± half its width or as its two ends. {}. **Violet** is *guessed*: an end is on surface that the network
inferred, and the interval includes the usual error of such guesses."""
).format(HELD_IN_SHORT)
OFF = Markdown("Clicks do not measure now.")
NOTHING_YET = Markdown("There is nothing to measure yet.")
MEASURING = "measuring …"
NOT_YET = "There is no surface to measure yet; click again when it has been computed"
LOST = "No answer came, because another computation took its place; click again"
HIDDEN = "The surface that is measured is not shown now"
FULL = "The address has no room for another measure; delete one first"
HINTS = {
    "on": "While this is on, a click in the picture measures; other clicks, such as on a hole, do nothing.",
    "what": "What the clicks measure.",
    "snap": "Where a click's point moves to: the surface as it is, the corner of flat faces near it (else "
    "its nearest vertex), the nearest edge between two planes, or the plane that fits there.",
    "chosen": "Measure that the controls below change.",
    "name": "Name of the chosen measure, in the list, the picture, the address and exports.",
    "true": "Length of the chosen measure as you know it, for example by a tape; it checks the scale.",
    "scale": "Set: the chosen measure has its true length, and all others are scaled by what this tells, "
    "weighed against the scale before. Undo: measure at the reconstruction's own scale again.",
}
INTERVAL = (
    "95 % interval",
    "Noise of the sensor, fit of planes, place of the click, scale and, but for boxes and holes, poses of "
    f"the nodes count. {HELD}.",
)


def prompt(step: Step, hint: str, missed: str) -> Markdown:
    """Return the prompt for the next click, after the reason why the last one gave no point."""
    trouble = Markdown("{}. ").format(missed.rstrip(".")) if missed else ""
    return Markdown("{}**{}** {}").format(trouble, step.prompt, hint)


def name_of(number: int, taken: Taken) -> str:
    """Return the name of a measure, its number if it has none."""
    return taken.name or str(number)


def measures_html(rows: Iterable[tuple[str, Taken, Made | None]]) -> Markup:
    """Return a table of the measures; empty without any.

    Args:
        rows: name, measure, and its numbers; None while they are computed.
    """
    lines = [(name, _hint(taken, made), _cell(made)) for name, taken, made in rows]
    return table(lines, (INTERVAL,)) if lines else Markup("")


def _hint(taken: Taken, made: Made | None) -> str:
    if made is not None and made.trouble:
        return made.trouble
    points = any(step.marks == "point" for step in steps_of(taken.kind, taken.snap))
    snapped = f", snapped to: {SNAP_NAMES[taken.snap].lower()}" if points else ""
    return f"{KIND_NAMES[taken.kind]}{snapped}."


def _cell(made: Made | None) -> Markup:
    if made is None:
        return Markup.escape(WAITING)
    if made.trouble:
        return Markup("<i>not on this surface</i>")
    lines = (_line(one, len(made.quantities) > 1) for one in made.quantities)
    text = Markup("<br>").join(lines)
    if made.guessed:
        text = Markup('{}<br><span style="color: {}">● guessed</span>').format(text, css(INFERRED))
    return text


def _line(one: Quantity, named: bool) -> str:
    return f"{one.name} {quantity_text(one)}" if named else quantity_text(one)


def notes_text(
    rows: Iterable[tuple[str, Taken, Made | None]], scale: Scale | None, answer: MeasureAnswer | None
) -> Markdown:
    """Return why measures have no number, by how much all are scaled, and how exact the scale is."""
    rows = list(rows)
    lines = [
        Markdown("**{}**: {}.").format(name, made.trouble.rstrip("."))
        for name, _, made in rows
        if made is not None and made.trouble
    ]
    if not rows or answer is None:
        return Markdown("\n\n").join(lines)
    if scale is not None and answer.scaled is not None:
        names = [name for name, taken, _ in rows if taken.unnamed == scale.by]
        lines.append(_scaled_text(", ".join(names), scale, answer.scaled))
    if answer.scale_source:
        lines.append(Markdown("{}.").format(answer.scale_source.rstrip(".")))
    return Markdown("\n\n").join(lines)


def _scaled_text(name: str, scale: Scale, scaled: ScaleView) -> Markdown:
    if scaled.trouble:
        return Markdown("**The scale is not set** by {}: {}.").format(name, scaled.trouble.rstrip("."))
    return Markdown("**{} is {}, as typed; all other lengths are scaled by {} %.**{}").format(
        name,
        _length_text(scale.true_m),
        f"{100.0 * (scaled.factor - 1.0):+.2f}",
        _sentence(scaled.advice),
    )


def _length_text(length_m: float) -> str:
    """Return a typed length in the unit in which the list has it."""
    return quantity_text(Quantity("length", length_m, "m", length_m, length_m, guessed=False))


def _sentence(advice: str) -> str:
    """Return advice as a further sentence; empty without."""
    return f" {advice}." if advice else ""


def check_text(check: Scale | None, checked: ScaleView | None, made: Made | None) -> Markdown:
    """Return whether a typed true length agrees with its measure, or by how much it differs."""
    if check is None or checked is None:
        return Markdown("")
    if checked.trouble or made is None or not made.quantities:
        return Markdown("{}.").format(checked.trouble.rstrip("."))
    true, measured = _length_text(check.true_m), quantity_text(made.quantities[0])
    if checked.agrees:
        return Markdown("**{} agrees** with the measured {}.{}").format(
            true, measured, _sentence(checked.advice)
        )
    return Markdown("**{} does not agree** with the measured {}: it differs by {} %.{}").format(
        true, measured, f"{100.0 * (checked.ratio - 1.0):+.1f}", _sentence(checked.advice)
    )

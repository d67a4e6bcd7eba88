"""The error of every view as a row of bars that can be clicked."""

from __future__ import annotations

import html
import json
from collections.abc import Callable, Collection
from dataclasses import dataclass

from app.drawing.colors import BRAND, LOSS, NEUTRAL, SOURCE, css
from app.screens.calibrate.terms import HELD_OUT, RMS
from app.screens.calibrate.view import CameraView
from app.tables import term
from app.ui import Ui

MARK = "packetmesh-views"
HEIGHT_PX, LEAST_PX = 84, 3
"""Of the row, and of a bar."""
PICK = (
    f"const input = this.closest('.{MARK}').parentElement.nextElementSibling.querySelector('input');"
    "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call("
    "input, JSON.stringify([this.dataset.view, Date.now()]));"
    "input.dispatchEvent(new Event('input', {bubbles: true}))"
)
"""What a page does when a bar is clicked: it writes into the hidden field behind the bars."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One view."""

    name: str
    rms_px: float | None
    """None if the board was not found."""
    unseen_rms_px: float | None
    """By a lens that has not seen it."""
    dropped: bool = False
    suspect: bool = False
    """Whether it is proposed to drop it."""


def bars_of(camera: CameraView, suspects: Collection[str] = ()) -> tuple[Bar, ...]:
    """A bar for each photograph; ``suspects`` are those that stand out."""
    bars = []
    for photograph in camera.photographs:
        name, fitted = photograph.name, camera.fitted(photograph.name)
        dropped, rms_px = name in camera.dropped, None if fitted is None else fitted.rms_px
        bars.append(Bar(name, rms_px, camera.unseen_rms_px(name), dropped, name in suspects))
    return tuple(bars)


class Bars:
    """The bars of one camera's views; a click on one of them picks it."""

    def __init__(self, ui: Ui, on_pick: Callable[[str], None]) -> None:
        """Add an empty row; ``on_pick`` is called with the name of a view."""
        self._on_pick = on_pick
        self._html = ui.gui.add_html(bars_html((), ""))
        self._field = ui.when_changed(ui.gui.add_text("View that was clicked", ""), self._picked)

    def show(self, bars: tuple[Bar, ...], chosen: str) -> None:
        """Show these, one of them chosen."""
        self._html.content = bars_html(bars, chosen)

    def _picked(self) -> None:
        name = picked_name(self._field.value)
        if name:
            self._on_pick(name)


def picked_name(text: str) -> str:
    """The view that a page names in the hidden field; empty if it is no such message."""
    try:
        name, _ = json.loads(text)
    except (ValueError, TypeError):
        return ""
    return name if isinstance(name, str) else ""


def bars_html(bars: tuple[Bar, ...], chosen: str) -> str:
    """HTML of the row, its axis and what it means."""
    errors = [one for bar in bars for one in (bar.rms_px, bar.unseen_rms_px) if one is not None]
    most = max(errors, default=1.0)
    columns = "".join(_column(bar, most, bar.name == chosen) for bar in bars)
    hide = f"<style>div:has(> .{MARK}) + div {{ display: none }}</style>"
    if not bars:
        return f'<div class="{MARK}">{hide}</div>'
    kept = [bar.rms_px for bar in bars if bar.rms_px is not None and not bar.dropped]
    meaning = (
        f"Error of each of {len(bars)} views, px ({term('RMS', RMS)}): bar by the lens that has seen it, "
    )
    meaning += f"line by one that has not ({term('held out', HELD_OUT)}). Click one."
    if len(kept) < len(bars):
        meaning += " ✕ no board found, pale: dropped."
    return (
        f'<div class="{MARK}" style="padding: 0 0.8em 0.5em; font-size: 12px">{hide}'
        f'<div style="display: flex; gap: 0.4em"><div style="text-align: right; display: flex; '
        f'flex-direction: column; justify-content: space-between; font-variant-numeric: tabular-nums">'
        f"<span>{most:.2g}</span><span>0</span></div>"
        f'<div role="group" aria-label="Views" style="display: flex; flex: 1; gap: 2px; '
        f"height: {HEIGHT_PX}px; "
        f'border-left: 1px solid #bbb; border-bottom: 1px solid #bbb">{columns}</div></div>'
        f'<div style="margin-top: 0.3em; color: #667">{meaning}</div></div>'
    )


def _column(bar: Bar, most: float, chosen: bool) -> str:
    name = html.escape(bar.name, quote=True)
    if bar.rms_px is None:
        told, inside = f"View {name}: no board found", f'<b style="color: {css(LOSS)}">✕</b>'
    else:
        told = f"View {name}: {bar.rms_px:.3f} px"
        if bar.unseen_rms_px is not None and not bar.dropped:
            told += f", {bar.unseen_rms_px:.3f} px by a lens that has not seen it"
        told += ", dropped" if bar.dropped else ", out of line" if bar.suspect else ""
        color = css(SOURCE) if chosen else css(LOSS) if bar.suspect else css(BRAND)
        tall = max(LEAST_PX, round(HEIGHT_PX * bar.rms_px / most))
        faint = "opacity: 0.3;" if bar.dropped else ""
        inside = (
            f'<i style="display: block; width: 100%; height: {tall}px; background: {color}; {faint}"></i>'
        )
        if bar.unseen_rms_px is not None:
            at = round(HEIGHT_PX * bar.unseen_rms_px / most)
            inside += (
                f'<i style="position: absolute; left: 0; right: 0; bottom: {at - 1}px; height: 2px; '
                f'background: {css(NEUTRAL)}"></i>'
            )
    around = f"outline: 2px solid {css(SOURCE)};" if chosen else ""
    look = (
        "position: relative; flex: 1; min-width: 4px; height: 100%; padding: 0; border: 0; cursor: pointer; "
        f"background: transparent; display: flex; align-items: flex-end; justify-content: center; {around}"
    )
    pressed = "true" if chosen else "false"
    return (
        f'<button type="button" data-view="{name}" title="{told}" aria-label="{told}" '
        f'aria-pressed="{pressed}" '
        f'style="{look}" onclick="{html.escape(PICK, quote=True)}">{inside}</button>'
    )

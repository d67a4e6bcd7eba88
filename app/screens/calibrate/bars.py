"""The error of every view as a row of bars that can be clicked."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass

from app.drawing.colors import BRAND, LOSS, NEUTRAL, SOURCE, css
from app.screens.calibrate.terms import HELD_OUT, RMS
from app.screens.calibrate.view import CameraView
from app.web.markup import Markup
from app.window.tables import term
from app.window.ui import Ui

MARK = "packetmesh-views"
HEIGHT_PX, LEAST_PX = 84, 3
"""Of the row, and of a bar."""


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


def bars_html(bars: tuple[Bar, ...], chosen: str) -> Markup:
    """HTML of the row, its axis and what it means."""
    errors = [one for bar in bars for one in (bar.rms_px, bar.unseen_rms_px) if one is not None]
    most = max(errors, default=1.0)
    columns = Markup("").join(_column(bar, most, bar.name == chosen) for bar in bars)
    hide = Markup("<style>div:has(> .{}) + div {{ display: none }}</style>").format(MARK)
    if not bars:
        return Markup('<div class="{}" data-packetmesh-field>{}</div>').format(MARK, hide)
    kept = [bar.rms_px for bar in bars if bar.rms_px is not None and not bar.dropped]
    meaning = Markup(
        "Error of each of {} views, px ({}): bar by the lens that has seen it, "
        "line by one that has not ({}). Click one."
    ).format(len(bars), term("RMS", RMS), term("held out", HELD_OUT))
    if len(kept) < len(bars):
        meaning += " ✕ no board found, pale: dropped."
    return Markup(
        '<div class="{}" data-packetmesh-field style="padding: 0 0.8em 0.5em; font-size: 12px">{}'
        '<div style="display: flex; gap: 0.4em"><div style="text-align: right; display: flex; '
        'flex-direction: column; justify-content: space-between; font-variant-numeric: tabular-nums">'
        "<span>{:.2g}</span><span>0</span></div>"
        '<div role="group" aria-label="Views" style="display: flex; flex: 1; gap: 2px; '
        "height: {}px; "
        'border-left: 1px solid #bbb; border-bottom: 1px solid #bbb">{}</div></div>'
        '<div style="margin-top: 0.3em; color: #667">{}</div></div>'
    ).format(MARK, hide, most, HEIGHT_PX, columns, meaning)


def _column(bar: Bar, most: float, chosen: bool) -> Markup:
    name = bar.name
    if bar.rms_px is None:
        told, inside = f"View {name}: no board found", Markup('<b style="color: {}">✕</b>').format(css(LOSS))
    else:
        told = f"View {name}: {bar.rms_px:.3f} px"
        if bar.unseen_rms_px is not None and not bar.dropped:
            told += f", {bar.unseen_rms_px:.3f} px by a lens that has not seen it"
        told += ", dropped" if bar.dropped else ", out of line" if bar.suspect else ""
        color = css(SOURCE) if chosen else css(LOSS) if bar.suspect else css(BRAND)
        tall = max(LEAST_PX, round(HEIGHT_PX * bar.rms_px / most))
        faint = "opacity: 0.3;" if bar.dropped else ""
        inside = Markup(
            '<i style="display: block; width: 100%; height: {}px; background: {}; {}"></i>'
        ).format(tall, color, faint)
        if bar.unseen_rms_px is not None:
            at = round(HEIGHT_PX * bar.unseen_rms_px / most)
            inside += Markup(
                '<i style="position: absolute; left: 0; right: 0; bottom: {}px; height: 2px; '
                'background: {}"></i>'
            ).format(at - 1, css(NEUTRAL))
    around = f"outline: 2px solid {css(SOURCE)};" if chosen else ""
    look = (
        "position: relative; flex: 1; min-width: 4px; height: 100%; padding: 0; border: 0; cursor: pointer; "
        f"background: transparent; display: flex; align-items: flex-end; justify-content: center; {around}"
    )
    pressed = "true" if chosen else "false"
    return Markup(
        '<button type="button" data-packetmesh-pick="{}" title="{}" aria-label="{}" aria-pressed="{}" '
        'style="{}">{}</button>'
    ).format(name, told, told, pressed, look, inside)

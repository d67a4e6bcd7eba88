"""What two pictures beside each other show, as HTML with their colour bars."""

from __future__ import annotations

import html

from app.drawing.colors import css
from app.records import ColorBar, Picture

_ROW = "display: flex; justify-content: space-between"


def captions_html(left: Picture, right: Picture) -> str:
    """Two columns under the picture: the caption and the colour bar of either side."""
    columns = "".join(
        f'<div style="flex: 1; min-width: 0"><b>{side}</b> {html.escape(picture.caption)}.'
        f"{'' if picture.bar is None else bar_html(picture.bar)}</div>"
        for side, picture in (("Left:", left), ("Right:", right))
    )
    return f'<div style="display: flex; gap: 1em; padding: 0 0.8em 0.8em; font-size: 12px">{columns}</div>'


def bar_html(bar: ColorBar) -> str:
    """The colours from left to right over their labels."""
    stops = ", ".join(css(stop) for stop in bar.stops)
    labels = "".join(f"<span>{html.escape(label)}</span>" for label in bar.labels)
    return (
        f'<div style="height: 0.7em; background: linear-gradient(to right, {stops}); border-radius: 2px; '
        f'margin-top: 0.3em"></div><div style="{_ROW}">{labels}</div>'
    )

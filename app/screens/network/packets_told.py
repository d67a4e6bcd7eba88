"""What the Network screen says of one packet, and of its colours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.drawing.colors import css
from app.screens.network.delivery_view import PacketView
from app.web.markup import Markup


def told(packet: PacketView) -> str:
    """What a packet says of its image, in a sentence."""
    parts = []
    for what, pixels in (("depth", packet.depth), ("colour", packet.color)):
        rows = np.flatnonzero(pixels.any(axis=1))
        if len(rows):
            where = f"row {rows[0] + 1}" if rows[0] == rows[-1] else f"rows {rows[0] + 1} to {rows[-1] + 1}"
            parts.append(f"{what} of {int(pixels.sum()):,} pixels in {where}")
    if not parts:
        return "By itself it tells no measured pixel: there is none in its rows, or it needs other packets."
    return f"It tells the {' and the '.join(parts)} (yellow in the picture and the cloud)."


def legend_html(colors: Sequence[tuple[str, tuple[int, int, int]]]) -> Markup:
    """HTML: what the colours of the drawing mean."""
    words = Markup(" &ensp; ").join(
        Markup("<span style='white-space: nowrap'><b style='color: {}'>●</b> {}</span>").format(
            css(color), name
        )
        for name, color in colors
    )
    return Markup("<div style='padding: 0 0.8em 0.8em; font-size: 12px'>{}</div>").format(words)

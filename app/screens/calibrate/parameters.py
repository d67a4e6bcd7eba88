"""The folder of all parameters: how sure each is by itself, and which of them go together."""

from __future__ import annotations

import numpy as np

from app.drawing.colors import ramp
from app.drawing.pictures import EQUAL, FARTHER, NEARER
from app.screens.calibrate.numbers import parameter_table
from app.screens.calibrate.terms import CORRELATION
from app.screens.calibrate.view import CameraView
from app.web.markup import Markup
from app.window.tables import term
from app.window.ui import Ui
from pipeline.calibration.correlation import DISTANCE, Correlations, Pair

WEAK = 0.8
"""Below it a pair is no reason for anything."""
DARK = -0.6
"""On the blue of a correlation below this, white is read better than black."""
SHORT, AWAY = "dist.", "The board's distance from the camera, the mean over the views."
FOCAL, CENTER, LEANING = ("fx", "fy"), ("cx", "cy"), ("p1", "p2")


class ParameterFolder:
    """A table, and a square of how every number goes together with every other."""

    def __init__(self, ui: Ui) -> None:
        """Add the folder."""
        with ui.gui.add_folder("Every parameter, and how sure it is", expand_by_default=False):
            self._table = ui.gui.add_html(Markup(""))
            self._together = ui.gui.add_html(Markup(""))

    def load(self, camera: CameraView | None) -> None:
        """Show another camera; None shows none."""
        self._table.content = Markup("") if camera is None else parameter_table(camera)
        if camera is None:
            self.relate(None)

    def relate(self, together: Correlations | None) -> None:
        """Show how its parameters go together, once that is known."""
        self._together.content = Markup("") if together is None else correlation_html(together)


def correlation_html(together: Correlations) -> Markup:
    """The strongest pair in a sentence over the lower half of the square, colours and numbers."""
    names = [short(name) for name in together.names]
    heads = [term(name, AWAY) if name == SHORT else name for name in names]
    rows = [
        Markup('<tr><th style="text-align: right; padding-right: 6px">{}</th>').format(heads[row])
        + Markup("").join(
            _cell(names[column], name, float(together.matrix[row, column])) for column in range(row)
        )
        + Markup("</tr>")
        for row, name in enumerate(names)
        if row
    ]
    below = Markup("").join(Markup("<th>{}</th>").format(head) for head in heads[:-1])
    return Markup(
        '<div style="padding: 0 0.8em 0.8em; font-size: 13px"><b>{}</b>: '
        "{}"
        '<table style="width: 100%; margin-top: 0.5em; border-collapse: separate; border-spacing: 2px; '
        'table-layout: fixed; font-size: 12px; font-variant-numeric: tabular-nums">{}'
        "<tr><th></th>{}</tr></table></div>"
    ).format(
        term("Correlation", CORRELATION),
        strongest_sentence(together.strongest),
        Markup("").join(rows),
        below,
    )


def _cell(one: str, other: str, value: float) -> Markup:
    red, green, blue = ramp(np.array([value + 1.0]), 2.0, (NEARER, EQUAL, FARTHER))[0].tolist()
    ink = "white" if value < DARK else "black"
    return Markup(
        '<td title="{} and {}: {}" style="background: rgb({}, {}, {}); '
        'color: {}; text-align: center; padding: 3px 0">{}</td>'
    ).format(one, other, signed(value), red, green, blue, ink, signed(value))


def signed(value: float) -> str:
    """A correlation in two digits: .97, −.30, 1.00."""
    digits = f"{abs(value):.2f}"
    return ("−" if value < -0.005 else "") + (digits[1:] if digits[0] == "0" else digits)


def short(name: str) -> str:
    """What heads a row."""
    return SHORT if name == DISTANCE else name


def strongest_sentence(pair: Pair) -> str:
    """Which two go together most, and what parts them."""
    one, other = ("the board's distance" if name == DISTANCE else name for name in (pair.first, pair.second))
    size = signed(abs(pair.correlation))
    if abs(pair.correlation) < WEAK:
        return (
            f"the views tell all numbers apart; the nearest to each other are {one} and {other}, at {size}."
        )
    way = "together" if pair.correlation > 0.0 else "against each other"
    return f"{one} and {other} go {way} at {size}: {parted_by(pair)}."


def parted_by(pair: Pair) -> str:
    """What kind of views tells the two apart."""
    names = (pair.first, pair.second)
    if all(name in (*FOCAL, DISTANCE) for name in names):
        return "a longer lens on a board farther away looks nearly the same; more tilted views part them"
    if all(name in (*CENTER, *LEANING) for name in names):
        return (
            "a lens that leans looks nearly like one that is moved aside; boards in all corners, some of "
            "them turned by 90°, part them"
        )
    if any(name in (*CENTER, *LEANING) for name in names):
        return "views tilted to the opposite sides part them"
    if DISTANCE in names or any(name in FOCAL for name in names):
        return "points from the middle out to the corners of the image part them"
    return "both bend the rim of the image; points nearer to its corners part them"

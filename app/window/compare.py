"""A picture area that shows two pictures of the same view on the two sides of a sliding line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.compute.records import Picture
from app.web.markup import Markup
from app.window.tables import bar_html
from app.window.ui import Ui
from packetmesh.errors import InputError
from pipeline.types import ByteArray

EMPTY = np.full((480, 640, 3), 235, np.uint8)
LINE_PX = 3
QUALITY = 92
"""JPEG quality. JPEG takes a tenth of PNG's time and a sixth of its bytes, which matters while dragging."""


class CompareArea:
    """Two drop-downs, a split slider, the picture, captions and colour bars."""

    def __init__(
        self, ui: Ui, labels: Mapping[Any, str], left: str, right: str, visible: bool = True
    ) -> None:
        """Add the area to the current container.

        Args:
            ui: the panel to add it to.
            labels: labels of the pictures that can be chosen, by their names.
            left: name of the first picture left of the line.
            right: name of the first picture right of the line.
            visible: whether the area is shown before the first pictures are loaded.
        """
        self._labels = labels
        self._names = {label: name for name, label in labels.items()}
        self._pictures: Mapping[Any, Picture] = {}
        self._drawn: tuple[Any, ...] = ()
        self._left, self._right = (
            ui.gui.add_dropdown(
                side,
                list(self._names),
                initial_value=labels[name],
                hint=f"Picture to the {side.lower()} of the line.",
                visible=visible,
            )
            for side, name in (("Left", left), ("Right", right))
        )
        self._split = ui.gui.add_slider(
            "Split (%)",
            0.0,
            100.0,
            1.0,
            50.0,
            hint="Position of the line, in % of the picture's width; 0 shows only the right picture.",
            visible=visible,
        )
        self._image = ui.gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY, visible=visible)
        self._captions = ui.gui.add_html(Markup(""), visible=visible)
        for handle in (self._left, self._right, self._split):
            ui.when_changed(handle, self._draw)
        self._start = (left, right, 50.0)

    def load(self, pictures: Mapping[Any, Picture] | None) -> None:
        """Show these pictures of one size, by their names; None hides the area."""
        self._pictures, self._drawn = pictures or {}, ()
        for handle in (self._left, self._right, self._split, self._image, self._captions):
            handle.visible = pictures is not None
        if pictures is not None:
            labels = tuple(self._labels[name] for name in pictures)
            for handle in (self._left, self._right):
                if handle.options != labels:
                    chosen = handle.value
                    handle.options = labels
                    handle.value = chosen if chosen in labels else labels[0]
        self._draw()

    def set(self, left: str, right: str, split_share: float) -> None:
        """Choose both pictures by name, and the share of the width, 0 to 1, that is left of the line."""
        self._left.value, self._right.value = self._labels[left], self._labels[right]
        self._split.value = round(100.0 * split_share)
        self._draw()

    def place(self) -> str:
        """Return the pictures' names and the line in % for the address; empty for the start values."""
        left, right = (self._names[handle.value] for handle in (self._left, self._right))
        now = (left, right, float(self._split.value))
        return "" if now == self._start else place_text(*now)

    def take(self, place: str) -> None:
        """Show the pictures that an address names.

        Raises:
            InputError: the text names no such pictures.
        """
        left, right, percent = place_of(place, self._start)
        if not {left, right} <= self._labels.keys():
            raise no_pictures(place, self._start)
        self.set(left, right, percent / 100.0)

    def _draw(self) -> None:
        """Draw if something has changed: a dragged slider reports more often than its value changes."""
        if not self._pictures:
            return
        left, right = (self._pictures[self._names[handle.value]] for handle in (self._left, self._right))
        current = (id(left), id(right), float(self._split.value))
        if current == self._drawn:
            return
        if current[:2] != self._drawn[:2]:
            self._captions.content = captions_html(left, right)
        self._drawn = current
        self._image.image = split(left.rgb, right.rgb, current[2] / 100.0)


def place_text(left: str, right: str, percent: float) -> str:
    """Return the address text of two pictures, by their names, and the line between them."""
    return f"{left},{right},{percent:g}"


def place_of(text: str, start: tuple[str, str, float]) -> tuple[str, str, float]:
    """Return the pictures and the line in an address text; ``start`` if it is empty.

    Raises:
        InputError: the text has another form.
    """
    if not text:
        return start
    found = re.fullmatch(r"([a-z-]+),([a-z-]+),(\d+(?:\.\d+)?)", text)
    if found is None or float(found[3]) > 100.0:
        raise no_pictures(text, start)
    return found[1], found[2], float(found[3])


def no_pictures(text: str, start: tuple[str, str, float]) -> InputError:
    """Return the error for an address that does not name two pictures."""
    return InputError(
        f"The address has pictures={text[:40]}; try two pictures and the position of the line in %, such "
        f"as {place_text(*start)}"
    )


def split(left: ByteArray, right: ByteArray, share: float) -> ByteArray:
    """Return a picture whose left part is ``left`` and whose right part is ``right``.

    Args:
        left: (H, W, 3) RGB.
        right: (H, W, 3) RGB.
        share: share of the width that shows ``left``, 0 to 1; at 0 and 1 there is no line.

    Returns:
        (H, W, 3), with a white line edged in black.
    """
    width = left.shape[1]
    column = round(share * width)
    rgb = right.copy()
    rgb[:, :column] = left[:, :column]
    if 0 < column < width:
        start = min(max(0, column - 1), max(0, width - LINE_PX))
        rgb[:, start : start + LINE_PX] = 0
        rgb[:, column : column + 1] = 255
    return rgb


def captions_html(left: Picture, right: Picture) -> Markup:
    """Return HTML of two columns: the caption and colour bar of each picture."""
    return _columns(((Markup("<b>Left:</b> "), left), (Markup("<b>Right:</b> "), right)))


def caption_html(picture: Picture) -> Markup:
    """Return HTML of the caption and colour bar of a picture that is shown alone."""
    return _columns((("", picture),))


def _columns(sides: Sequence[tuple[str, Picture]]) -> Markup:
    columns = Markup("").join(
        Markup('<div style="flex: 1; min-width: 0">{}{}.{}</div>').format(
            side, picture.caption, "" if picture.bar is None else bar_html(picture.bar)
        )
        for side, picture in sides
    )
    return Markup(
        '<div style="display: flex; gap: 1em; padding: 0 0.8em 0.8em; font-size: 12px">{}</div>'
    ).format(columns)

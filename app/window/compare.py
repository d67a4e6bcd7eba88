"""One picture area that shows two pictures of the same view, with a slider that divides them."""

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
"""Of JPEG, which takes a tenth of PNG's time and a sixth of its bytes: the slider is dragged."""


class CompareArea:
    """Two drop-downs, a split slider, the picture, and what its colours mean."""

    def __init__(
        self, ui: Ui, labels: Mapping[Any, str], left: str, right: str, visible: bool = True
    ) -> None:
        """Add the area to the current container.

        Args:
            ui: where to add it.
            labels: of the pictures that can be chosen, by their names.
            left: name of the picture left of the line at first.
            right: name of the one right of it.
            visible: whether it is there before the first pictures are.
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
                hint=f"What is shown {side.lower()} of the line.",
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
            hint="Where the line is, in % of the picture's width; 0 shows only the right picture.",
            visible=visible,
        )
        self._image = ui.gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY, visible=visible)
        self._captions = ui.gui.add_html(Markup(""), visible=visible)
        for handle in (self._left, self._right, self._split):
            ui.when_changed(handle, self._draw)
        self._start = (left, right, 50.0)

    def load(self, pictures: Mapping[Any, Picture] | None) -> None:
        """Show others of one size, by their names; None shows nothing."""
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
        """Choose for the person, by name."""
        self._left.value, self._right.value = self._labels[left], self._labels[right]
        self._split.value = round(100.0 * split_share)
        self._draw()

    def place(self) -> str:
        """Both pictures by their names and the line in %, for the address; empty as at the start."""
        left, right = (self._names[handle.value] for handle in (self._left, self._right))
        now = (left, right, float(self._split.value))
        return "" if now == self._start else place_text(*now)

    def take(self, place: str) -> None:
        """Show such pictures.

        Raises:
            InputError: there are none like them.
        """
        left, right, percent = place_of(place, self._start)
        if not {left, right} <= self._labels.keys():
            raise no_pictures(place, self._start)
        self.set(left, right, percent / 100.0)

    def _draw(self) -> None:
        """Only what has changed: a dragged slider asks more often than it moves."""
        if not self._pictures:
            return
        left, right = (self._pictures[self._names[handle.value]] for handle in (self._left, self._right))
        wanted = (id(left), id(right), float(self._split.value))
        if wanted == self._drawn:
            return
        if wanted[:2] != self._drawn[:2]:
            self._captions.content = captions_html(left, right)
        self._drawn = wanted
        self._image.image = split(left.rgb, right.rgb, wanted[2] / 100.0)


def place_text(left: str, right: str, percent: float) -> str:
    """What an address says of two pictures, by their names, and the line between them."""
    return f"{left},{right},{percent:g}"


def place_of(text: str, start: tuple[str, str, float]) -> tuple[str, str, float]:
    """The pictures and the line of such a text; those of the start if it is empty.

    Raises:
        InputError: it is no such text.
    """
    if not text:
        return start
    found = re.fullmatch(r"([a-z-]+),([a-z-]+),(\d+(?:\.\d+)?)", text)
    if found is None or float(found[3]) > 100.0:
        raise no_pictures(text, start)
    return found[1], found[2], float(found[3])


def no_pictures(text: str, start: tuple[str, str, float]) -> InputError:
    """Says that an address names no two pictures."""
    return InputError(
        f"The address has pictures={text[:40]}; try two pictures and where the line is in %, such as "
        f"{place_text(*start)}"
    )


def split(left: ByteArray, right: ByteArray, share: float) -> ByteArray:
    """One picture left of the line, the other right of it.

    Args:
        left: (H, W, 3) RGB.
        right: (H, W, 3) RGB.
        share: of the width that shows ``left``, 0 to 1; at both ends there is no line.

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
    """Two columns under the picture: the caption and the colour bar of either side."""
    return _columns(((Markup("<b>Left:</b> "), left), (Markup("<b>Right:</b> "), right)))


def caption_html(picture: Picture) -> Markup:
    """The caption and the colour bar under a picture that is shown alone."""
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

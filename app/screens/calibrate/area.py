"""A picture area with two pictures of a camera's view, divided by a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from app.compute.records import Picture
from app.screens.calibrate.labels import PAIRS, STRAIGHTENED
from app.web.markup import Markup
from app.window.compare import captions_html, no_pictures, place_of, place_text, split
from app.window.ui import Ui

EMPTY = np.full((480, 640, 3), 235, np.uint8)
QUALITY = 92
MISSING = "not available for this view"
START = (PAIRS[STRAIGHTENED].left, PAIRS[STRAIGHTENED].right, 50.0)
"""The first two pictures, and the line between them in %."""


class PictureArea:
    """The choice of two pictures, the line, the pictures, and their colour bars."""

    def __init__(self, ui: Ui, on_pair: Callable[[], None]) -> None:
        """Add the area to the current container; ``on_pair`` is called after another choice."""
        self._pictures: Mapping[str, Picture] = {}
        self._on_pair = on_pair
        self._drawn: tuple[object, ...] = ()
        self._pair = ui.gui.add_dropdown(
            "Compare", list(PAIRS), hint="Pictures to the left and right of the line."
        )
        self._split = ui.gui.add_slider(
            "Split (%)", 0.0, 100.0, 1.0, 50.0, hint="Position of the line, in % of the picture's width."
        )
        self._image = ui.gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY)
        self._captions = ui.gui.add_html(Markup(""))
        ui.when_changed(self._pair, on_pair)
        ui.when_changed(self._split, self._draw)

    @property
    def chosen_pair(self) -> str:
        """The chosen pair, one of ``PAIRS``."""
        return self._pair.value

    def load(self, pictures: Mapping[str, Picture]) -> None:
        """Show pictures of one size by ``labels.PictureName``, one of them "photo"; none hides the area."""
        self._pictures, self._drawn = pictures, ()
        for handle in (self._pair, self._split, self._image, self._captions):
            handle.visible = bool(pictures)
        self._draw()

    def set(self, pair: str = STRAIGHTENED, split_share: float = 0.5) -> None:
        """Choose one of ``PAIRS``, and the line by its share of the width, 0 to 1."""
        self._pair.value, self._split.value = pair, round(100.0 * split_share)
        self._draw()

    def place(self) -> str:
        """Return the two pictures' names and the line in % for the address; empty if they equal ``START``."""
        pair = PAIRS[self.chosen_pair]
        now = (pair.left, pair.right, float(self._split.value))
        return "" if now == START else place_text(*now)

    def take(self, place: str) -> None:
        """Show the pair and the line that an address names.

        Raises:
            InputError: there is no such pair.
        """
        left, right, percent = place_of(place, START)
        names = [name for name, pair in PAIRS.items() if (pair.left, pair.right) == (left, right)]
        if not names:
            raise no_pictures(place, START)
        self.set(names[0], percent / 100.0)
        self._on_pair()

    def _draw(self) -> None:
        """Draw if something has changed: a dragged slider reports more often than its value changes."""
        if not self._pictures:
            return
        photo = self._pictures["photo"]
        names, pair = self._pair.value.split(" | "), PAIRS[self._pair.value]
        left, right = (
            self._pictures.get(name) or Picture(photo.rgb, f"{title.capitalize()}: {MISSING}")
            for name, title in zip((pair.left, pair.right), names, strict=True)
        )
        current = (id(left.rgb), id(right.rgb), self._pair.value, float(self._split.value))
        if current == self._drawn:
            return
        self._drawn = current
        self._captions.content = captions_html(left, right)
        self._image.image = split(left.rgb, right.rgb, current[3] / 100.0)

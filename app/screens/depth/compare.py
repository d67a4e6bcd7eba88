"""One picture area that shows two pictures of the same view, with a slider that divides them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.records import Picture
from app.screens.depth.colorbar import captions_html
from app.screens.depth.split import split
from app.ui import Ui

EMPTY = np.full((480, 640, 3), 235, np.uint8)
QUALITY = 92
"""Of JPEG, which takes a tenth of PNG's time and a sixth of its bytes: the slider is dragged."""


class CompareArea:
    """Two drop-downs, a split slider, the picture, and what its colours mean."""

    def __init__(
        self,
        ui: Ui,
        names: Sequence[str],
        left: str,
        right: str,
        visible: bool = True,
    ) -> None:
        """Add the area to the current container.

        Args:
            ui: where to add it.
            names: of the pictures that can be chosen.
            left: the name shown left of the line at first.
            right: the name shown right of it.
            visible: whether it is there before the first pictures are.
        """
        self._pictures: Mapping[str, Picture] = {}
        self._drawn: tuple[Any, ...] = ()
        gui = ui.gui
        self._left = gui.add_dropdown(
            "Left", list(names), initial_value=left, hint="What is shown left of the line.", visible=visible
        )
        self._right = gui.add_dropdown(
            "Right", list(names), initial_value=right, hint="What is shown right of it.", visible=visible
        )
        self._split = gui.add_slider(
            "Split (%)",
            0.0,
            100.0,
            1.0,
            50.0,
            hint="Where the line is, in % of the picture's width; 0 shows only the right picture.",
            visible=visible,
        )
        self._image = gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY, visible=visible)
        self._captions = gui.add_html("", visible=visible)
        for handle in (self._left, self._right, self._split):
            ui.when_changed(handle, self._draw)

    def load(self, pictures: Mapping[str, Picture] | None) -> None:
        """Show others, of one size and by the names that were promised; None shows nothing."""
        self._pictures, self._drawn = pictures or {}, ()
        for handle in (self._left, self._right, self._split, self._image, self._captions):
            handle.visible = pictures is not None
        if pictures is not None:
            for handle in (self._left, self._right):
                if handle.options != tuple(pictures):
                    chosen = handle.value
                    handle.options = tuple(pictures)
                    handle.value = chosen if chosen in pictures else next(iter(pictures))
        self._draw()

    def set(self, left: str, right: str, split_share: float) -> None:
        """Choose for the person."""
        self._left.value, self._right.value = left, right
        self._split.value = round(100.0 * split_share)
        self._draw()

    def _draw(self) -> None:
        """Only what has changed: a dragged slider asks more often than it moves."""
        if not self._pictures:
            return
        left, right = self._pictures[self._left.value], self._pictures[self._right.value]
        wanted = (id(left), id(right), float(self._split.value))
        if wanted == self._drawn:
            return
        if wanted[:2] != self._drawn[:2]:
            self._captions.content = captions_html(left, right)
        self._drawn = wanted
        self._image.image = split(left.rgb, right.rgb, wanted[2] / 100.0)

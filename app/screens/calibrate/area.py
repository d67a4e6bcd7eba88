"""The photograph of the chosen view beside what is known of its pixels, with a line between the two."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from app.compare import captions_html, split
from app.records import Picture
from app.ui import Ui

EMPTY = np.full((480, 640, 3), 235, np.uint8)
QUALITY = 92


class PictureArea:
    """What is shown right of the line, where the line is, and the picture."""

    def __init__(self, ui: Ui, labels: Mapping[str, str], first: str) -> None:
        """Add the area to the current container.

        Args:
            ui: where to add it.
            labels: of the pictures that can stand to the right, by their names.
            first: name of the one that does at first.
        """
        self._names = {label: name for name, label in labels.items()}
        self._labels = labels
        self._left: Picture | None = None
        self._pictures: Mapping[str, Picture] = {}
        self._drawn: tuple[object, ...] = ()
        self._right = ui.gui.add_dropdown(
            "Right side",
            list(self._names),
            initial_value=labels[first],
            hint="What is shown right of the line.",
        )
        self._split = ui.gui.add_slider(
            "Split (%)",
            0.0,
            100.0,
            1.0,
            50.0,
            hint="Where the line is, in % of the picture's width: the photograph is left of it.",
        )
        self._image = ui.gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY)
        self._captions = ui.gui.add_html("")
        for handle in (self._right, self._split):
            ui.when_changed(handle, self._draw)

    @property
    def right(self) -> str:
        """Name of the picture that is wanted right of the line."""
        return self._names[self._right.value]

    def load(self, left: Picture | None, right: Mapping[str, Picture]) -> None:
        """Show another photograph, and what stands to its right, as far as it is there."""
        self._left, self._pictures, self._drawn = left, right, ()
        for handle in (self._right, self._split, self._image, self._captions):
            handle.visible = left is not None
        self._draw()

    def set(self, right: str, split_share: float) -> None:
        """Choose for the person."""
        self._right.value, self._split.value = self._labels[right], round(100.0 * split_share)
        self._draw()

    def _draw(self) -> None:
        if self._left is None:
            return
        right = self._pictures.get(self.right)
        wanted = (id(self._left), id(right), float(self._split.value))
        if wanted == self._drawn:
            return
        self._drawn = wanted
        if right is None:
            missing = Picture(self._left.rgb, f"{self._right.value}: not there for these views")
            self._captions.content = captions_html(self._left, missing)
            self._image.image = self._left.rgb
            return
        self._captions.content = captions_html(self._left, right)
        self._image.image = split(self._left.rgb, right.rgb, wanted[2] / 100.0)

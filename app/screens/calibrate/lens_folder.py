"""The folder with the lens model, and the choice whether the board may be bent."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

import numpy as np

from app.screens.calibrate.maps import warp_picture
from app.screens.calibrate.view import CameraView
from app.web.markup import Markdown, Markup
from app.window.compare import caption_html
from app.window.ui import Ui
from pipeline.config import Lens

ABOUT_LENS = (
    "Distortion parameters of the model: k1 and k2 (thesis), also p1, p2, k3 (brown), also k4 to k6 "
    "(rational). fisheye is for lenses so wide that straight lines cannot stay straight."
)
ABOUT_BENT = (
    "Estimates the board's shape together with the camera, and uses it if it predicts held-out views "
    "better. Off: the board is assumed to be flat."
)
NOT_BENT = Markdown(
    """Only with the photographs of **one camera**: for several cameras the board is assumed to be flat. To
check whether it is bent, use the photographs of one camera alone."""
)
EMPTY = np.full((48, 64, 3), 235, np.uint8)


class LensFolder:
    """A drop-down, a checkbox, and the board's shape if it was estimated."""

    def __init__(self, ui: Ui, on_change: Callable[[], None]) -> None:
        """Add the folder; ``on_change`` is called after a change."""
        gui = ui.gui
        with gui.add_folder("Advanced", expand_by_default=False):
            self._lens = gui.add_dropdown("Lens", list(get_args(Lens)), hint=ABOUT_LENS)
            self._bent = gui.add_checkbox("The board may be bent", False, hint=ABOUT_BENT)
            self._why_not = gui.add_markdown(Markdown(""))
            self._image = gui.add_image(EMPTY, format="jpeg", visible=False)
            self._caption = gui.add_html(Markup(""), visible=False)
        for handle in (self._lens, self._bent):
            ui.when_changed(handle, on_change)

    @property
    def lens(self) -> Lens:
        """The chosen lens model."""
        return self._lens.value

    @property
    def bent(self) -> bool:
        """Whether the board's shape is estimated too."""
        return bool(self._bent.value) and not self._bent.disabled

    def one_camera(self, alone: bool) -> None:
        """Allow a bent board only if there is one camera."""
        self._bent.disabled = not alone
        self._why_not.content = Markdown("") if alone else NOT_BENT
        if not alone:
            self._bent.value = False

    def set(self, lens: Lens) -> bool:
        """Choose a lens and a flat board. Returns whether that is a change."""
        changed = (self._lens.value, self._bent.value) != (lens, False)
        self._lens.value, self._bent.value = lens, False
        return changed

    def load(self, camera: CameraView | None) -> None:
        """Show the board's shape that was estimated with a camera; hide it if there is none."""
        warp = None if camera is None else camera.warp
        self._image.visible = self._caption.visible = warp is not None
        if warp is not None:
            picture = warp_picture(warp)
            self._image.image = picture.rgb
            self._caption.content = caption_html(picture)

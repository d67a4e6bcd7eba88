"""The photographs of one camera: a bar for the error of each, and the chosen one as a picture."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from app.compute.records import Picture
from app.screens.calibrate.answers import Answers
from app.screens.calibrate.area import PictureArea
from app.screens.calibrate.bars import Bars, bars_of
from app.screens.calibrate.photograph import found_picture, picture_of, straightened_picture
from app.screens.calibrate.view import CameraView
from app.window.in_address import tell_unknown
from app.window.ui import Ui


class Photographs:
    """Bars that can be clicked, buttons that go from view to view, and the picture area."""

    def __init__(
        self,
        ui: Ui,
        answers: Answers,
        on_pick: Callable[[str], None],
        on_pair: Callable[[], None],
        on_drop: Callable[[], None],
        on_all: Callable[[], None],
    ) -> None:
        """Add them to the current container.

        Args:
            ui: where to add them.
            answers: what is known of the pixels of a view.
            on_pick: called with the name of the view that a person wants to see.
            on_pair: called when other pictures of it are wanted.
            on_drop: leaves the chosen view out, or takes it in again.
            on_all: leaves none out.
        """
        self._ui, self._answers, self._on_pick = ui, answers, on_pick
        self._names: tuple[str, ...] = ()
        self.chosen = ""
        """Name of the view that is shown, or is to be shown once it is there."""
        self._asked = ""
        self._bars = Bars(ui, on_pick)
        self._row = ui.buttons(
            "View",
            {"Back": partial(self._go, -1), "Next": partial(self._go, 1), "Drop": on_drop, "All": on_all},
            "Back, Next: the view before or after. Drop: leave this one out, or take it in again. All: leave "
            "none out.",
            visible=False,
        )
        self.area = PictureArea(ui, on_pair)

    def load(self, camera: CameraView | None) -> None:
        """Show the views of a camera, and what is known of the pixels of the chosen one; None: nothing."""
        self._row.visible = camera is not None
        if camera is None:
            self.area.load({})
            self._bars.show((), "")
            return
        self._names = tuple(one.name for one in camera.photographs)
        asked, self._asked = self._asked, ""
        if self.chosen not in self._names:
            if asked and self.chosen == asked:
                self._ui.post(tell_unknown, asked, self._names)
            self.chosen = self._names[0]
        trust = self._answers.trust_in(camera)
        self._bars.show(bars_of(camera, () if trust is None else trust.outliers), self.chosen)
        photograph = picture_of(camera, self.chosen)
        pictures: dict[str, Picture] = {"photo": found_picture(photograph, camera.fitted(photograph.name))}
        if camera.calibration is not None:
            pictures["straightened"] = straightened_picture(
                pictures["photo"], camera.calibration, photograph.zoom
            )
        self.area.load(pictures | self._answers.pictures_of(camera, self.chosen))

    def place(self) -> str:
        """The name of the view that is shown, for the address; empty for the first."""
        return "" if self.chosen in self._names[:1] else self.chosen

    def take(self, place: str) -> None:
        """Show the view of that name, at once or when it is there."""
        self._asked = place
        self._on_pick(place or next(iter(self._names), ""))

    def _go(self, count: int) -> None:
        if self._names:
            self._on_pick(self._names[(self._names.index(self.chosen) + count) % len(self._names)])

"""The folder that hides a part of the sensor depth and shows how well it can be filled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import viser

from app.screens.depth.brush import BrushDrawing, clicked_disc
from app.screens.depth.labels import FILLS
from app.screens.depth.view import Disc, HiddenView, HideRequest, SeenSample
from app.web.markup import Markdown, Markup
from app.window.compare import CompareArea
from app.window.tables import number, table
from app.window.ui import Ui
from pipeline.types import FloatArray

TEXT = Markdown(
    """Where the sensor measured nothing, the error of filled depth is unknown. So **hide a part of the
measured depth**, fill it without that part, and compare. **Tick the brush and click points in the
picture**, or place discs with the sliders."""
)
BUTTON = "Hide and fill"
WAITING = Markdown("Filling …")
NO_RESULT = Markdown("There is no result. Press the button again.")
NO_POINT = Markdown("There is no measured point. Click a point of the node that is chosen above.")


class HideFolder:
    """A brush, a button, the pictures before and after, and the errors of all fill methods."""

    def __init__(self, ui: Ui, on_hide: Callable[[HideRequest], None]) -> None:
        """Add the folder; ``on_hide`` is called with the part of the shown node's depth to hide."""
        self._on_hide = on_hide
        self._drawing = BrushDrawing(ui.scene, "/depth/painted")
        self._cloud: SeenSample | None = None
        self._T_world_camera: FloatArray = np.eye(4)
        self.discs: tuple[Disc, ...] = ()
        gui = ui.gui
        with gui.add_folder("Hide a region and see it filled", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._add_brush(ui)
            gui.add_button(BUTTON, icon=viser.Icon.ERASER, hint="It takes some seconds.").on_click(
                lambda _: ui.post(self._request)
            )
            self._status = gui.add_markdown(Markdown(""))
            self._area = CompareArea(ui, FILLS, "hidden", "ours", visible=False)
            self._table = gui.add_html(Markup(""))

    def _add_brush(self, ui: Ui) -> None:
        gui = ui.gui
        self._brush = gui.add_checkbox(
            "Brush", False, hint="Each click on a measured point in the 3-D scene hides a disc around it."
        )
        self._size = gui.add_slider(
            "Diameter (%)",
            4.0,
            60.0,
            1.0,
            20.0,
            hint="Diameter of the next disc, in % of the image's width.",
        )
        self._x = gui.add_slider(
            "Centre x (%)",
            0.0,
            100.0,
            1.0,
            50.0,
            hint="Centre of the next disc, in % of the image's width from the left.",
        )
        self._y = gui.add_slider(
            "Centre y (%)",
            0.0,
            100.0,
            1.0,
            50.0,
            hint="Centre of the next disc, in % of the image's height from the top.",
        )
        ui.buttons(
            "Discs",
            {"Add": self._add, "Undo": self._undo, "Clear": self.clear},
            "Add: add a disc with the sliders' values. Undo: remove the last disc. Clear: remove all discs.",
        )

    def show(self, cloud: SeenSample, T_world_camera: FloatArray) -> None:
        """Let the brush paint on a node's points, at its camera's (4, 4) pose, and draw the discs on them."""
        self._cloud, self._T_world_camera = cloud, T_world_camera
        self._drawing.draw(cloud, T_world_camera, self.discs)

    def clicked(self, origin_m: FloatArray, direction: FloatArray) -> None:
        """Paint at the point that a click's ray, (3,) origin and direction, selects, if the brush is on."""
        if not self._brush.value or self._cloud is None:
            return
        size_share = self._size.value / 100.0
        disc = clicked_disc(self._cloud, self._T_world_camera, origin_m, direction, size_share)
        if disc is None:
            self._status.content = NO_POINT
        else:
            self._paint((*self.discs, disc))

    def set(self, request: HideRequest) -> None:
        """Paint these discs, set the sliders to the last one, and request the filling."""
        last = request.discs[-1]
        self._x.value, self._y.value = round(100.0 * last.x_share), round(100.0 * last.y_share)
        self._size.value = round(100.0 * last.size_share)
        self._paint(request.discs)
        self._request()

    def clear(self) -> None:
        """Remove all discs and the filled depth."""
        self._paint(())

    def forget(self) -> None:
        """Remove the filled depth, which belongs to other settings."""
        self._status.content = painted_line(self.discs)
        self._table.content = Markup("")
        self._area.load(None)

    def load(self, view: HiddenView | None) -> None:
        """Show the result; None if the job was stopped or failed."""
        self.forget()
        if view is None:
            self._status.content = NO_RESULT
            return
        self._status.content = Markdown("**{:,} measured pixels of {} hidden.**").format(
            view.hidden_px, view.node
        )
        self._area.load(
            {
                name: replace(picture, caption=f"{FILLS[name].capitalize()}: {picture.caption}")
                for name, picture in view.pictures.items()
            }
        )
        self._table.content = fills_table(view)

    def _add(self) -> None:
        disc = Disc(self._x.value / 100.0, self._y.value / 100.0, self._size.value / 100.0)
        self._paint((*self.discs, disc))

    def _undo(self) -> None:
        self._paint(self.discs[:-1])

    def _paint(self, discs: tuple[Disc, ...]) -> None:
        self.discs = discs
        self.forget()
        if self._cloud is not None:
            self._drawing.draw(self._cloud, self._T_world_camera, discs)

    def _request(self) -> None:
        """Request the filling of the discs; without any, of the one that the sliders set."""
        if not self.discs:
            self._add()
        self.forget()
        self._status.content = WAITING
        self._on_hide(HideRequest(0, self.discs))


def painted_line(discs: tuple[Disc, ...]) -> Markdown:
    """Return a line with the number of painted discs; empty without discs."""
    if not discs:
        return Markdown("")
    count = "1 disc" if len(discs) == 1 else f"{len(discs)} discs"
    return Markdown("{} painted in magenta. Paint more, or press **{}**.").format(count, BUTTON)


def fills_table(view: HiddenView) -> Markup:
    """Return a table in HTML with a row per fill method: AbsRel, share within 5 %, share filled, time."""
    hint = (
        "AbsRel: mean of |filled - measured| / measured over the hidden pixels that were filled. Within "
        "5 %: share of all hidden pixels. Filled: share of them that got a depth. Time: without the "
        "colour network's inference."
    )
    rows = [
        (
            FILLS[row.name],
            hint,
            number(row.abs_rel, 3),
            number(row.within_share, 0, "%", 100.0),
            number(row.filled_share, 0, "%", 100.0),
            number(row.elapsed_s, 0, "ms", 1000.0),
        )
        for row in view.rows
    ]
    return table(rows, ("AbsRel", "within 5 %", "filled", "time"))

"""The folder with a surface's holes: their list, their causes, and the result of filling them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from app.compute.cuts import Cut
from app.drawing.picking import picked_hole
from app.screens.surface.closing import HoleClosing
from app.screens.surface.draw_holes import HoleDrawing
from app.screens.surface.view import ExplainView, FilledView, HoleView, Which
from app.web.markup import Markdown, Markup
from app.window.panel import PanelSession
from app.window.tables import number, table
from app.window.ui import Ui
from pipeline.surface.findings import Explanation, RayParts
from pipeline.types import FloatArray

NONE = "none"
LISTED_HOLES, LISTED_RIMS = 30, 10
TEXT = Markdown(
    """**Click a red rim in the picture, or choose one here**, and read its cause. The rim of a *hole* is
shorter than 1 m, with surface all around it; at an *outer rim* the surface ends, or the rim is longer. The
list has the {} largest holes and the {} longest outer rims, also those that no camera sees."""
).format(LISTED_HOLES, LISTED_RIMS)
LOOKING = Markdown("Looking for the cause …")
NO_CAUSE = Markdown("There is no result: the computation was replaced or failed. Click the hole again.")
FILL_MOST_CM = 100.0
FILL_OFF = Markdown(
    "Filling is off. Drag the slider to close small holes with an invented surface, and compare its error."
)
FILLING = Markdown("Filling …")
UNFILLED = Markdown("There is no result: the computation was replaced or failed. Drag the slider again.")
NOTHING: tuple[HoleView, ...] = ()
WHICH: tuple[Which, ...] = ("after", "before")


class HolesFolder:
    """Folder with the list of holes, the cause of the chosen one, and a slider that fills small holes."""

    def __init__(
        self,
        session: PanelSession,
        on_explain: Callable[[Which, int], None],
        on_fill: Callable[[float | None], None],
    ) -> None:
        """Add the folder.

        Args:
            session: the session.
            on_explain: called with a surface and the index of its hole to explain.
            on_fill: called with the rim length, metres, up to which holes are filled; None fills none.
        """
        self._on_explain, self._on_fill = on_explain, on_fill
        self._holes: dict[Which, tuple[HoleView, ...]] = {}
        self._alone: Which | None = None
        self._which: Which | None = None
        self._index: int | None = None
        self._offset_m: FloatArray = np.zeros(3)
        self._drawing = HoleDrawing(session.ui.scene, "/surface/hole")
        ui, gui = session.ui, session.ui.gui
        with gui.add_folder("Holes", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._list = gui.add_dropdown(
                "Hole", [NONE], hint="Holes by area, the largest first, then outer rims by length."
            )
            ui.when_changed(self._list, self._listed)
            steps = {"Previous": lambda: self._step(-1), "Next": lambda: self._step(1)}
            ui.buttons("Go to", steps, "Choose the previous or the next hole.")
            self._why = gui.add_markdown(Markdown(""))
            self._shares = gui.add_html(Markup(""))
            self._closing = HoleClosing(session, "/surface/closing")
            self._parts = gui.add_markdown(Markdown(""))
            self._add_filling(ui)
        self.forget()

    def _add_filling(self, ui: Ui) -> None:
        self._fill = ui.gui.add_slider(
            "Fill small holes up to (cm)",
            0.0,
            FILL_MOST_CM,
            5.0,
            0.0,
            hint="Closes every hole after fusion whose rim is at most this long, with the least area; 0 "
            "is off. Outer rims, where the surface ends, stay open.",
        )
        ui.when_changed(self._fill, self._dragged)
        self._filled = ui.gui.add_markdown(FILL_OFF)

    def load(self, holes: Mapping[Which, tuple[HoleView, ...]], shown: Which | None) -> None:
        """Take the holes of the surfaces, and list those of one surface.

        A hole stays chosen if its surface and ``shown`` are unchanged. A new surface after fusion is not
        filled, so the slider returns to off.

        Args:
            holes: holes of each surface.
            shown: the surface that is shown alone, whose holes are listed; None if two are shown, or none.
        """
        same = {which: _alike(holes.get(which, NOTHING), self._holes.get(which, NOTHING)) for which in WHICH}
        self._holes = dict(holes)
        if not same["after"]:
            self._fill.value = 0.0
            self.filled(None)
        if self._which is None or self._alone != shown or not same[self._which]:
            self._alone = self._which = shown
            self._offset_m = np.zeros(3)
            self._choose(None)

    def parts(self, parts: RayParts | None) -> None:
        """Show where the rays of all pixels end; None if it is not known."""
        self._parts.content = Markdown("") if parts is None else parts_sentence(parts)

    def picked(
        self,
        ray_origin_m: FloatArray,
        ray_direction: FloatArray,
        which: Which,
        offset_m: FloatArray,
        cut: Cut = None,
    ) -> bool:
        """Choose the hole that was clicked in the scene.

        Args:
            ray_origin_m: (3,) world frame.
            ray_direction: (3,) world frame.
            which: the surface whose holes are searched.
            offset_m: (3,) offset of that surface in the scene.
            cut: what is left out of the picture, in the frame of the surface.

        Returns:
            Whether the click selected a hole.
        """
        holes = self._holes.get(which, NOTHING)
        index = picked_hole(holes, np.asarray(ray_origin_m) - offset_m, np.asarray(ray_direction), cut)
        if index is None:
            return False
        self._which, self._offset_m = which, np.asarray(offset_m)
        self._choose(index)
        return True

    def choose_largest(self) -> None:
        """Choose the first hole of the list."""
        if self._shown:
            self._choose(0)

    def explain(self, answer: ExplainView | None) -> None:
        """Show the cause of the chosen hole; None if the job was stopped or failed."""
        if self._index is None:
            return
        if answer is None:
            self._why.content = NO_CAUSE
        elif (answer.which, answer.index) == (self._which, self._index):
            self._why.content = reason_text(answer.found)
            self._shares.content = shares_table(answer.found)

    def filled(self, view: FilledView | None) -> None:
        """Show the filled surface's numbers; None if filling is off, or the job was stopped or failed."""
        if not self.filling:
            self._filled.content = FILL_OFF
        else:
            self._filled.content = UNFILLED if view is None else filled_sentence(view)

    @property
    def filling(self) -> bool:
        """Whether small holes are filled."""
        return self._fill.value > 0.0

    def unfill(self) -> None:
        """Turn filling off, because the surface is drawn again without it."""
        self._fill.value = 0.0
        self.filled(None)

    def forget(self) -> None:
        """Remove all holes, because the surfaces will be computed again."""
        self._holes, self._which, self._alone = {}, None, None
        self._choose(None)
        self.parts(None)
        self.unfill()

    def _listed(self) -> None:
        names = self._names()
        self._choose(next((index for index, name in names.items() if name == self._list.value), None))

    def _step(self, by: int) -> None:
        """Choose the next or previous hole; after the last comes the first."""
        count = len(self._shown)
        if count:
            start = -1 if self._index is None and by > 0 else self._index or 0
            self._choose((start + by) % count)

    def _choose(self, index: int | None) -> None:
        self._index = index
        names = self._names()
        self._list.options = [NONE, *names.values()]
        self._list.value = NONE if index is None else names[index]
        self._shares.content = Markup("")
        if index is None or self._which is None:
            self._closing.offer(None)
            self._drawing.clear()
            self._why.content = self._invitation()
            return
        self._drawing.draw(self._shown[index], names[index].partition(":")[0], self._offset_m)
        self._why.content = LOOKING
        self._closing.offer((self._which, index), self._shown[index].rim, self._offset_m)
        self._on_explain(self._which, index)

    @property
    def _shown(self) -> tuple[HoleView, ...]:
        return NOTHING if self._which is None else self._holes.get(self._which, NOTHING)

    def _names(self) -> dict[int, str]:
        """Return the names of the listed holes by index: the largest holes, longest rims, and chosen one."""
        holes = [index for index, hole in enumerate(self._shown) if not hole.rim]
        rims = [index for index, hole in enumerate(self._shown) if hole.rim]
        listed = {*holes[:LISTED_HOLES], *rims[:LISTED_RIMS]} | (
            set() if self._index is None else {self._index}
        )
        return {index: hole_name(index, self._shown[index]) for index in sorted(listed)}

    def _invitation(self) -> Markdown:
        """Return the advice that is shown while no hole is chosen."""
        if not self._holes:
            return Markdown("")
        if self._which is None:
            return Markdown("Click a red rim, or show one surface alone to have its holes listed here.")
        rims = sum(hole.rim for hole in self._shown)
        counts = f"{_count(len(self._shown) - rims, 'hole')} and {_count(rims, 'outer rim')}"
        return Markdown("{} {} fusion; choose one.").format(counts, self._which)

    def _dragged(self) -> None:
        longest_cm = float(self._fill.value)
        self._filled.content = FILLING if longest_cm > 0.0 else FILL_OFF
        self._on_fill(longest_cm / 100.0 if longest_cm > 0.0 else None)


def _alike(some: tuple[HoleView, ...], others: tuple[HoleView, ...]) -> bool:
    """Whether these are the holes of the same surface."""
    return [(hole.length_m, hole.area_m2) for hole in some] == [(o.length_m, o.area_m2) for o in others]


def _count(number_of: int, what: str) -> str:
    return f"1 {what}" if number_of == 1 else f"{number_of:,} {what}s"


def hole_name(index: int, hole: HoleView) -> str:
    """Return a hole's number, kind, length and area as text."""
    if hole.rim:
        return f"{index + 1}: outer rim, {100.0 * hole.length_m:,.0f} cm long"
    return f"{index + 1}: {100.0 * hole.length_m:,.0f} cm around, {1e4 * hole.area_m2:,.1f} cm²"


def reason_text(found: Explanation) -> Markdown:
    """Return markdown: the cause in a word and a sentence, and the remedy."""
    return Markdown("**{}.** {}\n\n**What to try:** {}").format(
        found.reason.capitalize(), found.sentence, found.remedy
    )


def shares_table(found: Explanation) -> Markup:
    """Return an HTML table of the depth sources of the hole's pixels; empty if no camera sees it."""
    rows = [
        (name, hint, number(share, 0, "%", 100.0))
        for name, hint, share in (
            (
                "Sensor measured",
                "Pixels with sensor depth: there are points, so the ball or their normals cause the hole.",
                found.sensor_share,
            ),
            (
                "Only inferred",
                "Pixels without sensor depth for which the depth network has one: here fusion can help.",
                found.inferred_share,
            ),
            (
                "Neither",
                "Pixels without measured or inferred depth. Only another camera or an invented surface "
                "can close these.",
                found.unknown_share,
            ),
        )
    ]
    return table(rows, ("share of pixels",)) if np.isfinite(found.sensor_share) else Markup("")


def parts_sentence(parts: RayParts) -> Markdown:
    """Return markdown: where the rays of all pixels end on the surface after fusion."""

    def share(value: float) -> str:
        return number(value, 1, "%", 100.0)

    missed = parts.missed_measured + parts.missed_inferred + parts.missed_unknown
    return Markdown(
        "**All pixel rays, after fusion:** {} end on measured surface and {} on inferred surface. {} "
        "are without a surface: {} where the sensor measured depth, {} where there is only inferred "
        "depth, {} where there is no depth."
    ).format(
        share(parts.on_sensor),
        share(parts.on_inferred),
        share(missed),
        share(parts.missed_measured),
        share(parts.missed_inferred),
        share(parts.missed_unknown),
    )


def filled_sentence(view: FilledView) -> Markdown:
    """Return markdown: the invented area, and how to judge it."""
    if not view.holes:
        return Markdown("No hole is that small. Drag the slider to a larger size.")
    truth = view.mesh.truth
    worth = (
        ""
        if truth is None
        else (f", and the F-score at 5 cm is {number(truth['f_score_5cm'], 1, '%', 100.0)}")
    )
    area, missed = number(view.area_m2, 1, "cm²", 1e4), view.mesh.quality.no_hit_ray_share
    return Markdown(
        "**{} filled, {}.** The magenta surface is invented, not measured. With it {} of the rays "
        "are without a surface{}. Compare with the surfaces before and after fusion: fusion adds surface "
        "inferred from the colour image, not extrapolated from the rim."
    ).format(_count(view.holes, "hole"), area, number(missed, 1, "%", 100.0), worth)

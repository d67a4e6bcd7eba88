"""The folder *Measure* of a screen: clicks become measures, listed, drawn, and kept in the address."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from app.compute.cuts import Cut
from app.compute.measures import (
    Click,
    Clicked,
    End,
    Made,
    MeasureAnswer,
    MeasureRequest,
    Scale,
    ScaleView,
    Taken,
    Tape,
)
from app.measuring import labels
from app.measuring.address import fits, name_of, tape_of, text_of
from app.measuring.draw import MeasureDrawing
from app.measuring.kinds import FEW, KIND_NAMES, KINDS, SNAPPED, SNAPS, steps_of
from app.web.markup import Markdown, Markup
from app.window.panel import PanelSession
from packetmesh.errors import InputError
from pipeline.types import FloatArray

NONE = "none"
DELETE, DELETE_ALL = "Delete", "Delete all"
SET, UNDO = "Set the scale by it", "Undo"
MOST_CM = 10_000.0
NOTE_M = 0.5
"""Distance from the camera at which a line over the picture is drawn, on the click's ray."""


class MeasureFolder:
    """The measures on one surface. A part of the address (``InAddress``)."""

    def __init__(
        self,
        session: PanelSession,
        below: str,
        job: str,
        on_change: Callable[[Tape], object] = lambda _: None,
        without: Collection[str] = (),
    ) -> None:
        """Add the folder to the current container; nothing can be measured before ``load``.

        Args:
            session: the session that computes the measures.
            below: scene node below which they are drawn: a child of the surface's node.
            job: address of the job that answers a ``MeasureRequest`` about the surface.
            on_change: called with the list when it has changed.
            without: labels of kinds that cannot be measured here.
        """
        self._session, self._job, self._on_change = session, job, on_change
        self._arguments: tuple[object, ...] | None = None
        """Arguments of the job after the request; None while there is no surface."""
        self._tape = Tape()
        self._made: dict[Taken, Made] = {}
        """Results on the current surface and scale, by measure without its name."""
        self._pending, self._ends, self._missed = Clicked("distance", "surface"), tuple[End, ...](), ""
        self._clicks: tuple[Click, ...] = ()
        """Clicks whose points are not known yet."""
        self._clicked_m: FloatArray | None = None
        """(3,) a place on the ray of the last click, until the click gave a point; below ``_node``."""
        self._asked: MeasureRequest | None = None
        self._answer: MeasureAnswer | None = None
        self._checked: ScaleView | None = None
        self._node = below.rpartition("/")[0]
        self._drawing = MeasureDrawing(session.ui.scene, below)
        with session.ui.gui.add_folder("Measure", expand_by_default=False):
            self._add_clicking(without)
            self._add_list()
        self._show()

    def _add_clicking(self, without: Collection[str]) -> None:
        ui, hints = self._session.ui, labels.HINTS
        ui.gui.add_markdown(labels.TEXT)
        self._on = ui.gui.add_checkbox("Clicks measure", False, hint=hints["on"])
        kinds = [label for label in KINDS if label not in without]
        self._what = ui.gui.add_dropdown("What", kinds, hint=hints["what"])
        self._snap = ui.gui.add_dropdown("Snap to", list(SNAPS), hint=hints["snap"])
        for handle in (self._on, self._what, self._snap):
            ui.when_changed(handle, self._begin)
        self._prompt = ui.gui.add_markdown(labels.OFF)

    def _add_list(self) -> None:
        ui, hints = self._session.ui, labels.HINTS
        self._table = ui.gui.add_html(Markup(""))
        self._note = ui.gui.add_markdown(Markdown(""))
        self._chosen = ui.gui.add_dropdown("Chosen measure", [NONE], hint=hints["chosen"])
        ui.when_changed(self._chosen, self._choose)
        self._name = ui.gui.add_text("Its name", "", hint=hints["name"])
        ui.when_changed(self._name, self._rename)
        deletes = {DELETE: self._delete, DELETE_ALL: lambda: self._change(Tape())}
        self._delete_buttons = ui.buttons("List", deletes, "Deletes the chosen measure, or all.")
        self._true = ui.gui.add_number(
            "True length (cm)", 0.0, min=0.0, max=MOST_CM, step=0.1, hint=hints["true"]
        )
        ui.when_changed(self._true, self._ask)
        scales = {SET: self._set_scale, UNDO: lambda: self._change(replace(self._tape, scale=None))}
        self._scale_buttons = ui.buttons("Scale", scales, hints["scale"])
        self._check_text = ui.gui.add_markdown(Markdown(""))

    # The surface.

    def load(self, *arguments: object) -> None:
        """Measure on another surface, and compute all measures anew; ``arguments`` are passed to the job."""
        self._arguments = arguments
        self._forget()
        if self._tape.taken or self._on.value:
            self._ask()

    def unload(self) -> None:
        """Show no numbers: the surface is being computed."""
        self._arguments = None
        self._forget()
        self._show()

    def _forget(self) -> None:
        self._made, self._answer, self._checked, self._asked, self._clicks = {}, None, None, None, ()
        self._restart()

    # Clicks.

    def clicked(self, origin_m: FloatArray, direction: FloatArray, cut: Cut = None) -> bool:
        """Take a click into the picture. Returns False if clicks do not measure now.

        Args:
            origin_m: (3,) origin of the click's ray, world frame.
            direction: (3,) direction of the ray.
            cut: what is left out of the picture, in the frame of the surface.
        """
        if not self._on.value:
            return False
        ui = self._session.ui
        if not ui.shows(self._node):
            self._missed = labels.HIDDEN
            self._show()
            return True
        offset_m = np.asarray(ui.scene.get_handle_by_name(self._node).position)
        origin_m, direction = np.asarray(origin_m) - offset_m, np.asarray(direction)
        self._clicked_m = origin_m + NOTE_M * direction / np.linalg.norm(direction)
        if self._arguments is None:
            self._missed = labels.NOT_YET
            self._show()
            return True
        ray = [tuple(one.tolist()) for one in (origin_m, direction)]
        self._clicks, self._missed = (*self._clicks, Click(ray[0], ray[1], cut)), ""
        if self._asked is None:
            self._ask()
        else:  # another request would stop the running one, which then would have to begin again
            self._show()
        return True

    def _restart(self) -> None:
        """Begin a measure of the chosen kind."""
        self._pending = Clicked(KINDS[self._what.value], SNAPS[self._snap.value])
        self._ends, self._missed, self._clicks, self._clicked_m = (), "", (), None

    def _begin(self) -> None:
        self._restart()
        self._ask()  # which prepares the surface before the first click

    # Questions and answers.

    def _ask(self) -> None:
        """Request the results that are not known yet: of the list's measures, the clicks and the scale."""
        self._checked = None
        if self._arguments is not None:
            wanted = (taken.unnamed for taken in self._tape.taken)
            self._asked = MeasureRequest(
                tuple(taken for taken in dict.fromkeys(wanted) if taken not in self._made),
                self._pending,
                self._clicks,
                self._tape.scale,
                self._check(),
            )
            answered = functools.partial(self._take, self._asked)
            self._session.quick_job(self._job, self._asked, *self._arguments, on_end=answered)
        self._show()

    def _take(self, asked: MeasureRequest, answer: MeasureAnswer | None) -> None:
        """Show the answer to the newest request; None if it was stopped."""
        if asked is not self._asked:
            return
        self._asked, self._clicks = None, self._clicks[len(asked.clicks) :]
        if answer is None:
            self._missed = labels.LOST if asked.clicks or self._clicks else ""
            self._clicks = ()
            self._show()
            return
        self._made |= dict(answer.made)
        self._answer, self._checked = answer, answer.checked
        self._pending, self._ends, self._missed = answer.pending, answer.ends, answer.missed
        tape = replace(self._tape, taken=(*self._tape.taken, *answer.completed))
        if not fits(tape):
            self._clicks = ()
            self._show()
            raise InputError(labels.FULL)
        if answer.completed:
            self._take_tape(tape)
            self._choose_row(len(tape.taken) - 1)
        if self._clicks:
            self._ask()
        self._show()

    # Changes of the list.

    def _change(self, tape: Tape) -> None:
        """Take another list; numbers at another scale are computed anew."""
        if tape.scale != self._tape.scale:
            self._made = {}
        self._take_tape(tape)
        self._ask()

    def _take_tape(self, tape: Tape) -> None:
        if tape.scale is not None and tape.scale.by not in {taken.unnamed for taken in tape.taken}:
            tape = replace(tape, scale=None)
            self._made = {}
        self._tape = tape
        self._on_change(tape)

    @property
    def _row(self) -> int | None:
        """Index of the chosen measure."""
        names = self._names()
        return names.index(self._chosen.value) if self._chosen.value in names else None

    def _names(self) -> list[str]:
        return [f"{number}: {self._label(taken)}" for number, taken in enumerate(self._tape.taken, 1)]

    @staticmethod
    def _label(taken: Taken) -> str:
        return taken.name or KIND_NAMES[taken.kind].lower()

    def _choose_row(self, row: int) -> None:
        self._mark_row(row)
        self._choose()

    def _mark_row(self, row: int) -> None:
        """Show the measures' names, and which one is chosen."""
        names = self._names()
        self._chosen.options = names or [NONE]
        if names:
            self._chosen.value = names[min(row, len(names) - 1)]

    def _choose(self) -> None:
        row, scale = self._row, self._tape.scale
        taken = None if row is None else self._tape.taken[row]
        self._name.value = "" if taken is None else taken.name
        known = scale is not None and taken is not None and scale.by == taken.unnamed
        self._true.value = round(100.0 * scale.true_m, 2) if known and scale is not None else 0.0
        self._checked = None
        self._show()

    def _rename(self) -> None:
        row = self._row
        if row is None:
            return
        taken = list(self._tape.taken)
        taken[row] = replace(taken[row], name=name_of(self._name.value))
        tape = replace(self._tape, taken=tuple(taken))
        if not fits(tape):
            raise InputError("The address has no room for this name; take a shorter one")
        self._take_tape(tape)
        self._mark_row(row)
        self._name.value = taken[row].name
        self._show()

    def _delete(self) -> None:
        row = self._row
        if row is not None:
            left = (*self._tape.taken[:row], *self._tape.taken[row + 1 :])
            self._change(replace(self._tape, taken=left))
            self._choose_row(row)

    # The scale.

    def _check(self) -> Scale | None:
        """Return the typed true length with its measure; None without one."""
        row = self._row
        if row is None or not self._true.value:
            return None
        true_m = round(self._true.value / 100.0, 4)  # tenths of a millimetre, as in the address
        check = Scale(self._tape.taken[row].unnamed, true_m)
        return None if check == self._tape.scale else check

    def _set_scale(self) -> None:
        scale = self._check()
        if scale is None:
            raise InputError("Choose a length, and type its true length in cm")
        made = self._made.get(scale.by)
        if made is None or len(made.quantities) != 1 or made.quantities[0].unit != "m":
            raise InputError("Only a length sets the scale; choose a distance that has a number")
        self._change(replace(self._tape, scale=scale))

    # The folder and the picture.

    def _show(self) -> None:
        """Update prompt, list, scale and drawing."""
        rows = [
            (labels.name_of(number, taken), taken, self._made.get(taken.unnamed))
            for number, taken in enumerate(self._tape.taken, 1)
        ]
        with self._session.ui.atomic():
            self._prompt.content = self._prompt_text()
            self._table.content = labels.measures_html(rows)
            self._note.content = labels.notes_text(rows, self._tape.scale, self._answer)
            check = self._check()
            made = None if check is None else self._made.get(check.by)
            self._check_text.content = labels.check_text(check, self._checked, made)
            names = self._names()
            if tuple(names or [NONE]) != tuple(self._chosen.options):
                self._chosen.options = names or [NONE]
            for handle in (self._chosen, self._name, self._delete_buttons, self._true, self._scale_buttons):
                handle.visible = bool(rows)
            drawn = [(taken, name, made) for name, taken, made in rows if made is not None]
            viewer = next(iter(self._session.clients()), None)
            self._drawing.draw(drawn, self._ends, None if viewer is None else viewer.camera, self._note_at())

    def _note_at(self) -> tuple[str, FloatArray] | None:
        """Return the line over the picture and its (3,) place: at the last click until it has a point, then
        at that point what to click next.
        """
        if self._clicked_m is not None and (self._clicks or self._missed):
            return (self._missed or labels.MEASURING), self._clicked_m
        if not self._ends:
            return None
        steps = steps_of(self._pending.kind, self._pending.snap)
        return steps[len(self._pending.points_m)].prompt.rstrip("."), self._ends[-1].point_m

    def _prompt_text(self) -> Markdown:
        if not self._on.value:
            return labels.OFF
        if self._arguments is None:
            return labels.NOTHING_YET
        steps = steps_of(self._pending.kind, self._pending.snap)
        kind = self._pending.kind
        hints = [FEW.get(kind, ""), "" if self._pending.snap == "plane" else SNAPPED.get(kind, "")]
        hint = " ".join(filter(None, hints))
        return labels.prompt(steps[len(self._pending.points_m)], hint, self._missed)

    # The address.

    def place(self) -> str:
        """Return the list as text; empty without a measure."""
        return text_of(self._tape)

    def take(self, place: str) -> None:
        """Take the list of an address, and compute its numbers as soon as there is a surface.

        Raises:
            InputError: the text is no list of measures.
        """
        self._change(tape_of(place))
        self._choose_row(len(self._tape.taken) - 1)

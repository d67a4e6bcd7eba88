"""The folder *Plan*: it requests a plan, shows its ghosts, and judges the one that is dragged."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import viser

from app.compute.state import Sent, Spec
from app.drawing.ghosts import Ghosts
from app.screens.network.planning.by_number import PoseByNumber
from app.screens.network.planning.controls import PlanControls
from app.screens.network.planning.export import plan_offers
from app.screens.network.planning.labels import (
    BEFORE,
    DRAG,
    JUDGING,
    MISSED,
    NONE_YET,
    PICTURE,
    PLANNING,
    STOPPED,
    TEXT,
)
from app.screens.network.planning.lesson import Before, PlanLook, PlanState, beside, plan_numbers
from app.screens.network.planning.numbers import delivery_bars, ghost_table, summary
from app.screens.network.planning.taking import Taking
from app.screens.network.planning.view import (
    Arrival,
    GhostsView,
    LookView,
    NoPlan,
    PlanView,
    Pose,
    Poses,
    PromiseView,
)
from app.web.markup import Markdown, Markup
from app.window.panel import Offers, PanelSession
from pipeline.spec import key
from pipeline.types import FloatArray

if TYPE_CHECKING:
    from collections.abc import Hashable

EMPTY = np.full((1, 1, 3), 235, np.uint8)
QUALITY = 85


class PlanFolder:
    """Controls, numbers and ghosts of a plan of the room's next cameras."""

    def __init__(
        self,
        session: PanelSession,
        below: str,
        sent: Callable[[], Sent],
        preset: Callable[[], str],
        on_change: Callable[[], None] = lambda: None,
    ):
        """Add the folder to the current container.

        Args:
            session: the session.
            below: scene node below which the ghosts are drawn.
            sent: returns the delivery that the screen's controls set; raises ``InputError``.
            preset: returns the name of the screen's preset.
            on_change: called when the numbers of a lesson may have changed.
        """
        self._session, self._ui, self._sent, self._preset = session, session.ui, sent, preset
        self._on_change = on_change
        gui = session.ui.gui
        self._plan: PlanView | None = None
        self._newest: PlanView | None = None
        """The last plan that was made, whether or not its ghosts are shown."""
        self._asked: object = None
        """Identifies the plan that is awaited; None if none is."""
        self._ghosts: GhostsView | None = None
        self._arrivals: tuple[Arrival, ...] = ()
        self._poses: list[Pose] = []
        self._row = 0
        self._judging = self._stale = False
        """Whether an answer for a dragged ghost is awaited, and whether the ghost has moved since."""
        self._looked: Sent | None = None
        """How the images travelled whose arrivals are shown."""
        self._surface: Hashable = None
        """The surface from which the newest plan was made."""
        self._before: Before | None = None
        self._places = self._placed = False
        """Whether the pupil of a lesson places the ghost, and whether it was moved since."""
        self._own: tuple[PromiseView, float] | None = None
        self._drawn = Ghosts(session.ui.scene, below, self._dragged, self._clicked)
        with gui.add_folder("Plan", expand_by_default=False) as self._folder:
            gui.add_markdown(TEXT)
            self._controls = PlanControls(session.ui)
            gui.add_button(
                "Suggest", icon=viser.Icon.BULB, hint="Judges free places and shows the best as ghosts."
            ).on_click(lambda _: session.ui.post(self._suggest, PlanLook("suggest")))
            self._status = gui.add_markdown(NONE_YET)
            self._table = gui.add_html(Markup(""))
            self._about = gui.add_markdown(Markdown(""))
            self._chosen = gui.add_dropdown(
                "Ghost",
                ["new 1"],
                hint="The ghost that has the arrows, the picture and Take it.",
                visible=False,
            )
            session.ui.when_changed(self._chosen, self._choose)
            self._numbers = PoseByNumber(session.ui, self._entered)
            self._picture = gui.add_image(EMPTY, format="jpeg", jpeg_quality=QUALITY, visible=False)
            self._caption = gui.add_markdown(Markdown(""))
            self._bars = gui.add_html(Markup(""))
            self._files = gui.add_button_group(
                "Save", ("…",), hint="The floor plan true to scale, and all positions.", visible=False
            )
            self._files.on_click(lambda event: session.ui.post(self._save, event.target.value, event.client))
            self._taking = Taking(session, on_change)
        self.place, self.take = self._controls.place, self._controls.take

    def show(self, visible: bool) -> None:
        """Show or hide the folder and its ghosts: on streets nothing is planned."""
        self._folder.visible = visible
        if not visible:
            self.forget()

    def on_spec(self, spec: Spec) -> None:
        """Drop a plan of another surface; send the images of the same ghosts through a changed network."""
        self._taking.on_spec(spec)
        if self._surface is not None and key(spec, "truth") != self._surface:
            self._surface = self._newest = self._own = None
            self.forget()
        elif self._plan is not None and spec.sent is not None and spec.sent != self._looked:
            self._look()

    def forget(self) -> None:
        """Show no plan."""
        self._plan, self._ghosts, self._arrivals, self._asked = None, None, (), None
        self._poses = []
        self._drawn.clear()
        self._status.content = NONE_YET
        for text in (self._about, self._caption):
            text.content = Markdown("")
        self._table.content = self._bars.content = Markup("")
        for handle in (self._chosen, self._picture, self._files):
            handle.visible = False
        self._numbers.hide()
        self._taking.offer(None, "")

    def offers(self) -> tuple[Offers, ...]:
        """Return the files of the plan."""
        if self._plan is None:
            return ()
        return (plan_offers(self._plan.request, self._sent_now, self._where, self._preset()),)

    # A lesson.

    def show_look(self, look: PlanLook) -> None:
        """Show what a stop of a lesson sets; the first stop that sets a plan puts the user's own aside.

        Raises:
            InputError: the stop names a camera that is not there.
        """
        if not look.show:
            self.give_back()
            return
        if self._before is None:
            self._before = Before(self._controls.place(), self._plan, self._where, self._surface)
        self._controls.take(look.place)
        if look.show == "none":
            self.forget()
        else:
            self._suggest(look)

    def give_back(self) -> None:
        """Show the user's own plan again, if a lesson has replaced it."""
        before, self._before, self._own = self._before, None, None
        if before is None:
            return
        self._controls.take(before.controls)
        self.forget()
        if before.plan is not None and before.surface == self._surface:
            self._newest = before.plan
            self._load(before.plan, before.poses)

    def reset(self) -> None:
        """Drop all plans, a user's own that a lesson has put aside, too."""
        self._before = self._own = None
        self.forget()

    def numbers(self) -> dict[str, str]:
        """Return the numbers of the plan for the texts of lessons."""
        pending = self._asked is not None or (self._plan is not None and self._ghosts is None)
        taken = self._taking.taken
        return plan_numbers(
            PlanState(self._newest, pending, self._ghosts, self._row, self._arrivals, self._own, taken)
        )

    # A plan.

    def _suggest(self, look: PlanLook) -> None:
        """Request a plan of the controls' settings; ``look.show`` sets how it is shown."""
        request = self._controls.request(self._sent())
        surface, newest = key(self._session.spec, "truth"), self._newest
        self.forget()
        if newest is not None and newest.request == request and surface == self._surface:
            self._show_as(newest, look)
            return
        self._surface, self._newest, self._status.content = surface, None, PLANNING
        asked = self._asked = object()

        def came(answer: PlanView | NoPlan | None) -> None:
            if asked is not self._asked:
                return
            self._asked = None
            if isinstance(answer, PlanView):
                self._newest = answer
                self._show_as(answer, look)
            else:
                self._status.content = (
                    STOPPED
                    if answer is None
                    else Markdown("**No plan**: {}.").format(answer.sentence.rstrip("."))
                )
                self._on_change()

        self._session.side_job("network.planning.plan_job:plan_job", request, on_end=came)

    def _show_as(self, plan: PlanView, look: PlanLook) -> None:
        """Show a plan's ghosts, the first next to a camera if the stop sets it; or the missed places only."""
        where = tuple(_pose_of(one.T_world_camera) for one in plan.ghosts.ghosts)
        if look.show == "missed":
            self._drawn.draw((), plan.fov_rad, plan.aspect, plan.targets_m, plan.dark)
            self._drawn.show_targets()
            self._status.content = MISSED.format(100.0 * (1.0 - plan.measured_share))
            self._on_change()
            return
        self._places = look.show == "beside"
        self._load(plan, (_pose_of(beside(plan, look)), *where[1:]) if self._places else where)

    def _load(self, plan: PlanView, where: Poses) -> None:
        """Show a plan with its ghosts at these poses."""
        ghosts, T_world_camera = plan.ghosts.ghosts, [np.reshape(pose, (4, 4)) for pose in where]
        self._plan, self._ghosts, self._row, self._arrivals = plan, None, 0, ()
        self._poses, self._placed = list(where), False
        self._drawn.draw(T_world_camera, plan.fov_rad, plan.aspect, plan.targets_m, plan.dark)
        self._about.content = DRAG
        self._chosen.options = tuple(f"new {row}" for row in range(1, len(ghosts) + 1))
        self._chosen.value = "new 1"
        self._chosen.visible = len(ghosts) > 1
        self._files.options = tuple(
            offer.label for offer in plan_offers(plan.request, plan.request.sent, (), "").files
        )
        self._files.visible = True
        if all(np.array_equal(T, one.T_world_camera) for T, one in zip(T_world_camera, ghosts, strict=True)):
            self._arrivals = plan.arrivals
            self._show(plan.ghosts)
        else:
            self._status.content = JUDGING
            self._judge()
        self._look()

    def _show(self, ghosts: GhostsView) -> None:
        """Show the promises of the ghosts, and what they would newly see."""
        plan, self._ghosts = self._plan, ghosts
        if plan is None:
            return
        self._status.content = summary(plan, ghosts)
        self._table.content = ghost_table(ghosts, self._arrivals)
        self._drawn.show_newly([one.newly for one in ghosts.ghosts])
        self._taking.offer(self._poses[self._row], plan.request.sensor)
        self._numbers.show(np.reshape(self._poses[self._row], (4, 4)), plan.floor_m)
        if self._placed:
            ghost = ghosts.ghosts[self._row]
            self._own = ghost.promise, ghost.overlap_share
        self._on_change()

    @property
    def _where(self) -> Poses:
        """The present poses of the ghosts."""
        return tuple(self._poses)

    @property
    def _sent_now(self) -> Sent:
        """The way in which the images travel by the screen's present settings."""
        assert self._plan is not None
        return self._session.spec.sent or self._plan.request.sent

    # A dragged ghost.

    def _clicked(self, row: int) -> None:
        self._ui.post(self._choose_row, row)

    def _choose_row(self, row: int) -> None:
        self._chosen.value = f"new {row + 1}"
        self._choose()

    def _choose(self) -> None:
        """Give arrows and picture to the ghost of the list."""
        row = self._chosen.options.index(self._chosen.value)
        if self._ghosts is None or row == self._row:
            return
        self._row = row
        self._drawn.choose(row)
        self._show(self._ghosts)
        self._look()

    def _dragged(self, row: int, T_world_camera: FloatArray, ended: bool) -> None:
        """Pass a dragged ghost's pose to the session's thread; called on that of the browser's messages."""
        self._ui.post(self._moved, self._plan, row, T_world_camera, ended)

    def _entered(self, T_world_camera: FloatArray) -> None:
        """Move the chosen ghost and its handle to a pose that was entered as numbers."""
        self._drawn.move_handle(T_world_camera)
        self._moved(self._plan, self._row, T_world_camera, True)

    def _moved(self, plan: PlanView | None, row: int, T_world_camera: FloatArray, ended: bool) -> None:
        """Move a ghost and judge it, once the judgement before has ended; when released, send its image."""
        if plan is None or plan is not self._plan:
            return
        self._poses[row] = _pose_of(T_world_camera)
        self._drawn.move_frustum(row, T_world_camera)
        self._stale, self._arrivals, self._placed = True, (), self._places
        self._caption.content = BEFORE
        if not self._judging:
            self._judge()
        if ended:
            self._look()

    def _judge(self) -> None:
        """Request the promises of the ghosts where they are; only one request is under way."""
        plan = self._plan
        if plan is None:
            return
        self._judging, self._stale = True, False

        def came(ghosts: GhostsView | None) -> None:
            self._judging = False
            if plan is not self._plan:
                return
            if ghosts is not None:
                self._show(ghosts)
            if self._stale:
                self._judge()

        job = "network.planning.drag_job:drag_job"
        self._session.quick_job(job, plan.request, self._where, on_end=came)

    def _look(self) -> None:
        """Request the chosen ghost's picture, and the times at which all images arrive."""
        plan, where, row = self._plan, self._where, self._row
        if plan is None:
            return
        self._looked = self._sent_now

        def came(look: LookView | None) -> None:
            if plan is not self._plan or look is None or (where, row) != (self._where, self._row):
                return
            self._arrivals = look.arrivals
            self._picture.image, self._picture.visible = look.picture, True
            self._caption.content = PICTURE
            self._bars.content = delivery_bars(look.arrivals, plan.request.deadline_s)
            if self._ghosts is not None:
                self._table.content = ghost_table(self._ghosts, look.arrivals)
            self._on_change()

        job = "network.planning.look_job:look_job"
        self._session.quick_job(job, plan.request, self._sent_now, where, row, on_end=came)

    # Files.

    def _save(self, label: str, client: viser.ClientHandle | None) -> None:
        """Send a file of the plan to the browser in which its button was pressed."""
        offer = next((one for offers in self.offers() for one in offers.files if one.label == label), None)
        if offer is None or client is None:
            return

        def send(content: bytes | None) -> None:
            if content is not None:
                client.send_file_download(offer.file, content, save_immediately=True)

        self._session.side_job(offer.job, *offer.arguments, on_end=send)


def _pose_of(T_world_camera: FloatArray) -> Pose:
    return tuple(np.asarray(T_world_camera, float).ravel().tolist())

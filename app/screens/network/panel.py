"""The Network screen's panel: the cameras send their images; losses and their cost for the mesh."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from typing import Any, ClassVar

from app.compute.state import Spec, Step
from app.dock.dock import Dock
from app.drawing.cameras import turn
from app.drawing.clouds import clear
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.looking.folder import LookFolder
from app.screens.network.delivery_draw import DeliveryDrawing
from app.screens.network.delivery_numbers import (
    changes,
    difference,
    legend,
    moment_table,
    more_rows,
    most_j,
    summary,
)
from app.screens.network.delivery_view import DeliveryView, MomentView
from app.screens.network.draw import NetworkDrawing, look_at_ground, road_legend
from app.screens.network.export import delivery_offers, network_offers
from app.screens.network.inspector import Inspector
from app.screens.network.labels import NETWORKS, ORIGIN, RUNNING, STREET_TEXT, TEXT, WALK_TEXT
from app.screens.network.lanes import lanes_of, stops_ns
from app.screens.network.lesson import KIND, SHIPPED, DeliveryNumbers, NetworkLook, find, street_numbers
from app.screens.network.measures import MomentMeasures
from app.screens.network.numbers import metric_tables, runs_summary, verdict
from app.screens.network.packets import Frames, legend_html
from app.screens.network.planning.folder import PlanFolder
from app.screens.network.setup import NetworkSetup
from app.screens.network.view import NetworkView
from app.web.markup import Markdown, Markup
from app.window.in_address import CallbackState
from app.window.panel import Offers, Panel
from packetmesh.errors import InputError

REST_S = 0.6
"""Time that the settings must be unchanged before a run begins, seconds."""
HAND_S = 0.15
"""Time that the clock must be still before its moment is drawn, seconds."""
MESH_S = 0.5
"""During playback a moment is drawn at once if the last drawing is this old."""
SHOWN = 10
"""Number of playback pictures for which a packet moves at least, and a loss stays visible."""


class NetworkPanel(Panel):
    """A delivery of the room, or runs of vehicles on streets, on one timeline."""

    title = "Network"
    step: ClassVar[Step | None] = "network"
    drawn_below: ClassVar[str] = "/network"
    only_when_shown: ClassVar[bool] = True

    def build(self) -> None:
        """Add controls, numbers, inspector and dock."""
        gui, ui = self.gui, self.ui
        self._source, self._other_room = self.session.spec.source, False
        self._delivery: DeliveryView | None = None
        self._before: DeliveryView | None = None
        self._runs: tuple[NetworkView, ...] = ()
        self._labels: tuple[str, ...] = ()
        self._frames: list[Frames] = []
        self._drawing: DeliveryDrawing | NetworkDrawing | None = None
        self._drawn = 0
        self._framed: tuple[tuple[int, float, int], ...] = ()
        self._visited = self._streaming = self._here = False
        self._moment_s = 0.0
        self._resting = ui.debounce(REST_S, self._run)
        self._hand = ui.debounce(HAND_S, self._show_moment)
        self._numbers = DeliveryNumbers()
        self._requested_ns: int | None = None
        """The moment that an address asks for, until its run is there."""
        self._text = gui.add_markdown(TEXT)
        self._difference = gui.add_markdown(Markdown(""))
        self._lessons = ScreenLessons(
            ui, KIND, SHIPPED, self._take_look, self._lesson_numbers, lambda: self._plan.give_back()
        )
        self._setup = NetworkSetup(ui, self._resting.restart)
        self._about = gui.add_markdown(Markdown(""))
        self._status = gui.add_markdown(Markdown("Nothing is sent yet."))
        self._table = gui.add_html(Markup(""))
        with gui.add_folder("What if"):
            self._setup.add_what_if(f"{self.drawn_below}/what-if")
        setup, plan = self._setup, f"{self.drawn_below}/plan"
        self._plan = PlanFolder(self.session, plan, setup.sent, lambda: setup.preset, self._lessons.refresh)
        self._inspector = Inspector(ui, self.session)
        self._legend = gui.add_html(Markup(""))
        measures = self._measures = MomentMeasures(self.session)
        looking = self._looking = LookFolder(self.session, self.drawn_below)
        ui.when_clicked(self.drawn_below, lambda eye_m, way: measures.clicked(eye_m, way, looking.cut))
        with gui.add_folder("All other numbers", expand_by_default=False):
            self._others = gui.add_html(Markup(""))
        with gui.add_folder("Advanced", expand_by_default=False):
            self._setup.add_advanced()
        self._dock = Dock(ui, self._moved, self._inspector.pick)
        self.in_address |= self._lessons.in_address | {"look": self._looking}
        self.always_in_address["measure-arrived"] = self._measures
        self.in_address["plan"] = CallbackState(self._plan.place, self._plan.take)
        self.in_address["net"] = CallbackState(self._setup.place, self._take_place)
        self.in_address["t"] = CallbackState(self._moment, self._take_moment)

    def on_show(self) -> None:
        """Send at the first visit; turn the view to the cameras."""
        self._framed, self._here = (), True
        self._dock.show(True)
        if not self._visited:
            self._visited = True
            self._run()

    def on_hide(self) -> None:
        """Stop the clock and hide the dock."""
        self._here = False
        self._dock.show(False)

    def on_action(self, action: str) -> None:
        """Restore the first settings on *Reset*, and drop the plan."""
        if action != "Reset":
            return
        self._plan.reset()
        if self._visited:
            self._setup.reset()
            self.ui.post(self._run)

    def on_spec(self, spec: Spec) -> None:
        """Ignore partial results of other settings; another scene also drops the previous delivery."""
        self._plan.on_spec(spec)
        self._looking.on_spec()
        if spec.source != self._source:
            self._source = spec.source
            self._before, self._other_room, self._difference.content = None, True, Markdown("")
            if self._setup.what_if.leave_room() and self._visited:
                self.ui.post(self._run)
        if not self.session.results.fresh("network", spec):
            self._streaming = False

    def on_partial(self, view: Any) -> None:
        """Show the frames at once, and every moment when it is computed."""
        if isinstance(view, DeliveryView):
            self._streaming = view.sent == self.session.spec.sent
            if self._streaming:
                self._take_delivery(view)
        elif isinstance(view, MomentView) and self._streaming and self._delivery is not None:
            moments = sorted((*self._delivery.moments, view), key=lambda one: one.t_ns)
            self._grow(replace(self._delivery, moments=tuple(moments)))

    def on_view(self, step: Step, view: Any) -> None:
        """Draw the delivery, or the runs."""
        if step != self.step or not self.session.results.fresh("network", self.session.spec):
            return
        with self.ui.atomic():
            if not isinstance(view, DeliveryView):
                labels = zip(view, self._labels, strict=True)
                self._take_runs(tuple(replace(one, label=label) for one, label in labels))
            elif self._streaming and self._delivery is not None:
                self._grow(view)
            else:
                self._take_delivery(view)
        self._streaming = False
        self._lessons.refresh()
        self.session.frame_view()

    def on_failure(self, step: Step, sentence: str) -> None:
        """Remove the drawing and show the error."""
        if step == self.step:
            with self.ui.atomic():
                self._forget()
                self._status.content = Markdown(
                    "**Not sent**: {}. Change a setting or press *Retry*."
                ).format(sentence.rstrip("."))

    def look(self) -> bool:
        """Turn the view to the room with its cameras, or to the streets, once per window shape."""
        clients = list(self.session.clients())
        shape = tuple(
            (client.client_id, round(client.camera.aspect, 1), client.camera.image_height)
            for client in clients
        )
        if self._drawing is None or shape == self._framed:
            return True
        self._framed = shape
        if isinstance(self._drawing, NetworkDrawing):
            look_at_ground(clients, self._drawing.ground)
        else:
            for client in clients:
                camera = client.camera
                turn(client, *self._drawing.viewpoint(camera.fov, camera.aspect))
                self._drawing.spread_names(camera.fov, camera.aspect, camera.image_height)
        return True

    def offers(self) -> tuple[Offers, ...]:
        """Return the offers of the delivery or runs shown, once they are complete."""
        plan = self._plan.offers()
        if not self.session.results.fresh("network", self.session.spec):
            return plan
        if self._delivery is None:
            return (network_offers(self._labels, self.command),) if self._runs else ()
        delivery = delivery_offers(self._delivery, self._dock.now_ns, self.command)
        return (delivery, network_offers((), ""), *plan)

    @property
    def command(self) -> str:
        """Return the command lines that compute the same."""
        return self._setup.command(self.session.spec)

    # Requests and results.

    def _run(self) -> None:
        """Request what the controls set."""
        setup, session = self._setup, self.session
        preset = NETWORKS[setup.preset]
        self._text.content = STREET_TEXT if preset.street else TEXT
        about = Markdown("{} {}").format(preset.sentence, ORIGIN)
        self._about.content = about if preset.street else Markdown("")
        self._plan.show(not preset.street)
        self._looking.show(not preset.street)
        if preset.street:
            runs = setup.runs()
            self._labels = tuple(runs)
            spec = replace(session.spec, networks=tuple(runs.values()), sent=None)
        else:
            spec = replace(session.spec, networks=(), sent=setup.sent())
        setup.show_idle()
        there = session.results.fresh("network", spec)
        if not there:
            self._status.content = RUNNING
        session.want(spec)
        if there:
            self.on_view("network", session.results.view("network"))

    def _take_delivery(self, view: DeliveryView) -> None:
        """Show another delivery: its frames, and the moments computed so far."""
        now_ns = self._dock.now_ns if self._delivery is not None else None
        if self._delivery is not None and self._delivery.moments and self._delivery.nodes:
            ended = self._delivery.moments[-1].t_ns == self._delivery.times_ns[-1]
            self._before = self._delivery if ended and not self._other_room else None
        self._delivery, self._runs, self._other_room = view, (), False
        self._text.content = WALK_TEXT if view.walk else TEXT
        self._frames = [Frames(view.run)]
        drawing = self._drawing = DeliveryDrawing(self.scene, self._next_name(), view)
        self._setup.what_if.load(view, drawing.place_m)
        if self._setup.apply_pending():
            self.ui.post(self._run)
        self._legend.content = legend_html(legend(view))
        self._inspector.load(self._frames, view, drawing)
        self._load(view.run.start_ns, view.run.end_ns, stops_ns(view.run))
        self._dock.seek(view.run.end_ns if now_ns is None else now_ns)
        self._grow(view)
        self._aim(view.run)
        self.session.frame_view()

    def _grow(self, view: DeliveryView) -> None:
        """Show more moments of the same delivery."""
        self._delivery = view
        self._status.content = summary(view)
        self._dock.update(lanes_of(self._delivery, self._runs, self._frames))
        if self._before is not None:
            self._difference.content = difference(self._before, view, changes(self._before, view))
        self._show_moment()

    def _take_runs(self, runs: tuple[NetworkView, ...]) -> None:
        self._runs, self._delivery, self._before = runs, None, None
        self._setup.what_if.clear()
        self._measures.follow(None, None)
        self._frames = [Frames(run) for run in runs]
        self._status.content = runs_summary(runs)
        self._table.content, self._others.content = metric_tables(runs)
        self._difference.content, self._legend.content = verdict(runs), road_legend(runs)
        self._inspector.load(self._frames)
        self._drawing = NetworkDrawing(self.scene, self._next_name(), runs)
        start_ns, end_ns = min(run.start_ns for run in runs), max(run.end_ns for run in runs)
        self._load(start_ns, end_ns, stops_ns(*runs))
        self._aim(runs[0])

    # The network's parts of the address.

    def _take_place(self, place: str) -> None:
        try:
            self._setup.take_place(place)
        finally:
            self._run()

    def _first_ns(self) -> int:
        """Return the clock's first time after a run has come."""
        if self._delivery is not None:
            return self._delivery.run.end_ns
        return min(run.start_ns for run in self._runs)

    def _moment(self) -> str:
        """Return the simulated seconds for the address; empty for the clock's first time."""
        if self._requested_ns is None and (self._drawing is None or self._dock.rest_ns == self._first_ns()):
            return ""
        at_ns = self._dock.rest_ns if self._requested_ns is None else self._requested_ns
        return f"{at_ns / 1e9:.9f}".rstrip("0").rstrip(".")

    def _take_moment(self, text: str) -> None:
        if text and re.fullmatch(r"\d{1,7}(\.\d+)?", text) is None:
            raise InputError(f"The address has t={text[:20]}; try simulated seconds, such as 3.5")
        self._requested_ns = round(1e9 * float(text)) if text else None
        spec, delivery = self.session.spec, self._delivery
        streams = delivery is not None and delivery.sent == spec.sent
        if (streams or self.session.results.fresh("network", spec)) and self._drawing is not None:
            self._dock.seek(self._first_ns() if self._requested_ns is None else self._requested_ns)
            self._requested_ns = None

    def _take_look(self, look: NetworkLook) -> None:
        """Run the network that a stop of a lesson sets; go to the stop's place once it is simulated."""
        with self.ui.atomic():
            self._setup.take(look)
        self._lessons.waiting = look
        self._run()
        if self._delivery is not None and self._delivery.sent == self.session.spec.sent:
            self._aim(self._delivery.run)  # it is already being computed
        if not self._setup.street:
            self._plan.show_look(look.plan)

    def _lesson_numbers(self) -> Numbers:
        """Return the numbers of what is shown; empty while something else is computed."""
        session = self.session
        scene = session.results.view("scene")
        if scene is None or not session.results.fresh("network", session.spec):
            return {}
        if self._delivery is None:
            return street_numbers(scene.title, self._runs) if self._runs else {}
        return self._numbers.with_plan(scene.title, self._delivery, self._frames[0], self._plan.numbers())

    def _aim(self, run: NetworkView) -> None:
        """Go to the place of the lesson's stop and describe the frame there."""
        look, self._lessons.waiting = self._lessons.waiting, None
        if look is not None:
            self._aim_at(look, run)
        if self._requested_ns is not None:
            self._dock.seek(self._requested_ns)
            self._requested_ns = None

    def _aim_at(self, look: NetworkLook, run: NetworkView) -> None:
        t_ns, item = find(look.at, run, self._frames[0])
        span_ns = run.end_ns - run.start_ns if look.window_s is None else round(1e9 * look.window_s)
        self._dock.look(t_ns - span_ns // 2, t_ns + span_ns // 2)
        self._dock.seek(t_ns)
        self._inspector.pick(0, item)

    def _load(self, start_ns: int, end_ns: int, stops: Any) -> None:
        self._framed = ()
        self._dock.load(start_ns, end_ns, stops, lanes_of(self._delivery, self._runs, self._frames))
        self._dock.show(self._here)
        self._moved(self._dock.now_ns)

    def _next_name(self) -> str:
        self._drawn += 1
        clear(self.scene, f"{self.drawn_below}/runs")
        return f"{self.drawn_below}/runs/{self._drawn}"

    def _forget(self) -> None:
        """Show nothing, because the results belong to other settings."""
        self._runs, self._delivery, self._before, self._drawing, self._streaming = (), None, None, None, False
        self._setup.what_if.clear()
        self._measures.follow(None, None)
        self._inspector.load(())
        self._dock.show(False)
        for html in (self._table, self._others, self._difference, self._legend):
            html.content = Markup("")
        clear(self.scene, f"{self.drawn_below}/runs")

    # The clock.

    def _moved(self, now_ns: int) -> None:
        if self._drawing is None:
            return
        self._drawing.show(now_ns, SHOWN * self._dock.shown_ns)
        if self._delivery is None:
            return
        if time.monotonic() - self._moment_s > MESH_S:
            self._show_moment()
        self._hand.restart()

    def _show_moment(self) -> None:
        """Show pictures, clouds, mesh and numbers of the clock's time."""
        view, drawing = self._delivery, self._drawing
        if view is None or not isinstance(drawing, DeliveryDrawing):
            return
        self._moment_s = time.monotonic()
        moment = view.moment_at(self._dock.now_ns)
        with self.ui.atomic():
            if drawing.show_moment(moment, most_j(view)):
                self._hand.restart()
            self._measures.follow(view, moment)
            self._table.content = moment_table(view, moment)
            self._others.content = more_rows(view, moment) + metric_tables((view.run,))[1]

"""Fuse: how the nodes find their places, and two methods racing from the same start."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar, get_args

import numpy as np

from app.controls import Choice, Controls
from app.drawing.cameras import stage_of
from app.drawing.clouds import add_cloud, clear
from app.drawing.poses import move
from app.drawing.race import RaceDrawing
from app.jobs.records import DepthView, FuseView, Race, RaceLane, RaceView, RegistrationRow, SceneView
from app.panel import Panel
from app.playback import Ticker, Timeline
from app.plots.curves import Curves
from app.state import Spec, Step
from app.tables import Row, number, table
from pipeline.config import Direction, Method, Metric

TEXT = """**What you see.** Two methods move the orange cloud of one node onto the blue cloud of another,
from where the nodes believe they are. Lines join the points each method pairs; the darker, the more weight.
Press **Play**, or drag the iteration. *Show: result* has all nodes in place. Go on with **Surface**."""
RACE, RESULT, BEFORE = "race of two methods", "result", "before registration"
RIVALS: dict[str, tuple[Method, Metric]] = {
    f"{method.upper()}, {metric}": (method, metric)
    for method in get_args(Method)
    for metric in get_args(Metric)
}
DIRECTIONS: dict[str, Direction] = {
    "source asks target": "q2p",
    "target asks source": "p2q",
    "both": "both",
}
ADVANCED = (
    Choice(
        "Chain: method",
        "node_registration.method",
        {m: m.upper() for m in get_args(Method)},
        hint="Method that places the nodes in the chain (not in the race).",
    ),
    Choice("Chain: metric", "node_registration.metric"),
    Choice("Chain: points", "fusion.align_nodes_with"),
)


class FusePanel(Panel):
    """Node-to-node registration, played step by step."""

    title = "Fuse"
    step: ClassVar[Step | None] = "fuse"
    drawn_below = "/fuse"

    def build(self) -> None:
        """Nodes, rivals and start; the player, curves and table."""
        gui, session = self.gui, self.session
        self._race = Race()
        self._raced: tuple[Any, ...] | None = None
        self._view: RaceView | None = None
        self._drawing: RaceDrawing | None = None
        self._timeline = Timeline(self._moved)
        self._ticker = Ticker(lambda: session.post(self._tick))
        gui.add_markdown(TEXT)
        self._shown = gui.add_dropdown("Show", [RACE, RESULT, BEFORE], hint="What the 3-D view shows.")
        self.when_changed(self._shown, self._arrange)
        self._build_race()
        self._build_player()
        self._verdict = gui.add_markdown("")
        self._table = gui.add_html("")
        self._error_curves = Curves(gui, "Distance from truth")
        self._rmse_curves = Curves(gui, "RMSE of pairs")
        self._rows = gui.add_html("")

    def _build_race(self) -> None:
        gui, session = self.gui, self.session
        names = ["node_00", "node_01"]
        self._source = gui.add_dropdown(
            "Move", names, initial_value=names[1], hint="Node whose cloud moves (orange)."
        )
        self._target = gui.add_dropdown("onto", names, hint="Node whose cloud stays (blue).")
        first, second = (
            next(name for name, rival in RIVALS.items() if rival == chosen) for chosen in self._race.rivals
        )
        hint = "Method and what it minimises: distance to the paired point, or to the plane at it."
        self._rivals = [
            gui.add_dropdown("Left", list(RIVALS), initial_value=first, hint=hint),
            gui.add_dropdown("Right", list(RIVALS), initial_value=second, hint=hint),
        ]
        with gui.add_folder("Start and advanced", expand_by_default=False):
            self._rotation = gui.add_slider(
                "Turned by (°)",
                0.0,
                30.0,
                0.5,
                self._race.rotation_deg,
                hint="Start error added to the pose the node believes in: rotation about the cloud's centre.",
            )
            self._shift = gui.add_slider(
                "Shifted by (cm)",
                0.0,
                60.0,
                1.0,
                self._race.translation_cm,
                hint="Start error added to the pose the node believes in: translation.",
            )
            self._seed = gui.add_slider(
                "Seed", 0, 20, 1, self._race.seed, hint="Chooses the directions of the start error."
            )
            self._direction = gui.add_dropdown(
                "Pairs", list(DIRECTIONS), hint="Whose points look for their nearest counterpart."
            )
            self._controls = Controls(
                gui, ADVANCED, session.spec.config, lambda change: session.post(session.edit, change)
            )
        for handle in (
            self._source,
            self._target,
            *self._rivals,
            self._rotation,
            self._shift,
            self._seed,
            self._direction,
        ):
            self.when_changed(handle, self._start)

    def _build_player(self) -> None:
        gui, session, timeline = self.gui, self.session, self._timeline
        self._keys = gui.add_button_group(
            "Player", ("Play", "Pause", "Step back", "Step"), hint="Step through the iterations."
        )
        actions = {
            "Play": timeline.play,
            "Pause": timeline.pause,
            "Step back": lambda: timeline.step(-1),
            "Step": lambda: timeline.step(1),
        }
        self._keys.on_click(lambda event: session.post(self._press, actions[event.target.value]))
        self._scrub = gui.add_slider("Iteration", 0, 1, 1, 0, hint="Drag to any iteration.")
        self.when_changed(self._scrub, self._seek)
        self._speed = gui.add_slider("Speed (1/s)", 1.0, 20.0, 1.0, 4.0, hint="Iterations a second.")
        self._speed.on_update(lambda _: session.post(setattr, timeline, "speed", self._speed.value))

    @property
    def wide(self) -> bool:
        """Whether the race is shown."""
        return self._view is not None and self._shown.value == RACE

    def close(self) -> None:
        """End the player's thread."""
        if hasattr(self, "_ticker"):
            self._ticker.close()

    def on_spec(self, spec: Spec) -> None:
        """Show the settings that are wanted."""
        self._controls.write(spec.config)

    def on_view(self, step: Step, view: Any) -> None:
        """New scene: forget the race. New clouds: other nodes. New places: draw the result and race again."""
        if step == "scene":
            self._forget()
        if step == "depth":
            names = tuple(node.name for node in view.nodes)
            if names != self._source.options:
                self._source.options = self._target.options = names
                self._source.value, self._target.value = names[min(1, len(names) - 1)], names[0]
        if step == "fuse":
            self._draw_result(view)
            self._rows.content = _places_table(view)
            self._start()

    def on_show(self) -> None:
        """Race at the latest when somebody looks."""
        self._start()

    def _start(self) -> None:
        """Race if the clouds or the race have changed."""
        depth: DepthView | None = self.session.results.view("depth")
        if depth is None or not self.session.results.fresh("fuse", self.session.spec):
            return
        if len(depth.nodes) < 2:
            self._verdict.content = (
                "This scene has a single node, so there is nothing to register: go on with **Surface**."
            )
            return
        names = [node.name for node in depth.nodes]
        first, second = (RIVALS[handle.value] for handle in self._rivals)
        self._race = replace(
            self._race,
            source=names.index(self._source.value),
            target=names.index(self._target.value),
            rivals=(first, second),
            direction=DIRECTIONS[self._direction.value],
            rotation_deg=float(self._rotation.value),
            translation_cm=float(self._shift.value),
            seed=int(self._seed.value),
        )
        wanted = (self.session.spec.key("fuse"), self._race)
        if wanted != self._raced:
            self._raced = wanted
            session = self.session
            session.side_job("race", session.store, session.spec, self._race, on_end=self._finished)

    def _forget(self) -> None:
        """Take the race of another scene away."""
        self._raced = self._view = self._drawing = None
        self._timeline.reset(0)
        with self.session.target.atomic():
            clear(self.scene, "/fuse/race")
            self._verdict.content = self._table.content = self._rows.content = ""
            self._error_curves.visible = self._rmse_curves.visible = False

    def _finished(self, view: RaceView | None) -> None:
        if view is None:
            self._raced = None
            return
        self._view = view
        scene: SceneView = self.session.results.view("scene")
        with self.session.target.atomic():
            self._drawing = RaceDrawing(self.scene, "/fuse/race", view, stage_of(scene.nodes))
            lanes = view.lanes
            self._error_curves.load(lanes, [[s.point_error_m for s in lane.steps] for lane in lanes])
            self._rmse_curves.load(lanes, [[s.rmse_m for s in lane.steps] for lane in lanes])
            self._verdict.content = _verdict(view.lanes)
            self._rmse_curves.visible = True
            self._error_curves.visible = view.lanes[0].steps[0].point_error_m is not None
            self._table.content = _race_table(view.lanes)
            length = max(len(lane.steps) for lane in view.lanes)
            self._scrub.max = max(1, length - 1)
            self._arrange()
        self._timeline.reset(length)

    def _press(self, action: Any) -> None:
        action()
        self._ticker.run(self._timeline.playing)

    def _seek(self) -> None:
        self._timeline.seek(int(self._scrub.value))

    def _tick(self) -> None:
        self._timeline.tick()
        self._ticker.run(self._timeline.playing)

    def _moved(self, position: int) -> None:
        if self._drawing is None:
            return
        with self.session.target.atomic():
            self._drawing.show(position)
            self._error_curves.mark(position)
            self._rmse_curves.mark(position)
            self._scrub.value = position

    def _draw_result(self, view: FuseView) -> None:
        depth: DepthView | None = self.session.results.view("depth")
        if depth is None or len(depth.nodes) != len(view.registered):
            return
        with self.session.target.atomic():
            clear(self.scene, "/fuse/result")
            self._placed = [
                add_cloud(self.scene, f"/fuse/result/{node.name}", node.fused, T)
                for node, T in zip(depth.nodes, view.registered, strict=True)
            ]
            self._arrange()

    def _arrange(self) -> None:
        """Show the race or the nodes in one of their two places."""
        racing = self._shown.value == RACE and self._view is not None
        for name, visible in (("/fuse/race", racing), ("/fuse/result", not racing)):
            frame = self.scene.get_handle_by_name(name)
            if frame is not None:
                frame.visible = visible
        self.session.frame_view()
        view: FuseView | None = self.session.results.view("fuse")
        if view is not None and hasattr(self, "_placed"):
            poses = view.believed if self._shown.value == BEFORE else view.registered
            for handle, T in zip(self._placed, poses, strict=True):
                move(handle, T)


def _verdict(lanes: tuple[RaceLane, ...]) -> str:
    """What the numbers say, in a sentence, whoever wins."""
    errors_m = [lane.steps[-1].point_error_m for lane in lanes]
    if any(error_m is None for error_m in errors_m):
        return (
            "The truth of this scene is not known. RMSE alone does not tell which is better: each method "
            "pairs and weighs other points."
        )
    (best_m, best), (other_m, other) = sorted(
        ((error_m or 0.0, lane.label) for error_m, lane in zip(errors_m, lanes, strict=True))
    )
    if np.isclose(best_m, other_m, rtol=0.05, atol=2e-4):
        return f"Here both end equally close to the truth ({100 * best_m:.1f} cm)."
    loss = " So CEICP loses here." if "CEICP" in other and "CEICP" not in best else ""
    return f"**{best}** ends {100 * best_m:.1f} cm from the truth, **{other}** {100 * other_m:.1f} cm.{loss}"


def _race_table(lanes: tuple[RaceLane, ...]) -> str:
    last = [lane.steps[-1] for lane in lanes]
    return table(
        [
            Row(
                "Iterations",
                "Matchings and pose updates until it stopped.",
                tuple(str(x.iterations) for x in lanes),
            ),
            Row(
                "Stopped",
                "converged: it moves less than 0.1 mm and 0.1 mrad; stalled: no change of the error.",
                tuple(lane.stop_reason for lane in lanes),
            ),
            Row(
                "Start error",
                "RMS distance of the moved points from where they truly are, at the start.",
                tuple(number(lane.steps[0].point_error_m, 1, "cm", 100) for lane in lanes),
            ),
            Row(
                "End error",
                "The same at the end; below 2 cm counts as success.",
                tuple(number(step.point_error_m, 2, "cm", 100) for step in last),
            ),
            Row(
                "RMSE",
                "Weighted RMS distance of the last pairs; not comparable between methods.",
                tuple(number(step.rmse_m, 2, "cm", 100) for step in last),
            ),
            Row(
                "Time",
                "All iterations, in this app's computing process.",
                tuple(number(lane.elapsed_s, 0, "ms", 1000) for lane in lanes),
            ),
        ],
        [lane.label for lane in lanes],
    )


def _places_table(view: FuseView) -> str:
    if not view.rows:
        return ""
    rows = [_place_row(row) for row in view.rows]
    return "<div style='padding: 0 0.8em; font-size: 13px'><b>The chain's own result</b></div>" + table(
        rows, ("iterations", "error before", "after")
    )


def _place_row(row: RegistrationRow) -> Row:
    return Row(
        f"{row.source} → {row.target}",
        f"{row.method.upper()}: {row.stop_reason}. Errors: RMS distance of the points from the truth.",
        (
            str(row.iterations),
            number(row.error_before_m, 1, "cm", 100),
            number(row.error_after_m, 2, "cm", 100),
        ),
    )

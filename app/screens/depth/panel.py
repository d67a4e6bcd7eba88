"""The Depth screen's panel: sensor depth, inferred depth, and its confidence."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import assets
from app.compute.cuts import kept_on_ray
from app.compute.records import DepthNode, DepthView, Sample, SceneView
from app.compute.state import Spec, Step
from app.drawing.clouds import add_sensor_cloud, clear
from app.drawing.colors import INFERRED, LOSS, TARGET
from app.lesson.files import Numbers
from app.lesson.on_screen import ScreenLessons
from app.looking.folder import LookFolder
from app.screens.depth.hide import HideFolder
from app.screens.depth.labels import COLORINGS, DRAWN, EVERYWHERE, HOLES, PICTURES
from app.screens.depth.lesson import KIND, SHIPPED, DepthLook, numbers
from app.screens.depth.model import ModelFolder
from app.screens.depth.numbers import confidence_table, depth_table, residual_figure, residual_table
from app.screens.depth.settings import ADVANCED, CONFIDENCE_CONTROLS, FIRST, with_model
from app.screens.depth.view import HiddenView, HideRequest, ModelChoice, ModelView, SeenSample
from app.web.markup import Markdown, Markup, shipped_markdown
from app.window.compare import CompareArea
from app.window.controls import Controls
from app.window.in_address import STOP, Awaited, Picked
from app.window.panel import Panel
from pipeline.types import FloatArray

TEXT = Markdown(
    """**What you see.** Blue: points that the sensor measured. Violet: inferred points. Where the sensor
measured depth, they come from the colour image and are aligned with it; in its holes they come from colours
and measured depth together. Red: points that the outlier filter rejects. Fusion takes violet points only
where the sensor measured nothing. Go on with **Fuse**."""
)
CONFIDENCE_TEXT = Markdown(
    "Inferred depth is left out at flying pixels, too far from measured pixels, and where confidence is low."
)

WORTH = Path(assets.__file__).parent / "depth" / "worth.md"
"""Text on the benefit of filling and its confidence; `make results` writes it from the records."""


class DepthPanel(Panel):
    """Sensor depth and inferred depth of every node."""

    title = "Depth"
    step: ClassVar[Step | None] = "depth"
    drawn_below = "/depth"

    def build(self) -> None:
        """Add the lesson, the main controls, two pictures to compare, one node's numbers, and the folders."""
        gui, session = self.gui, self.session
        self._here, self._undrawn = False, True
        self._source, self._key = session.spec.source, session.spec.key("depth")
        gui.add_markdown(TEXT)
        shipped = {STOP: SHIPPED}
        self._lessons = ScreenLessons(self.ui, KIND, shipped, self._take_look, self._lesson_numbers)
        nodes = gui.add_dropdown("Node", ["node_00"], hint="Node whose images and numbers are shown below.")
        self._node = Awaited(self.ui, nodes, self._picked_node)
        self._area = CompareArea(self.ui, PICTURES, "photo", "sensor")
        self._controls = [self._fields(FIRST)]
        self._coloring = gui.add_dropdown(
            "Colours", list(COLORINGS), hint="What the colours of the points in the 3-D scene mean."
        )
        self.ui.when_changed(self._coloring, self._draw)
        self._numbers = gui.add_html(Markup(""))
        colors: dict[str, str] = {coloring: label for label, coloring in COLORINGS.items()}
        self.in_address |= self._lessons.in_address
        self.in_address["color"] = Picked(self._coloring, colors, self._draw)
        self.in_address |= {"node": self._node, "pictures": self._area}
        self._build_folders()

    def _build_folders(self) -> None:
        gui, session = self.gui, self.session
        with gui.add_folder("Residuals of the alignment", expand_by_default=False):
            self._residuals = gui.add_html(Markup(""))
            self._histogram = gui.add_plotly(
                residual_figure(None), aspect=0.62, config={"displayModeBar": False}
            )
        with gui.add_folder("Confidence of inferred depth", expand_by_default=False):
            gui.add_markdown(CONFIDENCE_TEXT)
            gui.add_markdown(shipped_markdown(WORTH.read_text("utf-8")))
            self._controls.append(self._fields(CONFIDENCE_CONTROLS))
            self._confidence_table = gui.add_html(Markup(""))
        self._hide = HideFolder(self.ui, self._request_filling)
        self._looking = LookFolder(session, self.drawn_below, surface=False)
        self.in_address["look"] = self._looking
        self._model = ModelFolder(self.ui, session.folder, self._choose_model)
        with gui.add_folder("Advanced", expand_by_default=False):
            self._drawn = gui.add_dropdown(
                "Inferred points", list(DRAWN), hint="Which of the inferred (violet) points are drawn."
            )
            self._rejected = gui.add_checkbox(
                "Outliers", True, hint="Draw the points that the filter rejects, in red."
            )
            for handle in (self._drawn, self._rejected):
                self.ui.when_changed(handle, self._draw)
            self._controls.append(self._fields(ADVANCED))
        self.ui.when_clicked(self.drawn_below, self._clicked)

    def _clicked(self, origin_m: FloatArray, direction: FloatArray) -> None:
        """Paint where a ray first meets what the cut keeps."""
        for begin, _ in kept_on_ray(self._looking.cut, origin_m, direction)[:1]:
            self._hide.clicked(origin_m + begin * direction, direction)

    def _fields(self, fields: Any) -> Controls:
        return Controls(self.ui, fields, self.session.spec.config, self.session.edit)

    def on_spec(self, spec: Spec) -> None:
        """Show the settings; remove depth filled under other settings, and discs painted in another scene."""
        self._looking.on_spec()
        for controls in self._controls:
            controls.write(spec.config)
        self._model.write(spec.config.depth)
        if spec.source != self._source:
            self._source = spec.source
            self._hide.clear()
        if spec.key("depth") != self._key:
            self._key = spec.key("depth")
            self._hide.forget()

    def on_view(self, step: Step, view: Any) -> None:
        """Draw the new clouds, and show pictures and numbers of the chosen node."""
        if step != "depth":
            return
        self._node.offer(tuple(node.name for node in view.nodes))
        self._undrawn = True
        if self._here:
            self._draw()
        self._show_node()
        self._show_look()

    # Drawing.

    def on_show(self) -> None:
        """Draw the clouds that came while another screen was shown."""
        self._here = True
        if self._undrawn:
            self._draw()

    def on_hide(self) -> None:
        """Draw nothing until the screen is shown again."""
        self._here = False

    def _draw(self) -> None:
        self._undrawn = False
        depth: DepthView | None = self.session.results.view("depth")
        if depth is None:
            return
        own = COLORINGS[self._coloring.value] == "photo"
        with self.ui.atomic():
            clear(self.scene, "/depth")
            for node in depth.nodes:
                below, T = f"/depth/{node.name}", node.T_world_camera
                add_sensor_cloud(self.scene, f"{below}/sensor", node.sensor, T, None if own else TARGET)
                chosen = self._inferred(node)
                if chosen is not None:
                    points, color = chosen
                    add_sensor_cloud(self.scene, f"{below}/inferred", points, T, color)
                if self._rejected.value:
                    add_sensor_cloud(self.scene, f"{below}/outliers", node.outliers, T, LOSS)
            self._show_canvas()
            self._looking.redraw()

    def _inferred(self, node: DepthNode) -> tuple[Sample, tuple[int, int, int] | None] | None:
        """Return the inferred points to draw and their colour (None: each its own); None to draw none."""
        everywhere = self._drawn.value == EVERYWHERE
        if not everywhere and self._drawn.value != HOLES:
            return None
        points = node.inferred if everywhere else node.filled
        coloring = COLORINGS[self._coloring.value]
        if coloring == "confidence":
            colors = node.inferred_confidence if everywhere else node.filled_confidence
            return replace(points, colors=colors), None
        return points, None if coloring == "photo" else INFERRED

    def _shown(self) -> tuple[int, DepthNode] | None:
        """Return the chosen node's index and its depth."""
        view: DepthView | None = self.session.results.view("depth")
        if view is None:
            return None
        names = [node.name for node in view.nodes]
        index = names.index(self._node.value) if self._node.value in names else 0
        return index, view.nodes[index]

    def _picked_node(self) -> None:
        self._hide.clear()
        self._show_canvas()
        self._show_node()

    def _show_node(self) -> None:
        shown = self._shown()
        if shown is None:
            return
        node = shown[1]
        with self.ui.atomic():
            self._area.load(node.pictures)
            self._numbers.content = depth_table(node)
            self._residuals.content = residual_table(node)
            self._confidence_table.content = confidence_table(node)
            self._histogram.figure = residual_figure(node.residuals)
            self._lessons.refresh()

    # The folders.

    def _show_canvas(self) -> None:
        """Let the brush paint on the chosen node's points."""
        shown = self._shown()
        if shown is not None:
            node = shown[1]
            assert isinstance(node.sensor, SeenSample)
            self._hide.show(node.sensor, node.T_world_camera)

    def _request_filling(self, request: HideRequest) -> None:
        session, spec, shown = self.session, self.session.spec, self._shown()
        if shown is None or not session.results.fresh("depth", spec):
            self._hide.load(None)
            return
        request = replace(request, node=shown[0])
        session.quick_job(
            "depth.hide_job:hide_job",
            request,
            on_end=lambda view: self._filled(spec.key("depth"), request, view),
        )

    def _filled(self, key: tuple[Hashable, ...], request: HideRequest, view: HiddenView | None) -> None:
        shown = self._shown()
        if key != self.session.spec.key("depth") or request.discs != self._hide.discs:
            return
        if shown is not None and shown[0] == request.node:
            with self.ui.atomic():
                self._hide.load(view)

    def _choose_model(self, choice: ModelChoice) -> None:
        """Try the network before it is used: a file that is no depth network changes nothing."""
        self.session.quick_job("depth.model_job:model_job", choice, on_end=self._tried)

    def _tried(self, view: ModelView | None) -> None:
        if view is not None:
            self.session.edit(with_model(view.choice))
        self._model.load(view)

    # The lesson.

    def _lesson_numbers(self) -> Numbers:
        """Return the numbers of the chosen node; empty unless its depth is up to date."""
        session, shown = self.session, self._shown()
        scene: SceneView | None = session.results.view("scene")
        if shown is None or scene is None or not session.results.fresh("depth", session.spec):
            return {}
        return numbers(scene, *shown)

    def _take_look(self, look: DepthLook) -> None:
        """Set the controls for a stop of the lesson; its region is hidden once the depth is computed."""
        session = self.session
        with self.ui.atomic():
            self._area.set(look.left, look.right, look.split_share)
            self._coloring.value = next(name for name, key in COLORINGS.items() if key == look.coloring)
            self._drawn.value = look.drawn
            self._hide.clear()
        self._lessons.waiting = look
        session.edit(
            lambda config: replace(
                config,
                depth=replace(
                    config.depth,
                    alignment=look.alignment,
                    reach=look.reach,
                    least_confidence=look.least_confidence,
                ),
            )
        )
        self._draw()
        self._show_look()

    def _show_look(self) -> None:
        """Hide and fill the region that the stop names, once the depth of its settings has been computed."""
        look, session = self._lessons.waiting, self.session
        if look is None or not session.results.fresh("depth", session.spec):
            return
        self._lessons.waiting = None
        if look.hide is not None:
            self._hide.set(look.hide)

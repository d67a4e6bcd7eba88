"""The Scene screen's panel: the choice of a scene, and the images and clouds of its nodes."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from app.compute.records import SceneView
from app.compute.state import Spec, Step
from app.drawing.cameras import add_camera
from app.drawing.clouds import add_sensor_cloud, clear
from app.looking.folder import LookFolder
from app.measuring.folder import MeasureFolder
from app.screens.scene.own import OwnFolder
from app.screens.scene.recording import ReadRecording
from app.web.markup import Markdown, Markup
from app.window.panel import Panel
from app.window.tables import number, table
from pipeline.config import PRESETS
from pipeline.io.demos import DEMOS
from pipeline.sources import ImagePair, Recorded, RigFolder, demo_of
from pipeline.types import FloatArray

TEXT = Markdown(
    """**What you see.** Each camera node delivers a colour image and a depth image. The points are the
depth pixels at their places in space; holes are pixels that the sensor could not measure. Go on with
**Depth**."""
)
WALK_TEXT = Markdown(
    """**What you see.** One camera walked through the room; each node is a keyframe of its recording, with
its points and its pose as tracking found it. Holes are pixels that the sensor could not measure. Go on with
**Fuse** to see the walk."""
)
TITLES = {name: scene.title for name, scene in DEMOS.items()}
QUALITY = 85
"""JPEG quality of the depth picture."""
EMPTY = np.full((480, 640, 3), 235, np.uint8)


class ScenePanel(Panel):
    """Choice or upload of a scene, with its images and clouds."""

    title = "Scene"
    step: ClassVar[Step | None] = "scene"
    drawn_below = "/scene"

    def build(self) -> None:
        """Add the choice of scene, preset and node, the upload, and the node's images and numbers."""
        gui, spec = self.gui, self.session.spec
        self._text = gui.add_markdown(TEXT)
        title = _title(spec)
        options = [*TITLES.values()] if title in TITLES.values() else [title, *TITLES.values()]
        self._demo = gui.add_dropdown(
            "Scene",
            options,
            initial_value=title,
            hint="Rendered rooms with known truth: nodes, or one camera that walks.",
        )
        self.ui.when_changed(self._demo, self._picked_demo)
        self._preset = gui.add_dropdown(
            "Preset",
            list(PRESETS),
            initial_value=spec.preset,
            hint="packetmesh: align inferred depth pixel by pixel, fill only the holes, register nodes with "
            "CEICP-A. thesis: rigid CEICP-N of the inferred on the sensor cloud, plain union.",
        )
        self.ui.when_changed(self._preset, self._picked_preset)
        self._node = gui.add_dropdown("Node", ["node_00"], hint="Node whose images are shown below.")
        self.ui.when_changed(self._node, self._show_node)
        self._own = OwnFolder(
            self.ui, self.session.folder, self.session.new_folder, self._use_pair, self._read_recording
        )
        self._measures = MeasureFolder(
            self.session, "/scene/measures", "scene.measure_job:measure_job", without=("Hole", "Box")
        )
        self._looking = LookFolder(self.session, self.drawn_below, surface=False)
        self.in_address["look"] = self._looking
        self.always_in_address["measure-points"] = self._measures
        self.ui.when_clicked(self.drawn_below, self._clicked)
        self._notes = gui.add_markdown(Markdown(""))
        self._color = gui.add_image(EMPTY, label="Colour image")
        self._depth = gui.add_image(EMPTY, label="Sensor depth", format="jpeg", jpeg_quality=QUALITY)
        self._numbers = gui.add_html(Markup(""))

    def on_spec(self, spec: Spec) -> None:
        """Show the current preset and scene."""
        self._looking.on_spec()
        self._preset.value = spec.preset
        title = _title(spec)
        if title not in self._demo.options:
            self._demo.options = (title, *TITLES.values())
        self._demo.value = title
        if not self.session.results.fresh("scene", spec):
            self._measures.unload()

    def on_view(self, step: Step, view: Any) -> None:
        """Draw a newly loaded rig."""
        if step != "scene":
            return
        self._view: SceneView = view
        with self.ui.atomic():
            clear(self.scene, "/scene")
            self._text.content = WALK_TEXT if view.has_walk else TEXT
            for node in view.nodes:
                add_sensor_cloud(self.scene, f"/scene/{node.name}/cloud", node.sensor, node.T_world_camera)
                add_camera(self.scene, f"/scene/{node.name}/camera", node, node.T_world_camera)
            self._notes.content = Markdown("\n\n").join(
                Markdown("**{}.**").format(note) for note in view.notes
            )
            names = tuple(node.name for node in view.nodes)
            if names != self._node.options:
                self._node.options = names
            self._measures.load()
            self._looking.redraw()
        self.session.frame_view(anew=True)
        self._show_node()

    def _clicked(self, origin_m: FloatArray, direction: FloatArray) -> None:
        self._measures.clicked(origin_m, direction, self._looking.cut)

    def _show_node(self) -> None:
        view = self.session.results.view("scene")
        if view is None:
            return
        node = next((n for n in view.nodes if n.name == self._node.value), view.nodes[0])
        with self.ui.atomic():
            self._color.image, self._color.label = node.color.rgb, node.color.caption
            self._depth.image, self._depth.label = node.depth.rgb, node.depth.caption
            self._numbers.content = table(
                [
                    ("Points", "Depth pixels that became points.", f"{node.sensor.total:,}"),
                    (
                        "Sensor coverage",
                        "Share of the pixels for which the sensor measured a depth.",
                        number(node.coverage, 1, "%", 100),
                    ),
                    (
                        "Holes",
                        "Share of the pixels without depth: in the projector's shadow, out of range, or "
                        "on dark, shiny or steep surfaces.",
                        number(1 - node.coverage, 1, "%", 100),
                    ),
                    (
                        "Depth range",
                        "2nd to 98th percentile of the measured depths.",
                        f"{node.nearest_m:.2f} to {node.farthest_m:.2f} m",
                    ),
                    (
                        "Nodes",
                        "Keyframes of the recording that are nodes; the map has all frames."
                        if view.has_walk
                        else "Camera nodes of this rig; a single RGB-D pair is a rig of one.",
                        str(len(view.nodes)),
                    ),
                ]
            )

    def _picked_demo(self) -> None:
        name = next((name for name, title in TITLES.items() if title == self._demo.value), None)
        if name is not None:
            self.session.want(dataclasses.replace(self.session.spec, source=demo_of(name)))

    def _picked_preset(self) -> None:
        self.session.want(self.session.spec.with_preset(self._preset.value))

    def _use_pair(self, source: ImagePair) -> None:
        self.session.want(dataclasses.replace(self.session.spec, source=source))

    def _read_recording(self, path: Path, name: str, depth_scale: float | None, frames: int | None) -> None:
        words = path, name, depth_scale, frames
        self.session.side_job("scene.recording_job:recording_job", *words, on_end=self._use_recording)

    def _use_recording(self, read: ReadRecording | None) -> None:
        if read is None:
            self._own.show_notes(("Nothing could be used. Add another file.",))
            return
        self._own.show_notes(read.notes)
        self.session.want(dataclasses.replace(self.session.spec, source=read.source))


def _title(spec: Spec) -> str:
    """Return the scene's name: a demo's title, the name of a rig or recording, or a pair's colour image."""
    source = spec.source
    if isinstance(source, RigFolder | ImagePair) or (isinstance(source, Recorded) and source.demo is None):
        return Path(source.title).name
    return TITLES.get(source.title, source.title)

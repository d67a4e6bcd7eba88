"""Scene: which place, and what its camera nodes deliver."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import viser

from app.drawing.cameras import add_camera
from app.drawing.clouds import add_cloud, clear
from app.records import SceneView
from app.state import Spec, Step
from app.tables import number, table
from app.ui import Panel, keep_upload
from packetmesh.errors import InputError
from pipeline.config import PRESETS
from pipeline.io.demos import DEMO_SCENES
from pipeline.sources import Demo, ImagePair

TEXT = """**What you see.** Each camera node delivers a colour image and a depth image. The points are
the depth pixels put where they belong in space; the gaps are what the sensor could not measure.
Go on with **Depth**."""
DEMOS = {name: scene.title for name, scene in DEMO_SCENES.items()}
UPLOAD_LIMIT_BYTES = 32 << 20
EMPTY = np.full((480, 640, 3), 235, np.uint8)


class ScenePanel(Panel):
    """Choose or upload a scene; its images and clouds."""

    title = "Scene"
    step: ClassVar[Step | None] = "scene"
    drawn_below = "/scene"

    def build(self) -> None:
        """Scene, preset, node, upload; the node's images and numbers."""
        gui, spec = self.gui, self.session.spec
        gui.add_markdown(TEXT)
        title = _title(spec)
        options = [*DEMOS.values()] if title in DEMOS.values() else [title, *DEMOS.values()]
        self._demo = gui.add_dropdown(
            "Scene",
            options,
            initial_value=title,
            hint="Rendered rooms with known truth.",
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
        self._node = gui.add_dropdown("Node", ["node_00"], hint="Whose images are shown below.")
        self.ui.when_changed(self._node, self._show_node)
        self._build_upload()
        self._color = gui.add_image(EMPTY, label="Colour image")
        self._depth = gui.add_image(EMPTY, label="Sensor depth", format="png")
        self._numbers = gui.add_html("")

    def _build_upload(self) -> None:
        gui = self.gui
        self._files: dict[str, Path] = {}
        with gui.add_folder("Use your own RGB-D pair", expand_by_default=False):
            for kind, label, mime in (
                ("color", "Colour image …", "image/png,image/jpeg"),
                ("depth", "Depth PNG, 16 bit …", "image/png"),
                ("intrinsics", "Intrinsics JSON or YAML …", ".json,.yaml,.yml"),
            ):
                button = gui.add_upload_button(label, icon=viser.Icon.UPLOAD, mime_type=mime)
                button.on_upload(lambda event, kind=kind: self._uploaded(kind, event))
            self._scale = gui.add_number(
                "Units per m",
                1000.0,
                min=1.0,
                max=100_000.0,
                step=1.0,
                hint="Depth image units in one metre: 1000 for millimetres.",
            )
            self._have = gui.add_markdown("Add all three files, then press the button.")
            gui.add_button("Reconstruct this pair", icon=viser.Icon.PLAYER_PLAY).on_click(
                lambda _: self.ui.post(self._use_files)
            )

    def on_spec(self, spec: Spec) -> None:
        """Show the preset and the scene that are wanted."""
        self._preset.value = spec.preset
        title = _title(spec)
        if title not in self._demo.options:
            self._demo.options = (title, *DEMOS.values())
        self._demo.value = title

    def on_view(self, step: Step, view: Any) -> None:
        """Draw a newly loaded rig."""
        if step != "scene":
            return
        self._view: SceneView = view
        with self.ui.atomic():
            clear(self.scene, "/scene")
            for node in view.nodes:
                add_cloud(self.scene, f"/scene/{node.name}/cloud", node.sensor, node.T_world_camera)
                add_camera(self.scene, f"/scene/{node.name}/camera", node, node.T_world_camera)
            names = tuple(node.name for node in view.nodes)
            if names != self._node.options:
                self._node.options = names
        self.session.frame_view(anew=True)
        self._show_node()

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
                        "Share of the pixels for which the sensor knows a depth.",
                        number(node.coverage, 1, "%", 100),
                    ),
                    (
                        "Holes",
                        "Share of the pixels without depth: shadows of the projector, dark, shiny or steep "
                        "surfaces, out of range.",
                        number(1 - node.coverage, 1, "%", 100),
                    ),
                    (
                        "Depth range",
                        "2nd to 98th percentile of the known depths.",
                        f"{node.nearest_m:.2f} to {node.farthest_m:.2f} m",
                    ),
                    (
                        "Nodes",
                        "Camera nodes of this rig; a single RGB-D pair is a rig of one.",
                        str(len(view.nodes)),
                    ),
                ]
            )

    def _picked_demo(self) -> None:
        name = next((name for name, title in DEMOS.items() if title == self._demo.value), None)
        if name is not None:
            self.session.want(dataclasses.replace(self.session.spec, source=Demo(name)))

    def _picked_preset(self) -> None:
        self.session.want(self.session.spec.with_preset(self._preset.value))

    def _uploaded(self, kind: str, event: viser.GuiEvent) -> None:
        self.ui.post(self._keep_file, kind, event.target.value)

    def _keep_file(self, kind: str, file: viser.UploadedFile) -> None:
        instead = "use packetmesh reconstruct for larger files"
        self._files[kind] = keep_upload(file, self.session.folder, kind, UPLOAD_LIMIT_BYTES, instead)
        missing = [name for name in ("color", "depth", "intrinsics") if name not in self._files]
        self._have.content = (
            f"Still needed: {', '.join(missing)}." if missing else "All there: press the button."
        )

    def _use_files(self) -> None:
        if len(self._files) < 3:
            raise InputError("A pair needs a colour image, a depth image and intrinsics; add all three.")
        files = {kind: str(path) for kind, path in self._files.items()}
        source = ImagePair(**files, depth_scale=float(self._scale.value))
        self.session.want(dataclasses.replace(self.session.spec, source=source))


def _title(spec: Spec) -> str:
    """What to call the scene: a demo by its title."""
    return DEMOS.get(spec.source.title, spec.source.title)

"""Depth: what the sensor measured, what the network inferred, and what fusion takes of it."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from app.controls import Choice, Controls, Number, Toggle
from app.drawing.clouds import add_cloud, clear
from app.drawing.colors import INFERRED, LOSS, TARGET
from app.jobs.records import DepthNode, DepthView, SceneView
from app.panel import Panel
from app.state import Spec, Step
from app.tables import Row, number, table

TEXT = """**What you see.** Blue: points the sensor measured. Violet: points a neural network inferred
from the colour image alone, made metric by comparing it with the sensor where both know a depth. Red:
points the outlier filter rejects. Fusion takes the violet points where blue ones are missing.
Go on with **Fuse**."""
HOLES, EVERYWHERE, HIDDEN = "only in the holes", "everywhere", "hidden"
EMPTY = np.full((480, 640, 3), 235, np.uint8)
CONTROLS = (
    Choice(
        "Alignment",
        "depth.alignment",
        {
            "none": "none (as the network says)",
            "median": "one scale",
            "affine_depth": "scale and shift",
            "affine_inverse": "scale and shift of 1/depth",
            "local": "scale, shift, local",
        },
    ),
    Choice(
        "Outlier filter",
        "acquisition.outlier_mode",
        {"thesis": "thesis: mean + t sigma", "depth_normalised": "depth-normalised", "robust": "robust"},
    ),
)
ADVANCED = (
    Number("Neighbours N", "acquisition.outlier_neighbours", 1, 16, 1),
    Number("Threshold t (σ)", "acquisition.outlier_t", 0.0, 4.0, 0.1),
    Toggle("Centre crop", "depth.crop"),
    Choice("Fusion", "fusion.mode", {"union": "union: all points", "fill": "fill: only the holes"}),
    Toggle("Rigid fit", "fusion.register_inferred"),
)


class DepthPanel(Panel):
    """Sensed and inferred depth of every node."""

    title = "Depth"
    step: ClassVar[Step | None] = "depth"
    drawn_below = "/depth"

    def build(self) -> None:
        """Alignment, filter, what to draw; pictures and numbers of one node."""
        gui, session = self.gui, self.session
        gui.add_markdown(TEXT)

        def edit(change: Any) -> None:
            session.post(session.edit, change)

        self._controls = [Controls(gui, CONTROLS, session.spec.config, edit)]
        self._inferred = gui.add_dropdown(
            "Inferred", [HOLES, EVERYWHERE, HIDDEN], hint="Which of the inferred (violet) points are drawn."
        )
        self._photo = gui.add_checkbox("Photo colours", False, hint="Colour the points as in the photograph.")
        self._rejected = gui.add_checkbox(
            "Outliers", True, hint="Draw the points the filter rejects, in red."
        )
        for handle in (self._inferred, self._photo, self._rejected):
            self.when_changed(handle, self._draw)
        with gui.add_folder("Advanced", expand_by_default=False):
            self._controls.append(Controls(gui, ADVANCED, session.spec.config, edit))
        self._node = gui.add_dropdown("Node", ["node_00"], hint="Whose images and numbers are shown below.")
        self.when_changed(self._node, self._show_node)
        self._numbers = gui.add_html("")
        self._pictures = [gui.add_image(EMPTY, format="png") for _ in range(3)]

    def on_spec(self, spec: Spec) -> None:
        """Show the settings that are wanted."""
        for controls in self._controls:
            controls.write(spec.config)

    def on_view(self, step: Step, view: Any) -> None:
        """Draw new clouds."""
        if step != "depth":
            return
        names = tuple(node.name for node in view.nodes)
        if names != self._node.options:
            self._node.options = names
        self._draw()
        self._show_node()

    def _draw(self) -> None:
        scene: SceneView | None = self.session.results.view("scene")
        depth: DepthView | None = self.session.results.view("depth")
        if scene is None or depth is None or len(scene.nodes) != len(depth.nodes):
            return
        photo = self._photo.value
        with self.session.target.atomic():
            clear(self.scene, "/depth")
            for place, node in zip(scene.nodes, depth.nodes, strict=True):
                below, T = f"/depth/{node.name}", place.T_world_camera
                add_cloud(self.scene, f"{below}/sensor", node.sensor, T, None if photo else TARGET)
                chosen = {HOLES: node.filled, EVERYWHERE: node.inferred}.get(self._inferred.value)
                if chosen is not None:
                    add_cloud(self.scene, f"{below}/inferred", chosen, T, None if photo else INFERRED)
                if self._rejected.value:
                    add_cloud(self.scene, f"{below}/outliers", node.outliers, T, LOSS)

    def _show_node(self) -> None:
        view: DepthView | None = self.session.results.view("depth")
        if view is None:
            return
        node = next((n for n in view.nodes if n.name == self._node.value), view.nodes[0])
        pictures = (node.sensor_picture, node.inferred_picture, node.difference_picture)
        with self.session.target.atomic():
            for handle, picture in zip(self._pictures, pictures, strict=True):
                handle.image, handle.label = picture.rgb, picture.caption
            self._numbers.content = table(_rows(node))


def _rows(node: DepthNode) -> list[Row]:
    kept, rejected = node.sensor.total, node.outliers.total
    share = rejected / max(1, kept + rejected)
    coefficients = ", ".join(f"{name} {value:.3f}" for name, value in node.coefficients.items())
    ran = "remembered" if node.inference_s is None else number(node.inference_s, 0, "ms", 1000)
    return [
        Row(
            "Network ran on",
            "The execution provider that onnxruntime really used, and its time.",
            (f"{node.provider}, {ran}",),
        ),
        Row(
            "Alignment",
            "How inferred depth was made metric, and what was fitted.",
            (f"{node.alignment_mode}{coefficients and ': '}{coefficients}",),
        ),
        Row(
            "Residual",
            "RMS difference of aligned and sensed depth where both are known.",
            (number(node.residual_rms_m, 1, "cm", 100),),
        ),
        Row(
            "Inliers",
            "Share of those pixels that the robust fit believes.",
            (number(node.inlier_share, 0, "%", 100),),
        ),
        Row(
            "Error in holes",
            "Median error of the inferred depth where the sensor is blind, against the truth.",
            (number(node.truth_error_m, 1, "cm", 100),),
        ),
        Row("Outliers", "Sensor points that the filter rejects.", (f"{rejected:,} ({share:.1%})",)),
        Row("Sensor points", "Points that pass the filter.", (f"{kept:,}",)),
        Row("Filled points", "Inferred points that fusion adds.", (f"{node.filled.total:,}",)),
    ]

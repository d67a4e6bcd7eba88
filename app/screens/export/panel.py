"""Export: take the results along."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import viser

from app.records import Shown
from app.state import Spec
from app.tables import command_html
from app.ui import Panel
from app.uploads import plain
from packetmesh.errors import InputError

TEXT = """**Take it along.** Files hold metres, Z up. The HTML file needs no server: it opens in any
browser, offline. The run folder is what `packetmesh reconstruct` writes: configuration, metrics, clouds,
surfaces and the report."""
GROUPS = {
    "Surface": {"PLY": "surface.ply", "GLB": "surface.glb", "OBJ": "surface.obj"},
    "Clouds": {"Fused PLY": "fused.ply", "Sensor PLY": "sensor.ply", "Inferred PLY": "inferred.ply"},
    "Numbers": {"Metrics JSON": "metrics.json", "Config JSON": "config.json"},
    "Whole": {"HTML, 3-D": "scene.html", "Run folder": "run.zip"},
}
HINTS = {
    "Surface": "The surface that the Surface screen shows, with colours.",
    "Clouds": "Points of all nodes in the world frame, as the ball meets them.",
    "Numbers": "Everything measured; everything set.",
    "Whole": "One self-contained page with the surface to turn; or a ZIP of the whole run.",
}
SURFACES: dict[Shown, str] = {
    "after": "the surface after fusion",
    "before": "the surface before fusion",
    "poisson": "the Poisson surface",
    "alpha": "the alpha shape",
}


class ExportPanel(Panel):
    """Downloads, and the command line that computes the same."""

    title = "Export"
    drawn_below = "/surface"

    def build(self) -> None:
        """Buttons by kind, a picture of the view, the command."""
        gui = self.gui
        gui.add_markdown(TEXT)
        self._surface = gui.add_markdown("")
        for label, kinds in GROUPS.items():
            group = gui.add_button_group(label, list(kinds), hint=HINTS[label])
            group.on_click(lambda event, kinds=kinds: self._clicked(kinds[event.target.value], event.client))
        picture = gui.add_button_group("Picture", ["PNG of this view"], hint="The 3-D view as it is now.")
        picture.on_click(lambda event: self._photograph(event.client))
        gui.add_markdown("**The same from the command line**")
        self._command = gui.add_html("")
        self.on_spec(self.session.spec)

    def on_spec(self, spec: Spec) -> None:
        """Show which surface is exported, and the command for these settings."""
        self._surface.content = (
            f"Surface and page hold **{SURFACES[spec.shown]}**, as the Surface screen shows."
        )
        self._command.content = command_html(plain(spec.command()))

    def _clicked(self, name: str, client: viser.ClientHandle | None) -> None:
        self.ui.post(self._export, name, client)

    def _export(self, name: str, client: viser.ClientHandle | None) -> None:
        session = self.session
        if session.results.failure("scene", session.spec) or client is None:
            raise InputError("There is no scene to export; choose one under Scene.")

        def send(content: Any) -> None:
            if content is not None:
                client.send_file_download(name, content, save_immediately=True)

        spec = session.spec
        session.side_job("export.job:export_job", name, spec.shown, on_end=send)

    def _photograph(self, client: viser.ClientHandle | None) -> None:
        """Runs on the server's own thread, because it waits for the browser to draw."""
        if client is None:
            return
        camera = client.camera
        height = min(max(camera.image_height, 240), 2160)
        width = min(max(camera.image_width, 320), 3840)
        try:
            pixels = client.get_render(height, width, transport_format="png", timeout=20.0)
        except (RuntimeError, TimeoutError):
            self.session.notify("No picture", "The browser did not deliver a picture of the view; try again.")
            return
        share = pixels[..., 3:] / 255.0
        opaque = (pixels[..., :3] * share + 255.0 * (1.0 - share)).astype(np.uint8)
        encoded = cv2.imencode(".png", cv2.cvtColor(opaque, cv2.COLOR_RGB2BGR))[1].tobytes()
        client.send_file_download("packetmesh.png", encoded, save_immediately=True)

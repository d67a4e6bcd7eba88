"""The Export screen's panel: downloads of all results."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import viser

from app.compute.records import Shown
from app.compute.state import Spec, Step
from app.web.markup import Markdown, Markup
from app.web.uploads import plain
from app.window.panel import Offer, Offers, Panel
from app.window.tables import command_html
from packetmesh.errors import InputError
from pipeline.types import ByteArray

TEXT = Markdown(
    """**Download the results.** Coordinates are in metres, Z up. Pages need no server: they open in any
browser, offline. The run folder has what `packetmesh reconstruct` writes: configuration, metrics, clouds,
surfaces and the report."""
)
SURFACES: dict[Shown, str] = {
    "after": "the surface after fusion",
    "before": "the surface before fusion",
    "poisson": "the Poisson surface",
    "alpha": "the alpha shape",
}
FILES: dict[Shown, str] = {
    "after": "surface_after.ply",
    "before": "surface_before.ply",
    "poisson": "surface_poisson.ply",
    "alpha": "surface_alpha.ply",
}
"""File name of each surface in the run folder."""
KINDS = ("Surface", "Clouds", "Numbers", "Measures", "To show", "Race", "Delivery", "Network", "Plan")
"""Kinds of files in the order of the buttons; kinds without files are hidden."""


class ExportPanel(Panel):
    """Downloads, and the command line that computes the same."""

    title = "Export"
    drawn_below = "/surface"

    def build(self) -> None:
        """Add buttons by kind, and the command."""
        gui = self.gui
        self._offers: dict[str, Offers] = {}
        gui.add_markdown(TEXT)
        self._surface = gui.add_markdown(Markdown(""))
        self._groups = {kind: gui.add_button_group(kind, ("…",), visible=False) for kind in KINDS}
        for kind, group in self._groups.items():
            group.on_click(lambda event, kind=kind: self._clicked(kind, event.target.value, event.client))
        gui.add_markdown(Markdown("**The same from the command line**"))
        self._commands = {kind: (gui.add_markdown(Markdown("")), gui.add_html(Markup(""))) for kind in KINDS}
        self.on_spec(self.session.spec)

    def on_spec(self, spec: Spec) -> None:
        """Show which surface is exported, and the files that are available."""
        self._surface.content = Markdown(
            "Surface and page contain **{}**, as on the Surface screen, and all of it: a cut under **Look** "
            "is only in pictures of the view."
        ).format(SURFACES[spec.shown])
        self._arrange()

    def on_view(self, step: Step, view: Any) -> None:
        """Update the available files."""
        self._arrange()

    def on_show(self) -> None:
        """Update the available files."""
        self._arrange()

    def offers(self) -> tuple[Offers, ...]:
        """Return the offers of the chain's results, independent of the current screen."""
        spec = self.session.spec
        surfaces = tuple(_file(kind.upper(), f"surface.{kind}", spec.shown) for kind in ("ply", "glb", "obj"))
        clouds = tuple(_file(name, f"{name.lower()}.ply") for name in ("Fused", "Sensor", "Inferred"))
        numbers = (
            _file("Metrics", "metrics.json"),
            _file("Config", "config.json"),
            _file("Run folder", "run.zip", spec.shown),
        )
        return (
            Offers(
                "Surface",
                "The surface that the Surface screen shows, with colours.",
                surfaces,
                plain(spec.command()),
                Markdown("`{}` in its folder is {}.").format(FILES[spec.shown], SURFACES[spec.shown]),
            ),
            Offers(
                "Clouds",
                "Points of all nodes in the world frame, as PLY; Fused gives the surface after fusion.",
                clouds,
            ),
            Offers("Numbers", "All metrics and settings as JSON, or the whole run as a ZIP.", numbers),
        )

    def _arrange(self) -> None:
        """Show a row of buttons for each kind with files."""
        self._offers = {offers.kind: offers for offers in self.session.offers()}
        with self.ui.atomic():
            for kind, group in self._groups.items():
                offers = self._offers.get(kind)
                group.visible = offers is not None
                text, command = self._commands[kind]
                text.content, command.content = Markdown(""), Markup("")
                if offers is None:
                    continue
                group.hint = offers.hint
                labels = tuple(offer.label for offer in offers.files)
                if group.options != labels:
                    group.options = labels
                if offers.note:
                    text.content = Markdown("{}: {}").format(kind, offers.note)
                if offers.command:
                    command.content = command_html(plain(offers.command))

    def _clicked(self, kind: str, label: str, client: viser.ClientHandle | None) -> None:
        """Export a file; one with a picture of the view has its own thread, which waits for the browser."""
        offers = self._offers.get(kind)
        offer = next((one for one in offers.files if one.label == label), None) if offers else None
        if offer is None or client is None:
            return
        if offer.photographs:
            threading.Thread(target=self._export_with_picture, args=(offer, client), daemon=True).start()
        else:
            self.ui.post(self._export, offer, (), client)

    def _export_with_picture(self, offer: Offer, client: viser.ClientHandle) -> None:
        picture = self._photograph(client)
        if picture is not None:
            self.ui.post(self._export, offer, (picture,), client)

    def _export(self, offer: Offer, seen: tuple[Any, ...], client: viser.ClientHandle) -> None:
        session = self.session
        if session.results.failure("scene", session.spec):
            raise InputError("There is no scene to export; choose one under Scene.")

        def send(content: Any) -> None:
            if content is not None:
                client.send_file_download(offer.file, content, save_immediately=True)

        session.side_job(offer.job, *offer.arguments, *seen, on_end=send)

    def _photograph(self, client: viser.ClientHandle) -> ByteArray | None:
        """Return (H, W, 4) the view as the browser draws it; None, and a notification, if no picture came."""
        camera = client.camera
        height = min(max(camera.image_height, 240), 2160)
        width = min(max(camera.image_width, 320), 3840)
        try:
            return np.asarray(client.get_render(height, width, transport_format="png", timeout=20.0))
        except (RuntimeError, TimeoutError):
            self.session.notify("No picture", "The browser did not deliver a picture of the view; try again.")
            return None


def _file(label: str, name: str, *arguments: Any) -> Offer:
    return Offer(label, name, "export.job:export_job", (name, *arguments))

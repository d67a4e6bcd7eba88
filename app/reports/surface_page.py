"""A page of two surfaces of one scene on both sides of a sliding line; it needs no network."""

from __future__ import annotations

from dataclasses import dataclass

from app.drawing.legend import Legend
from app.reports.hand_out import Viewpoint
from app.reports.offline_page import offline_page
from app.web.markup import Markup

_PARTS = ("surface_page.css", "offline_page.js", "hand_out_view.js", "surface_page.js")


@dataclass(frozen=True, slots=True)
class Side:
    """The surface to the left or to the right of the line."""

    name: str
    note: str
    """Sentence with its numbers."""
    glb: bytes
    """Mesh as ``app.drawing.glb`` writes it; empty without a triangle."""


@dataclass(frozen=True, slots=True)
class SurfacePage:
    """A reconstruction for viewers without PacketMesh."""

    title: str
    """Title of the scene."""
    sentence: str
    left: Side
    right: Side
    view: Viewpoint
    legend: Legend


def surface_page(page: SurfacePage) -> Markup:
    """Return a self-contained HTML document."""
    sides = (page.left, page.right)
    record = {
        "view": page.view.record(),
        "sides": [{"name": side.name, "note": side.note, "there": bool(side.glb)} for side in sides],
        "legend": page.legend.record(),
    }
    blocks = {f"mesh-{row}": side.glb for row, side in enumerate(sides)}
    words = {"title": page.title, "sentence": page.sentence}
    return offline_page(f"{page.title} · PacketMesh", "surface_page.html", words, _PARTS, record, blocks)

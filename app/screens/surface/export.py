"""Files that the Surface screen offers for download."""

from __future__ import annotations

from app.screens.surface.labels import BASELINES, COLORINGS
from app.screens.surface.view import Coloring
from app.web.markup import Markdown
from app.window.panel import Offer, Offers

HINT = """The surface as the Surface screen shows it: one page to turn it, offline, with a line between before
and after; a moving picture of a flight along the cameras, for slides; the 3-D view as it is now."""
NOTE = Markdown(
    "No command makes these: each is of what you see. The meshes in them are those of the command above."
)


def surface_offers(shown: str, colors: str, rims: bool) -> Offers:
    """Return offers of the surface shown, with its rims if drawn; a baseline has its points' colours."""
    coloring: Coloring = "color" if shown in BASELINES else COLORINGS[colors]
    job = "surface.export_job"
    files = (
        Offer("3-D page", "scene.html", f"{job}:page_job", (coloring,)),
        Offer("Flight, GIF", "flight.gif", f"{job}:flight_job", (coloring,)),
        Offer("This view, PNG", "view.png", f"{job}:view_job", (coloring, rims), photographs=True),
    )
    return Offers("To show", HINT, files, note=NOTE)

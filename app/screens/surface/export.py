"""Files that the Surface screen offers for download."""

from __future__ import annotations

from app.compute.measures import Tape
from app.measuring.command import measure_commands
from app.screens.surface.labels import BASELINES, COLORINGS
from app.screens.surface.view import Coloring
from app.web.markup import Markdown
from app.window.panel import Offer, Offers

HINT = """The surface as the Surface screen shows it: an offline page with the surface in 3-D and a line
between before and after; an animation of a flight along the cameras, for slides; the current 3-D view."""
NOTE = Markdown(
    "No command writes these files: they show the current view. Their meshes are those of the command above."
)

MEASURES_HINT = """The measures on the Surface screen: their points, numbers in metres, degrees and square
metres with 95 % intervals, and what was guessed. They are also in the run folder and in its report."""

RUN = "runs/from-app"
"""Folder of the command that makes the surface (``Spec.command``)."""
MEASURES_NOTE = Markdown(
    "Each command takes one measure on the run of the first command above; with `--json` it prints JSON. "
    "For an angle of three points it also prints both legs."
)
MEASURES_UNSCALED = Markdown(
    "{} The commands measure at the reconstruction's own scale; `--scale-by` sets that of one command."
).format(MEASURES_NOTE)


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


def measure_offers(tape: Tape) -> tuple[Offers, ...]:
    """Return the offer of the list of measures, and the commands that take them; none without a measure."""
    if not tape.taken:
        return ()
    files = (Offer("JSON", "measures.json", "surface.measure_job:measures_job"),)
    note = MEASURES_NOTE if tape.scale is None else MEASURES_UNSCALED
    return (Offers("Measures", MEASURES_HINT, files, measure_commands(tape, RUN), note),)

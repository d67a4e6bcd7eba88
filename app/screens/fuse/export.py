"""Files that the Fuse screen offers for download."""

from __future__ import annotations

from app.screens.fuse.view import Race
from app.web.markup import Markdown
from app.window.panel import Offer, Offers

HINT = """The race as it is set up on the Fuse screen, with the error of every method: an offline page that
plays it, and an animation for slides."""
NOTE = Markdown(
    "No command runs a race; `packetmesh register` registers one cloud with another by any of these methods."
)


def race_offers(race: Race) -> Offers:
    """Return the offers of a race that has run."""
    job = "fuse.export_job"
    files = (
        Offer("Page", "race.html", f"{job}:page_job", (race,)),
        Offer("GIF", "race.gif", f"{job}:animation_job", (race,)),
    )
    return Offers("Race", HINT, files, note=NOTE)

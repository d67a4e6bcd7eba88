"""Files of a plan that are offered for download."""

from __future__ import annotations

from app.compute.state import Sent
from app.screens.network.planning.view import PlanRequest, Poses
from app.web.markup import Markdown
from app.window.panel import Offer, Offers

JOB = "network.planning.export_job"


def plan_offers(request: PlanRequest, sent: Sent, poses: Poses, preset: str) -> Offers:
    """Return the floor plan and the positions of a plan whose ghosts are at these poses.

    Args:
        request: request of the plan.
        sent: how the images travel now.
        poses: where its ghosts are.
        preset: name of the network's preset.
    """
    files = (
        Offer("SVG", "floor_plan.svg", f"{JOB}:drawing_job", (request, sent, poses, "svg")),
        Offer("PDF", "floor_plan.pdf", f"{JOB}:drawing_job", (request, sent, poses, "pdf")),
        Offer("JSON", "plan.json", f"{JOB}:record_job", (request, sent, poses, preset)),
    )
    hint = "The floor plan of the new cameras, true to scale at 100 %, and their positions as JSON."
    note = Markdown("`packetmesh plan` writes the same files, but knows no ghosts that were dragged.")
    return Offers("Plan", hint, files, note=note)

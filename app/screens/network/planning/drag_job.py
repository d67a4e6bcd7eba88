"""The job that judges the ghosts while one of them is dragged."""

from __future__ import annotations

from collections.abc import Generator

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.network.planning.planned import ghosts_view, moved, plan_of_request
from app.screens.network.planning.view import GhostsView, PlanRequest, Poses
from packetmesh.progress import Progress


def drag_job(
    store: Store, spec: Spec, request: PlanRequest, poses: Poses
) -> Generator[Progress, None, GhostsView]:
    """Return the ghosts of a plan at other poses, in the order of the plan."""
    place, plan, _ = yield from plan_of_request(store, spec, request)
    return ghosts_view(place, *moved(place, plan, poses))

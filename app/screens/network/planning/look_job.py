"""The job that shows what a ghost would see, and when the ghosts' images arrive."""

from __future__ import annotations

from collections.abc import Generator
from itertools import islice

from app.compute.state import Sent, Spec
from app.compute.store import Store
from app.reports.plan_pictures import plan_pictures
from app.screens.network.planning.planned import arrivals_of, rig_plan
from app.screens.network.planning.view import LookView, PlanRequest, Poses
from packetmesh.progress import Progress
from pipeline.stages import dressed


def look_job(
    store: Store, spec: Spec, request: PlanRequest, sent: Sent, poses: Poses, row: int
) -> Generator[Progress, None, LookView]:
    """Return the picture of the ghost ``row``, and the arrivals of all ghosts at these poses.

    Args:
        store: store of the results.
        spec: spec of the room.
        request: request of the plan.
        sent: how the images travel now; the screen's settings may have changed since the plan.
        poses: where the ghosts are.
        row: index of the ghost in the picture.
    """
    place, planned = yield from rig_plan(store, spec, request, poses, sent)
    done = place.done
    texture = dressed(done.rig, done.placement, done.after)
    pictures = plan_pictures(place.seen, planned.plan, texture)
    return LookView(next(islice(pictures, row, None)), arrivals_of(planned.delivery))

"""The job that plans the next cameras."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.network.planning.planned import (
    arrivals_of,
    ghosts_view,
    moved,
    plan_of_request,
    sending_of,
)
from app.screens.network.planning.view import NoPlan, PlanRequest, PlanView, Pose
from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress
from pipeline.folders.plan import fewer_sentence, level_sentence
from pipeline.planning.calls import RigPlan
from pipeline.planning.plan import LEAST_OVERLAP
from pipeline.planning.radio import ruled_out
from pipeline.types import FloatArray


def plan_job(store: Store, spec: Spec, request: PlanRequest) -> Generator[Progress, None, PlanView | NoPlan]:
    """Return the plan of a request, or why there is none."""
    try:
        return (yield from _view(store, spec, request))
    except PacketMeshError as error:
        return NoPlan(str(error))


def _view(store: Store, spec: Spec, request: PlanRequest) -> Generator[Progress, None, PlanView]:
    place, plan, delivery = yield from plan_of_request(store, spec, request)
    poses = tuple(_pose(camera.T_world_camera) for camera in plan.cameras)
    plan, judged = moved(place, plan, poses)
    rig, radio = sending_of(place, request)
    whole = RigPlan(place.seen, rig, plan, radio, delivery)
    notes = [fewer_sentence(whole, request.cameras), level_sentence(whole), *_ignored(request)]
    lens = plan.sensor.intrinsics
    return PlanView(
        request,
        ghosts_view(place, plan, judged),
        arrivals_of(delivery),
        place.seen.targets.points_m.astype(np.float32),
        place.seen.targets.dark_return > 0.0,
        2.0 * float(np.arctan2(0.5 * lens.height_px, lens.fy_px)),
        lens.width_px / lens.height_px,
        plan.measured_share,
        place.floor_m,
        {frame.name: _pose(frame.T_world_camera) for frame in rig.frames},
        len(delivery.walls_m),
        plan.at_least_of_best,
        plan.candidates,
        ruled_out(plan, request.deadline_s),
        delivery.image_bytes,
        LEAST_OVERLAP,
        tuple(filter(None, notes)),
    )


def _pose(T_world_camera: FloatArray | None) -> Pose:
    assert T_world_camera is not None, "registered cameras have poses"
    return tuple(T_world_camera.ravel().tolist())


def _ignored(request: PlanRequest) -> list[str]:
    """Return sentences on what a plan leaves out, and on settings of the screen that have no effect on it."""
    notes = []
    if not request.dark_surface:
        notes.append("Surface that looks dark to a present sensor is left out of this plan")
    if request.sent.network.radio.walls_m:
        notes.append("The wall of What if does not count here: the plan takes the walls of the surface")
    if request.sent.down:
        notes.append(
            f"{', '.join(request.sent.down)} sends nothing, but what it measured still counts as known"
        )
    return notes

"""What all jobs of the folder *Plan* share: the plan of a request, and its ghosts at any poses."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from app.compute.seen_places import Place, place_of
from app.compute.state import Sent, Spec
from app.compute.store import Store
from app.screens.network.planning.view import (
    Arrival,
    Ghost,
    GhostsView,
    PlanRequest,
    Poses,
    PromiseView,
)
from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.delivery.plan import placed
from pipeline.planning.calls import RigPlan, registered
from pipeline.planning.chances import Judged, judge
from pipeline.planning.places import is_free
from pipeline.planning.plan import Plan, PlanConfig, bright_only, iterate_candidates, moved_plan
from pipeline.planning.promise import Promise
from pipeline.planning.radio import PlanDelivery, PlanRadio, deliver_plan, plan_within
from pipeline.planning.seen import without_dark
from pipeline.planning.sensors import sensor_named
from pipeline.types import FloatArray, Rig

CLEAR_M = 0.05
"""Least distance of a ghost from any surface."""

_judged: dict[tuple[str, bytes], tuple[Place, Judged]] = {}
"""What this process judged last, by sensor and pose, with its place."""
MOST_JUDGED = 16
_bright: list[tuple[Place, Place]] = []
"""The place of which this process last left dark surface out, and that place without it."""


def plan_of_request(
    store: Store, spec: Spec, request: PlanRequest
) -> Generator[Progress, None, tuple[Place, Plan, PlanDelivery]]:
    """Return the place, the plan that the request gives, and the delivery of its images.

    Raises:
        PacketMeshError: there is no plan; the message says why and what to try.
    """
    whole = yield from part(place_of(store, spec), "the present cameras", 0.0, 0.6, detail=True)
    place = whole if request.dark_surface else _without_dark(whole)
    key = ("plan", spec.key("surface"), request)
    plan, delivery = yield from store.remember(key, partial(_planned, store, spec, whole, place, request))
    return place, plan, delivery


def _without_dark(place: Place) -> Place:
    if not (_bright and _bright[0][0] is place):
        _bright[:] = [(place, replace(place, seen=without_dark(place.seen)))]
    return _bright[0][1]


def _planned(
    store: Store, spec: Spec, whole: Place, place: Place, request: PlanRequest
) -> Generator[Progress, None, tuple[Plan, PlanDelivery]]:
    """Return a plan for ``place``, which is ``whole`` or the same without dark surface.

    The candidates are judged on ``whole``, once for both.
    """
    config, done = config_of(request), place.done
    rig, radio = sending_of(place, request)
    sensor = sensor_named(request.sensor, done.rig)
    key = ("judged", spec.key("surface"), sensor.name, config.where)
    compute = partial(iterate_candidates, whole.seen, sensor, config.where)
    judging = store.remember(key, compute)
    judged = yield from part(judging, "judging places", 0.6, 0.9, detail=True)
    if place is not whole:
        judged = bright_only(judged, whole.seen)
    yield Progress("images by radio", 0.9)
    return plan_within(rig, place.seen, judged, sensor, config, radio)


def config_of(request: PlanRequest) -> PlanConfig:
    """Return the planner's settings; raises ``InputError`` if no kind of place is allowed."""
    places = request.where
    return PlanConfig(request.cameras, request.sensor, places, request.dark_surface)  # type: ignore[arg-type]


def sending_of(place: Place, request: PlanRequest) -> tuple[Rig, PlanRadio]:
    """Return the registered cameras that are not switched off, and the radio of the screen's settings.

    Raises:
        InputError: none is left, or the screen's settings place another number of cameras.
    """
    sent, whole = request.sent, place.done.rig
    found = registered(place.done)
    frames = tuple(frame for frame in found.frames if frame.name not in sent.down)
    if not frames:
        raise InputError(
            "All registered cameras are switched off, so nothing can be planned; "
            f"switch on {found.frames[0].name}"
        )
    network = sent.network
    if network.nodes.places_m and whole.walk is None:
        names = [frame.name for frame in whole.frames]
        network = placed(whole, network, [names.index(frame.name) for frame in frames])
    radio = PlanRadio(
        network, sent.coding, request.walls, budget_j=request.budget_j, deadline_s=request.deadline_s
    )
    return Rig(found.name, frames, walk=found.walk), radio


def moved(place: Place, plan: Plan, poses: Poses) -> tuple[Plan, list[Judged]]:
    """Return the plan with its cameras at these poses, and what each of them would measure."""
    T_world_camera = [np.reshape(pose, (4, 4)) for pose in poses]
    judged = [_judge(place, plan, T) for T in T_world_camera]
    return moved_plan(place.seen, plan, T_world_camera, judged), judged


def _judge(place: Place, plan: Plan, T_world_camera: FloatArray) -> Judged:
    """Judge a pose, unless this process has just done so: of several ghosts only one is dragged."""
    key = (plan.sensor.name, T_world_camera.tobytes())
    of, found = _judged.pop(key, (None, None))
    if found is None or of is not place:
        found = judge(place.seen, T_world_camera, plan.sensor)
    _judged[key] = place, found
    while len(_judged) > MOST_JUDGED:
        del _judged[next(iter(_judged))]
    return found


def ghosts_view(place: Place, plan: Plan, judged: Sequence[Judged]) -> GhostsView:
    """Return the cameras of a plan, and what each of them would newly measure, as ghosts."""
    seen = place.seen
    missed: FloatArray = np.ones(len(seen.targets.points_m))
    ghosts = []
    for camera, found in zip(plan.cameras, judged, strict=True):
        T = camera.T_world_camera
        free = bool(is_free(seen, T[None, :3, 3], CLEAR_M)[0])
        newly = (missed * found.chance).astype(np.float32)
        height_m = float(T[2, 3] - place.floor_m)
        ghosts.append(
            Ghost(T, camera.where, height_m, promise_view(camera.promise), camera.overlap_share, free, newly)
        )
        missed = missed * (1.0 - found.chance)
    return GhostsView(tuple(ghosts), promise_view(plan.total))


def promise_view(one: Promise) -> PromiseView:
    """Return a promise as the server reads it."""
    return PromiseView(one.gain_share, one.ci95_share, one.dark_share)


def arrivals_of(delivery: PlanDelivery) -> tuple[Arrival, ...]:
    """Return when each new camera's image arrives."""
    return tuple(Arrival(one.seconds_to_90_s, one.seconds_to_99_s, one.joules) for one in delivery.cameras)


def rig_plan(
    store: Store, spec: Spec, request: PlanRequest, poses: Poses, sent: Sent
) -> Generator[Progress, None, tuple[Place, RigPlan]]:
    """Return the place, and the plan with its ghosts at these poses and its images sent from there as now."""
    place, plan, _ = yield from plan_of_request(store, spec, request)
    there, _ = moved(place, plan, poses)
    rig, radio = sending_of(place, replace(request, sent=sent))
    delivery = deliver_plan(rig, place.seen, there, radio)
    return place, RigPlan(place.seen, rig, there, radio, delivery)

"""A plan of a rig's next cameras by one call, with the delivery of their images."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

from packetmesh.progress import Progress, drain, part
from pipeline.planning.plan import Plan, PlanConfig, bright_only, iterate_candidates
from pipeline.planning.radio import PlanDelivery, PlanRadio, plan_within
from pipeline.planning.seen import SeenPlace, seen_place, without_dark
from pipeline.planning.sensors import sensor_named
from pipeline.reconstruct import Reconstruction, reconstruct
from pipeline.types import Rig


@dataclass(frozen=True, slots=True)
class RigPlan:
    """The next cameras of a rig, and the cost of sending their images."""

    seen: SeenPlace
    """Knowledge of the present cameras about the place; in a plan that leaves dark surface out, without
    it."""
    rig: Rig
    """The registered present cameras, at the poses that registration found."""
    plan: Plan
    radio: PlanRadio
    delivery: PlanDelivery


def plan(
    result: Rig | Reconstruction, config: PlanConfig | None = None, radio: PlanRadio | None = None
) -> RigPlan:
    """Plan where the next cameras of a rig stand best, what they add, and what their images cost by radio.

    Args:
        result: images, or their reconstruction, which several plans share.
        config: number and kind of cameras, and where they may stand; None plans one camera.
        radio: network, walls, sink, budget and deadline; None takes the network of the preset office.

    Raises:
        PacketMeshError: the rig cannot be reconstructed, no place is free or sees what is missing, or the
            radio carries no image within budget and deadline; the message says what to try.

    >>> import packetmesh as pm
    >>> rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    >>> result = pm.reconstruct(rig, pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=3000"]))
    >>> planned = pm.plan(result, pm.PlanConfig(cameras=2, where=("tripods",)))
    >>> [camera.where for camera in planned.plan.cameras]
    ['tripods', 'tripods']
    >>> planned.plan.total.gain_share > planned.plan.cameras[0].promise.gain_share > 0.0
    True
    """
    done = result if isinstance(result, Reconstruction) else reconstruct(result)
    return drain(iterate_plan(done, config or PlanConfig(), radio or PlanRadio()))


def iterate_plan(
    done: Reconstruction, config: PlanConfig, radio: PlanRadio
) -> Generator[Progress, None, RigPlan]:
    """Plan with a report after each batch of candidates; raises as ``plan``."""
    yield Progress("what the cameras see", 0.0)
    seen = seen_place(done)
    sensor = sensor_named(config.sensor, done.rig)
    judged = yield from part(
        iterate_candidates(seen, sensor, config.where), "candidates", 0.1, 0.7, detail=True
    )
    if not config.dark_surface:
        judged, seen = bright_only(judged, seen), without_dark(seen)
    yield Progress("images by radio", 0.7)
    rig = registered(done)
    chosen, delivery = plan_within(rig, seen, judged, sensor, config, radio)
    return RigPlan(seen, rig, chosen, radio, delivery)


def registered(done: Reconstruction) -> Rig:
    """Return the registered cameras of a reconstruction, at the poses that registration found."""
    placement = done.placement
    frames = zip(placement.placed(done.rig.frames), placement.placed(placement.T_world_camera), strict=True)
    posed = tuple(replace(frame, T_world_camera=pose) for frame, pose in frames)
    return Rig(done.rig.name, posed, walk=done.rig.walk)

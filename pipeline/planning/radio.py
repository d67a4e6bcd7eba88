"""Delivery of a plan's images by radio: when the new cameras' images arrive, and what they cost in energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from network_sim.config import NetworkConfig
from network_sim.metrics.arrivals import Arrivals, arrivals, energy_by_node_j
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import NS_PER_S
from packetmesh.checks import above
from packetmesh.errors import InputError
from pipeline.delivery import coding_named
from pipeline.delivery.plan import check_collects, network_of, places_of
from pipeline.delivery.sending import packet_bytes_of
from pipeline.delivery.sink import images_of
from pipeline.planning.plan import Candidates, Plan, PlanConfig, plan_of
from pipeline.planning.seen import SeenPlace
from pipeline.planning.sensors import Sensor
from pipeline.planning.sinks import best_sink
from pipeline.planning.walls import DAMPING_DB, walls_of
from pipeline.types import FloatArray, Rig

BATTERY_J = 133_200.0
"""Energy of a power bank of 10 Ah at 3.7 V."""
ROUNDS = 5
"""Most plans that are tried until one meets budget and deadline."""
NEAR_M = 0.5
"""Candidates this close to a camera that misses budget or deadline are not tried again."""


@dataclass(frozen=True, slots=True)
class PlanRadio:
    """How a plan's images travel."""

    network: NetworkConfig = field(default_factory=lambda: PRESETS["office"])
    coding: str = "exact"
    """Name in ``pipeline.delivery.CODINGS``."""
    walls: str = "brick"
    """Material of the walls, a name in ``DAMPING_DB``."""
    sink_m: tuple[float, float] | Literal["best"] | None = None
    """x and y of the sink; "best" places it by ``best_sink``, None leaves it where the network has it."""
    every_s: float = 600.0
    """Time between two images of a camera, for the days that its battery lasts."""
    budget_j: float | None = None
    """Most energy of all new cameras together for one image of each."""
    deadline_s: float | None = None
    """Latest time until 99 % of each new camera's bytes have arrived."""

    def __post_init__(self) -> None:
        for key in ("every_s", "budget_j", "deadline_s"):
            above(key, getattr(self, key), 0.0)
        coding_named(self.coding)
        check_collects(self.network)
        if self.walls not in DAMPING_DB:
            raise InputError(f"There is no wall of {self.walls!r}; try one of {', '.join(DAMPING_DB)}")


@dataclass(frozen=True, slots=True)
class CameraDelivery:
    """One image of a new camera on its way to the sink; times are infinite for what never arrives."""

    seconds_to_90_s: float
    """Until 90 % of its bytes have arrived."""
    seconds_to_99_s: float
    """Until 99 % of its bytes have arrived."""
    joules: float
    """Energy of radio and platform until 99 % have arrived, or until the run's end."""
    battery_days: float
    """Days on a battery of ``BATTERY_J`` (or the network's), with an image every ``every_s``."""


@dataclass(frozen=True, slots=True)
class PlanDelivery:
    """All new cameras' images, sent together with those of the present ones."""

    cameras: tuple[CameraDelivery, ...]
    image_bytes: int
    """Bytes of each new camera's image: the mean of the present ones'."""
    sink_m: tuple[float, float]
    walls_m: FloatArray
    """(W, 2, 2) ends of the walls that damp the links."""

    @property
    def joules(self) -> float:
        """Energy of all new cameras together."""
        return sum(camera.joules for camera in self.cameras)


@dataclass(frozen=True, slots=True)
class _Sending:
    """Values that are the same for all plans of a rig."""

    rig: Rig
    present_bytes: tuple[int, ...]
    """Bytes of each present camera's image."""
    seen: SeenPlace
    walls_m: FloatArray


def deliver_plan(rig: Rig, seen: SeenPlace, plan: Plan, radio: PlanRadio) -> PlanDelivery:
    """Send one image of every present and every new camera through the network model.

    The camera of a recording is no longer there: the new ones send alone. The room's walls damp the links. A
    new camera's image has as many bytes as the present ones have on average; its content, and so its surface,
    is not known yet.

    Args:
        rig: the registered cameras, at the poses that registration found (``registered``).
        seen: the place.
        plan: the new cameras.
        radio: how images travel.

    Raises:
        InputError: the network places another number of cameras than the rig has.
    """
    return _delivered(_sending(rig, seen, radio), plan, radio)


def _sending(rig: Rig, seen: SeenPlace, radio: PlanRadio) -> _Sending:
    coding, packet_bytes = coding_named(radio.coding), packet_bytes_of(radio.network)
    present_bytes = tuple(len(coding.encode(images_of(frame), packet_bytes)) for frame in rig.frames)
    return _Sending(rig, present_bytes, seen, walls_of(seen))


def _delivered(sending: _Sending, plan: Plan, radio: PlanRadio) -> PlanDelivery:
    rig, walls_m = sending.rig, sending.walls_m
    present = len(rig.frames) if rig.walk is None else 0
    image_bytes = round(float(np.mean(sending.present_bytes)))
    damped = replace(
        radio.network.radio, walls_m=tuple(walls_m.ravel().tolist()), wall_db=DAMPING_DB[radio.walls]
    )
    given, own_places_m = replace(radio.network, radio=damped), radio.network.nodes.places_m
    if rig.walk is not None:
        given = replace(given, nodes=replace(given.nodes, count=1, places_m=()))
    network = network_of(rig, sending.present_bytes, given)
    old_m = np.reshape(own_places_m or places_of(rig, network.nodes.spacing_m), (-1, 2))
    new_m = [camera.T_world_camera[:2, 3] for camera in plan.cameras]
    cameras_m = np.vstack([old_m[:present], *new_m])
    sink_m = _sink_m(sending.seen, cameras_m, old_m[-1], replace(radio, network=network))
    places_m = np.vstack([cameras_m, sink_m])
    nodes = replace(
        network.nodes,
        count=present + len(new_m),
        places_m=tuple(places_m.ravel().tolist()),
        bytes_by_node=(*sending.present_bytes[:present], *len(new_m) * [image_bytes]),
    )
    trace = simulate(replace(network, nodes=nodes))
    came = arrivals(trace)
    times_s = [
        [_seconds(came, present + k, share * image_bytes) for share in (0.9, 0.99)] for k in range(len(new_m))
    ]
    ends_ns = [
        min(round(last_s * NS_PER_S), trace.horizon_ns) if np.isfinite(last_s) else trace.horizon_ns
        for _, last_s in times_s
    ]
    spent_j = energy_by_node_j(trace, ends_ns)
    cameras = [
        CameraDelivery(both_s[0], both_s[1], float(spent_j[k, present + k]), 0.0)
        for k, both_s in enumerate(times_s)
    ]
    lasting = [replace(one, battery_days=_battery_days(one, radio)) for one in cameras]
    return PlanDelivery(tuple(lasting), image_bytes, (float(sink_m[0]), float(sink_m[1])), walls_m)


def _sink_m(seen: SeenPlace, cameras_m: FloatArray, old_m: FloatArray, radio: PlanRadio) -> FloatArray:
    if radio.sink_m is None:
        return old_m
    if radio.sink_m == "best":
        return best_sink(seen, cameras_m, radio.network.radio)
    return np.asarray(radio.sink_m)


def _seconds(came: Arrivals, node: int, least_bytes: float) -> float:
    """Return the time until this many bytes of a node have arrived; infinite if they never do."""
    mine = came.node == node
    total = np.cumsum(came.byte_count[mine])
    reached = np.searchsorted(total, least_bytes)
    return float(came.t_ns[mine][reached] / NS_PER_S) if reached < len(total) else float("inf")


def _battery_days(camera: CameraDelivery, radio: PlanRadio) -> float:
    """Return the days on a battery: in each period the camera sends one image and then sleeps."""
    energy = radio.network.energy
    busy_s = min(camera.seconds_to_99_s, radio.every_s)
    asleep_w = energy.sleep_w + energy.platform_sleep_w
    period_j = camera.joules + asleep_w * (radio.every_s - busy_s)
    return (energy.battery_j or BATTERY_J) / period_j * radio.every_s / 86_400.0


def plan_within(
    rig: Rig, seen: SeenPlace, judged: Candidates, sensor: Sensor, config: PlanConfig, radio: PlanRadio
) -> tuple[Plan, PlanDelivery]:
    """Choose cameras whose images arrive by the deadline and within the budget.

    The network model judges the best plan. Cameras that miss the deadline are replaced, at most ``ROUNDS``
    times; over budget, the plan gets a camera less.

    Raises:
        InputError: no plan meets both, or no radio reaches; the message says what the last one tried needs.
    """
    sending = _sending(rig, seen, radio)
    barred: list[int] = []
    for _ in range(ROUNDS):
        plan = plan_of(seen, judged, sensor, config, barred)
        delivery = _delivered(sending, plan, radio)
        late = [
            camera
            for camera, sent in zip(plan.cameras, delivery.cameras, strict=True)
            if sent.seconds_to_99_s > (np.inf if radio.deadline_s is None else radio.deadline_s)
            or not np.isfinite(sent.seconds_to_99_s)
        ]
        over = radio.budget_j is not None and delivery.joules > radio.budget_j
        if not late and not over:
            return plan, delivery
        if late:
            barred += _near(judged, [camera.T_world_camera[:3, 3] for camera in late])
        elif config.cameras > 1:
            config = replace(config, cameras=config.cameras - 1)
        else:
            break
        if judged.allowed[[k for k in range(len(judged.allowed)) if k not in set(barred)]].sum() == 0:
            break
    raise InputError(_why_none(delivery, radio))


def ruled_out(plan: Plan, deadline_s: float | None) -> str:
    """Return the end of a sentence on the candidates that were not barred; empty if none was barred."""
    if not plan.barred:
        return ""
    return f" and are not ruled out by the {'radio' if deadline_s is None else 'deadline'}"


def _near(judged: Candidates, places_m: Sequence[FloatArray]) -> list[int]:
    at_m = np.array([candidate.T_world_camera[:3, 3] for candidate in judged.candidates])
    near = [np.linalg.norm(at_m - place, axis=1) < NEAR_M for place in places_m]
    return np.flatnonzero(np.any(near, axis=0)).tolist()


def _why_none(delivery: PlanDelivery, radio: PlanRadio) -> str:
    slowest_s = max(camera.seconds_to_99_s for camera in delivery.cameras)
    if not np.isfinite(slowest_s):
        return (
            "The radio does not carry a new camera's image to the sink from any place that was tried; try "
            "another preset, a sink that is nearer or the best one, or walls of another material"
        )
    needs = f"{slowest_s:.3g} s and {delivery.joules:.3g} J"
    return f"No camera meets budget and deadline: the last one that was tried needs {needs}; allow that much"

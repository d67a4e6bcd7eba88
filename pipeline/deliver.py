"""Delivery of a rig's images through a network, and the surface from what has arrived so far (SPEC 6.5).

Every node sends its own encoded colour and depth image; the camera of a recording is one node, which sends
its keyframes, each from the time at which it was taken. At each moment the sink decodes exactly the
bytes that have arrived by then, and the usual chain reconstructs what it can from them.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np

from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS as NETWORKS
from packetmesh.batch import process_pool
from packetmesh.errors import ReconstructionError
from packetmesh.progress import drain
from pipeline.config import PRESETS, PipelineConfig
from pipeline.delivery.leaving_out import Order
from pipeline.delivery.moments import Moment, Rebuilder, lossless_spec, spec_of
from pipeline.delivery.sending import DeliverySpec, Sending, frames_at_sink, received_at, send
from pipeline.delivery.sink import heard
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import Cache, RunCache, compute
from pipeline.types import RgbdFrame, Rig


@dataclass(frozen=True, slots=True)
class Delivery:
    """Result of sending a rig's images through a network."""

    sending: Sending
    moments: tuple[Moment, ...]
    last: Reconstruction | None
    """Reconstruction of all that arrived; None if that was too little."""
    lossless: Reconstruction
    """Reconstruction of the images before coding; of a walk it is without the map, which is not sent."""


def deliver(
    rig: Rig,
    network: NetworkConfig = NETWORKS["office"],
    coding: str = "exact",
    moments: int = 40,
    config: PipelineConfig = PRESETS["packetmesh"],
    leave_out_seen: bool = False,
    order: Order = "own",
) -> Delivery:
    """Send a rig's images through a network and rebuild the scene from what has arrived at each moment.

    Args:
        rig: one to 200 camera nodes with colour and depth images, intrinsics and given poses.
        network: any network that collects images from fixed nodes.
        coding: name in ``pipeline.delivery.CODINGS``, which decides how images become bytes.
        moments: number of moments at which the scene is rebuilt, after equal shares of the bytes that arrive.
        config: settings of the reconstruction.
        leave_out_seen: whether every node first sends a coarse image, and then leaves out the tiles of which
            the sink tells it that another camera shows them; with the coding ``exact`` and two nodes or more.
        order: ``own`` sends the tiles in the order of the coding; with ``worth``, for the coding ``exact``,
            every node first sends a coarse image, by which the sink requests its depth tiles in the order
            in which they add most to the surface.

    Returns:
        The moments in order of time, with surfaces in metres, times in seconds and energies in joules.

    Raises:
        InputError: the rig, the network or the coding cannot be used; the message gives the reason.

    >>> import packetmesh as pm
    >>> rig = pm.Rig("one node", pm.load_demo("office").frames[:1])
    >>> config = pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=3000"])
    >>> result = pm.deliver(rig, coding="jpeg", moments=2, config=config)
    >>> [moment.surface is not None for moment in result.moments]
    [False, True]
    """
    spec = Spec(LoadedRig(rig), config=config)
    sent = DeliverySpec(spec, network, coding, moments, leave_out_seen=leave_out_seen, order=order)
    return drain(iterate_delivery(sent))


def iterate_delivery(
    spec: DeliverySpec, processes: int = 1, cache: Cache | None = None
) -> Generator[Moment, None, Delivery]:
    """Run ``deliver`` for any source; yields each moment.

    Args:
        spec: the source, the network, the coding, and the number of moments.
        processes: number of moments that are rebuilt in parallel; it does not change the results.
        cache: stored results of stages, such as the rig of a recording; None starts an empty one.

    Yields:
        The moments in order of time; closing the generator cancels those not yet rebuilt.

    Raises:
        InputError: the rig, the network or the coding cannot be used; the message says why.
    """
    cache = cache or RunCache()
    rig = drain(compute(spec.spec, "rig", cache)).value
    sending, moments = send(spec, rig), []
    for moment in _moments(sending, processes):
        moments.append(moment)
        yield moment
    lossless = drain(iterate_reconstruction(lossless_spec(sending), cache))
    return Delivery(sending, tuple(moments), _last(sending, lossless), lossless)


def _moments(sending: Sending, processes: int) -> Iterator[Moment]:
    here = Rebuilder(sending)
    first, *others = range(len(sending.times_ns))
    yield drain(here.moment(first))
    if processes < 2 or len(others) < 2:
        for index in others:
            yield drain(here.moment(index))
        return
    pool = process_pool(processes, _start_worker, sending)
    try:
        yield from pool.map(_moment_in_worker, others)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


_rebuilder: Rebuilder
"""The ``Rebuilder`` of a worker process."""


def _start_worker(sending: Sending) -> None:
    global _rebuilder
    _rebuilder = Rebuilder(sending)


def _moment_in_worker(index: int) -> Moment:
    return drain(_rebuilder.moment(index))


def _last(sending: Sending, lossless: Reconstruction) -> Reconstruction | None:
    """Reconstruct from all that arrived: ``lossless`` if nothing is missing, None if it is too little."""
    frames = frames_at_sink(sending, received_at(sending, int(sending.times_ns[-1])))
    if all(_same(*both) for both in zip(frames, sending.rig.frames, strict=True)):
        return lossless
    present = [index for index, frame in enumerate(frames) if heard(frame)]
    if not present:
        return None
    try:
        return drain(iterate_reconstruction(spec_of(sending, frames, present)))
    except ReconstructionError:
        return None


def _same(one: RgbdFrame, other: RgbdFrame) -> bool:
    return np.array_equal(one.rgb, other.rgb) and np.array_equal(
        one.depth.z_m, other.depth.z_m, equal_nan=True
    )

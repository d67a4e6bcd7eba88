"""Jobs of the measuring tool on the surface that the sink has at a moment of a delivery."""

from __future__ import annotations

from collections.abc import Generator

from app.compute.measures import MeasureAnswer, MeasureRequest
from app.compute.state import Spec
from app.compute.store import Store
from app.measuring.work import answer
from app.screens.network.delivery_job import sending_of
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.delivery.moments import spec_of
from pipeline.delivery.sending import frames_at_sink, received_at
from pipeline.delivery.sink import heard
from pipeline.measuring.surface import MeasuredSurface, surface_of_rig
from pipeline.spec import REBUILD
from pipeline.stages import run


def measure_job(
    store: Store, spec: Spec, request: MeasureRequest, index: int
) -> Generator[Progress, None, MeasureAnswer]:
    """Turn clicks into points of the surface of the moment with this index, and compute measures on it."""
    surface = yield from _surface(store, spec, index)
    return answer([surface], request)


def prepare_job(store: Store, spec: Spec, index: int) -> Generator[Progress, None, bool]:
    """Compute and store the surface of a moment for later measuring. Returns True."""
    yield from _surface(store, spec, index)
    return True


def _surface(store: Store, spec: Spec, index: int) -> Generator[Progress, None, MeasuredSurface]:
    """Return the surface of a moment with the noise of its vertices.

    Raises:
        InputError: no node has been heard by then.
        ReconstructionError: what was heard gives no surface.
    """

    def make() -> Generator[Progress, None, MeasuredSurface]:
        sending = yield from sending_of(store, spec)
        frames = frames_at_sink(sending, received_at(sending, int(sending.times_ns[index])))
        present = [row for row, frame in enumerate(frames) if heard(frame)]
        if not present:
            raise InputError("Nothing has arrived that can be measured; go to a later time")
        chain = spec_of(sending, frames, present)
        results = yield from run(chain, None, REBUILD)
        rig, nodes, placement, after = (
            results[stage].value for stage in ("rig", "nodes", "placement", "after")
        )
        smoothed = chain.config.surface.smoothing_passes > 0
        return surface_of_rig(rig, nodes, placement, after, smoothed)

    return (yield from store.remember(("measured-moment", spec.key("network"), index), make))

"""Jobs of the measuring tool on the surface after fusion."""

from __future__ import annotations

import json
from collections.abc import Generator

from app.compute.measures import MeasureAnswer, MeasureRequest
from app.compute.state import Spec
from app.compute.store import Store
from app.measuring.results import measures_of, surface_to_measure
from app.measuring.work import answer
from packetmesh.progress import Progress


def measure_job(
    store: Store, spec: Spec, request: MeasureRequest
) -> Generator[Progress, None, MeasureAnswer]:
    """Return points of clicks and numbers of measures on the surface after fusion.

    Raises:
        InputError: the reconstruction has no surface.
    """
    surface = yield from surface_to_measure(store, spec)
    return answer([surface], request)


def measures_job(store: Store, spec: Spec) -> Generator[Progress, None, bytes]:
    """Return the spec's measures as JSON."""
    record = yield from measures_of(store, spec)
    return (json.dumps(record, indent=2) + "\n").encode()

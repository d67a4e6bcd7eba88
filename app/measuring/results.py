"""The surface after fusion ready to be measured, and its measures as a record for reports and exports."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from app.compute.measures import Clicked, MeasureAnswer, MeasureRequest, Quantity
from app.compute.state import Spec
from app.compute.store import Store
from app.measuring.labels import name_of
from app.measuring.work import answer
from packetmesh.progress import Progress
from pipeline.measuring.surface import MeasuredSurface, measured_surface
from pipeline.reconstruct import iterate_reconstruction
from pipeline.spec import key


def surface_to_measure(store: Store, spec: Spec) -> Generator[Progress, None, MeasuredSurface]:
    """Return the surface after fusion with the noise of its vertices; made once for its settings.

    Raises:
        InputError: the reconstruction has no surface.
    """

    def make() -> Generator[Progress, None, MeasuredSurface]:
        return measured_surface((yield from iterate_reconstruction(spec, store)))

    return (yield from store.remember(("measured", key(spec, "truth")), make))


def measures_of(store: Store, spec: Spec) -> Generator[Progress, None, dict[str, Any]]:
    """Return the spec's measures as JSON values, in metres, degrees and square metres."""
    surface = yield from surface_to_measure(store, spec)
    tape = spec.tape
    wanted = tuple(taken.unnamed for taken in tape.taken)
    request = MeasureRequest(wanted, Clicked("distance", "surface"), scale=tape.scale)
    return record(spec, answer([surface], request))


def record(spec: Spec, answered: MeasureAnswer) -> dict[str, Any]:
    """Return the answer about a spec's measures as JSON values."""
    made, scaled = dict(answered.made), answered.scaled
    return {
        "scale": answered.scale_source,
        "scaled_by": None if scaled is None else scaled.factor,
        "measures": [
            {
                "name": name_of(number, taken),
                "kind": taken.kind,
                "snap": taken.snap,
                "points_m": [list(point_m) for point_m in taken.points_m],
                "values": [_value(one) for one in made[taken.unnamed].quantities],
                "trouble": made[taken.unnamed].trouble or None,
            }
            for number, taken in enumerate(spec.tape.taken, 1)
        ],
    }


def _value(one: Quantity) -> dict[str, Any]:
    return {
        "name": one.name,
        "value": one.value,
        "unit": one.unit,
        "ci95": [one.low, one.high],
        "guessed": one.guessed,
    }

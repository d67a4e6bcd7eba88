"""The job that sweeps the ball radius, and the radii that the points suggest."""

from __future__ import annotations

from collections.abc import Generator

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.surface.view import SweepView
from packetmesh.progress import Progress
from pipeline.spec import key
from pipeline.stages import cameras_of
from pipeline.surface.advice import suggest_radii
from pipeline.surface.findings import Suggestion
from pipeline.surface.sweep import iterate_sweep, sweep_radii_m


def suggestions_of(store: Store, spec: Spec) -> Generator[Progress, None, tuple[Suggestion, ...]]:
    """Return the radii that the cloud after fusion suggests; none if no point has neighbours on all sides."""
    clouds = yield from store.stage(spec, "fused")

    def suggest() -> Generator[Progress, None, tuple[Suggestion, ...]]:
        yield Progress("computing the ball radius from the points", 0.4)
        return suggest_radii(clouds.fused)

    return (yield from store.remember(("suggest", key(spec, "fused")), suggest))


def sweep_job(store: Store, spec: Spec) -> Generator[Progress | SweepView, None, SweepView]:
    """Roll each ball alone over the cloud after fusion; yields the results so far after each ball."""
    rig, placement, clouds = yield from store.stages(spec, "rig", "placement", "fused")
    suggested = yield from suggestions_of(store, spec)

    def sweep() -> Generator[Progress | SweepView, None, SweepView]:
        radii_m = sweep_radii_m(clouds.r_F_m, [row.radius_m for row in suggested])
        view = SweepView((), clouds.r_F_m, clouds.sigma_D_m, len(radii_m))
        points = iterate_sweep(clouds.fused, radii_m, cameras_of(rig, placement), rig.truth)
        for done, radius_m in enumerate(radii_m):
            yield Progress(f"a ball of {1000 * radius_m:.1f} mm", done / len(radii_m))
            view = SweepView((*view.points, next(points)), view.r_F_m, view.sigma_D_m, view.planned)
            yield view
        return view

    return (yield from store.remember(("sweep", key(spec, "fused")), sweep))

"""The job of the Surface screen: the surfaces before and after fusion."""

from __future__ import annotations

import functools
from collections.abc import Callable, Generator
from dataclasses import replace

import numpy as np

from app.compute.records import MeshView
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.meshes import mesh_view
from app.screens.surface.holes_job import hole_views, parts_of
from app.screens.surface.sweep_job import suggestions_of
from app.screens.surface.unused import POINT_SHARE, unused_view
from app.screens.surface.view import SpacingView, SurfaceView, UnusedView, Which
from packetmesh.progress import Progress
from pipeline.io.textures import Texture
from pipeline.merging import FusedCloud
from pipeline.stages import compute, dressed
from pipeline.surface.fill import without_seams
from pipeline.surface.radii import nearest_distances_m
from pipeline.types import Surface, SurfaceResult

HISTOGRAM_BINS = 60


def surface_job(store: Store, spec: Spec) -> Generator[Progress | SurfaceView, None, SurfaceView]:
    """Return the surfaces before and after fusion with holes and numbers; yields partial results."""
    clouds = yield from store.stage(spec, "fused")
    rolled = yield from compute(spec, "after", store)
    after = rolled.value
    rig, placement = yield from store.stages(spec, "rig", "placement")
    in_photographs = functools.partial(dressed, rig, placement)
    view_after = _textured_view(after, in_photographs)
    size_m = POINT_SHARE * clouds.r_F_m
    unused: dict[Which, UnusedView] = {"after": unused_view(clouds.fused, after, size_m)}
    view = SurfaceView(
        spacing_of(clouds), after.radii_m, view_after, None, rolled.elapsed_s, unused=dict(unused)
    )
    yield view
    before, both = yield from store.stages(spec, "before", "clouds")
    unused["before"] = unused_view(both.sensor, before, size_m)
    view_before = _textured_view(before, in_photographs)
    view = replace(view, before=view_before, unused=unused)
    yield view
    truth_before, truth_after = yield from store.stage(spec, "truth")
    if truth_before or truth_after:
        view = replace(
            view,
            before=replace(view_before, truth=truth_before),
            after=replace(view_after, truth=truth_after),
        )
        yield view
    yield Progress("looking for holes", 0.9)
    return replace(
        view,
        holes={"after": hole_views(after), "before": hole_views(before)},
        parts=(yield from parts_of(store, spec, after)),
        suggestions=(yield from suggestions_of(store, spec)),
    )


def _textured_view(surface: SurfaceResult, in_photographs: Callable[[Surface], Texture]) -> MeshView:
    """Return a surface in photographs; its seams are closed, but their triangles are not counted."""
    closed = without_seams(surface)
    view = mesh_view(closed, None, in_photographs(closed))
    return replace(view, triangles=len(surface.triangles))


def spacing_of(clouds: FusedCloud) -> SpacingView:
    """Return the histogram of the fused cloud's nearest-neighbour distances, from 0 to r_F + 5 sigma_D."""
    r_F_m, sigma_D_m = clouds.r_F_m, clouds.sigma_D_m
    distances_m = nearest_distances_m(clouds.fused.points_m)
    counts, edges_m = np.histogram(distances_m, bins=HISTOGRAM_BINS, range=(0.0, r_F_m + 5 * sigma_D_m))
    return SpacingView(r_F_m, sigma_D_m, edges_m, counts)

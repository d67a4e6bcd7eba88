"""Jobs that draw surfaces in chosen colours, and quick looks while the radius is dragged."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.colors import DISTANCE_STOPS, INFERRED, LOSS, MOST_DISTANCE_M, NEUTRAL, TARGET, ramp
from app.drawing.glb import lines_glb
from app.drawing.meshes import photographed_glb, rim_segments_m, surface_glb
from app.screens.surface.unused import POINT_SHARE, resting_ball_m, unused_view
from app.screens.surface.view import Coloring, PaintedMesh, PaintedView, PaintRequest, Ray, Which
from packetmesh.progress import Progress
from pipeline.kernels.rays import Camera
from pipeline.placement.outcome import Placement
from pipeline.spec import key
from pipeline.stages import cameras_of, dressed, run
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.fill import without_seams
from pipeline.surface.radii import spacing
from pipeline.surface.truth import distances_to_truth_m
from pipeline.surface.voxel import voxel_average, voxel_for_count
from pipeline.types import ByteArray, FloatArray, PointCloud, PointSource, Rig, Surface

PHOTOGRAPHED: tuple[Coloring, ...] = ("photo", "violet", "color")
"""Colourings that contain a camera's light and shadow."""
QUICK_UNUSED = 8_000
"""Most left-out points in a quick look."""


def paint_job(store: Store, spec: Spec, request: PaintRequest) -> Generator[Progress, None, PaintedView]:
    """Return the surfaces of a spec, or of one ball in place of the spec's, in colours."""
    rig, placement = yield from store.stages(spec, "rig", "placement")
    whole = yield from _clouds(store, spec)
    if request.radius_m is None:
        done = yield from run(spec, store, request.which)
        thin, roll_s = whole, done[request.which[0]].elapsed_s
        surfaces: dict[Which, Surface] = {name: done[name].value for name in request.which}
    else:
        thin = yield from _thinned(store, spec, request.most_points)
        started = time.perf_counter()
        surfaces = {name: roll_or_nothing(thin[name], (request.radius_m,)) for name in request.which}
        roll_s = time.perf_counter() - started
    first = request.which[0]
    view = PaintedView(
        request,
        {name: _painted(surface, request, rig, placement) for name, surface in surfaces.items()},
        len(thin[first]),
        len(whole[first]),
        roll_s,
    )
    if request.radius_m is None:
        return view
    spacing_m = yield from _spacing_m(store, spec, request.most_points)
    unused = {
        name: unused_view(thin[name], surface, POINT_SHARE * spacing_m, QUICK_UNUSED)
        for name, surface in surfaces.items()
    }
    return replace(view, unused=unused)


def ball_job(
    store: Store, spec: Spec, request: PaintRequest, ray: Ray
) -> Generator[Progress, None, FloatArray | None]:
    """Return (3,) the centre of a quick look's ball at rest where a ray meets the cloud; None if nowhere."""
    thin = yield from _thinned(store, spec, request.most_points)
    return resting_ball_m(thin[request.which[0]], ray, request.radius_m or 0.0)


def _spacing_m(store: Store, spec: Spec, most_points: int) -> Generator[Progress, None, float]:
    """Return the mean distance of nearest points in the cloud of a quick look."""

    def measure() -> Generator[Progress, None, float]:
        thin = yield from _thinned(store, spec, most_points)
        return spacing(thin["after"].points_m)[0]

    return (yield from store.remember(("spacing", most_points, key(spec, "clouds")), measure))


def _clouds(store: Store, spec: Spec) -> Generator[Progress, None, dict[Which, PointCloud]]:
    clouds = yield from store.stage(spec, "clouds")
    return {"after": clouds.fused, "before": clouds.sensor}


def _thinned(
    store: Store, spec: Spec, most_points: int
) -> Generator[Progress, None, dict[Which, PointCloud]]:
    """Return both clouds with at most about ``most_points`` points."""

    def thin() -> Generator[Progress, None, dict[Which, PointCloud]]:
        clouds = yield from _clouds(store, spec)
        if len(clouds["after"]) <= most_points:
            return clouds
        voxel_m = voxel_for_count(clouds["after"].points_m, most_points)
        return {name: voxel_average(cloud, voxel_m) for name, cloud in clouds.items()}

    return (yield from store.remember(("quick", most_points, key(spec, "clouds")), thin))


def _painted(surface: Surface, request: PaintRequest, rig: Rig, placement: Placement) -> PaintedMesh:
    """Return the surface for the browser; a quick look has no rims or photographs, which draw slowly."""
    quick = request.radius_m is not None
    glb = colored_glb(surface, request.coloring, rig, placement, worn=not quick)
    rims_glb = b"" if quick else lines_glb(rim_segments_m(surface), LOSS)
    return PaintedMesh(glb, rims_glb, len(surface.vertices_m), len(surface.triangles))


def colored_glb(
    surface: Surface, coloring: Coloring, rig: Rig, placement: Placement, worn: bool = True
) -> bytes:
    """Return the mesh in its colours; photographs only if ``worn``."""
    if coloring in ("photo", "violet") and worn:
        closed = without_seams(surface)
        return photographed_glb(closed, dressed(rig, placement, closed), tinted=coloring == "violet")
    colors = vertex_colors(surface, coloring, rig, cameras_of(rig, placement))
    return surface_glb(surface, colors, photographed=coloring in PHOTOGRAPHED)


def vertex_colors(surface: Surface, coloring: Coloring, rig: Rig, cameras: list[Camera]) -> ByteArray | None:
    """Return (V, 3) RGB; grey where the coloured quantity is unknown."""
    count = len(surface.vertices_m)
    if not count or coloring in PHOTOGRAPHED:
        return surface.colors
    if coloring == "source" and surface.source is not None:
        palette = np.array([TARGET, INFERRED], dtype=np.uint8)
        return palette[(surface.source == PointSource.INFERRED).astype(int)]
    if coloring == "normal" and surface.normals is not None:
        return np.rint(127.5 * (surface.normals + 1.0)).astype(np.uint8)
    if coloring == "distance" and rig.truth is not None:
        distance_m = distances_to_truth_m(surface.vertices_m, rig.truth, cameras)
        return ramp(distance_m, MOST_DISTANCE_M, DISTANCE_STOPS)
    return np.tile(np.array(NEUTRAL, dtype=np.uint8), (count, 1))

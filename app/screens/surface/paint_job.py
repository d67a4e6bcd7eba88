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
    """Return the surfaces of a spec, or of one ball in place of the spec's, in the requested colours."""
    rig, placement = yield from store.stages(spec, "rig", "placement")
    whole = yield from _clouds(store, spec)
    first = request.which[0]

    def painted(surfaces: dict[Which, Surface], thin: dict[Which, PointCloud], roll_s: float) -> PaintedView:
        meshes = {name: _painted(surface, request, rig, placement) for name, surface in surfaces.items()}
        return PaintedView(request, meshes, len(thin[first]), len(whole[first]), roll_s)

    if request.radius_m is None:
        done = yield from run(spec, store, request.which)
        return painted({name: done[name].value for name in request.which}, whole, done[first].elapsed_s)
    count = yield from _count(store, spec, request)
    thin = yield from _thinned(store, spec, count)
    started = time.perf_counter()
    surfaces = {name: roll_or_nothing(thin[name], (request.radius_m,)) for name in request.which}
    view = painted(surfaces, thin, time.perf_counter() - started)
    spacing_m = yield from _spacing_m(store, spec, count)
    unused = {
        name: unused_view(thin[name], surface, POINT_SHARE * spacing_m, QUICK_UNUSED)
        for name, surface in surfaces.items()
    }
    return replace(view, unused=unused)


def ball_job(
    store: Store, spec: Spec, request: PaintRequest, ray: Ray
) -> Generator[Progress, None, FloatArray | None]:
    """Return (3,) the centre of a quick look's ball at rest where a ray meets the cloud; None if nowhere."""
    thin = yield from _thinned(store, spec, (yield from _count(store, spec, request)))
    return resting_ball_m(thin[request.which[0]], ray, request.radius_m or 0.0)


def _clouds(store: Store, spec: Spec) -> Generator[Progress, None, dict[Which, PointCloud]]:
    clouds = yield from store.stage(spec, "clouds")
    return {"after": clouds.fused, "before": clouds.sensor}


def _count(store: Store, spec: Spec, request: PaintRequest) -> Generator[Progress, None, int]:
    """Return the number of points to which a quick look thins the cloud after fusion.

    It is ``most_points``, doubled until the voxel's edge is at most the ball's radius: with larger voxels the
    ball falls through where it rests on all points, and the look would show holes that are not there.
    With as many points as the cloud has, it is not thinned.
    """
    whole = yield from _clouds(store, spec)
    count = request.most_points
    while count < len(whole["after"]) and (yield from _voxel_m(store, spec, count)) > (request.radius_m or 0):
        count *= 2
    return count


def _voxel_m(store: Store, spec: Spec, count: int) -> Generator[Progress, None, float]:
    """Return the edge of the voxels that thin the cloud after fusion to about ``count`` points."""

    def measure() -> Generator[Progress, None, float]:
        whole = yield from _clouds(store, spec)
        return voxel_for_count(whole["after"].points_m, count)

    return (yield from store.remember(("voxel", count, key(spec, "clouds")), measure))


def _thinned(store: Store, spec: Spec, count: int) -> Generator[Progress, None, dict[Which, PointCloud]]:
    """Return both clouds in the voxels that thin the one after fusion to about ``count`` points."""

    def thin() -> Generator[Progress, None, dict[Which, PointCloud]]:
        clouds = yield from _clouds(store, spec)
        if len(clouds["after"]) <= count:
            return clouds
        voxel_m = yield from _voxel_m(store, spec, count)
        return {name: voxel_average(cloud, voxel_m) for name, cloud in clouds.items()}

    return (yield from store.remember(("quick", count, key(spec, "clouds")), thin))


def _spacing_m(store: Store, spec: Spec, count: int) -> Generator[Progress, None, float]:
    """Return the mean distance of nearest points in the cloud after fusion, thinned to ``count`` points."""

    def measure() -> Generator[Progress, None, float]:
        thin = yield from _thinned(store, spec, count)
        return spacing(thin["after"].points_m)[0]

    return (yield from store.remember(("spacing", count, key(spec, "clouds")), measure))


def _painted(surface: Surface, request: PaintRequest, rig: Rig, placement: Placement) -> PaintedMesh:
    """Return the surface for the browser; a quick look has no rims or photographs, which draw slowly."""
    quick = request.radius_m is not None
    glb = colored_glb(surface, request.coloring, rig, placement, worn=not quick)
    rims_glb = b"" if quick else lines_glb(rim_segments_m(surface), LOSS)
    return PaintedMesh(glb, rims_glb, len(surface.triangles))


def colored_glb(
    surface: Surface, coloring: Coloring, rig: Rig, placement: Placement, worn: bool = True
) -> bytes:
    """Return the mesh in its colours as binary glTF; with photographs only if ``worn``."""
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

"""Jobs on the holes of a surface: their places, their causes, and the result of filling them."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.colors import HOLE, NEUTRAL
from app.drawing.meshes import mesh_view, surface_glb
from app.screens.surface.view import ExplainView, FilledView, HoleView, Which
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.spec import key
from pipeline.stages import cameras_of, compared, with_rays
from pipeline.surface.fill import Filled, fill_holes
from pipeline.surface.findings import RayParts
from pipeline.surface.hole_diagnosis import explain_hole
from pipeline.surface.holes import find_holes
from pipeline.surface.ray_parts import View, ray_parts
from pipeline.types import SurfaceResult


def hole_views(surface: SurfaceResult) -> tuple[HoleView, ...]:
    """Return the holes of a surface in the order of ``find_holes``."""
    return tuple(
        HoleView(
            loop_m=surface.vertices_m[hole.loop].astype(np.float32),
            length_m=hole.length_m,
            area_m2=hole.area_m2,
            center_m=hole.center_m,
            rim=not hole.open,
        )
        for hole in find_holes(surface.vertices_m, surface.triangles)
    )


def views_of(store: Store, spec: Spec) -> Generator[Progress, None, list[View]]:
    """Return every registered camera with the pixels that have sensor depth and those with inferred depth."""
    rig, nodes, placement = yield from store.stages(spec, "rig", "nodes", "placement")
    return [
        View(camera, frame.depth.valid, node.alignment.depth.valid)
        for camera, frame, node in zip(
            cameras_of(rig, placement), placement.placed(rig.frames), placement.placed(nodes), strict=True
        )
    ]


def parts_of(store: Store, spec: Spec, surface: SurfaceResult) -> Generator[Progress, None, RayParts]:
    """Return the shares of the cameras' pixel rays by where they end on a surface of the spec."""
    views = yield from views_of(store, spec)
    return ray_parts(surface, views)


def explain_job(store: Store, spec: Spec, which: Which, index: int) -> Generator[Progress, None, ExplainView]:
    """Return the cause of one hole of the surface after or before fusion.

    Raises:
        InputError: the surface has no hole with this index.
    """

    def explain() -> Generator[Progress, None, ExplainView]:
        views = yield from views_of(store, spec)
        clouds, surface = yield from store.stages(spec, "clouds", which)
        yield Progress("looking for the cause of the hole", 0.8)
        holes = find_holes(surface.vertices_m, surface.triangles)
        if not 0 <= index < len(holes):
            raise InputError(
                f"There is no hole {index + 1} on the surface {which} fusion, which has {len(holes)} holes "
                "and rims; choose one from the list"
            )
        cloud = clouds.fused if which == "after" else clouds.sensor
        return ExplainView(which, index, explain_hole(holes[index], surface, cloud, views))

    return (yield from store.remember(("explain", key(spec, which), which, index), explain))


def fill_job(store: Store, spec: Spec, longest_cm: float) -> Generator[Progress, None, FilledView]:
    """Fill the holes of the surface after fusion up to this rim length, and measure the result."""
    rig, placement, after = yield from store.stages(spec, "rig", "placement", "after")
    yield Progress("filling small holes", 0.6)
    filled = fill_holes(after, longest_cm / 100.0)
    yield Progress("measuring the filled surface", 0.8)
    surface = with_rays(filled.surface, rig, placement)
    view = mesh_view(surface, compared(rig, placement, surface))
    return FilledView(replace(view, glb=_marked_glb(filled)), filled.holes, filled.area_m2)


def _marked_glb(filled: Filled) -> bytes:
    """Return the surface as binary glTF, with all triangles that fill holes in one colour.

    Each of them gets its own three vertices, so that its colour does not spread to its neighbours.
    """
    surface = filled.surface
    count, corners = len(surface.vertices_m), surface.triangles[filled.filled].ravel()
    own = count + np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    known = np.tile(np.array(NEUTRAL, np.uint8), (count, 1)) if surface.colors is None else surface.colors
    normals = surface.normals
    marked = replace(
        surface,
        vertices_m=np.concatenate([surface.vertices_m, surface.vertices_m[corners]]),
        triangles=np.concatenate([surface.triangles[~filled.filled], own]),
        normals=None if normals is None else np.concatenate([normals, normals[corners]]),
    )
    invented = np.tile(np.array(HOLE, np.uint8), (len(corners), 1))
    return surface_glb(marked, np.concatenate([known, invented]), photographed=True)

"""The job that looks for a camera which would close a hole."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.compute.seen_places import place_of
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.surface.view import ClosingCamera, ClosingView, Which
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress, part
from pipeline.planning.hole_targets import hole_targets
from pipeline.planning.plan import PlanConfig, iterate_candidates, plan_of
from pipeline.planning.sensors import AS_PRESENT, sensor_named
from pipeline.surface.holes import find_holes


def closing_job(store: Store, spec: Spec, which: Which, index: int) -> Generator[Progress, None, ClosingView]:
    """Return the camera that would measure most of a hole of the surface after or before fusion."""
    try:
        camera = yield from _camera(store, spec, which, index)
    except PacketMeshError as error:
        return ClosingView(which, index, None, str(error))
    return ClosingView(which, index, camera)


def _camera(store: Store, spec: Spec, which: Which, index: int) -> Generator[Progress, None, ClosingCamera]:
    place = yield from part(place_of(store, spec), "the present cameras", 0.0, 0.6, detail=True)
    surface = place.done.after if which == "after" else place.done.before
    holes = find_holes(surface.vertices_m, surface.triangles)
    if not 0 <= index < len(holes):
        raise InputError(
            f"There is no hole {index + 1} on the surface {which} fusion; choose one from the list"
        )
    targets = hole_targets(surface, holes[index], place.seen.views, surface.radii_m[-1])
    seen = replace(place.seen, targets=targets)
    sensor = sensor_named(AS_PRESENT, place.done.rig)
    judged = yield from part(iterate_candidates(seen, sensor), "judging places", 0.6, 1.0, detail=True)
    (camera,) = plan_of(seen, judged, sensor, PlanConfig()).cameras
    row = next(k for k, one in enumerate(judged.candidates) if one.T_world_camera is camera.T_world_camera)
    lens = sensor.intrinsics
    return ClosingCamera(
        camera.T_world_camera,
        camera.where,
        float(camera.T_world_camera[2, 3] - place.floor_m),
        camera.promise.gain_share,
        camera.promise.dark_share,
        camera.overlap_share,
        2.0 * float(np.arctan2(0.5 * lens.height_px, lens.fy_px)),
        lens.width_px / lens.height_px,
        targets.points_m.astype(np.float32),
        judged.chance[row],
        targets.dark_return > 0.0,
    )

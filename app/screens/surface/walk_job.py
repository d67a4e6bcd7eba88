"""The job that records a ball's walk: pivot by pivot on a patch, or in batches over all points."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.surface.walk_view import Happening, WalkRequest, WalkView
from packetmesh.progress import Progress
from pipeline.spec import key
from pipeline.surface.pivoting import roll
from pipeline.surface.radii import radii
from pipeline.surface.walk import Kind, Walk, ball_on_arc, hole_on_flat_ground, iterate_walk, nearest_rows
from pipeline.types import PointCloud

PATCH_POINTS = 550
PLACES = 10
"""Positions of the ball on one arc."""
BATCHES = 170
HAPPENINGS: dict[int, Happening] = {Kind.SEED: "seed", Kind.JOIN: "join", Kind.GLUE: "glue"}


def walk_job(store: Store, spec: Spec, request: WalkRequest) -> Generator[Progress, None, WalkView]:
    """Roll the spec's balls and record every step.

    Raises:
        InputError: the cloud has no points.
        ReconstructionError: no ball finds three points to rest on.
    """
    clouds = yield from store.stage(spec, "clouds")
    radii_m = radii(spec.config.surface, clouds.r_F_m, clouds.sigma_D_m)
    cloud = clouds.fused if request.which == "after" else clouds.sensor

    def walk() -> Generator[Progress, None, WalkView]:
        yield Progress("choosing a patch of the cloud", 0.0)
        return (yield from walk_over(cloud, radii_m, request))

    return (yield from store.remember(("walk", key(spec, "after"), request), walk))


def walk_over(
    cloud: PointCloud, radii_m: tuple[float, ...], request: WalkRequest
) -> Generator[Progress, None, WalkView]:
    """Return the ball's walk over a cloud with normals, or over a patch of it; raises like ``walk_job``."""
    if request.close_up:
        triangles = roll(cloud.points_m, cloud.normals, radii_m).triangles
        assert cloud.normals is not None  # or the ball would not have rolled
        center_m = hole_on_flat_ground(cloud.points_m, cloud.normals, triangles, PATCH_POINTS)
        cloud = cloud.select(nearest_rows(cloud.points_m, center_m, PATCH_POINTS))
    batch = 1 if request.close_up else max(1, 2 * len(cloud) // BATCHES)
    walk = yield from iterate_walk(cloud.points_m, cloud.normals, radii_m, batch)
    return _view_of(cloud, walk, request)


def _view_of(cloud: PointCloud, walk: Walk, request: WalkRequest) -> WalkView:
    assert cloud.normals is not None  # or the ball would not have rolled
    last = walk.step_ends - 1
    if request.close_up:
        shares = np.arange(1, PLACES + 1) / PLACES
        places_m = np.stack([ball_on_arc(walk, last, share) for share in shares], axis=1)
        idle = np.diff(walk.step_ends, prepend=0) == 0
        places_m[idle] = walk.ball_centers_m[last[idle], None]
        kinds = np.where(idle, -1, walk.kind[last]).tolist()
        happenings = tuple(HAPPENINGS.get(kind, "end") for kind in kinds)
    else:
        places_m, happenings = walk.ball_centers_m[last, None], ()
    center_m = np.median(cloud.points_m, axis=0)
    outward = cloud.normals.mean(axis=0)
    return WalkView(
        request,
        cloud.points_m.astype(np.float32),
        cloud.colors,
        walk.triangles.astype(np.int32),
        walk.radii_m,
        walk.step_ends.astype(np.int32),
        walk.step_radius,
        places_m.astype(np.float32),
        happenings,
        walk.glued_by,
        walk.left_front.astype(np.uint16),
        center_m,
        float(np.linalg.norm(cloud.points_m - center_m, axis=1).max()),
        outward / max(float(np.linalg.norm(outward)), 1e-9),
    )

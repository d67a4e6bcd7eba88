"""Other methods over the cloud that the ball rolls over after fusion."""

from __future__ import annotations

import time
from collections.abc import Generator, Hashable
from dataclasses import replace

from app.chain import BallClouds, ball_clouds, cameras_of, compared, placed, rig_of
from app.drawing.meshes import mesh_view
from app.screens.surface.baselines_view import BaselineName, BaselineView
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.surface import radii
from pipeline.surface.baselines import TRIM_SPACINGS, alpha_surface, poisson_depth, poisson_surface
from pipeline.surface.quality import no_hit_ray_share
from pipeline.types import SurfaceResult

TITLES: dict[BaselineName, str] = {"poisson": "Poisson reconstruction", "alpha": "the alpha shape"}


def baseline_job(store: Store, spec: Spec, name: BaselineName) -> Generator[Progress, None, BaselineView]:
    """The surface of another method, measured as the ball's is.

    Raises:
        InputError: a method that there is not.
        ReconstructionError: the method finds no surface.
    """
    if name not in TITLES:
        raise InputError(f"There is no baseline '{name}'; try one of {', '.join(TITLES)}.")
    rig = yield from rig_of(store, spec)
    places = yield from placed(store, spec)
    clouds = yield from ball_clouds(store, spec)
    largest_m = radii(spec.config.surface, clouds.spacing.r_F_m, clouds.spacing.sigma_D_m)[-1]

    def make() -> Generator[Progress, None, BaselineView]:
        yield Progress(f"making {TITLES[name]}", 0.2)
        started = time.perf_counter()
        surface, note = _surface(clouds, name, largest_m)
        elapsed_s = time.perf_counter() - started
        yield Progress("counting the rays that miss", 0.7)
        cameras = cameras_of(rig, places)
        missed = no_hit_ray_share(surface.vertices_m, surface.triangles, cameras)
        surface = replace(surface, quality=replace(surface.quality, no_hit_ray_share=missed))
        yield Progress("comparing with the truth", 0.9)
        return BaselineView(name, mesh_view(surface, compared(rig, surface, cameras)), elapsed_s, note)

    return (yield from store.remember(_key(spec, name, largest_m), make))


def _key(spec: Spec, name: BaselineName, largest_m: float) -> tuple[Hashable, ...]:
    """Poisson does not depend on the ball."""
    surface = spec.config.surface
    thinning = (surface.max_points, surface.smoothing_passes)
    return (f"baseline {name}", *spec.key("fuse"), *thinning, largest_m if name == "alpha" else None)


def _surface(clouds: BallClouds, name: BaselineName, largest_m: float) -> tuple[SurfaceResult, str]:
    """The surface, and a sentence on how it was made."""
    if name == "alpha":
        return alpha_surface(clouds.fused, largest_m), (
            f"Open3D's alpha shape (Edelsbrunner and Mücke 1994) with alpha {100 * largest_m:.3g} cm, the "
            "radius of the largest ball: it bounds the small tetrahedra only, so a rough wall is a slab with "
            "two sides and a smooth wall has gaps, which the full alpha shape would not have."
        )
    spacing_m = clouds.spacing.r_F_m
    return poisson_surface(clouds.fused, spacing_m), (
        "Screened Poisson reconstruction (Kazhdan and Hoppe 2013) with an octree of depth "
        f"{poisson_depth(clouds.fused.points_m, spacing_m)} for a point spacing of {100 * spacing_m:.3g} cm, "
        f"cut off farther than {100 * TRIM_SPACINGS * spacing_m:.3g} cm from the points."
    )

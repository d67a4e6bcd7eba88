"""The job that computes another method's surface over the cloud after fusion."""

from __future__ import annotations

from collections.abc import Generator
from typing import get_args

from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.meshes import mesh_view
from app.screens.surface.view import BaselineName, BaselineView
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.merging import FusedCloud
from pipeline.stages import compared, compute
from pipeline.surface.baselines import TRIM_SPACINGS, poisson_depth
from pipeline.surface.radii import radii


def baseline_job(store: Store, spec: Spec, name: BaselineName) -> Generator[Progress, None, BaselineView]:
    """Return the surface of another method, measured like the ball's surface.

    Raises:
        InputError: the method is unknown.
        ReconstructionError: the method finds no surface.
    """
    if name not in get_args(BaselineName):
        raise InputError(f"There is no baseline '{name}'; try one of {', '.join(get_args(BaselineName))}.")
    clouds, rig, placement = yield from store.stages(spec, "fused", "rig", "placement")
    done = yield from compute(spec, name, store)
    truth = compared(rig, placement, done.value)
    return BaselineView(name, mesh_view(done.value, truth), done.elapsed_s, _note(clouds, name, spec))


def _note(clouds: FusedCloud, name: BaselineName, spec: Spec) -> str:
    """Return a sentence on how the surface was made."""
    if name == "alpha":
        largest_m = radii(spec.config.surface, clouds.r_F_m, clouds.sigma_D_m)[-1]
        return (
            f"Open3D's alpha shape (Edelsbrunner and Mücke 1994) with alpha {100 * largest_m:.3g} cm, the "
            "radius of the largest ball: it keeps only faces of small tetrahedra, so a rough wall "
            "becomes a slab with two sides, and a smooth wall has holes that the full alpha shape would "
            "not have."
        )
    return (
        "Screened Poisson reconstruction (Kazhdan and Hoppe 2013) with an octree of depth "
        f"{poisson_depth(clouds.fused.points_m, clouds.r_F_m)} for a point spacing of "
        f"{100 * clouds.r_F_m:.3g} cm, cut off farther than {100 * TRIM_SPACINGS * clouds.r_F_m:.3g} cm from "
        "the points."
    )

"""Knowledge of the present cameras about a place, from which candidates for new cameras are judged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, guessed_triangles, triangle_scene
from pipeline.planning.space import FreeSpace, free_space
from pipeline.planning.targets import Targets, targets_at, targets_of
from pipeline.planning.views import Meets, PresentView, view_of
from pipeline.reconstruct import Reconstruction
from pipeline.types import BoolArray, Surface


@dataclass(frozen=True, slots=True)
class SeenPlace:
    """Everything by which a candidate for a new camera is judged."""

    surface: Surface
    whole: o3d.t.geometry.RaycastingScene
    """All triangles."""
    measured: o3d.t.geometry.RaycastingScene
    """Triangles without the guessed ones."""
    guessed: BoolArray
    """(F,) True for guessed triangles."""
    views: tuple[PresentView, ...]
    """View of each registered camera."""
    targets: Targets
    space: FreeSpace
    measured_share: float
    """Share of the present cameras' rays on measured surface."""


def without_dark(seen: SeenPlace) -> SeenPlace:
    """Return the place without those targets that look dark to a present sensor."""
    return replace(seen, targets=targets_at(seen.targets, seen.targets.dark_return == 0.0))


def seen_place(done: Reconstruction) -> SeenPlace:
    """Collect what a reconstruction knows of its place.

    Raises:
        InputError: the surface after fusion has no triangles, so that no camera can be judged.
    """
    surface = done.after
    if not len(surface.triangles):
        raise InputError(
            "The fused cloud has no surface, so no place for a camera can be judged; try a larger ball radius"
        )
    source = surface.source
    guessed = (
        np.zeros(len(surface.triangles), bool)
        if source is None
        else guessed_triangles(surface.triangles, source)
    )
    whole = triangle_scene(surface.vertices_m, surface.triangles)
    nodes = done.placement.placed(done.nodes)
    poses = done.placement.placed(done.placement.T_world_camera)
    views = tuple(
        view_of(whole, guessed, node, Camera(node.frame.intrinsics, T))
        for node, T in zip(nodes, poses, strict=True)
    )
    rays = sum(int((view.meets != Meets.NO_RAY).sum()) for view in views)
    return SeenPlace(
        surface,
        whole,
        triangle_scene(surface.vertices_m, surface.triangles[~guessed]),
        guessed,
        views,
        targets_of(views),
        free_space(surface.vertices_m, views),
        sum(int((view.meets == Meets.MEASURED).sum()) for view in views) / rays,
    )

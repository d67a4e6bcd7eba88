"""Ray casting with Embree: first intersections of rays, the parts they hit, and shadow tests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lab.worlds import shading
from lab.worlds.primitives import merged
from lab.worlds.scene import Part, Scene
from pipeline.kernels.geometry import apply
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Hits:
    """The first intersections of N rays with the scene."""

    t: FloatArray
    """(N,) ray parameter: distance to the hit in lengths of the ray's direction; infinite for a miss."""
    positions: FloatArray
    """(N, 3) in the world frame, metres; zero for a miss."""
    normals: FloatArray
    """(N, 3) unit shading normals towards the ray's origin; zero for a miss."""
    view: FloatArray
    """(N, 3) unit direction of the ray, from its origin."""
    part: IntArray
    """(N,) index of the part, -1 for a miss."""

    def select(self, rows: IntArray) -> Hits:
        """Return the hits of the rays with these indices."""
        return Hits(self.t[rows], self.positions[rows], self.normals[rows], self.view[rows], self.part[rows])


class RayCaster:
    """Casts rays, (N, 6) float32 origins and directions in the world frame.

    Args:
        scene: parts with emission do not block light, so that lamps shine through shades.
        threads: Embree threads; 0 takes all cores.
    """

    def __init__(self, scene: Scene, threads: int = 0) -> None:
        self._parts = scene.parts
        self._threads = threads
        self._meshes = [_world_mesh(part) for part in scene.parts]
        self._corner_normals = np.concatenate([normals for _, _, normals in self._meshes])
        counts = [len(triangles) for _, triangles, _ in self._meshes]
        self._triangle_part = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        self._all = _embree(self._meshes)

    @cached_property
    def _opaque(self) -> o3d.t.geometry.RaycastingScene:
        """Return the ray-casting scene of the parts that cast shadows."""
        pairs = zip(self._meshes, self._parts, strict=True)
        return _embree([mesh for mesh, part in pairs if part.material.emission <= 0.0])

    def cast(self, rays: FloatArray) -> Hits:
        """Return the first intersection of each ray."""
        answer = self._all.cast_rays(tensor(rays, np.float32), nthreads=self._threads)
        t, triangle = answer["t_hit"].numpy(), answer["primitive_ids"].numpy()
        positions, normals, view = np.zeros((3, len(t), 3), np.float32)
        barycentric = answer["primitive_uvs"].numpy()
        shading.interpolate_hits(
            rays, t, triangle, barycentric, self._corner_normals, positions, normals, view
        )
        seen = np.isfinite(t)
        part = np.where(seen, self._triangle_part[np.where(seen, triangle, 0)], -1)
        return Hits(t, positions, normals, view, part)

    def occluded(self, rays: FloatArray, t_far: float) -> BoolArray:
        """Return (N,) True where a part that casts shadows is met at a ray parameter below ``t_far``."""
        cast = tensor(rays, np.float32)
        return self._opaque.test_occlusions(cast, 0.0, t_far, nthreads=self._threads).numpy()


def world_mesh(scene: Scene) -> tuple[FloatArray, IntArray]:
    """Return (V, 3) vertices in the world frame and (F, 3) triangles of all parts."""
    return merged([(apply(part.T_world_part, part.vertices_m), part.triangles) for part in scene.parts])


_ShadedMesh = tuple[FloatArray, IntArray, FloatArray]


def _world_mesh(part: Part) -> _ShadedMesh:
    """Return world vertices, triangles, and (F, 3, 3) shading normals at the corners of the triangles."""
    vertices = apply(part.T_world_part, part.vertices_m)
    triangles = np.ascontiguousarray(part.triangles)
    return vertices, triangles, shading.corner_normals(vertices, triangles, part.smooth)


def _embree(meshes: list[_ShadedMesh]) -> o3d.t.geometry.RaycastingScene:
    solids = [(vertices, triangles) for vertices, triangles, _ in meshes]
    return triangle_scene(*merged(solids)) if solids else o3d.t.geometry.RaycastingScene()

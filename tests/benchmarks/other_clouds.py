"""Surfaces of clouds as others have them: points alone, unevenly sampled, with outliers.

``python tests/benchmarks/other_clouds.py`` prints what `packetmesh mesh` makes of each cloud, what the rule
r_F + {0, 1, 2, 4} sigma_D makes of it with the same normals, and Open3D and MeshLab with their usual radii:
the area over the true one, facets on the side of most true normals, points that no facet uses, loops of the
boundary, seconds. The seeds of these clouds had no part in choosing any number.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymeshlab
from scipy.spatial import cKDTree

from packetmesh.progress import drain
from pipeline.config import SurfaceConfig
from pipeline.kernels.open3d_runtime import o3d
from pipeline.surface.boundary import boundary_loops
from pipeline.surface.mesh_cloud import MeshOptions, iterate_mesh_cloud
from pipeline.surface.radii import radii, spacing
from pipeline.types import PointCloud, Surface

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.pipeline.surface.shapes import lidar_room, sphere, torus_knot, with_outliers

SEED = 77
TIMES_SPACING = (1.0, 2.0, 4.0)
"""Open3D's tutorial takes multiples of the mean distance to the nearest point."""


def ours(cloud: PointCloud) -> Surface:
    """`packetmesh mesh`."""
    return drain(iterate_mesh_cloud(cloud, MeshOptions())).surface


def by_rule(cloud: PointCloud) -> Surface:
    """The same with r_F + {0, 1, 2, 4} sigma_D."""
    chosen = radii(SurfaceConfig("thesis+"), *spacing(cloud.points_m))
    return drain(iterate_mesh_cloud(cloud, MeshOptions(radii_m=chosen))).surface


def open3d(cloud: PointCloud) -> Surface:
    """Its normals, turned along its spanning tree, and its ball pivoting."""
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    points.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
    points.orient_normals_consistent_tangent_plane(20)
    r_F_m = spacing(cloud.points_m)[0]
    chosen = o3d.utility.DoubleVector([times * r_F_m for times in TIMES_SPACING])
    mesh = o3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(points, chosen)
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.triangles))


def meshlab(cloud: PointCloud) -> Surface:
    """Its normals and its ball pivoting, whose radius it chooses by itself."""
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud.points_m))
    meshes.compute_normal_for_point_clouds(k=20)
    meshes.generate_surface_reconstruction_ball_pivoting()
    mesh = meshes.current_mesh()
    return Surface(mesh.vertex_matrix(), mesh.face_matrix())


PROGRAMS: dict[str, Callable[[PointCloud], Surface]] = {
    "packetmesh": ours,
    "r_F rule": by_rule,
    "Open3D": open3d,
    "MeshLab": meshlab,
}
KNOT_M2 = 0.35 * 2.0 * np.pi * 31.8986  # the tube's circumference times the knot's length
ROOM_M2 = 120.59  # of the walls, between the lowest and the highest ring
CLOUDS: dict[str, tuple[PointCloud, PointCloud, float]] = {
    "sphere": (ball := sphere(6000), ball, 4.0 * np.pi),
    "knot": (knot := torus_knot(12_000, 0.35, seed=SEED), knot, KNOT_M2),
    "noisy knot": (torus_knot(12_000, 0.35, 0.01, SEED), knot, KNOT_M2),
    "knot, 5 % outliers": (with_outliers(knot, 0.05, SEED), knot, KNOT_M2),
    "16 rings": (rings := lidar_room(16, 0.01, SEED), rings, ROOM_M2),
    "64 rings": (rings := lidar_room(64, 0.01, SEED), rings, ROOM_M2),
}
"""Clouds, points that know their normals, and the area of the surface."""


def outward_share(surface: Surface, truth: PointCloud) -> float:
    """Of the facets: how many have the true normal of the nearest point on their side."""
    corners_m = surface.vertices_m[surface.triangles]
    normals = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    _, nearest = cKDTree(truth.points_m).query(corners_m.mean(axis=1), workers=-1)
    assert truth.normals is not None
    return float((np.sum(normals * truth.normals[nearest], axis=1) > 0.0).mean())


def area_m2(surface: Surface) -> float:
    """Of all facets."""
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def main() -> None:
    """Measure and print."""
    print(f"{'':20}{'':12}{'area':>8}{'outwards':>10}{'unused':>8}{'holes':>7}{'s':>7}")
    for name, (points, truth, true_m2) in CLOUDS.items():
        cloud = PointCloud(points.points_m)
        for program, run in PROGRAMS.items():
            started = time.perf_counter()
            surface = run(cloud)
            elapsed_s = time.perf_counter() - started
            outwards = max(share := outward_share(surface, truth), 1.0 - share)  # either side of all
            unused = 1.0 - len(np.unique(surface.triangles)) / len(cloud)
            holes = len(boundary_loops(surface.triangles))
            share = area_m2(surface) / true_m2
            print(
                f"{name:20}{program:12}{share:8.1%}{outwards:10.1%}{unused:8.1%}{holes:7}{elapsed_s:7.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()

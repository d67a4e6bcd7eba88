"""``packetmesh mesh``: a mesh from a point cloud by a rolling ball."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.text import mesh_lines, print_json, say, say_progress, wrong_use
from packetmesh.progress import drain


def mesh(
    cloud: Annotated[Path, tyro.conf.Positional],
    out: Path,
    radii_m: Literal["auto"] | tuple[float, ...] = "auto",
    viewpoint: tuple[float, float, float] | None = None,
    max_points: int | None = None,
    smoothing_passes: int = 0,
    metres_per_unit: float = 1.0,
    json: bool = False,
) -> None:
    """Roll a ball over a point cloud (PLY, PCD, LAS, E57, NPY, text, the vertices of models), in metres.

    Args:
        cloud: The points, with or without normals.
        out: The mesh: a .ply, .obj, .glb or .stl file.
        radii_m: Radii of the ball; `auto` takes them from the distances of the points.
        viewpoint: Where the camera was, X Y Z; normals are turned there. Without it normals stay as they
            are, or point outwards if there are none.
        max_points: Thin the cloud to about so many points first; all are used without it.
        smoothing_passes: How often every point is moved onto the plane of its neighbours.
        metres_per_unit: Of the coordinates in the file: 0.001 if they are millimetres.
        json: Print the quality of the mesh as one JSON object.
    """
    from pipeline.surface.mesh_cloud import MeshOptions, iterate_mesh_file

    if radii_m == ():
        wrong_use("--radii-m needs at least one radius, or auto")
    given_m = None if radii_m == "auto" else radii_m
    options = MeshOptions(given_m, viewpoint, max_points, smoothing_passes, metres_per_unit)
    steps = iterate_mesh_file(cloud, out, options)
    report = drain(steps, say_progress)
    if json:
        print_json(report)
    else:
        say(mesh_lines(report))

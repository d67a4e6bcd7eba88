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
    metres_per_unit: float | None = None,
    estimate_normals: bool = False,
    columns: str | None = None,
    json: bool = False,
) -> None:
    """Roll a ball over a point cloud (PLY, PCD, LAS, E57, NPY, text, the vertices of models), in metres.

    Args:
        cloud: The points, with or without normals.
        out: The mesh: a .ply, .obj, .glb or .stl file.
        radii_m: Radii of the balls; `auto` derives them from the spacing of the points.
        viewpoint: Position of the camera, X Y Z; normals are turned towards it. Without it, normals stay as
            they are, or point outwards if the cloud has none.
        max_points: Thin the cloud to about this many points first; without it, all points are used.
        smoothing_passes: How often every point is moved onto the plane of its neighbours.
        metres_per_unit: Metres per unit of the coordinates in the file: 0.001 for millimetres. Without it,
            the unit is the one in the column titles of a text file or in the coordinate system of a LAS
            file, or else the metre.
        estimate_normals: Ignore the normals in the file and estimate them from the points.
        columns: Columns of a text, .npy or .bin file, such as x,y,z,_,r,g,b with _ for a column that is not
            used; without it, they are found in the file.
        json: Print the quality of the mesh as one JSON object.
    """
    from pipeline.folders.inputs import check_inputs_stay
    from pipeline.surface.mesh_cloud import MeshOptions, iterate_mesh_file

    if radii_m == ():
        wrong_use("--radii-m needs at least one radius, or auto")
    if out.is_file():
        check_inputs_stay([out], [cloud])
    given_m = None if radii_m == "auto" else radii_m
    options = MeshOptions(
        given_m, viewpoint, max_points, smoothing_passes, metres_per_unit, estimate_normals, columns
    )
    steps = iterate_mesh_file(cloud, out, options)
    report = drain(steps, say_progress)
    if json:
        print_json(report)
    else:
        say(mesh_lines(report))

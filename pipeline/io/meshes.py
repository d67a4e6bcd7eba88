"""Triangle meshes as PLY, GLB, OBJ and STL files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, atomic_path, read_bytes
from pipeline.geometry import rigid
from pipeline.types import AnyPath, ByteArray, FloatArray, IntArray

MESH_SUFFIXES = (".ply", ".glb", ".obj", ".stl")
_T_GLTF_WORLD = rigid(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), np.zeros(3))
"""glTF has y up and the world frame z; the file's root node carries this rotation."""


class Mesh(NamedTuple):
    """What a mesh file holds."""

    vertices_m: FloatArray
    """(V, 3) float64."""
    triangles: IntArray
    """(F, 3) int32."""
    colors: ByteArray | None
    """(V, 3) RGB."""


def write_mesh(
    path: AnyPath, vertices_m: FloatArray, triangles: IntArray, colors: ByteArray | None = None
) -> None:
    """Write a mesh in the format of the suffix.

    Args:
        path: ends in .ply (binary), .glb, .obj or .stl (binary, which has no place for colours).
        vertices_m: (V, 3), Z up.
        triangles: (F, 3).
        colors: (V, 3) RGB or None.

    Raises:
        InputError: another suffix, no triangle, or a folder that cannot be written.
    """
    suffix = mesh_suffix(path)
    if not len(triangles):
        raise InputError(f"There is no triangle to write into {path}; try a larger ball radius")
    mesh = trimesh.Trimesh(vertices_m, triangles, vertex_colors=colors, process=False)
    with atomic_path(path) as sibling:
        if suffix == ".glb":
            scene = trimesh.Scene()
            scene.add_geometry(mesh, transform=_T_GLTF_WORLD)
            scene.export(str(sibling))
        else:
            mesh.export(str(sibling))


def read_mesh(path: AnyPath) -> Mesh:
    """The triangles of a PLY, GLB, OBJ or STL file, everything in it joined to one mesh, Z up.

    STL repeats a vertex for each of its triangles; equal ones are joined again.

    Raises:
        InputError: missing, damaged, too large, of another format or without triangles.
    """
    suffix = mesh_suffix(path)
    data = read_bytes(path, MAX_GEOMETRY_BYTES, "mesh")
    try:
        loaded = trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], process=False)
        if suffix == ".glb":
            loaded.apply_transform(_T_GLTF_WORLD.T)
        mesh = loaded.to_mesh()
        triangles = np.asarray(mesh.faces, dtype=np.int32)
        vertices_m = np.asarray(mesh.vertices, dtype=np.float64)
        if suffix == ".stl":
            vertices_m, rows = np.unique(vertices_m, axis=0, return_inverse=True)
            triangles = rows.reshape(-1)[triangles].astype(np.int32)
    except Exception:  # a parser fails on damaged data in more ways than can be listed
        raise InputError(f"The mesh {path} is truncated or damaged; try to copy or export it again") from None
    if not len(triangles) or not np.isfinite(vertices_m).all():
        raise InputError(f"The mesh {path} holds no triangle with finite corners; try another file")
    colored = mesh.visual.kind == "vertex"
    colors = np.asarray(mesh.visual.vertex_colors, dtype=np.uint8)[:, :3] if colored else None
    return Mesh(vertices_m, triangles, colors)


def mesh_suffix(path: AnyPath) -> str:
    """The suffix of a mesh's name, in small letters.

    Raises:
        InputError: none of ``MESH_SUFFIXES``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise InputError(f"{path} is no name for a mesh; try one that ends in {', '.join(MESH_SUFFIXES)}")
    return suffix

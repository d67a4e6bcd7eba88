"""Reading and writing of triangle meshes as PLY, GLB, OBJ and STL files."""

from __future__ import annotations

import io
import json
import logging
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.exchange.gltf import export_glb, load_glb

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, atomic_path, read_bytes
from pipeline.io.cloud_precision import middle_m, too_coarse
from pipeline.io.images import jpeg_of
from pipeline.io.srgb import linear_of, srgb_of
from pipeline.io.textures import Texture
from pipeline.kernels.geometry import rigid
from pipeline.types import AnyPath, FloatArray, Surface

_log = logging.getLogger(__name__)

MESH_SUFFIXES = (".ply", ".glb", ".obj", ".stl")
_MAX_HEADER_BYTES = 10_000
_PLY_FACES = re.compile(rb"^element face (\d{1,18})\s*$", re.MULTILINE)
_LINEAR = "_LINEAR"
"""Attribute in which trimesh stores numbers for ``COLOR_0`` as they are; its own colours have 8 bits."""
_SRGB_WRITERS = ("https://github.com/mikedh/trimesh", "Open3D")
"""Generators of glTF files whose vertex colours are sRGB, where the standard demands linear light."""
T_GLTF_WORLD = rigid(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), np.zeros(3))
"""(4, 4) rotation from the world frame (z up) to glTF's (y up); the file's root node stores it."""


def write_mesh(path: AnyPath, surface: Surface, texture: Texture | None = None) -> None:
    """Write the triangles of a surface, with its colours, in the format of the suffix.

    Where 32-bit numbers would move a vertex by more than a tenth of a millimetre, far from the origin, PLY
    stores doubles, and GLB stores vertices relative to a translation of its root node. OBJ stores decimals.

    Args:
        path: name ending in .ply (binary), .glb, .obj or .stl (binary, without colours).
        surface: in metres, Z up; a .glb file is rotated to Y up, as glTF requires.
        texture: photographs for the surface, which only .glb files store; without them vertex colours are
            stored as linear light there, as glTF requires.

    Raises:
        InputError: the suffix is none of these, there is no triangle, the format is too coarse for its place
            (``check_place``), or the folder cannot be written.

    >>> import numpy as np, packetmesh as pm
    >>> surface = pm.Surface(np.eye(3), np.array([[0, 1, 2]]))
    >>> pm.write_mesh("triangle.glb", surface)
    >>> pm.read_mesh("triangle.glb").triangles.tolist()
    [[0, 1, 2]]
    """
    suffix = mesh_suffix(path)
    if not len(surface.triangles):
        raise InputError(f"There is no triangle to write into {path}; try a larger ball radius")
    check_place(path, surface.vertices_m)
    far = too_coarse(surface.vertices_m)
    T_gltf_mesh = T_GLTF_WORLD
    if far and suffix == ".glb":
        offset_m = middle_m(surface.vertices_m)
        surface = replace(surface, vertices_m=surface.vertices_m - offset_m)
        T_gltf_mesh = T_GLTF_WORLD @ rigid(np.eye(3), offset_m)
        _log.warning(
            "%s: its 32-bit numbers are too coarse so far from the origin, so the vertices are relative to "
            "(%.0f, %.0f, %.0f) m, which the translation of the root node adds",
            path,
            *offset_m,
        )
    if texture is not None and suffix == ".glb":
        mesh = _dressed(surface, texture)
    else:
        colors = None if suffix == ".glb" else surface.colors
        mesh = trimesh.Trimesh(surface.vertices_m, surface.triangles, vertex_colors=colors, process=False)
        if suffix == ".glb" and surface.colors is not None:
            mesh.vertex_attributes[_LINEAR] = linear_of(surface.colors)
    with atomic_path(path) as sibling:
        if suffix == ".glb":
            scene = trimesh.Scene()
            scene.add_geometry(mesh, transform=T_gltf_mesh)
            sibling.write_bytes(export_glb(scene, tree_postprocessor=_name_colors))
        elif far and suffix == ".ply":
            sibling.write_bytes(_ply_of_doubles(surface))
        else:
            mesh.export(str(sibling))


def _name_colors(document: dict[str, Any]) -> None:
    """Give ``_LINEAR`` in the JSON of a glTF file glTF's name of colours, and the file its own generator."""
    for mesh in document["meshes"]:
        attributes = mesh["primitives"][0]["attributes"]
        if _LINEAR in attributes:
            attributes["COLOR_0"] = attributes.pop(_LINEAR)
    document["asset"]["generator"] = "PacketMesh"


def check_place(path: AnyPath, points_m: FloatArray) -> None:
    """Check that the format of a mesh file is fine enough for (N, 3) points.

    Raises:
        InputError: the file would move a point by more than a tenth of a millimetre.
    """
    suffix = mesh_suffix(path)
    if suffix not in (".stl", ".glb") or not too_coarse(points_m):
        return
    if suffix == ".stl" or too_coarse(points_m - middle_m(points_m)):
        raise InputError(
            f"The mesh {path} reaches {np.nanmax(np.abs(points_m)):.4g} m from the origin, where the 32-bit "
            f"numbers of {suffix} files are too coarse; try .ply or .obj"
        )


def _ply_of_doubles(surface: Surface) -> bytes:
    """Return a binary PLY with double positions and, if there are any, colours."""
    names = [("x", "<f8"), ("y", "<f8"), ("z", "<f8")]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(surface.vertices_m)}"]
    header += [f"property double {name}" for name, _ in names]
    if surface.colors is not None:
        names += [(name, "u1") for name in ("red", "green", "blue")]
        header += [f"property uchar {name}" for name, _ in names[3:]]
    vertices = np.empty(len(surface.vertices_m), names)
    columns = [*surface.vertices_m.T, *(() if surface.colors is None else surface.colors.T)]
    for (name, _), column in zip(names, columns, strict=True):
        vertices[name] = column
    faces = np.empty(len(surface.triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, surface.triangles
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    return "\n".join(header).encode("ascii") + vertices.tobytes() + faces.tobytes()


def _dressed(surface: Surface, texture: Texture) -> trimesh.Trimesh:
    """Build a mesh with photographs and, where there are none, vertex colours; glTF multiplies both."""
    corners = texture.corners(surface.triangles)
    colors = np.full((len(corners.vertices), 4), 255, np.uint8)
    if surface.colors is not None:
        own = surface.colors[corners.vertices[~corners.seen]]
        colors[~corners.seen, :3] = np.rint(255.0 * linear_of(own))
    picture = Image.open(io.BytesIO(jpeg_of(texture.image)))
    material = trimesh.visual.material.PBRMaterial(
        baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=1.0
    )
    uv = corners.uv * (1.0, -1.0) + (0.0, 1.0)  # trimesh counts from the lower edge
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    visual.vertex_attributes["color"] = colors
    vertices_m = surface.vertices_m[corners.vertices]
    return trimesh.Trimesh(vertices_m, corners.triangles, visual=visual, process=False)


def read_mesh(path: AnyPath) -> Surface:
    """Read the triangles of a PLY, GLB, OBJ or STL file; all parts are joined to one mesh, Z up.

    STL repeats a vertex for each of its triangles; equal vertices are merged.

    Returns:
        (V, 3) float64 vertices in the file's unit (metres in glTF), (F, 3) int32 triangles, and colours
            if the vertices have them.

    Raises:
        InputError: the file is missing, damaged, too large, of another format or without triangles.

    >>> import numpy as np, packetmesh as pm
    >>> pm.write_mesh("triangle.stl", pm.Surface(np.eye(3), np.array([[0, 1, 2]])))
    >>> pm.read_mesh("triangle.stl").vertices_m.shape
    (3, 3)
    """
    suffix = mesh_suffix(path)
    data = read_bytes(path, MAX_GEOMETRY_BYTES, "mesh")
    try:
        mesh = scene_in(data, suffix).to_mesh()
        triangles = np.asarray(mesh.faces, dtype=np.int32)
        vertices_m = np.asarray(mesh.vertices, dtype=np.float64)
        if suffix == ".stl":
            vertices_m, rows = np.unique(vertices_m, axis=0, return_inverse=True)
            triangles = rows.reshape(-1)[triangles].astype(np.int32)
    except Exception:  # a parser fails on damaged data in more ways than can be listed
        raise InputError(f"The mesh {path} is truncated or damaged; try to copy or export it again") from None
    if not len(triangles) or not np.isfinite(vertices_m).all():
        raise InputError(f"The mesh {path} holds no triangle with finite corners; try another file")
    faces = _PLY_FACES.search(data, 0, _MAX_HEADER_BYTES) if suffix == ".ply" else None
    if (
        triangles.min() < 0
        or triangles.max() >= len(vertices_m)
        or (faces and len(triangles) < int(faces[1]))
    ):
        raise InputError(
            f"The mesh {path} lacks faces that its header promises, or corners that its faces name; try to "
            "export it again"
        )
    colored = mesh.visual.kind == "vertex"
    colors = np.asarray(mesh.visual.vertex_colors, dtype=np.uint8)[:, :3] if colored else None
    return Surface(vertices_m, triangles, colors)


def scene_in(data: bytes, suffix: str) -> trimesh.Scene:
    """Load a model from memory with trimesh, Z up, without the lines of a GLB file; no other file is opened.

    Raises:
        Exception: of any type, if the file is damaged.
    """
    if suffix != ".glb":
        return trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:], process=False)
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    _check_accessors(document)
    loaded = load_glb(io.BytesIO(data))
    if document.get("asset", {}).get("generator") not in _SRGB_WRITERS:
        for part in loaded["geometry"].values():
            if "vertex_colors" in part:  # as stored; a part of the scene has 8 bits of linear light
                part["vertex_colors"] = srgb_of(part["vertex_colors"])
    lines = [name for name, part in loaded["geometry"].items() if "entities" in part]
    scene = trimesh.load_scene(loaded)
    scene.delete_geometry(lines)
    scene.apply_transform(T_GLTF_WORLD.T)
    return scene


def _check_accessors(document: dict[str, Any]) -> None:
    """Raise a ValueError for negative counts or offsets, which would be used as slices."""
    for part in (*document.get("accessors", ()), *document.get("bufferViews", ())):
        if min(part.get(name, 0) for name in ("count", "byteOffset", "byteLength", "byteStride")) < 0:
            raise ValueError


def mesh_suffix(path: AnyPath) -> str:
    """Return the suffix of a mesh file's name, in lower case.

    Raises:
        InputError: it is none of ``MESH_SUFFIXES``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in MESH_SUFFIXES:
        raise InputError(f"{path} is no name for a mesh; try one that ends in {', '.join(MESH_SUFFIXES)}")
    return suffix

"""Furniture models prepared for rooms: true size, few triangles, colours by position; kept in a cache."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from lab.training.solid_colors import SolidColors
from lab.training.wavefront import Finish, Wavefront
from packetmesh.files import atomic_path
from pipeline.types import FloatArray, IntArray

Kind = Literal["matt", "glossy", "glass", "mirror", "glowing"]
GRID = 24
"""Cells along each side of a model's map of heights."""
_CUBES = 40_000
"""About the number of colour cubes of a model's surface."""
_TRIANGLES_PER_M, _FEWEST, _MOST = 2000, 300, 3500
_KEPT_AREA = 0.75
"""Least share of the area that a simplified mesh must keep."""
_FRAME = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from the catalogue's frame (Y up, front towards +Z) to a piece's (Z up, front towards -Y)."""


@dataclass(frozen=True, slots=True)
class Surface:
    """The part of a model with one kind of material."""

    kind: Kind
    vertices_m: FloatArray
    """(V, 3)."""
    triangles: IntArray
    """(F, 3)."""
    colors: SolidColors


@dataclass(frozen=True, slots=True)
class Model:
    """A model that stands on z = 0, centred on the z axis, its front towards -y."""

    surfaces: tuple[Surface, ...]
    top_m: FloatArray
    """(24, 24) highest point above each cell of the footprint, along x then y; NaN for empty cells."""


def make_model(
    mesh: Wavefront, rotation: FloatArray, size_m: FloatArray, light_m: FloatArray | None
) -> Model:
    """Rotate, scale, thin and colour a model.

    Args:
        mesh: the model as read.
        rotation: (3, 3) the catalogue's rotation of the model.
        size_m: (3,) true width, depth and height, to which the bounding box is scaled.
        light_m: (3,) position of its light, in the piece's frame, or None; the surfaces around it glow.
    """
    vertices = _standing(mesh.vertices @ (_FRAME @ rotation).T, mesh.triangles, size_m)
    corners = vertices[mesh.triangles]
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    kinds = np.array([_kind(finish) for finish in mesh.finishes])[mesh.finish].astype("U7")
    if light_m is not None:
        reach = np.clip(0.3 * size_m.max(), 0.05, 0.2)
        kinds[np.linalg.norm(corners.mean(axis=1) - light_m, axis=1) < reach] = "glowing"

    cube_m = float(max(np.sqrt(area.sum() / _CUBES), 0.0015))
    rng = np.random.default_rng(0)
    face, points_m = _sampled(corners, area, 4 * _CUBES, rng)
    rgb, opaque = _colors(mesh, face, points_m, corners)
    visible = np.bincount(face, opaque, len(corners)) >= 0.3 * np.bincount(face, minlength=len(corners))
    surfaces = []
    for kind in get_args(Kind):
        chosen = np.flatnonzero((kinds == kind) & visible & (area > 1e-10))
        rows = (kinds[face] == kind) & opaque
        if len(chosen) and rows.any():
            share = len(chosen) / len(corners)
            budget = int(np.clip(_TRIANGLES_PER_M * size_m.max(), _FEWEST, _MOST) * max(share, 0.05))
            thin = _thinned(vertices, mesh.triangles[chosen], budget)
            surfaces.append(Surface(kind, *thin, SolidColors.sampled(points_m[rows], rgb[rows], cube_m)))
    return Model(tuple(surfaces), _top(points_m, size_m))


def save_model(model: Model, file: Path) -> None:
    """Write a model as npz."""
    arrays: dict[str, np.ndarray] = {"top_m": model.top_m.astype(np.float32)}
    for surface in model.surfaces:
        colors = surface.colors
        arrays[f"{surface.kind}_vertices"] = surface.vertices_m.astype(np.float32)
        arrays[f"{surface.kind}_triangles"] = surface.triangles.astype(np.int32)
        arrays[f"{surface.kind}_cubes"] = np.append(colors.low_m, colors.cube_m)
        arrays[f"{surface.kind}_keys"], arrays[f"{surface.kind}_colors"] = colors.keys, colors.colors
    with atomic_path(file) as temporary:
        np.savez(temporary, **arrays)  # type: ignore[arg-type]


def load_model(file: Path) -> Model:
    """Read what ``save_model`` wrote."""
    with np.load(file) as arrays:
        surfaces = []
        for kind in get_args(Kind):
            if f"{kind}_keys" in arrays:
                cubes = arrays[f"{kind}_cubes"]
                keys, colors = arrays[f"{kind}_keys"], arrays[f"{kind}_colors"]
                colors = SolidColors(cubes[:3].astype(np.float32), float(cubes[3]), keys, colors)
                mesh = arrays[f"{kind}_vertices"].astype(float), arrays[f"{kind}_triangles"].astype(np.int64)
                surfaces.append(Surface(kind, *mesh, colors))
        return Model(tuple(surfaces), arrays["top_m"])


def _standing(vertices: FloatArray, triangles: IntArray, size_m: FloatArray) -> FloatArray:
    """Scale and move vertices so that the triangles' box has this size, on z = 0 and about the z axis."""
    used = vertices[np.unique(triangles)]
    low, extent = used.min(axis=0), np.ptp(used, axis=0)
    scaled = (vertices - low) / np.where(extent > 0.0, extent, 1.0) * size_m
    return scaled - np.array([0.5 * size_m[0], 0.5 * size_m[1], 0.0])


def _kind(finish: Finish) -> Kind:
    """Return a material's kind; Blender's defaults, Ks 0.5 and Ns 96, count as matt."""
    name = finish.name.lower()
    if "mirror" in name or "espejo" in name:
        return "mirror"
    if finish.opacity < 0.6:
        return "glass"
    metal = any(word in name for word in ("chrom", "metal", "steel", "inox"))
    return "glossy" if metal or (finish.specular > 0.6 and finish.shininess > 60.0) else "matt"


def _sampled(
    corners: FloatArray, area: FloatArray, count: int, rng: np.random.Generator
) -> tuple[IntArray, FloatArray]:
    """Return (N,) triangle indices drawn by area, each at least once, and (N, 3) random positions on them."""
    face = np.searchsorted(np.cumsum(area), rng.random(count) * area.sum())
    face = np.concatenate([np.minimum(face, len(area) - 1), np.arange(len(area))])
    u, v = np.sqrt(rng.random(len(face))), rng.random(len(face))
    weights = np.stack([1.0 - u, u * (1.0 - v), u * v], axis=1)
    return face, np.einsum("nk,nkd->nd", weights, corners[face])


def _colors(
    mesh: Wavefront, face: IntArray, points_m: FloatArray, corners: FloatArray
) -> tuple[FloatArray, np.ndarray]:
    """Return (N, 3) linear colours of positions on triangles, and (N,) True where the texture is opaque."""
    rgb, opaque = np.zeros((len(face), 3)), np.ones(len(face), np.bool_)
    for k, finish in enumerate(mesh.finishes):
        rows = np.flatnonzero(mesh.finish[face] == k)
        if finish.image is None:
            rgb[rows] = finish.color**2.2
            continue
        weights = _barycentric(points_m[rows], corners[face[rows]])
        u, v = np.einsum("nk,nkd->dn", weights, mesh.uv[face[rows]])
        height, width = finish.image.shape[:2]
        texel = finish.image[
            ((1.0 - v) % 1.0 * height).astype(int) % height, (u % 1.0 * width).astype(int) % width
        ]
        rgb[rows] = (texel[:, :3] / 255.0) ** 2.2
        opaque[rows] = texel[:, 3] > 127
    return np.clip(rgb, 0.01, 0.9), opaque


def _barycentric(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return (N, 3) weights of the corners of (N, 3, 3) triangles at positions on them."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb = (np.einsum("nd,nd->n", x, y) for x, y in ((a, a), (a, b), (b, b)))
    pa, pb = np.einsum("nd,nd->n", p, a), np.einsum("nd,nd->n", p, b)
    determinant = np.maximum(aa * bb - ab * ab, 1e-30)
    second, third = (bb * pa - ab * pb) / determinant, (aa * pb - ab * pa) / determinant
    weights = np.stack([1.0 - second - third, second, third], axis=1)
    return np.clip(weights, 0.0, 1.0)


def _thinned(vertices: FloatArray, triangles: IntArray, budget: int) -> tuple[FloatArray, IntArray]:
    """Return these triangles simplified to about ``budget``, by quadric errors (Garland, Heckbert 1997)."""
    from pipeline.kernels.open3d_runtime import o3d

    rounded = np.round(vertices[triangles].reshape(-1, 3), 5)
    places, index = np.unique(rounded, axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(places), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    most = 4 * budget
    while budget < len(faces):
        thin = mesh.simplify_quadric_decimation(budget)
        if len(thin.triangles) > 2 * budget:  # triangles that share no edges cannot collapse
            thin = mesh.simplify_vertex_clustering(float(np.ptp(places, axis=0).max()) / np.sqrt(budget))
        kept = thin.get_surface_area() / mesh.get_surface_area()
        if kept < _KEPT_AREA and budget < most:  # separate leaves of plants vanish
            budget *= 2
            continue
        places, faces = np.asarray(thin.vertices).copy(), np.asarray(thin.triangles).astype(np.int64)
        break
    return np.clip(places, vertices.min(axis=0), vertices.max(axis=0)), faces


def _top(points_m: FloatArray, size_m: FloatArray) -> FloatArray:
    """Return ``Model.top_m`` of (N, 3) points on the surface."""
    top = np.full((GRID, GRID), -np.inf)
    cell = np.clip(((points_m[:, :2] / size_m[:2] + 0.5) * GRID).astype(int), 0, GRID - 1)
    np.maximum.at(top, (cell[:, 0], cell[:, 1]), points_m[:, 2])
    return np.where(np.isfinite(top), top, np.nan).astype(np.float32)

"""Closed solids, as (vertices, triangles): every edge has two faces, each counter-clockwise from outside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from pipeline.kernels import geometry
from pipeline.types import FloatArray, IntArray

Mesh = tuple[FloatArray, IntArray]
"""(V, 3) vertices in metres and (F, 3) triangles."""
Vector = Sequence[float] | FloatArray


def box(size_m: Vector) -> Mesh:
    """A box of (x, y, z) size, centred on the origin."""
    corner = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    return corner * np.asarray(size_m, float), _split(np.array(quads))


def rounded_box(
    size_m: Vector, radius_m: float, crown_m: float = 0.0, steps: int = 3, cells: int = 4
) -> Mesh:
    """A box with round edges, centred on the origin, ``size_m`` over all; its part should be ``smooth``.

    Args:
        size_m: (x, y, z) size.
        radius_m: radius of the edges; limited to half of the smallest side without its crown.
        crown_m: how far the top and bottom bulge in the middle (cushions), part of the z size.
        steps: facets over 45 degrees of an edge, which spans 90.
        cells: cells across the flat part of each face; only a crown needs more than one.
    """
    half = np.asarray(size_m, float) / 2.0 - [0.0, 0.0, crown_m]
    inner = half - min(radius_m, half.min() * 0.999)
    arc = np.tan(np.linspace(0.0, np.pi / 4.0, steps + 1)[1:])
    axes = []
    for h, flat in zip(half, inner, strict=True):
        middle = np.linspace(-flat, flat, cells + 1)
        axes.append(np.concatenate([-(flat + (h - flat) * arc[::-1]), middle, flat + (h - flat) * arc]))
    surface, triangles = _cube_surface(axes)
    core = np.clip(surface, -inner, inner)
    outwards = (surface - core) / (half - inner)
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    vertices = core + outwards * (half - inner)
    fall = (1.0 - (vertices[:, 0] / half[0]) ** 2) * (1.0 - (vertices[:, 1] / half[1]) ** 2)
    vertices[:, 2] *= 1.0 + crown_m / half[2] * fall
    return vertices, triangles


def lathe(profile_m: FloatArray | Sequence, segments: int = 32, bevel_m: float = 0.0) -> Mesh:
    """A profile turned about the z axis: vases, cups, shades, bottles.

    Args:
        profile_m: (K, 2) radius and height. An open profile runs from bottom to top along the outside and is
            closed along the axis; a profile that returns to its start is a ring, counter-clockwise in the
            (radius, height) plane.
        segments: facets around the axis.
        bevel_m: distance from each corner of the profile at which it is cut, so that corners stay sharp in
            smooth shading; 0 cuts none.
    """
    profile = np.asarray(profile_m, float)
    ring = np.array_equal(profile[0], profile[-1])
    if ring:
        profile = profile[:-1]
    else:
        poles = [(0.0, profile[end, 1]) for end in (0, -1)]
        profile = np.array([poles[0], *profile[profile[:, 0] > 0.0], poles[1]])
    if bevel_m > 0.0:
        profile = _bevelled(profile, bevel_m, ring)
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = profile if ring else profile[1:-1]
    around = (rings[:, None, :1] * turn).reshape(-1, 2)
    vertices = np.column_stack([around, np.repeat(rings[:, 1], segments)])
    rows = np.arange(len(rings) if ring else len(rings) - 1)[:, None] * segments
    here, there = np.arange(segments)[None], (np.arange(segments) + 1)[None] % segments
    above = (rows + segments) % len(vertices)
    quads = np.stack(np.broadcast_arrays(rows + here, rows + there, above + there, above + here), axis=-1)
    triangles = _split(quads.reshape(-1, 4))
    if ring:
        return vertices, triangles
    bottom, top, last = len(vertices), len(vertices) + 1, len(vertices) - segments
    vertices = np.concatenate([vertices, [[0.0, 0.0, profile[0, 1]], [0.0, 0.0, profile[-1, 1]]]])
    cap = np.stack([np.full(segments, bottom), there[0], here[0]], axis=1)
    lid = np.stack([np.full(segments, top), last + here[0], last + there[0]], axis=1)
    return vertices, np.concatenate([triangles, cap, lid])


def cylinder(radius_m: float, height_m: float, segments: int = 32, bevel_m: float = 0.0) -> Mesh:
    """A cylinder that stands on the origin."""
    return frustum(radius_m, radius_m, height_m, segments, bevel_m)


def frustum(bottom_m: float, top_m: float, height_m: float, segments: int = 32, bevel_m: float = 0.0) -> Mesh:
    """A cut cone that stands on the origin, with a bottom and a top radius (0 for a point)."""
    return lathe([(bottom_m, 0.0), (top_m, height_m)], segments, bevel_m)


def sphere(radius_m: float, segments: int = 32) -> Mesh:
    """A sphere about the origin, by longitude and latitude."""
    latitude = np.linspace(-np.pi / 2.0, np.pi / 2.0, segments // 2 + 1)
    profile = radius_m * np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    profile[[0, -1], 0] = 0.0
    return lathe(profile, segments)


def extrude(outline_m: FloatArray | Sequence, height_m: float) -> Mesh:
    """A simple counter-clockwise (K, 2) outline in the xy plane, raised from z = 0 to ``height_m``."""
    outline = np.asarray(outline_m, float)
    count = len(outline)
    face = _ear_clip(outline)
    here, there = np.arange(count), (np.arange(count) + 1) % count
    walls = _split(np.stack([here, there, there + count, here + count], axis=1))
    low, high = (np.column_stack([outline, np.full(count, z)]) for z in (0.0, height_m))
    return np.concatenate([low, high]), np.concatenate([face[:, ::-1], face + count, walls])


def sheet(
    size_m: Vector,
    height: Callable[[FloatArray, FloatArray], FloatArray],
    thickness_m: float,
    cells: tuple[int, int] = (32, 32),
) -> Mesh:
    """A cloth: the surface z = height(x, y) over an (x, y) rectangle about the origin, and its underside.

    Args:
        size_m: (x, y) size of the rectangle.
        height: (N,) x and (N,) y, metres -> (N,) z of the upper side.
        thickness_m: distance to the underside, along z.
        cells: number of cells in x and in y.
    """
    columns, rows = cells[0] + 1, cells[1] + 1
    x, y = (np.linspace(-s / 2.0, s / 2.0, n) for s, n in zip(size_m, (columns, rows), strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    z = np.broadcast_to(height(grid[:, 0], grid[:, 1]), len(grid))
    top = np.column_stack([grid, z])
    index = np.arange(rows * columns).reshape(rows, columns)
    rim = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    return thickened(top, quads_of(index), rim, thickness_m)


def thickened(upper_m: FloatArray, quads: IntArray, rim: IntArray, thickness_m: float) -> Mesh:
    """A surface of (N, 3) points and (Q, 4) cells with its copy ``thickness_m`` below, joined at the rim.

    ``quads`` and ``rim``, (R,), hold indices of points, counter-clockwise seen from above.
    """
    face, ahead, under = _split(quads), np.roll(rim, -1), len(upper_m)
    walls = _split(np.stack([rim + under, ahead + under, ahead, rim], axis=1))
    vertices = np.concatenate([upper_m, upper_m - [0.0, 0.0, thickness_m]])
    return vertices, np.concatenate([face, face[:, ::-1] + under, walls])


def tube(path_m: FloatArray | Sequence, radius_m: float | Vector, segments: int = 10) -> Mesh:
    """A round bar along a (K, 3) path (lamp arms, cables, stems), of one radius or (K,) radii."""
    path = np.asarray(path_m, float)
    radius = np.broadcast_to(np.asarray(radius_m, float), len(path))[:, None, None]
    forward = np.gradient(path, axis=0)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    side = np.cross(forward[0], np.eye(3)[np.argmin(np.abs(forward[0]))])
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    sides = []
    for axis in forward:
        side = side - axis * (side @ axis)
        sides.append(side)
    across = np.array(sides) / np.linalg.norm(sides, axis=1, keepdims=True)
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    circle = c * across[:, None] + s * np.cross(forward, across)[:, None]
    vertices = np.concatenate([(path[:, None] + radius * circle).reshape(-1, 3), path[[0, -1]]])
    index = np.arange(len(path) * segments).reshape(len(path), segments)
    walls = _split(quads_of(np.concatenate([index, index[:, :1]], axis=1)))
    first, last, ends = index[0], index[-1], len(path) * segments
    cap = np.stack([np.full(segments, ends), np.roll(first, -1), first], axis=1)
    lid = np.stack([np.full(segments, ends + 1), last, np.roll(last, -1)], axis=1)
    return vertices, np.concatenate([walls, cap, lid])


def transformed(mesh: Mesh, T: FloatArray) -> Mesh:
    """Return the mesh after a (4, 4) rigid or scaling transform that keeps its handedness."""
    return geometry.apply(T, mesh[0]), mesh[1]


def moved(mesh: Mesh, x_m: float = 0.0, y_m: float = 0.0, z_m: float = 0.0) -> Mesh:
    """Return the mesh shifted."""
    return mesh[0] + np.array([x_m, y_m, z_m]), mesh[1]


def merged(meshes: Sequence[Mesh]) -> Mesh:
    """Return several solids as one mesh."""
    first = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    triangles = [triangles + start for (_, triangles), start in zip(meshes, first, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(triangles)


def quads_of(index: IntArray) -> IntArray:
    """Return (Q, 4) cells of a (rows, columns) grid of vertex indices, counter-clockwise if rows go up."""
    corners = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _split(quads: IntArray) -> IntArray:
    """Return two triangles for each quad."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _cube_surface(axes: list[FloatArray]) -> Mesh:
    """Return the surface of a box, divided by planes at three lists of coordinates (along x, y and z)."""
    used, triangles = _cube_triangles(tuple(len(axis) for axis in axes))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)[used], triangles


@lru_cache(maxsize=64)
def _cube_triangles(shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Return the indices of the points on the surface of a 3-D grid, and (F, 3) triangles of them."""
    number = np.arange(np.prod(shape)).reshape(shape)
    # For each axis, the other two in the order that makes the high side's faces counter-clockwise.
    quads = []
    for axis, other in ((0, (1, 2)), (1, (2, 0)), (2, (0, 1))):
        sides = np.moveaxis(number, (axis, other[1], other[0]), (0, 1, 2))
        quads += [quads_of(sides[-1]), quads_of(sides[0])[:, ::-1]]
    used, triangles = np.unique(_split(np.concatenate(quads)), return_inverse=True)
    return used, triangles.reshape(-1, 3)


def _bevelled(profile: FloatArray, bevel_m: float, ring: bool) -> FloatArray:
    """Replace each corner by two points on its edges, ``bevel_m`` (at most a third of the edge) from it."""
    corners = profile if ring else profile[1:-1]
    before = np.roll(profile, 1, axis=0) if ring else profile[:-2]
    after = np.roll(profile, -1, axis=0) if ring else profile[2:]
    pair = []
    for neighbour in (before, after):
        edge = neighbour - corners
        length = np.linalg.norm(edge, axis=1, keepdims=True)
        pair.append(corners + edge * np.minimum(bevel_m / length, 1.0 / 3.0))
    cut = np.stack(pair, axis=1).reshape(-1, 2)
    return cut if ring else np.concatenate([profile[:1], cut, profile[-1:]])


def _ear_clip(outline: FloatArray) -> IntArray:
    """Return (K - 2, 3) triangles of a simple counter-clockwise polygon."""
    rest, triangles = list(range(len(outline))), []
    while len(rest) > 3:
        for k in range(len(rest)):
            ear = [rest[k - 1], rest[k], rest[(k + 1) % len(rest)]]
            others = [i for i in rest if i not in ear]
            if _is_ear(outline[ear], outline[others]):
                triangles.append(ear)
                del rest[k]
                break
    return np.array([*triangles, rest])


def _is_ear(ear: FloatArray, others: FloatArray) -> bool:
    """Return whether the triangle at a corner is convex and contains none of the other points."""
    edges = np.roll(ear, -1, axis=0) - ear
    if edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0] <= 0.0:
        return False
    to = others[:, None] - ear
    left = edges[:, 0] * to[..., 1] - edges[:, 1] * to[..., 0]
    return not np.any(np.all(left >= 0.0, axis=1))

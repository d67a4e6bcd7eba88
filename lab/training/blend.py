"""Path-traced images of scenes: Blender renders the light, our ray caster gives the exact depth.

Blender's Python module ``bpy`` needs other library versions than we do, so it has its own environment. A room
is sent to it as one ``.npz`` file, and its light comes back as one ``.npy`` file.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import cv2
import numba
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from lab.training import dataset
from lab.training.furniture import Catalogue
from lab.worlds import shading
from lab.worlds.film import Film, develop
from lab.worlds.pixels import camera_rays
from lab.worlds.raycast import world_mesh
from lab.worlds.scene import Scene
from packetmesh.errors import InputError
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray, IntArray

Camera = tuple[CameraIntrinsics, FloatArray]
"""Undistorted intrinsics, and T_world_camera (4, 4)."""
FIRST_TRACED = 500_000
"""Offset of the traced rooms' seeds from their split's first, so that they differ from the ray-cast ones."""
_SCRIPT = Path(__file__).with_name("blender_script.py")
_FILM = Film(0.7, 0.08, noise=(0.0, 0.02), blur_px=(0.25, 0.6), vignette=(0.0, 0.25))
_ATLAS_WIDTH = 4096
_GUTTER = 2
"""Border of each chart in texels, so that texture filtering never reaches its neighbour."""
_CHART_TEXELS = 700_000
_FINEST_M, _COARSEST_M = 0.002, 0.03
"""Range of the texels' size; within it, a texel is smaller than a pixel of the nearest camera, except in
charts that would exceed ``_CHART_TEXELS`` or the image's width."""
_TEXELS_A_PIXEL = 1.4
_RAISED_M = 3e-4
_GOLDEN = 0.6180339887498949
"""Golden ratio; the fractional parts of its multiples are spread evenly over 0 to 1."""


def render_traced(
    data: Path,
    split: str,
    first: int,
    last: int,
    blender: Path,
    samples: int = 16,
    threads: int = 1,
    catalogue: Catalogue | None = None,
) -> Iterator[Path]:
    """Path-trace shards [first, last) of ten rooms each and yield their RGB files; existing ones are kept.

    A shard is like those of ``dataset.render_shards``, named ``<split>_traced_<number>_rgb.npy``.

    Args:
        data: folder of the shards.
        split: train, validation or test.
        first: first shard.
        last: one past the last shard.
        blender: a Python that has ``bpy``.
        samples: light paths per pixel, before denoising.
        threads: threads that render.
        catalogue: furniture of the rooms; None takes procedural pieces.

    Raises:
        InputError: that Python cannot render; raised when the first shard is rendered.
    """

    room = partial(traced_views, blender=blender, samples=samples, threads=threads, catalogue=catalogue)
    first_seed = dataset.FIRST_SEED[split] + FIRST_TRACED
    return dataset.write_shards(data, f"{split}_traced", range(first, last), first_seed, room)


def traced_views(
    seed: int, blender: Path, samples: int, threads: int, catalogue: Catalogue | None = None
) -> Iterator[tuple[ByteArray, FloatArray]]:
    """Yield photographs (H, W, 3) uint8 of one room, each with the depth (H, W) of ``room_views``."""
    room = dataset.viewed_room(seed, catalogue, threads)
    light = trace(room.scene, room.cameras, blender, samples, threads)
    for camera, view in zip(room.cameras, light, strict=True):
        yield develop(view, _FILM, room.rng), room.canonical_m(room.renderer.depth(*camera), camera[0])


def trace(
    scene: Scene, cameras: Sequence[Camera], blender: Path, samples: int = 16, threads: int = 1
) -> FloatArray:
    """Return (N, H, W, 3) float32 linear light of N views, path-traced by a Python that has ``bpy``.

    Raises:
        InputError: a camera is distorted or has another size than the first, or that Python cannot render.
    """
    with tempfile.TemporaryDirectory() as folder:
        room, light = Path(folder) / "room.npz", Path(folder) / "light.npy"
        write_exchange(room, scene, cameras)
        options = ["--samples", str(samples), "--threads", str(threads)]
        try:
            subprocess.run(
                [blender, _SCRIPT, room, light, *options], check=True, capture_output=True, text=True
            )
        except OSError as error:
            raise InputError(
                f"Blender's Python '{blender}' does not start ({error.strerror}); name one that has bpy."
            ) from error
        except subprocess.CalledProcessError as error:
            reason = (error.stderr.strip().splitlines() or ["no message"])[-1]
            raise InputError(
                f"'{blender}' could not render {scene.name} ({reason}); name a Python that has bpy."
            ) from error
        return np.load(light).astype(np.float32)


def write_exchange(file: Path, scene: Scene, cameras: Sequence[Camera]) -> None:
    """Write a scene and its cameras as plain arrays; lengths in metres, colours linear unless stated.

    The arrays are: ``corners_m`` and ``corner_normals`` (F, 3, 3) of the triangles, world frame; ``uv``
    (F, 3, 2) from the lower left of the image; ``material`` (F,) index into ``gloss`` and ``emission`` (M,);
    ``atlas_png`` the bytes of an 8-bit sRGB PNG; ``light_position_m`` (L, 3), ``light_color`` (L, 3)
    intensity at 1 m, ``light_size_m`` (L,) radius; ``ambient`` (3,); ``matrix`` (N, 3, 3), ``T_world_camera``
    (N, 4, 4), ``size_px`` width and height.

    Raises:
        InputError: a camera is distorted or has another size than the first.
    """
    _check(cameras)
    vertices, triangles = world_mesh(scene)
    count = [len(part.triangles) for part in scene.parts]
    finishes = np.array([(part.material.gloss, part.material.emission) for part in scene.parts], np.float32)
    kinds, kind = np.unique(finishes, axis=0, return_inverse=True)
    uv, atlas = unwrap(scene, _nearest_m(vertices, triangles, cameras))
    np.savez(
        file,
        corners_m=_apart(vertices[triangles]).astype(np.float32),
        corner_normals=_world_normals(scene),
        uv=uv,
        material=np.repeat(kind.ravel().astype(np.int32), count),
        gloss=kinds[:, 0],
        emission=kinds[:, 1],
        atlas_png=cv2.imencode(".png", atlas[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1],
        light_position_m=np.array([light.position_m for light in scene.lights]).reshape(-1, 3),
        light_color=np.array([light.color for light in scene.lights]).reshape(-1, 3),
        light_size_m=np.array([light.size_m for light in scene.lights]),
        ambient=np.asarray(scene.ambient, float),
        matrix=np.stack([intrinsics.matrix for intrinsics, _ in cameras]),
        T_world_camera=np.stack([pose for _, pose in cameras]),
        size_px=np.array([cameras[0][0].width_px, cameras[0][0].height_px]),
    )


def _check(cameras: Sequence[Camera]) -> None:
    if not cameras:
        raise InputError("No camera was given to path-trace; give at least one.")
    sizes = {(intrinsics.width_px, intrinsics.height_px) for intrinsics, _ in cameras}
    if len(sizes) > 1:
        raise InputError(f"Cameras of sizes {sorted(sizes)} cannot be traced together; give one size.")
    if any(np.any(intrinsics.distortion) for intrinsics, _ in cameras):
        raise InputError("A camera with lens distortion cannot be path-traced; give one without.")


def _apart(corners_m: FloatArray) -> FloatArray:
    """Return (F, 3, 3) triangles, each raised by a different height up to 0.3 mm.

    Between two triangles in the same place, Blender's rays would be trapped.
    """
    raised_m = _RAISED_M * (np.arange(len(corners_m)) * _GOLDEN % 1.0)
    return corners_m + (raised_m[:, None] * _face_normals(corners_m))[:, None]


def _face_normals(corners_m: FloatArray) -> FloatArray:
    """Return (F, 3) unit normals of (F, 3, 3) triangles."""
    normals = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)


def _nearest_m(vertices: FloatArray, triangles: IntArray, cameras: Sequence[Camera]) -> FloatArray:
    """Return (F,) smallest size of a pixel on each triangle, metres, over all cameras; inf if unseen."""
    caster = triangle_scene(vertices, triangles)
    covered_m = np.full(len(triangles), np.inf)
    for intrinsics, pose in cameras:
        answer = caster.cast_rays(tensor(camera_rays(intrinsics, pose), np.float32), nthreads=1)
        z_m, triangle = answer["t_hit"].numpy(), answer["primitive_ids"].numpy()
        seen = np.isfinite(z_m)
        np.minimum.at(covered_m, triangle[seen], z_m[seen] / intrinsics.fx_px)
    return covered_m


def _world_normals(scene: Scene) -> FloatArray:
    """Return (F, 3, 3) shading normals at the corners, as in our own renderer."""
    return np.concatenate(
        [
            shading.corner_normals(part.vertices_m, np.ascontiguousarray(part.triangles), part.smooth)
            @ part.T_world_part[:3, :3].T.astype(np.float32)
            for part in scene.parts
        ]
    )


def unwrap(scene: Scene, covered_m: FloatArray) -> tuple[FloatArray, ByteArray]:
    """Bake the parts' solid textures into one image.

    Args:
        scene: the triangles of its parts, in order, are the F triangles.
        covered_m: (F,) a pixel's size on each triangle, metres, which determines the texels' size; infinite
            if unseen.

    Returns:
        (F, 3, 2) float32 coordinates of the corners, 0 to 1 from the lower left, and the
        (H, 4096, 3) uint8 sRGB image.
    """
    points = np.concatenate([part.vertices_m[part.triangles] for part in scene.parts])
    part = np.repeat(np.arange(len(scene.parts)), [len(part.triangles) for part in scene.parts])
    normals = _face_normals(points)
    corners_px, height_px = _lay_out(points, normals, part, covered_m)
    owner, places = _rasterise(corners_px, points, height_px, _ATLAS_WIDTH)
    atlas = np.zeros((height_px, _ATLAS_WIDTH, 3), np.uint8)
    rows = np.flatnonzero(owner >= 0)
    triangle = owner.ravel()[rows]
    order = np.argsort(part[triangle], kind="stable")
    rows, triangle = rows[order], triangle[order]
    bounds = np.searchsorted(part[triangle], np.arange(len(scene.parts) + 1))
    for k, piece in enumerate(scene.parts):
        some = slice(bounds[k], bounds[k + 1])
        if some.stop > some.start:
            where = places.reshape(-1, 3)[rows[some]]
            albedo = piece.material.texture(where, normals[triangle[some]].astype(np.float32))
            atlas.reshape(-1, 3)[rows[some]] = _srgb(albedo)
    uv = corners_px / [_ATLAS_WIDTH, height_px]
    uv[..., 1] = 1.0 - uv[..., 1]
    return uv.astype(np.float32), atlas


def _lay_out(
    points: FloatArray, normals: FloatArray, part: IntArray, covered_m: FloatArray
) -> tuple[FloatArray, int]:
    """Lay charts (connected triangles that face the same way along x, y or z) flat in one image.

    They are packed in rows, the tallest first.

    Returns:
        (F, 3, 2) positions of the triangles' corners in the image, pixels, and its height.
    """
    axis = np.argmax(np.abs(normals), axis=1)
    facing = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0.0)
    chart = _connected(points, 6 * part + facing)
    across = np.stack([(axis + 1) % 3, (axis + 2) % 3], axis=1)
    flat_m = np.take_along_axis(points, across[:, None], 2)
    low, high, texel_m = _extent(flat_m, chart, covered_m)
    size = np.ceil((high - low) / texel_m[:, None]).astype(int) + 2 * _GUTTER + 1
    origin, height = np.empty_like(size), 0
    x = shelf = 0
    for k in np.argsort(-size[:, 1], kind="stable"):
        if x + size[k, 0] > _ATLAS_WIDTH:
            x, height, shelf = 0, height + shelf, 0
        origin[k] = x, height
        x, shelf = x + size[k, 0], max(shelf, size[k, 1])
    corners = (flat_m - low[chart][:, None]) / texel_m[chart][:, None, None]
    return corners + (origin + _GUTTER + 0.5)[chart][:, None], height + shelf


def _extent(
    flat_m: FloatArray, chart: IntArray, covered_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (C, 2) low and high corners of the charts, and (C,) sizes of their texels."""
    count = int(chart.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    covered = np.full(count, np.inf)
    np.minimum.at(low, chart, flat_m.min(axis=1))
    np.maximum.at(high, chart, flat_m.max(axis=1))
    np.minimum.at(covered, chart, covered_m)
    size = high - low
    texel_m = np.clip(covered / _TEXELS_A_PIXEL, _FINEST_M, _COARSEST_M)
    texel_m = np.maximum(texel_m, np.sqrt(size.prod(axis=1) / _CHART_TEXELS))
    return low, high, np.maximum(texel_m, size.max(axis=1) / (_ATLAS_WIDTH - 4 * _GUTTER))


def _connected(points: FloatArray, group: IntArray) -> IntArray:
    """Return (F,) patch number of each triangle: triangles of a group that share corners are one patch."""
    count = len(points)
    corners = np.concatenate(
        [np.repeat(group, 3)[:, None], np.round(points.reshape(-1, 3) * 1e5).astype(np.int64)], axis=1
    )
    _, corner = np.unique(corners, axis=0, return_inverse=True)
    edges = (np.repeat(np.arange(count), 3), count + corner.ravel())
    nodes = count + int(corner.max()) + 1
    graph = coo_matrix((np.ones(3 * count, np.int8), edges), shape=(nodes, nodes))
    label = connected_components(graph, directed=False)[1][:count]
    return np.unique(label, return_inverse=True)[1].ravel()


@numba.njit(cache=True, nogil=True)
def _rasterise(corners_px, points, height, width):  # type: ignore[no-untyped-def]
    """Return (height, width) index of the triangle at or near each texel's centre, -1 for none, and
    (height, width, 3) the place of the texel on it.

    Triangles extend a texel and a half beyond their edges, unless another one is nearer.
    """
    owner = np.full((height, width), -1, np.int32)
    miss = np.full((height, width), 1.5, np.float32)
    places = np.zeros((height, width, 3), np.float32)
    for f in range(len(corners_px)):
        a, b, c = corners_px[f, 0], corners_px[f, 1], corners_px[f, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < 1e-12:
            continue
        edge_a, edge_b = np.hypot(c[0] - b[0], c[1] - b[1]), np.hypot(a[0] - c[0], a[1] - c[1])
        edge_c = np.hypot(b[0] - a[0], b[1] - a[1])
        left, right = min(a[0], b[0], c[0]) - 1.5, max(a[0], b[0], c[0]) + 1.5
        low, high = min(a[1], b[1], c[1]) - 1.5, max(a[1], b[1], c[1]) + 1.5
        for y in range(max(0, int(low)), min(height, int(high) + 1)):
            for x in range(max(0, int(left)), min(width, int(right) + 1)):
                px, py = x + 0.5, y + 0.5
                v = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / area
                w = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area
                u = 1.0 - v - w
                out = -abs(area) * min(u / edge_a, v / edge_b, w / edge_c)
                if max(out, 0.0) < miss[y, x]:
                    miss[y, x], owner[y, x] = max(out, 0.0), f
                    for k in range(3):
                        places[y, x, k] = u * points[f, 0, k] + v * points[f, 1, k] + w * points[f, 2, k]
    return owner, places


def _srgb(albedo: FloatArray) -> ByteArray:
    """Return 8-bit sRGB of linear colours."""
    linear = np.clip(albedo, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * encoded).astype(np.uint8)

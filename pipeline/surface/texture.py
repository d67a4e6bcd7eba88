"""Texture of a mesh from photographs: every triangle is textured by the camera that sees it best.

The method follows Lempitsky and Ivanov, "Seamless Mosaicing of Image-Based Texture Maps", CVPR 2007: one
photograph per triangle, chosen so that neighbours share it; exposures are equalised, not blended. A triangle
that no camera sees has no texture.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from pipeline.io.textures import WHITE_ROWS, Texture
from pipeline.kernels.geometry import apply, inverse, project, scaled
from pipeline.kernels.kdtree import compiled
from pipeline.kernels.rays import Camera, hit_depths
from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray, Surface

DEPTH_WIDTH_PX = 320
"""Largest width of the depth images that are used to test occlusion."""
HIDDEN_M, HIDDEN_SHARE = 0.03, 0.015
"""A triangle is hidden if it is farther behind the first surface than both (the share is of its depth)."""
NEAR_RIM_PX = 3
"""Width of the window of a depth image that must have no surface in front of a triangle, as photograph and
mesh are not aligned to the pixel; otherwise the camera is used only if no other sees the triangle."""
AT_RIM = 0.05
"""Factor on a camera's score in that case."""
LEAST_COSINE = 0.08
"""Least cosine of the viewing angle; at a smaller one a few pixels would be stretched over the triangle."""
SMOOTHING_ROUNDS = 12
"""Number of times that scores are averaged with those of the neighbours, for large patches per camera."""
MOST_GAIN = 1.5
"""Largest factor by which a photograph is made brighter or darker."""
DARK = 8.0
"""Added to colours before their ratios are taken."""
FAR_OUTSIDE_PX = -1e5
LEAST_COMMON = 200
"""Least number of triangles that two cameras must both see to compare their exposures."""
LARGEST_SIDE_PX = 4096
"""Largest side of the texture image, which every browser supports."""


def photographed(
    surface: Surface, cameras: Sequence[Camera], pictures: Sequence[tuple[ByteArray, BoolArray | None]]
) -> Texture:
    """Compute the texture of a mesh from photographs.

    Args:
        surface: mesh in the world frame.
        cameras: cameras of the pictures.
        pictures: (H, W, 3) RGB of each camera, and (H, W) True where it is known; None means everywhere.
    """
    vertices_m, triangles = surface.vertices_m, surface.triangles
    small = [Camera(scaled(camera.intrinsics, _shrink(camera)), camera.T_world_camera) for camera in cameras]
    depths = hit_depths(vertices_m, triangles, small)
    pixels = [_pixels(camera, vertices_m) for camera in cameras]
    scores = np.empty((len(cameras), len(triangles)))
    middles = np.empty(scores.shape, np.int32)
    for row, (camera, depth, (rgb, known)) in enumerate(zip(cameras, depths, pictures, strict=True)):
        shape = rgb.shape[0], rgb.shape[1]
        first_m = np.where(np.isfinite(depth.z_m), depth.z_m, np.inf).astype(np.float32)
        around_m = cv2.erode(first_m, np.ones((NEAR_RIM_PX, NEAR_RIM_PX), np.uint8))
        seen = _inside(pixels[row], shape, known), shape, first_m, around_m, _shrink(camera)
        to = scores[row], middles[row]
        _score(vertices_m, triangles, pixels[row], *seen, camera.T_world_camera, *to)
    gains = _gains(scores > 0, middles, [rgb for rgb, _ in pictures])
    image, corners, scale = _side_by_side([rgb for rgb, _ in pictures], gains)
    size = np.array([image.shape[1], image.shape[0]])
    uv = [(scale * (own + 0.5) + corner) / size for own, corner in zip(pixels, corners, strict=True)]
    return Texture(image, _chosen(scores, triangles), np.stack(uv).astype(np.float32))


def _shrink(camera: Camera) -> float:
    """Return the factor from a camera's image size to that of its depth image."""
    return min(1.0, DEPTH_WIDTH_PX / camera.intrinsics.width_px)


def _pixels(camera: Camera, points_m: FloatArray) -> FloatArray:
    """Return (N, 2) pixels of world points; far outside the image for those without an image."""
    own_m = apply(inverse(camera.T_world_camera), points_m)
    ahead = own_m[:, 2] > 1e-3
    pixels = np.full((len(points_m), 2), FAR_OUTSIDE_PX)
    pixels[ahead] = project(camera.intrinsics, own_m[ahead])
    pixels[np.isnan(pixels)] = FAR_OUTSIDE_PX
    return np.clip(pixels, FAR_OUTSIDE_PX, -FAR_OUTSIDE_PX)


def _inside(pixels: FloatArray, shape: tuple[int, int], known: BoolArray | None) -> BoolArray:
    """Return (V,) True for the pixels inside an image of this shape whose colour is known."""
    inside: BoolArray = np.all((pixels >= 0.0) & (pixels <= (shape[1] - 1.0, shape[0] - 1.0)), axis=1)
    if known is not None:
        column, row = np.rint(np.clip(pixels, 0, (shape[1] - 1, shape[0] - 1))).astype(int).T
        inside &= known[row, column]
    return inside


@compiled
def _score(
    vertices_m: FloatArray,
    triangles: IntArray,
    pixels: FloatArray,
    inside: BoolArray,
    shape: tuple[int, int],
    first_m: FloatArray,
    around_m: FloatArray,
    shrink: float,
    T_world_camera: FloatArray,
    scores: FloatArray,
    middles: IntArray,
) -> None:
    """Score the triangles of a mesh in one camera.

    Args:
        vertices_m: (V, 3) world frame.
        triangles: (F, 3).
        pixels: (V, 2) pixels of the vertices, in the photograph.
        inside: (V,) True where the photograph has a colour.
        shape: (rows, columns) of the photograph.
        first_m: (h, w) depth of the first surface, at reduced size; inf where there is none.
        around_m: (h, w) the smallest depth around each pixel.
        shrink: factor from the size of the photograph to that of the depth.
        T_world_camera: (4, 4) pose of the camera.
        scores: (F,) written: cosine over squared distance of each triangle, to which the camera's pixels per
            area are proportional (``AT_RIM`` times that near a rim); 0 if not seen.
        middles: (F,) written: index of the photograph's pixel at the middle of each triangle.
    """
    eye_m = T_world_camera[:3, 3]
    for f in range(len(triangles)):
        a, b, c = triangles[f]
        u = (pixels[a, 0] + pixels[b, 0] + pixels[c, 0]) / 3.0
        v = (pixels[a, 1] + pixels[b, 1] + pixels[c, 1]) / 3.0
        middles[f] = _nearest(v, shape[0]) * shape[1] + _nearest(u, shape[1])
        scores[f] = 0.0
        if not (inside[a] and inside[b] and inside[c]):
            continue
        area = square = z_m = along = 0.0
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            normal = (vertices_m[b, i] - vertices_m[a, i]) * (vertices_m[c, j] - vertices_m[a, j]) - (
                vertices_m[b, j] - vertices_m[a, j]
            ) * (vertices_m[c, i] - vertices_m[a, i])
            to_camera_m = eye_m[k] - (vertices_m[a, k] + vertices_m[b, k] + vertices_m[c, k]) / 3.0
            area += normal**2
            square += to_camera_m**2
            along += normal * to_camera_m
            z_m -= to_camera_m * T_world_camera[k, 2]
        distance_m = max(np.sqrt(square), 1e-9)
        cosine = abs(along) / max(np.sqrt(area) * distance_m, 1e-15)
        nearest_m = z_m - max(HIDDEN_M, HIDDEN_SHARE * z_m)
        row = _nearest((v + 0.5) * shrink - 0.5, first_m.shape[0])
        column = _nearest((u + 0.5) * shrink - 0.5, first_m.shape[1])
        if cosine > LEAST_COSINE and nearest_m <= first_m[row, column]:
            free = nearest_m <= around_m[row, column]
            scores[f] = cosine / distance_m**2 * (1.0 if free else AT_RIM)


@compiled
def _nearest(place_px: float, size_px: int) -> int:
    """Return the index of the pixel nearest to a position on an image axis of ``size_px`` pixels."""
    return int(np.rint(min(max(place_px, 0.0), size_px - 1.0)))


def _chosen(scores: FloatArray, triangles: IntArray) -> IntArray:
    """Return (F,) best camera of each triangle by (C, F) scores smoothed over neighbours; -1 for none."""
    most, neighbours = np.maximum(scores.max(axis=0), 1e-12), _neighbours(triangles)
    best, best_score = np.full(len(triangles), -1, np.int32), np.full(len(triangles), -1.0)
    for camera, own in enumerate(scores):
        smoothed = _smoothed(own / most, neighbours)
        better = (own > 0.0) & (smoothed > best_score)
        best[better], best_score[better] = camera, smoothed[better]
    return best


@compiled
def _smoothed(scores: FloatArray, neighbours: IntArray) -> FloatArray:
    """Return (F,) scores averaged with those of the (F, 3) neighbours ``SMOOTHING_ROUNDS`` times."""
    now, then = scores.copy(), np.empty_like(scores)
    for _ in range(SMOOTHING_ROUNDS):
        for f in range(len(scores)):
            then[f] = 0.25 * (now[f] + now[neighbours[f, 0]] + now[neighbours[f, 1]] + now[neighbours[f, 2]])
        now, then = then, now
    return now


def _neighbours(triangles: IntArray) -> IntArray:
    """Return (F, 3) triangle beyond each edge; at the boundary the triangle itself."""
    count = len(triangles)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    keys = edges[:, 0] << 32 | edges[:, 1]
    order = np.argsort(keys, kind="stable")
    first = np.flatnonzero(keys[order[:-1]] == keys[order[1:]])
    neighbours = np.repeat(np.arange(count), 3)
    one, other = order[first], order[first + 1]
    neighbours[one], neighbours[other] = other // 3, one // 3
    return neighbours.reshape(count, 3)


def _gains(seen: BoolArray, middles: IntArray, pictures: Sequence[ByteArray]) -> FloatArray:
    """Return (C, 3) factors that equalise the cameras' exposures, from medians of logarithmic ratios.

    Args:
        seen: (C, F) True for the triangles that each camera sees.
        middles: (C, F) index of the pixel at the middle of each triangle.
        pictures: photographs of the cameras.
    """
    count = len(pictures)
    log_of = np.log(np.arange(256, dtype=np.float32) + np.float32(DARK))
    logs = [log_of[rgb.reshape(-1, 3)[own]] for own, rgb in zip(middles, pictures, strict=True)]
    rows, values = [np.ones(count)], [np.zeros(3)]
    for a in range(count):
        for b in range(a):
            both = seen[a] & seen[b]
            if both.sum() >= LEAST_COMMON:
                row = np.zeros(count)
                row[a], row[b] = 1.0, -1.0
                rows.append(row)
                values.append(np.median(logs[b][both] - logs[a][both], axis=0))
    solved = np.linalg.lstsq(np.array(rows), np.array(values), rcond=None)[0]
    return np.clip(np.exp(solved), 1.0 / MOST_GAIN, MOST_GAIN)


def _side_by_side(
    pictures: Sequence[ByteArray], gains: FloatArray
) -> tuple[ByteArray, list[tuple[int, int]], float]:
    """Join all photographs in one image; returns it, the corner (x, y) of each, and the scale factor."""
    height = max(rgb.shape[0] for rgb in pictures)
    width = max(rgb.shape[1] for rgb in pictures)
    columns = int(np.ceil(np.sqrt(len(pictures))))
    rows = -(-len(pictures) // columns)
    scale = min(1.0, (LARGEST_SIDE_PX - WHITE_ROWS) / max(columns * width, rows * height))
    tile_w, tile_h = int(np.ceil(scale * width)), int(np.ceil(scale * height))
    image = np.full((rows * tile_h + WHITE_ROWS, columns * tile_w, 3), 255, np.uint8)
    corners = []
    for index, (rgb, gain) in enumerate(zip(pictures, gains, strict=True)):
        x, y = index % columns * tile_w, index // columns * tile_h
        even = np.clip(rgb * gain, 0.0, 255.0).astype(np.uint8)
        if scale < 1.0:
            size = round(scale * rgb.shape[1]), round(scale * rgb.shape[0])
            even = cv2.resize(even, size, interpolation=cv2.INTER_AREA)
        image[y : y + even.shape[0], x : x + even.shape[1]] = even
        corners.append((x, y))
    return image, corners, scale

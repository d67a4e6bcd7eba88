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
    middles = [pixels_of[triangles].mean(axis=1) for pixels_of in pixels]
    scores = np.stack(
        [
            _scores(surface, camera, pixels_of, middle, depth.z_m, known)
            for camera, pixels_of, middle, depth, (_, known) in zip(
                cameras, pixels, middles, depths, pictures, strict=True
            )
        ]
    )
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


def _scores(
    surface: Surface,
    camera: Camera,
    pixels: FloatArray,
    middles: FloatArray,
    z_m: FloatArray,
    known: BoolArray | None,
) -> FloatArray:
    """Return (F,) scores: a camera's pixels per area of each triangle, up to a factor; 0 if not seen.

    Args:
        surface: mesh, whose triangles are tested at their corners and middles.
        camera: camera at full image size.
        pixels: (V, 2) pixels of the vertices.
        middles: (F, 2) pixels of the triangles' middles.
        z_m: (h, w) depth of the first surface, at reduced size.
        known: (H, W) True where the photograph is known, or None.
    """
    shape = camera.intrinsics.height_px, camera.intrinsics.width_px
    limits = np.array([shape[1] - 1.0, shape[0] - 1.0])
    inside = np.all((pixels >= 0.0) & (pixels <= limits), axis=1)
    if known is not None:
        inside &= known[_places(pixels, shape)]
    corners_m = surface.vertices_m[surface.triangles]
    normals = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    to_camera_m = camera.T_world_camera[:3, 3] - corners_m.mean(axis=1)
    distance_m = np.maximum(np.linalg.norm(to_camera_m, axis=1), 1e-9)
    cosines = np.abs(np.einsum("fi,fi->f", normals, to_camera_m))
    cosines /= np.maximum(np.linalg.norm(normals, axis=1) * distance_m, 1e-15)
    own_z_m = -to_camera_m @ camera.T_world_camera[:3, 2]
    nearest_m = own_z_m - np.maximum(HIDDEN_M, HIDDEN_SHARE * own_z_m)
    first_m = np.where(np.isfinite(z_m), z_m, np.inf).astype(np.float32)
    around_m = cv2.erode(first_m, np.ones((NEAR_RIM_PX, NEAR_RIM_PX), np.uint8))
    place = _places((middles + 0.5) * _shrink(camera) - 0.5, first_m.shape)
    shown: BoolArray = nearest_m <= first_m[place]
    free = nearest_m <= around_m[place]
    seen = inside[surface.triangles].all(axis=1) & shown & (cosines > LEAST_COSINE)
    return np.where(seen, cosines / distance_m**2 * np.where(free, 1.0, AT_RIM), 0.0)


def _places(pixels: FloatArray, shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Return rows and columns of (N, 2) pixels, clipped to an image of this shape."""
    column, row = np.rint(np.clip(pixels, 0, (shape[1] - 1, shape[0] - 1))).astype(int).T
    return row, column


def _chosen(scores: FloatArray, triangles: IntArray) -> IntArray:
    """Return (F,) best camera of each triangle by (C, F) scores smoothed over neighbours; -1 for none."""
    seen = scores > 0.0
    relative = scores / np.maximum(scores.max(axis=0), 1e-12)
    beside = _neighbours(triangles)
    for _ in range(SMOOTHING_ROUNDS):
        relative = 0.25 * (relative + relative[:, beside].sum(axis=2))
    best = np.where(seen, relative, -1.0).argmax(axis=0)
    return np.where(seen.any(axis=0), best, -1).astype(np.int32)


def _neighbours(triangles: IntArray) -> IntArray:
    """Return (F, 3) triangle beyond each edge; at the boundary the triangle itself."""
    count = len(triangles)
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64), axis=1)
    keys = edges[:, 0] << 32 | edges[:, 1]
    order = np.argsort(keys, kind="stable")
    first = np.flatnonzero(keys[order[:-1]] == keys[order[1:]])
    beside = np.repeat(np.arange(count), 3)
    one, other = order[first], order[first + 1]
    beside[one], beside[other] = other // 3, one // 3
    return beside.reshape(count, 3)


def _gains(seen: BoolArray, middles: Sequence[FloatArray], pictures: Sequence[ByteArray]) -> FloatArray:
    """Return (C, 3) factors that equalise the cameras' exposures, from medians of logarithmic ratios.

    Args:
        seen: (C, F) True for the triangles that each camera sees.
        middles: (F, 2) pixels of the triangles in each camera.
        pictures: photographs of the cameras.
    """
    count = len(pictures)
    logs = [
        np.log(rgb[_places(own, rgb.shape)] + np.float32(DARK))
        for own, rgb in zip(middles, pictures, strict=True)
    ]
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

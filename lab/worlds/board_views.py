"""Rendering of board views: photographs and biased depth by the cameras of a rig (SPEC 1.2, 1.5).

The sheet is sampled with ``OVER`` x ``OVER`` rays per pixel through the true lens, lit by the room's lamps.
Objects in front of it hide it; the room behind it is traced once per camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from lab.worlds.depth_bias import DepthBias
from lab.worlds.film import Film
from lab.worlds.furniture.placing import ORIGIN
from lab.worlds.furniture.placing import board as slab
from lab.worlds.printed import printed, sheet_corners_m, sheet_px
from lab.worlds.render import Exposure, Quality, Renderer
from lab.worlds.scene import Light, Material, Scene
from lab.worlds.sensor import sense_depth
from lab.worlds.textures import parquet, plaster
from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, FloatArray

OVER = 4
"""Rays along each side of a pixel; the pixel's value is the mean of all its rays."""
INK, PAPER, BACK = 0.05, 0.82, 0.45
"""Albedo of the print, of the sheet, and of the board's back."""
LIGHT_STEP_PX = 4
"""Distance between the pixels, in both directions, at which the light on the sheet is traced."""
LIGHT_BLUR = 2.0
"""Standard deviation, in steps of ``LIGHT_STEP_PX``, of the blur that reduces the light's noise."""
NEAREST_M = 0.05
"""A camera sees no place of the sheet with a smaller depth."""
AROUND_M = 0.6
"""Least distance of a plain room's walls from all cameras and boards."""


@dataclass(frozen=True, slots=True)
class BoardCamera:
    """A node with its true parameters; its depth and colour images share one pixel grid."""

    intrinsics: CameraIntrinsics
    T_world_camera: FloatArray
    """(4, 4)."""
    bias: DepthBias = field(default_factory=DepthBias)
    """Bias of its depth sensor; none by default."""


@dataclass(frozen=True, slots=True)
class BoardImage:
    """The images of one camera at one moment."""

    rgb: ByteArray
    """(H, W, 3)."""
    depth: DepthMap
    """(H, W) with the sensor's noise, holes and bias."""


@dataclass(frozen=True, slots=True)
class BoardViews:
    """A board at several moments in front of several cameras."""

    board: Board
    cameras: tuple[BoardCamera, ...]
    T_world_board: tuple[FloatArray, ...]
    """(4, 4) of every moment."""
    images: tuple[tuple[BoardImage, ...], ...]
    """``images[moment][camera]``."""

    def T_camera_board(self, moment: int, camera: int) -> FloatArray:
        """Return the (4, 4) true pose of the board in a camera's frame."""
        return inverse(self.cameras[camera].T_world_camera) @ self.T_world_board[moment]


def render_board_views(
    board: Board,
    cameras: Sequence[BoardCamera],
    T_world_board: Sequence[FloatArray],
    seed: int,
    scene: Scene | None = None,
    quality: Quality = "fast",
    film: Film | None = None,
) -> BoardViews:
    """Render photographs and depth of a board.

    Args:
        board: the printed board.
        cameras: the cameras.
        T_world_board: (4, 4) pose of the board at every moment.
        seed: seed of noise, blur and exposure; every image has its own.
        scene: the room around; None builds a plain one that holds all cameras and boards.
        quality: quality of the room behind the board.
        film: colour film of the cameras; None is the demo scenes' film.

    Raises:
        InputError: a board is partly behind a camera.
    """
    scene = scene or room_around(board, cameras, T_world_board)
    renderer = Renderer(scene)
    rows = []
    for index, camera in enumerate(cameras):
        rng = np.random.default_rng([seed, index])
        room = renderer.exposure(camera.intrinsics, camera.T_world_camera, quality, rng)
        rays = pixel_rays(camera.intrinsics)
        row = []
        for moment, T in enumerate(T_world_board):
            rng = np.random.default_rng([seed, index, moment])
            view = _with_board(room, rays, renderer, board, T, camera, rng).developed(film or Film(), rng)
            sensed = sense_depth(view, camera.intrinsics, rng)
            row.append(BoardImage(view.rgb, camera.bias.measured(sensed)))
        rows.append(row)
    return BoardViews(board, tuple(cameras), tuple(T_world_board), tuple(zip(*rows, strict=True)))


def with_depth_near_boards(views: BoardViews, margin_px: int) -> BoardViews:
    """Return the views without the depth of pixels beyond a margin around the board's bounding rectangle."""
    rows = []
    for moment, images in enumerate(views.images):
        row = []
        for node, image in enumerate(images):
            lens = views.cameras[node].intrinsics
            near = np.zeros(image.depth.z_m.shape, np.uint8)
            window = _window(views.board, views.T_camera_board(moment, node), lens)
            if window is not None:
                near[window] = 1
            near = cv2.dilate(near, np.ones((2 * margin_px + 1,) * 2, np.uint8))
            z_m = np.where(near > 0, image.depth.z_m, np.float32(np.nan))
            row.append(BoardImage(image.rgb, DepthMap(z_m)))
        rows.append(tuple(row))
    return replace(views, images=tuple(rows))


def room_around(board: Board, cameras: Sequence[BoardCamera], T_world_board: Sequence[FloatArray]) -> Scene:
    """Return a plain room, along the world's axes, that holds all cameras and boards."""
    held = [camera.T_world_camera[:3, 3][None] for camera in cameras]
    held += [apply(T, sheet_corners_m(board)) for T in T_world_board]
    low, high = np.concatenate(held).min(axis=0) - AROUND_M, np.concatenate(held).max(axis=0) + AROUND_M
    size, middle = high - low, 0.5 * (low + high)
    textures = (
        (plaster("#d8d2c4", 1), plaster("#9c5a44", 2)),
        (plaster("#b9c4c8", 3), plaster("#c9b79c", 4)),
        (parquet("#b8864f", "#8a5e34", 5), plaster("#e6e4dc", 6)),
    )
    parts = []
    for axis, pair in enumerate(textures):
        for side, texture in zip((-1.0, 1.0), pair, strict=True):
            wall_m, at = size + 0.2, middle.copy()
            wall_m[axis], at[axis] = 0.1, middle[axis] + side * (0.5 * size[axis] + 0.05)
            parts.append(slab(wall_m, Material(texture), ORIGIN, at))
    lamps = [low + size * place for place in ((0.3, 0.35, 0.9), (0.75, 0.6, 0.85))]
    strength = 0.35 * float(np.mean(size**2))
    lights = tuple(Light(at, strength * np.array([1.0, 0.95, 0.88]), 0.15) for at in lamps)
    return Scene("plain room", tuple(parts), lights, np.full(3, 0.35), (), cameras[0].intrinsics)


def _with_board(
    room: Exposure,
    rays: FloatArray,
    renderer: Renderer,
    board: Board,
    T_world_board: FloatArray,
    camera: BoardCamera,
    rng: np.random.Generator,
) -> Exposure:
    """Return the exposure of the room with the board in it; objects in front of the board hide it."""
    T_camera_board = inverse(camera.T_world_camera) @ T_world_board
    window = _window(board, T_camera_board, camera.intrinsics)
    if window is None:
        return room
    faces = float(T_camera_board[:3, 2] @ T_camera_board[:3, 3]) > 0.0
    normal = T_camera_board[:3, 2] * (-1.0 if faces else 1.0)
    z_m = (T_camera_board[:3, 3] @ normal) / (rays[window] @ normal)
    before = (z_m > 0.0) & ~(z_m >= room.z_m[window])
    covered, albedo = _looked_at(board, T_camera_board, rays[window], faces)
    covered *= before

    places_m = apply(camera.T_world_camera, rays[window] * z_m[..., None])
    world_normal = camera.T_world_camera[:3, :3] @ normal
    places_m[~np.isfinite(places_m).all(axis=2)] = T_world_board[:3, 3]  # these pixels do not see the sheet
    light = _light(renderer, places_m, world_normal, rng)
    radiance, depth_m = room.radiance.copy(), room.z_m.copy()
    normals, infrared, gloss = room.normals.copy(), room.infrared.copy(), room.gloss.copy()
    share = covered[..., None]
    radiance[window] = (1.0 - share) * radiance[window] + albedo[..., None] * before[..., None] * light
    on_board = covered > 0.5
    depth_m[window][on_board] = z_m[on_board]
    normals[window][on_board] = world_normal
    infrared[window][on_board] = (albedo / np.maximum(covered, 1e-6))[on_board]
    gloss[window][on_board] = 0.0
    return replace(room, radiance=radiance, z_m=depth_m, normals=normals, infrared=infrared, gloss=gloss)


def is_partly_behind(board: Board, T_camera_board: FloatArray) -> bool:
    """Return whether a part of the sheet, but not all of it, has a depth of more than ``NEAREST_M``."""
    before = apply(T_camera_board, sheet_corners_m(board))[:, 2] > NEAREST_M
    return bool(before.any() and not before.all())


Window = tuple[slice, slice]


def _window(board: Board, T_camera_board: FloatArray, intrinsics: CameraIntrinsics) -> Window | None:
    """Return the rows and columns that the sheet can cover; None if it is out of the picture.

    Raises:
        InputError: the sheet is partly behind the camera.
    """
    if is_partly_behind(board, T_camera_board):
        raise InputError("A board is partly behind a camera; move all of it in front of the camera")
    corners_m = apply(T_camera_board, sheet_corners_m(board))
    if (corners_m[:, 2] <= NEAREST_M).any():
        return None
    # The lens bends the sheet's edges, so points along them, not the corners alone, bound the sheet.
    around = np.linspace(0.0, 1.0, 16, endpoint=False)[:, None]
    edges_m = [
        (1.0 - around) * a + around * b
        for a, b in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True)
    ]
    seen_px = project(intrinsics, np.concatenate(edges_m))
    if np.isnan(seen_px).any():  # the sheet reaches beyond the range of the lens, where it has no pixels
        return slice(0, intrinsics.height_px), slice(0, intrinsics.width_px)
    low = np.clip(np.floor(seen_px.min(axis=0)).astype(int) - 2, 0, None)
    high = np.ceil(seen_px.max(axis=0)).astype(int) + 3
    high = np.minimum(high, (intrinsics.width_px, intrinsics.height_px))
    if (high <= low).any():
        return None
    return slice(low[1], high[1]), slice(low[0], high[0])


def _looked_at(
    board: Board, T_camera_board: FloatArray, rays: FloatArray, faces: bool
) -> tuple[FloatArray, FloatArray]:
    """Return (h, w) share of each pixel that the sheet covers, and that share times its albedo."""
    h, w = rays.shape[:2]
    plane = np.column_stack([T_camera_board[:3, 0], T_camera_board[:3, 1], T_camera_board[:3, 3]])
    on_board = rays.reshape(-1, 3) @ np.linalg.inv(plane).T
    at_px = sheet_px(board, on_board[:, :2] / on_board[:, 2:]).reshape(h, w, 2).astype(np.float32)
    # Within a pixel the sheet is straight to a thousandth of a millimetre, so positions are interpolated.
    x, y = cv2.split(cv2.resize(at_px, (OVER * w, OVER * h), interpolation=cv2.INTER_LINEAR))
    print_ = printed(board)
    inside = (x >= -0.5) & (y >= -0.5) & (x < print_.shape[1] - 0.5) & (y < print_.shape[0] - 0.5)
    covered = inside.astype(np.float32)
    albedo = np.full_like(covered, BACK)
    if faces:
        value = cv2.remap(print_, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        albedo = np.float32(INK) + np.float32((PAPER - INK) / 255.0) * value
    covered_share, albedo_share = (
        cv2.resize(image, (w, h), interpolation=cv2.INTER_AREA) for image in (covered, albedo * covered)
    )
    return covered_share, albedo_share


def _light(
    renderer: Renderer, places_m: FloatArray, normal: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Return (h, w, 3) irradiance of the sheet, traced at every ``LIGHT_STEP_PX``-th pixel and blurred."""
    some_m = places_m[LIGHT_STEP_PX // 2 :: LIGHT_STEP_PX, LIGHT_STEP_PX // 2 :: LIGHT_STEP_PX]
    if not some_m.size:
        some_m = places_m[:1, :1]
    light = renderer.irradiance(some_m, np.broadcast_to(normal, some_m.shape), rng)
    size = places_m.shape[1], places_m.shape[0]
    return cv2.resize(cv2.GaussianBlur(light, (0, 0), LIGHT_BLUR), size, interpolation=cv2.INTER_LINEAR)

"""A box-shaped room with textured walls, seen through any lens: the ray of each pixel meets known planes."""

import cv2
import numpy as np

from pipeline.kernels.geometry import pixel_rays
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame

HALF_M = np.array([2.0, 1.3, 2.4])
"""Half sides of the room around the origin; cameras look along +z."""
PER_M = 100
CAMERA = CameraIntrinsics.pinhole(260.0, 260.0, 159.5, 119.5, 320, 240)


def textures(seed: int, contrast: float = 1.0) -> list[np.ndarray]:
    """Return six grey wall textures, 5 x 5 m, with blobs of several sizes."""
    rng, walls = np.random.default_rng(seed), []
    for _ in range(6):
        wall = np.zeros((500, 500), np.float32)
        for blur in (1.5, 3.0, 6.0, 12.0):
            wall += cv2.GaussianBlur(rng.standard_normal(wall.shape).astype(np.float32), (0, 0), blur) * blur
        walls.append(np.clip(128.0 + contrast * 90.0 * wall, 0.0, 255.0))
    return walls


def seen(walls, T_world_camera, camera=CAMERA, name="node") -> RgbdFrame:
    """Return the colours and the exact depth that a camera in the room sees."""
    rays = pixel_rays(camera)
    directions = rays @ T_world_camera[:3, :3].T
    eye_m = T_world_camera[:3, 3]
    with np.errstate(divide="ignore"):
        along = (np.sign(directions) * HALF_M - eye_m) / directions
    axis = along.argmin(axis=2)
    z_m = along.min(axis=2)
    places_m = eye_m + directions * z_m[..., None]
    gray = np.zeros(z_m.shape, np.float32)
    for side in range(6):
        on = (axis == side % 3) & (
            (np.take_along_axis(places_m, axis[..., None], 2)[..., 0] > 0) == (side < 3)
        )
        u, v = (((places_m[..., k] + 2.5) * PER_M).astype(np.float32) for k in range(3) if k != side % 3)
        gray[on] = cv2.remap(walls[side], u, v, cv2.INTER_LINEAR)[on]
    rgb = np.repeat(np.rint(gray).astype(np.uint8)[..., None], 3, axis=2)
    return RgbdFrame(name, rgb, DepthMap(z_m.astype(np.float32)), camera, np.eye(4), pose_known=False)


def with_tag(wall: np.ndarray, number: int, corner_px: tuple[int, int], side_px: int = 40) -> np.ndarray:
    """Return a wall with an AprilTag on a white sheet; (column, row) of its upper left corner."""
    tag = cv2.aruco.generateImageMarker(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), number, side_px
    )
    sheet = np.pad(tag, side_px // 4, constant_values=255)
    wall = wall.copy()
    column, row = corner_px
    wall[row : row + len(sheet), column : column + len(sheet)] = sheet
    return wall

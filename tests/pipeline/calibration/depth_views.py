"""Depth images of boards by a sensor whose bias and noise are known."""

import cv2
import numpy as np

from lab.claims.calibration.photograph import seen_px
from pipeline.calibration.board import Board
from pipeline.calibration.depth_samples import DepthSamples, board_depth_samples
from pipeline.calibration.estimate import View, calibrate
from pipeline.io.depth_correction import DepthCorrection
from pipeline.kernels.geometry import pixel_rays, project
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise

CAMERA = CameraIntrinsics(
    np.array([[525.0, 0.0, 318.0], [0.0, 527.0, 243.0], [0.0, 0.0, 1.0]]),
    np.array([0.05, -0.08, 0.0, 0.0, 0.0]),
    640,
    480,
)
SIZE = (CAMERA.width_px, CAMERA.height_px)
BOARD = Board()
NOISE = DepthNoise(0.002, 0.0019, 2.36, 0.5)
"""SPEC 1.5's Astra, and a little angle."""
BEHIND_M = 0.6
RAYS = pixel_rays(CAMERA)


def poses(rng, count=16, range_m=(0.5, 1.8), tilt_deg=(10.0, 45.0)):
    """(4, 4) of boards wholly in the picture, tilted to all sides, from near to far."""
    made = []
    for away_m in np.geomspace(*range_m, count):
        while True:
            axis, tilt = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(*tilt_deg))
            turn = np.radians(rng.uniform(-20.0, 20.0))
            R = cv2.Rodrigues(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))[0]
            T = np.eye(4)
            T[:3, :3] = R @ cv2.Rodrigues(np.array([0.0, 0.0, turn]))[0]
            T[:3, 3] = (*(rng.uniform(-0.6, 0.6, 2) * (away_m, 0.75 * away_m)), away_m)
            points_px = seen_px(BOARD, T, CAMERA)
            if ((points_px >= 10.0) & (points_px <= np.array(SIZE) - 11.0)).all():
                made.append(T)
                break
    return made


def view_of(T, noise_px, rng, name=""):
    """The board's points, seen with noise."""
    points_px = seen_px(BOARD, T, CAMERA)
    return View(name, points_px + rng.normal(0.0, noise_px, points_px.shape), BOARD.points_m)


def depth_of(T, bias: DepthCorrection, noise: DepthNoise, rng):
    """What a sensor says of a board before a wall: where the correction gives the true depth, with noise."""
    normal = T[:3, 2]
    true_m = (normal @ T[:3, 3]) / (RAYS @ normal)
    points_m = RAYS * true_m[..., None]
    flat_m = (points_m - T[:3, 3]) @ T[:3, :3]
    half_m = 0.5 * np.ptp(BOARD.points_m[:, :2], axis=0) + BOARD.spacing_m
    on_board = (np.abs(flat_m[..., :2]) <= half_m).all(axis=-1)
    true_m = np.where(on_board, true_m, T[2, 3] + BEHIND_M)
    cosine = np.where(on_board, np.abs(RAYS @ normal) / np.linalg.norm(RAYS, axis=-1), 1.0)
    noisy_m = true_m + rng.standard_normal(true_m.shape) * noise.sd_m(true_m, cosine)
    return DepthMap(measured(noisy_m, bias).astype(np.float32))


def samples(bias, seed, count=16, range_m=(0.5, 1.8), tilt_deg=(10.0, 45.0), noise_px=0.2, noise=NOISE):
    """From images, with a lens that is estimated from the same views."""
    rng = np.random.default_rng(seed)
    boards = poses(rng, count, range_m, tilt_deg)
    views = [view_of(T, noise_px, rng, f"view {index}") for index, T in enumerate(boards)]
    depths = [depth_of(T, bias, noise, rng) for T in boards]
    return board_depth_samples(calibrate(views, SIZE), depths, BOARD)


def quick_samples(
    bias, seed, count=16, range_m=(0.5, 1.8), lens_share=0.001, pose_share=0.0003, of_a_view=300
):
    """Without images: boards are off by a share of their distance each, and by one of the lens."""
    rng = np.random.default_rng(seed)
    focal_off = lens_share * rng.standard_normal()
    parts = []
    for index, T in enumerate(poses(rng, count, range_m)):
        flat_m = rng.uniform(-0.5, 0.5, (of_a_view, 2)) * np.ptp(BOARD.points_m[:, :2], axis=0)
        points_m = np.column_stack([flat_m, np.zeros(of_a_view)]) @ T[:3, :3].T + T[:3, 3]
        z_m, pixels = points_m[:, 2], np.rint(project(CAMERA, points_m)).astype(int)
        cosine = np.abs(points_m @ T[:3, 2]) / np.linalg.norm(points_m, axis=1)
        noisy_m = z_m + NOISE.sd_m(z_m, cosine) * rng.standard_normal(of_a_view)
        share = bias.map_over_image()[pixels[:, 1], pixels[:, 0]]
        believed_m = z_m * (1.0 + focal_off + pose_share * rng.standard_normal())
        parts.append((pixels, _undone(noisy_m, bias, share), believed_m, cosine, np.full(of_a_view, index)))
    pixels, measured_m, true_m, cosine, view = (np.concatenate(column) for column in zip(*parts, strict=True))
    nothing = np.zeros(len(view), bool)
    lens_m, focal = lens_share * true_m[None], np.array([lens_share])
    names = tuple(map(str, range(count)))
    return DepthSamples(SIZE, pixels, measured_m, true_m, cosine, view, nothing, names, lens_m, focal)


def measured(true_m, bias: DepthCorrection):
    """(H, W) what the sensor measures of a true depth."""
    return _undone(true_m, bias, bias.map_over_image())


def _undone(true_m, bias: DepthCorrection, share):
    """What the correction takes to a true depth, where its map has a share."""
    linear, lacking_m = bias.scale + share, bias.offset_m - true_m
    return -2.0 * lacking_m / (linear + np.sqrt(linear**2 - 4.0 * bias.curvature_per_m * lacking_m))

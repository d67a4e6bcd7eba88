"""The chance that a camera measures what the present ones do not, ray by ray (SPEC 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import apply, inverse, pixel_rays, project, scaled
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import Camera, camera_hits, tensor
from pipeline.planning.seen import SeenPlace
from pipeline.planning.sensors import FADE_SHARE, Sensor
from pipeline.planning.views import depth_at
from pipeline.types import BoolArray, FloatArray

SLACK_M = 0.05
"""Surface this close to an estimated point along a ray is the point itself."""
ASKEW, FACING = 0.1, 0.6
"""Cosines between ray and normal at which a guessed surface is never and always measured: its normal is
uncertain, and the rays along it are those that miss it."""
DARK_CHANCE, DARK_RATIOS = 0.7, (0.5, 3.0)
"""Largest chance of measuring a surface that was too dark for a present sensor; and the ratios, of the light
that a new camera gets to the light that this sensor got, at which the chance is 0 and at which it is the
largest."""
DARK_APART_RAD = np.radians(1.0)
"""Angle from the nearest pixel with depth over which that chance falls to 1/e. A sensor gets some returns
from surface that is only a little too dark for it; from glass, a screen or the sky it gets none."""
APART_RAD, APART_FADE_RAD = np.radians(0.9), np.radians(2.7)
"""Depth that is missing for other reasons: the chance is not reduced up to the first angle from the nearest
pixel with depth; over each further second angle it falls to 1/e. All five were chosen on fourteen validation
rooms."""
MARGIN = 0.02
"""Border of an image, as a share of its size, that registered depth does not reach."""
PREVIEW_WIDTH_PX = 48
"""Width of the image with which overlap is estimated."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Chances and overlap of one candidate."""

    chance: FloatArray
    """(T,) float32 chance that it measures each of the targets."""
    overlap_share: float
    """Share of its image on measured surface that one present camera, the best one, sees as well."""


def judge(seen: SeenPlace, T_world_camera: FloatArray, sensor: Sensor) -> Judged:
    """Estimate the chance of each target to be measured by a camera at this pose.

    A target counts if no surface stands between it and the camera, nor between it and the sensor's projector
    or second camera. Its chance is then the product of those by angle, distance and darkness.
    """
    camera = Camera(sensor.intrinsics, T_world_camera)
    targets = seen.targets
    chance = np.zeros(len(targets.points_m), np.float32)
    in_camera_m = apply(inverse(T_world_camera), targets.points_m)
    rows = np.flatnonzero((in_camera_m[:, 2] > sensor.near_m) & (in_camera_m[:, 2] < sensor.far_m))
    pixels = project(sensor.intrinsics, in_camera_m[rows])
    size_px = np.array([sensor.intrinsics.width_px, sensor.intrinsics.height_px])
    rows = rows[np.all((pixels >= MARGIN * size_px) & (pixels < (1.0 - MARGIN) * size_px), axis=1)]
    if len(rows):
        eye_m = T_world_camera[:3, 3]
        likely = _returned(seen, rows, in_camera_m[rows, 2], eye_m, sensor)
        some = likely > 0.0
        rows, likely = rows[some], likely[some]
        points_m = targets.points_m[rows]
        likely *= ~_blocked(seen.whole, points_m, eye_m)
        if sensor.baseline_m:
            other_m = eye_m + sensor.baseline_m * T_world_camera[:3, 0]
            likely *= ~_blocked(seen.whole, points_m, other_m)
        chance[rows] = likely
    return Judged(chance, overlap_share(seen, camera))


def _returned(
    seen: SeenPlace, rows: np.ndarray, z_m: FloatArray, eye_m: FloatArray, sensor: Sensor
) -> FloatArray:
    """Return (R,) chances that enough light returns: by angle, distance, and what present sensors got."""
    targets = seen.targets
    ways_m = targets.points_m[rows] - eye_m
    cosine = -np.sum(ways_m * targets.normals[rows], axis=1) / np.linalg.norm(ways_m, axis=1)
    cosine = np.clip(cosine, 0.0, 1.0)  # from behind, a solid hides its own surface
    chance = np.clip((cosine - ASKEW) / (FACING - ASKEW), 0.0, 1.0)
    chance *= np.clip((sensor.far_m - z_m) / (FADE_SHARE * sensor.far_m), 0.0, 1.0)
    dark, apart_rad = targets.dark_return[rows], targets.apart_rad[rows]
    some = dark > 0.0
    ratio = np.maximum((cosine[some] / z_m[some] ** 2) / dark[some], 1e-9)
    none, all_ = np.log(DARK_RATIOS)
    chance[some] *= DARK_CHANCE * np.clip((np.log(ratio) - none) / (all_ - none), 0.0, 1.0)
    chance[some] *= np.exp(-apart_rad[some] / DARK_APART_RAD)
    chance[~some] *= np.exp(-np.maximum(apart_rad[~some] - APART_RAD, 0.0) / APART_FADE_RAD)
    return chance


def _blocked(scene: o3d.t.geometry.RaycastingScene, points_m: FloatArray, eye_m: FloatArray) -> BoolArray:
    """Return (R,) True where a triangle stands between a place and the points."""
    ways_m = points_m - eye_m
    lengths_m = np.linalg.norm(ways_m, axis=1, keepdims=True)
    ways_m *= 1.0 - SLACK_M / np.maximum(lengths_m, 2.0 * SLACK_M)
    rays = np.concatenate([np.broadcast_to(eye_m, ways_m.shape), ways_m], axis=1)
    return scene.test_occlusions(tensor(rays, np.float32), 0.0, 1.0).numpy()


def overlap_share(seen: SeenPlace, camera: Camera) -> float:
    """Return the share of a camera's image that shows measured surface which one present camera sees, too.

    It is the share for the present camera that shares most: that of the pair by which it is registered.
    """
    small = Camera(
        scaled(camera.intrinsics, PREVIEW_WIDTH_PX / camera.intrinsics.width_px), camera.T_world_camera
    )
    hits = camera_hits(seen.measured, small)
    z_m = hits["t_hit"].numpy().astype(float)
    met = np.isfinite(z_m)
    points_m = apply(camera.T_world_camera, pixel_rays(small.intrinsics)[met] * z_m[met][:, None])
    shares = [0.0]
    for view in seen.views:
        depth_m, image_m = depth_at(points_m, view.camera, view.z_m)
        shares.append(float(np.sum(np.abs(depth_m - image_m) < 0.03 * depth_m + SLACK_M)) / z_m.size)
    return max(shares)

"""Rooms as the nodes of a rig see them, for the tests of this folder."""

import numpy as np

from lab.worlds.render import Renderer
from lab.worlds.scene import Scene
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import PointCloud


def seen_by(scene: Scene, noise_m: float = 0.0, seed: int = 0) -> list[PointCloud]:
    """Every camera's points, in its own frame, with noise along the axis."""
    renderer, rng = Renderer(scene, threads=1), np.random.default_rng(seed)
    rays = pixel_rays(scene.intrinsics)
    clouds = []
    for camera in scene.cameras:
        z_m = renderer.depth(scene.intrinsics, camera).astype(np.float64)
        points_m = (rays * (z_m + noise_m * rng.standard_normal(z_m.shape))[..., None]).reshape(-1, 3)
        clouds.append(PointCloud(points_m[np.isfinite(points_m).all(axis=1)]))
    return clouds

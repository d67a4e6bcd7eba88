"""Recordings of a camera that stands before a wall, in memory and as a folder of TUM's form."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from pipeline.importing.recorded import DepthView
from pipeline.io.intrinsics import write_intrinsics
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, RgbdFrame
from tests.pipeline.recording.rendered import CAMERA

LAW = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)


@dataclass
class Frames:
    """Frames in memory; has what ``recording.Recording`` has."""

    depths_m: list
    rgbs: list
    T_color_depth: np.ndarray = field(default_factory=lambda: np.eye(4))
    color_camera: CameraIntrinsics = CAMERA
    T_world_camera: tuple | None = None
    name: str = "frames"
    notes: tuple = ()

    @property
    def times_s(self):
        return np.arange(len(self.depths_m)) / 30.0

    def view(self, index):
        depth = DepthMap(self.depths_m[index].astype(np.float32))
        return DepthView(depth, CAMERA, self.T_color_depth, LAW)

    def frame(self, index):
        rgb = self.rgbs[index]
        z_m = np.full(rgb.shape[:2], np.nan, np.float32)
        return RgbdFrame(f"frame_{index:05d}", rgb, DepthMap(z_m), self.color_camera, LEVEL_POSE)


def wall(frames, z_m=2.0, seed=0):
    """A floor and a wall, with noise and a hole."""
    rng = np.random.default_rng(seed)
    true_m = np.minimum(z_m, 60.0 / np.maximum(np.arange(120) - 40.0, 1.0))[:, None] * np.ones(160)
    depths_m = [true_m + LAW.sd_m(true_m) * rng.standard_normal(true_m.shape) for _ in range(frames)]
    for depth_m in depths_m:
        depth_m[20:40, 30:50] = np.nan
    return depths_m


def pictures(*levels):
    return [np.full((120, 160, 3), level, np.uint8) for level in levels]


def standing(frames=16, **options):
    return Frames(wall(frames), pictures(*[100] * frames), **options)


def write_tum(folder, depths_m, level=100):
    """Write frames of one colour, 30 a second."""
    folder.mkdir(parents=True, exist_ok=True)
    write_intrinsics(folder / "intrinsics.json", CAMERA)
    lists = {"rgb": [], "depth": []}
    for k, depth_m in enumerate(depths_m):
        units = np.rint(5000.0 * np.nan_to_num(depth_m)).astype(np.uint16)
        images = {"rgb": np.full((*units.shape, 3), level, np.uint8), "depth": units}
        for name, image in images.items():
            (folder / name).mkdir(exist_ok=True)
            cv2.imwrite(str(folder / name / f"{k:04d}.png"), image)
            lists[name].append(f"{k / 30.0:.6f} {name}/{k:04d}.png\n")
    for name, lines in lists.items():
        (folder / f"{name}.txt").write_text("".join(lines))
    return folder

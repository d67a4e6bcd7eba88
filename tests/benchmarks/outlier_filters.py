"""What outlier filters find of flying pixels, what they take of good ones, and how long they need.

``python tests/benchmarks/outlier_filters.py`` runs ours, the thesis's and its two variants, and Open3D's two
on every node of the demo scenes, on two views of each of six rooms that nobody looked at while ours was
written, and on the real frames there are. The sensor model plants flying pixels: a pixel flies if it is
farther than noise goes from everything that truly is within two pixels. Ours was debugged on the living room
and looked at on all demo scenes, but no constant was fitted; Open3D's have the values of its own tutorial.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from lab.claims.depth.scenes import load_real, real_folders
from lab.training.dataset import viewed_room
from lab.training.evaluate import FIRST_TEST_ROOM
from lab.worlds.sensor import sense_depth
from pipeline.acquisition import back_project, find_outliers
from pipeline.acquisition.flying import flying_score
from pipeline.acquisition.planes import FARTHEST_SD, local_planes
from pipeline.config import AcquisitionConfig
from pipeline.io.demos import CALIBRATED_SCENES, load_demo
from pipeline.kernels.geometry import scaled
from pipeline.kernels.open3d_runtime import o3d
from pipeline.types import DepthMap, RgbdFrame
from tests.pipeline.acquisition.depths import off_everything

SLANTED_DEG = 60.0
ROOMS = range(FIRST_TEST_ROOM + 60, FIRST_TEST_ROOM + 66)
NOWHERE_M = 50.0
"""Instead of no depth at all."""
FAR_OFF = 0.05
"""Of the depth: flying pixels that spoil a surface for everyone to see."""
Filter = Callable[[RgbdFrame], np.ndarray]
"""(H, W) True for the pixels that it takes out."""


def flying(frame: RgbdFrame) -> np.ndarray:
    return flying_score(local_planes(frame.depth, frame.intrinsics, frame.noise)) > FARTHEST_SD


def by_neighbours(mode) -> Filter:
    def judge(frame: RgbdFrame) -> np.ndarray:
        cloud = back_project(frame)
        return image_of(
            frame, cloud, find_outliers(cloud, AcquisitionConfig(mode), frame.intrinsics.fx_px).keep
        )

    return judge


def open3d(remove: Callable) -> Filter:
    def judge(frame: RgbdFrame) -> np.ndarray:
        cloud = back_project(frame)
        keep = np.zeros(len(cloud), bool)
        keep[remove(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m)))[1]] = True
        return image_of(frame, cloud, keep)

    return judge


def image_of(frame: RgbdFrame, cloud, keep: np.ndarray) -> np.ndarray:
    out = np.zeros(frame.depth.z_m.shape, bool)
    out[cloud.pixels[~keep, 1], cloud.pixels[~keep, 0]] = True
    return out


FILTERS: dict[str, Filter] = {
    "flying (ours)": flying,
    "thesis": by_neighbours("thesis"),
    "depth_normalised": by_neighbours("depth_normalised"),
    "robust": by_neighbours("robust"),
    "Open3D statistical": open3d(lambda c: c.remove_statistical_outlier(nb_neighbors=20, std_ratio=2.0)),
    "Open3D radius": open3d(lambda c: c.remove_radius_outlier(nb_points=16, radius=0.05)),
}


def demo_frames() -> Iterator[tuple[RgbdFrame, np.ndarray]]:
    for scene in CALIBRATED_SCENES:
        rig = load_demo(scene)
        yield from zip(rig.frames, (depth.z_m for depth in rig.truth.depth), strict=True)


def room_frames() -> Iterator[tuple[RgbdFrame, np.ndarray]]:
    for seed in ROOMS:
        room = viewed_room(seed, None, threads=0, views=2)
        for half, T_world_camera in room.cameras:
            camera = scaled(half, 2.0)
            view = room.renderer.view(camera, T_world_camera, "fast", room.rng)
            depth = sense_depth(view, camera, room.rng)
            yield RgbdFrame(f"room {seed}", view.rgb, depth, camera, T_world_camera), view.z_m


def slanted(frame: RgbdFrame, true_m: np.ndarray) -> np.ndarray:
    """(H, W) where the true surface stands at 60 degrees or more."""
    planes = local_planes(DepthMap(true_m), frame.intrinsics)
    slope = np.hypot(planes.right, planes.down) * true_m * frame.intrinsics.fx_px
    return slope > np.tan(np.radians(SLANTED_DEG))


def table(title: str, frames: Iterable[tuple[RgbdFrame, np.ndarray]]) -> None:
    found: dict[str, list[tuple[float, ...]]] = {name: [] for name in FILTERS}
    for frame, true_m in frames:
        planted = off_everything(frame.depth, np.where(np.isfinite(true_m), true_m, NOWHERE_M))
        good = frame.depth.valid & ~planted
        steep = good & slanted(frame, true_m)
        gross = planted & (np.abs(frame.depth.z_m / true_m - 1.0) > FAR_OFF)
        for name, judge in FILTERS.items():
            started = time.perf_counter()
            out = judge(frame)
            elapsed_s = time.perf_counter() - started
            parts = [
                count for part in (planted, gross, good, steep) for count in (out[part].sum(), part.sum())
            ]
            found[name].append((*parts, elapsed_s))
    print(f"{title:20} flying found   of those 5 % off   good taken   on slants      ms")
    for name, rows in found.items():
        *counts, _ = np.sum(rows, axis=0)
        shares = [taken / there for taken, there in zip(counts[::2], counts[1::2], strict=True)]
        ms = 1000.0 * np.median([row[-1] for row in rows])
        print(f"{name:20} {shares[0]:12.1%} {shares[1]:18.1%} {shares[2]:12.2%} {shares[3]:11.2%} {ms:7.0f}")


def main() -> None:
    table("demo scenes", demo_frames())
    table("rooms not seen", room_frames())
    for frame in map(load_real, real_folders()):
        shares = {name: judge(frame).sum() / frame.depth.valid.sum() for name, judge in FILTERS.items()}
        print(
            f"{frame.name}: of the measured pixels taken: "
            + ", ".join(f"{k} {v:.2%}" for k, v in shares.items())
        )


if __name__ == "__main__":
    main()

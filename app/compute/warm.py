"""``python -m app.compute.warm``: compile the numba functions ahead of their first use."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.acquisition import acquire
from pipeline.config import AcquisitionConfig, RegistrationConfig
from pipeline.delivery import levels
from pipeline.delivery.coding import areas_of
from pipeline.delivery.sink import images_of
from pipeline.delivery.tiled import TILE
from pipeline.depth.extension import extrapolated
from pipeline.depth.robust import best_random_line
from pipeline.kernels.rays import Camera, camera_hits, triangle_scene
from pipeline.registration import register
from pipeline.surface.pivoting import compile_all
from pipeline.surface.smooth import smooth
from pipeline.surface.voxel import voxel_average
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, RgbdFrame


def warm_up() -> Iterator[None]:
    """Run each compiled function once, with yields between them: roll a ball; thin, smooth and register
    points; acquire, encode, decode and fill a depth image; cast rays at a mesh. The compiled code stays on
    disk.
    """
    compile_all()
    yield
    grid_m = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0), [0.0, 1.0]), axis=-1).reshape(-1, 3)
    black = np.zeros(grid_m.shape, np.uint8)
    cloud = PointCloud(grid_m, colors=black, normals=np.tile([0.0, 0.0, 1.0], (len(grid_m), 1)))
    smooth(voxel_average(cloud, 0.5), 1)
    yield
    for direction in ("q2p", "p2q"):
        config = RegistrationConfig(direction=direction, gate_m=1.0, max_points=len(cloud) - 1)
        register(cloud, PointCloud(grid_m + 0.1), config)
        yield
    frame = _frame()
    acquire(frame, AcquisitionConfig())
    yield
    depth = images_of(frame).depth
    areas = areas_of(depth.shape, TILE)
    coded = levels.encode(depth, areas)
    for area, tile in zip(areas, coded.tiles, strict=True):
        levels.decode_tile(np.frombuffer(tile, np.uint8), levels.read_header(coded.header), depth[area].shape)
    yield
    extrapolated(frame.depth.z_m, frame.depth.valid, frame.rgb)
    best_random_line(np.arange(8.0), np.arange(8.0), np.random.default_rng(0))
    yield
    camera_hits(triangle_scene(grid_m, np.array([[0, 1, 2]])), Camera(frame.intrinsics, frame.T_world_camera))
    yield


def _frame() -> RgbdFrame:
    """Return a small RGB-D frame of a depth step with a hole."""
    z_m = np.ones((12, 16), np.float32)
    z_m[:, 8:] = 2.0
    z_m[4:6, 4:6] = np.nan
    camera = CameraIntrinsics.pinhole(20.0, 20.0, 8.0, 6.0, width_px=16, height_px=12)
    return RgbdFrame("a step", np.zeros((12, 16, 3), np.uint8), DepthMap(z_m), camera, np.eye(4))


if __name__ == "__main__":
    for _ in warm_up():
        pass

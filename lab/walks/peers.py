"""Other programs that follow a depth camera, each with the main loop of its own example.

Programs for LiDAR in streets get lengths that suit rooms. The settings gave the smallest ATE on a walk that
the benchmark does not have.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from lab.benchmarks.benchmark import run_alone
from lab.walks.held_out import FramesInMemory, WalkTask
from lab.walks.judging import Program, WalkAnswer, measured
from lab.walks.surfaces import Mesh, Row
from pipeline.kernels.geometry import inverse, orthonormal, pixel_rays
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import tensor
from pipeline.recording.walk import voxel_edge_m
from pipeline.types import FloatArray

odometry: Any = o3d.t.pipelines.odometry
FARTHEST_M = 4.0
"""Largest depth that the peers use."""
UNITS_PER_METRE = 5000.0
"""Units of the 16-bit depth that Open3D gets, because it accepts no other kind together with 8-bit colour."""
ITERATIONS = (20, 20, 20)
"""Most iterations of Open3D's odometry and SLAM at each size of the image. With their defaults, (10, 5, 3)
and (6, 3, 1), the ATE was two to four times as large."""
LEAST_FITNESS, MOST_STEP_M = 0.1, 0.15
"""Open3D's SLAM gives no pose with a smaller share of inliers or a longer step, as in its example."""
FINE_VOXEL_M = 0.0058
"""The default of Open3D's SLAM. With voxels as large as ours it is faster and drifts more."""
OBSERVATIONS = 3.0
"""Least weight of a voxel for Open3D's mesh, its default."""
GICP_THIN_M, GICP_VOXEL_M, GICP_GATE_M = 0.05, 0.2, 0.5
"""small_gicp: voxel that thins a frame, voxel of the map, largest distance of a pair."""
KISS_VOXEL_M, KISS_FIRST_M, KISS_LEAST_M = 0.05, 0.1, 0.005
"""KISS-ICP: voxel of the map, first threshold and least motion; a twentieth of the defaults for streets."""


@dataclass(frozen=True, slots=True)
class WalkPeer:
    """A program that follows a camera."""

    module: str
    """Name of its library's module."""
    program: Program


def available_walk_peers() -> tuple[str, ...]:
    """Return the names of the programs whose libraries are installed."""
    return tuple(name for name, peer in WALK_PEERS.items() if find_spec(peer.module) is not None)


def measure_peer(task: WalkTask) -> Row:
    """Measure one of the programs on a walk in a fresh process; returns the row of ``measured``.

    If the program ends the process, as by a segmentation fault, its row has ``crashed`` and no poses.
    """
    started = time.perf_counter()
    try:
        return run_alone(solve_peer, task)
    except BrokenProcessPool:
        elapsed_s = time.perf_counter() - started
        return run_alone(measured, task, _without_poses) | {
            "crashed": True,
            "elapsed_s": elapsed_s,
            "frames_s": None,
        }


def solve_peer(task: WalkTask) -> Row:
    """Measure one of the programs on a walk in this process."""
    peer = WALK_PEERS[task.program]
    import_module(peer.module)  # before the clock starts
    return measured(task, peer.program)


def _without_poses(frames: FramesInMemory) -> WalkAnswer:
    return WalkAnswer((None,) * len(frames.times_s))


def _open3d_slam(frames: FramesInMemory, voxel_m: float | None = None) -> WalkAnswer:
    """Run Open3D's dense SLAM on the CPU: each frame to the ray-cast model; by default with our voxels."""
    slam, device = o3d.t.pipelines.slam, o3d.core.Device("CPU:0")
    camera = frames.frames[0].intrinsics
    edge_m = voxel_m or voxel_edge_m(frames, range(len(frames.views)))
    model = slam.Model(edge_m, 16, 10_000, tensor(np.eye(4), np.float64), device)
    matrix = tensor(camera.matrix, np.float64)
    seen, cast = (slam.Frame(camera.height_px, camera.width_px, matrix, device) for _ in range(2))
    T: FloatArray = np.eye(4)
    poses: list[FloatArray | None] = []
    for k, (depth, color) in enumerate(_images(frames)):
        seen.set_data_from_image("depth", depth)
        seen.set_data_from_image("color", color)
        step = np.eye(4) if k == 0 else _slam_step(model, seen, cast)
        poses.append(None if step is None else T @ step)
        if step is not None:
            T = orthonormal(T @ step)
        model.update_frame_pose(k, tensor(T, np.float64))
        if step is not None:
            model.integrate(seen, UNITS_PER_METRE, FARTHEST_M)
        model.synthesize_model_frame(cast, UNITS_PER_METRE, 0.1, FARTHEST_M)
    points_m = model.extract_pointcloud(OBSERVATIONS).point.positions.numpy()
    return WalkAnswer(tuple(poses), points_m.astype(np.float64), lambda: _extracted(model))


def _slam_step(model: Any, seen: Any, cast: Any) -> FloatArray | None:
    """Return the (4, 4) motion since the last pose; None if tracking failed."""
    try:
        found = model.track_frame_to_model(
            seen, cast, UNITS_PER_METRE, FARTHEST_M, criteria=_criteria(), method=odometry.Method.PointToPlane
        )
    except RuntimeError:  # too few inliers to solve for a motion
        return None
    step: FloatArray = found.transformation.numpy()
    right = found.fitness >= LEAST_FITNESS and np.linalg.norm(step[:3, 3]) < MOST_STEP_M
    return step if right else None


def _extracted(model: Any) -> Mesh:
    mesh = model.extract_trianglemesh(OBSERVATIONS)
    return Mesh(mesh.vertex.positions.numpy().astype(np.float64), mesh.triangle.indices.numpy())


def _open3d_odometry(frames: FramesInMemory) -> WalkAnswer:
    """Run Open3D's hybrid RGB-D odometry from each frame to the last one with a pose."""
    matrix = tensor(frames.frames[0].intrinsics.matrix, np.float64)
    T: FloatArray = np.eye(4)
    poses: list[FloatArray | None] = []
    before = None
    for depth, color in _images(frames):
        image = o3d.t.geometry.RGBDImage(color, depth)
        if before is not None:
            try:
                found = odometry.rgbd_odometry_multi_scale(
                    image,
                    before,
                    matrix,
                    tensor(np.eye(4), np.float64),
                    UNITS_PER_METRE,
                    FARTHEST_M,
                    _criteria(),
                    odometry.Method.Hybrid,
                )
            except RuntimeError:  # too few inliers to solve for a motion
                poses.append(None)
                continue
            T = orthonormal(T @ found.transformation.numpy())
        before = image
        poses.append(T)
    return WalkAnswer(tuple(poses))


def _criteria() -> list[Any]:
    return [odometry.OdometryConvergenceCriteria(count) for count in ITERATIONS]


def _small_gicp(frames: FramesInMemory) -> WalkAnswer:
    """Run small_gicp's example of odometry: each frame to a map of Gaussian voxels."""
    import small_gicp

    model = small_gicp.GaussianVoxelMap(GICP_VOXEL_M)
    T: FloatArray = np.eye(4)
    motion: FloatArray = np.eye(4)
    poses = []
    for k, points_m in enumerate(_clouds(frames)):
        thin, _ = small_gicp.preprocess_points(points_m, GICP_THIN_M)
        if k:
            found = small_gicp.align(model, thin, T @ motion, GICP_GATE_M)
            T_new = orthonormal(found.T_target_source)
            motion, T = inverse(T) @ T_new, T_new
        model.insert(thin, T)
        poses.append(T)
    return WalkAnswer(tuple(poses))


def _kiss_icp(frames: FramesInMemory) -> WalkAnswer:
    """Run KISS-ICP (Vizzo et al., RA-L 2023) without its correction for the motion during a scan."""
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    settings = KISSConfig()
    settings.data.max_range, settings.data.deskew = 2.0 * FARTHEST_M, False
    settings.mapping.voxel_size = KISS_VOXEL_M
    settings.adaptive_threshold.initial_threshold = KISS_FIRST_M
    settings.adaptive_threshold.min_motion_th = KISS_LEAST_M
    settings.registration.max_num_threads = 1
    tracker, poses = KissICP(settings), []
    for points_m in _clouds(frames):
        tracker.register_frame(points_m, np.empty(0))
        poses.append(np.array(tracker.last_pose))
    return WalkAnswer(tuple(poses))


def _images(frames: FramesInMemory) -> Iterator[tuple[Any, Any]]:
    """Yield each frame's depth and colour as images of Open3D."""
    for frame in frames.frames:
        units = np.rint(np.nan_to_num(frame.depth.z_m) * UNITS_PER_METRE)
        depth = np.where(units <= 65535.0, units, 0.0)[..., None]
        yield (
            o3d.t.geometry.Image(tensor(depth, np.uint16)),
            o3d.t.geometry.Image(tensor(frame.rgb, np.uint8)),
        )


def _clouds(frames: FramesInMemory) -> Iterator[FloatArray]:
    """Yield each frame's (N, 3) points in the camera's frame."""
    rays = pixel_rays(frames.frames[0].intrinsics)
    for frame in frames.frames:
        z_m = frame.depth.z_m
        near = z_m < FARTHEST_M
        yield (rays[near] * z_m[near, None]).astype(np.float64)


WALK_PEERS: dict[str, WalkPeer] = {
    "open3d-slam": WalkPeer("open3d", _open3d_slam),
    "open3d-slam, fine voxels": WalkPeer("open3d", partial(_open3d_slam, voxel_m=FINE_VOXEL_M)),
    "open3d-odometry": WalkPeer("open3d", _open3d_odometry),
    "small-gicp": WalkPeer("small_gicp", _small_gicp),
    "kiss-icp": WalkPeer("kiss_icp", _kiss_icp),
}
"""All programs by name, installed or not."""

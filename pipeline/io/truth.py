"""Ground truth of a rig: ``RIG/truth.ply``, ``RIG/node_NN/true_pose.txt`` and, if the node's own intrinsics
are wrong, ``true_intrinsics.json``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.poses import read_pose, write_pose
from pipeline.kernels.rays import Camera, hit_depths
from pipeline.types import CameraIntrinsics, RgbdFrame, RigTruth, Surface

MESH_NAME = "truth.ply"
POSE_NAME = "true_pose.txt"
INTRINSICS_NAME = "true_intrinsics.json"


def read_truth(directory: Path, names: Sequence[str]) -> RigTruth | None:
    """Read the true surface and the nodes' true poses, and render the true depth of each camera.

    Returns None if the rig has no true surface.

    Raises:
        InputError: a true surface exists but cannot be read, or a node has no true pose.
    """
    if not (directory / MESH_NAME).exists():
        return None
    mesh = read_mesh(directory / MESH_NAME)
    cameras = []
    for name in names:
        path = directory / name / POSE_NAME
        if not path.exists():
            raise InputError(
                f"The rig {directory} has a true surface, but {name} has no {POSE_NAME}; add it, or remove "
                f"{MESH_NAME}"
            )
        lens = directory / name / INTRINSICS_NAME
        known = lens if lens.exists() else lens.with_name("intrinsics.json")
        cameras.append(Camera(read_intrinsics(known), read_pose(path)))
    depth = tuple(hit_depths(mesh.vertices_m, mesh.triangles, cameras))
    poses = tuple(camera.T_world_camera for camera in cameras)
    lenses = tuple(camera.intrinsics for camera in cameras)
    return RigTruth(mesh.vertices_m, mesh.triangles, poses, depth, lenses)


def write_truth(directory: Path, frames: Mapping[str, RgbdFrame], truth: RigTruth) -> None:
    """Write the true surface, and the true pose and intrinsics of every node.

    Args:
        directory: folder of the rig.
        frames: frames by the names of the nodes' folders; true intrinsics are written if they differ.
        truth: the ground truth.

    Raises:
        InputError: the folder cannot be written.
    """
    write_mesh(directory / MESH_NAME, Surface(truth.vertices_m, truth.triangles))
    nodes = zip(frames.items(), truth.T_world_camera, truth.intrinsics, strict=True)
    for (name, frame), T_world_camera, true in nodes:
        write_pose(directory / name / POSE_NAME, T_world_camera)
        if not _same(true, frame.intrinsics):
            write_intrinsics(directory / name / INTRINSICS_NAME, true)


def _same(one: CameraIntrinsics, other: CameraIntrinsics) -> bool:
    return np.array_equal(one.matrix, other.matrix) and np.array_equal(one.distortion, other.distortion)

"""The true surface and poses of a rig: ``RIG/truth.ply`` and ``RIG/node_NN/true_pose.txt``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.meshes import read_mesh, write_mesh
from pipeline.io.poses import read_pose, write_pose
from pipeline.rays import Camera, hit_depths
from pipeline.types import RigTruth, Surface

MESH_NAME = "truth.ply"
POSE_NAME = "true_pose.txt"


def read_truth(directory: Path, names: Sequence[str]) -> RigTruth | None:
    """The true surface and poses of a rig's nodes, with the depth that the true cameras see of it.

    Raises:
        InputError: there is a true surface, but it cannot be read, or a node has no true pose.
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
        cameras.append(Camera(read_intrinsics(directory / name / "intrinsics.json"), read_pose(path)))
    depth = tuple(hit_depths(mesh.vertices_m, mesh.triangles, cameras))
    poses = tuple(camera.T_world_camera for camera in cameras)
    return RigTruth(mesh.vertices_m, mesh.triangles, poses, depth)


def write_truth(directory: Path, names: Sequence[str], truth: RigTruth) -> None:
    """Write the true surface and the true pose of every node in ``names``.

    Raises:
        InputError: the folder cannot be written.
    """
    write_mesh(directory / MESH_NAME, Surface(truth.vertices_m, truth.triangles))
    for name, T_world_camera in zip(names, truth.T_world_camera, strict=True):
        write_pose(directory / name / POSE_NAME, T_world_camera)

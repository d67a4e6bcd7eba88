"""A program's answer on a walk, judged by the truth: trajectory, map and surface (SPEC 10.5)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from lab.walks.held_out import FramesInMemory, WalkTask, frames_in_memory
from lab.walks.surfaces import F_SCORES, Mesh, Row, map_distance_m, surface_errors
from lab.walks.walk import TRUTH, WalkTruth, read_truth
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.memory import peak_memory_bytes
from pipeline.folders.walk import path_m
from pipeline.importing.recorded import open_recording
from pipeline.kernels.geometry import apply, inverse, rigid
from pipeline.recording.errors import ate_m
from pipeline.types import CameraIntrinsics, FloatArray

LOST_M, LOST_SHARE = 0.2, 0.5
"""A walk is lost if its ATE is larger than the first, or a larger share of its frames has no pose."""
RPE_S = 1.0
"""Time over which the relative pose error is measured."""
WARM_FRAMES = 5
"""Frames that a program processes before the clock starts, to load its code."""


@dataclass(frozen=True, slots=True)
class WalkAnswer:
    """A program's answer on a walk."""

    T_world_camera: tuple[FloatArray | None, ...]
    """(4, 4) pose of each frame in any world; None where the program has none."""
    points_m: FloatArray | None = None
    """(N, 3) points of the map in the same world; None from programs without a map."""
    surface: Callable[[], Mesh] | None = None
    """Makes the map's surface, which is timed apart."""


Program = Callable[[FramesInMemory], WalkAnswer]


def measured(task: WalkTask, program: Program) -> Row:
    """Run a program on a walk and judge its answer; a program that raises a PacketMeshError has no poses.

    The time is that from images in memory to poses and map; reading, imports and the surface do not count.
    The peak memory includes the images, the surface and all libraries, so it needs a process of its own.
    """
    frames = frames_in_memory(task.folder, task.every)
    with suppress(PacketMeshError):
        program(frames.first(WARM_FRAMES))
    started = time.perf_counter()
    try:
        answer = program(frames)
    except PacketMeshError:
        answer = WalkAnswer((None,) * len(frames.times_s))
    elapsed_s = time.perf_counter() - started
    poses = tuple(None if T is None or not np.all(np.isfinite(T)) else T for T in answer.T_world_camera)
    started = time.perf_counter()
    mesh = None if answer.surface is None else answer.surface()
    surface_s = None if mesh is None else time.perf_counter() - started
    peak_bytes = peak_memory_bytes()
    T_true, room = reference_of(task.folder)
    return {
        "program": task.program,
        "walk": task.folder.name,
        "every": task.every,
        "frames": len(frames.times_s),
        **trajectory_errors(poses, frames.times_s, T_true, task.every),
        "elapsed_s": elapsed_s,
        "frames_s": len(frames.times_s) / elapsed_s,
        "surface_s": surface_s,
        "peak_memory_bytes": peak_bytes,
        **map_errors(poses, answer.points_m, mesh, frames.frames[0].intrinsics, room, task.every),
    }


def reference_of(folder: Path) -> tuple[list[FloatArray | None], WalkTruth | None]:
    """Return the true pose of each frame of a walk, and the true room (None if the walk is not rendered).

    The true poses of a recording that is not rendered are those that came with it, None where there is none.

    Raises:
        InputError: it has no poses, or cannot be opened.
    """
    if (folder / TRUTH).exists():
        truth = read_truth(folder)
        return list(truth.T_world_camera), truth
    poses = open_recording(folder).T_world_camera
    if poses is None:
        raise InputError(
            f"{folder} has no poses to compare with; try `packetmesh reconstruct --recording {folder}`"
        )
    return list(poses), None


def trajectory_errors(
    T_world_camera: Sequence[FloatArray | None],
    times_s: FloatArray,
    T_true_camera: Sequence[FloatArray | None],
    every: int,
) -> Row:
    """Return the true path's length, ATE, its share of that, RPE, frames without a pose, and whether lost.

    Lengths are in metres. Every ``every``-th true pose belongs to an estimated one.
    """
    T_true = T_true_camera[::every]
    length_m = path_m(tuple(T_true_camera))
    error_m = ate_m(T_world_camera, T_true)
    without = sum(T is None for T in T_world_camera)
    return {
        "path_m": length_m,
        "ate_m": error_m,
        "ate_share": error_m / length_m,
        "rpe_m": rpe_m(T_world_camera, T_true, times_s),
        "without_pose": without,
        "lost": not error_m <= LOST_M or without > LOST_SHARE * len(T_world_camera),
    }


def rpe_m(
    T_world_camera: Sequence[FloatArray | None],
    T_reference_camera: Sequence[FloatArray | None],
    times_s: FloatArray,
    apart_s: float = RPE_S,
) -> float:
    """Return the relative pose error: the RMSE of the translation between poses ``apart_s`` apart.

    Args:
        T_world_camera: (4, 4) poses; None where there is none, which does not count.
        T_reference_camera: as many poses in another world, or None.
        times_s: (N,) their times, seconds.
        apart_s: seconds between the two poses of a motion.

    Returns:
        Metres; NaN if no two known poses are so far apart in time.
    """
    apart_m = []
    for k, later in enumerate(np.searchsorted(times_s, times_s + apart_s - 1e-3)):
        if later >= len(times_s):
            break
        a, b, c, d = (poses[i] for poses in (T_world_camera, T_reference_camera) for i in (k, later))
        if a is not None and b is not None and c is not None and d is not None:
            motion = inverse(c) @ d
            apart_m.append((inverse(motion) @ inverse(a) @ b)[:3, 3])
    return float(np.sqrt(np.mean(np.sum(np.square(apart_m), axis=1)))) if apart_m else float("nan")


def map_errors(
    T_world_camera: Sequence[FloatArray | None],
    points_m: FloatArray | None,
    mesh: Mesh | None,
    camera: CameraIntrinsics,
    truth: WalkTruth | None,
    every: int,
) -> Row:
    """Return the median distance of the map's points to the true surface, and the mesh's ``surface_errors``.

    The map is moved by the mean difference of true and estimated poses. All values are None without a map, a
    true surface or poses.
    """
    T = None if truth is None else to_truth(T_world_camera, list(truth.T_world_camera[::every]))
    if truth is None or T is None or points_m is None or mesh is None or not len(points_m):
        names = ("map_points", "map_median_m", "triangles", *F_SCORES, "without_surface")
        return dict.fromkeys(names)
    return {
        "map_points": len(points_m),
        "map_median_m": map_distance_m(apply(T, points_m), truth),
        "triangles": len(mesh.triangles),
        **surface_errors(Mesh(apply(T, mesh.vertices_m), mesh.triangles), camera, truth),
    }


def to_truth(
    T_world_camera: Sequence[FloatArray | None], T_true_camera: Sequence[FloatArray]
) -> FloatArray | None:
    """Return the (4, 4) T_true_world by all known poses, None without any.

    Its rotation is the chordal mean over the poses; its translation is the mean shift after this rotation.
    """
    known = [(T, T_true_camera[k]) for k, T in enumerate(T_world_camera) if T is not None]
    if not known:
        return None
    turn = Rotation.from_matrix([true[:3, :3] @ own[:3, :3].T for own, true in known]).mean().as_matrix()
    shift_m = np.mean([true[:3, 3] - turn @ own[:3, 3] for own, true in known], axis=0)
    return rigid(turn, shift_m)

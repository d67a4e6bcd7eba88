"""The walk of a camera by PacketMesh: tracking alone, with loops, and with the map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.benchmarks.benchmark import run_alone
from lab.walks.held_out import FramesInMemory, WalkTask
from lab.walks.judging import Mesh, Program, Row, WalkAnswer, measured
from packetmesh.progress import drain
from pipeline.config import PRESETS
from pipeline.kernels.geometry import inverse
from pipeline.recording.loops import iterate_loops
from pipeline.recording.places import iterate_joins, parts_of
from pipeline.recording.tracking import Track, iterate_tracking
from pipeline.recording.walk import iterate_walk
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.radii import radii, spacing
from pipeline.types import FloatArray, PointCloud, PointSource

OURS = "packetmesh"
OURS_TRACKING = "packetmesh, tracking"
OURS_LOOPS = "packetmesh, tracking and loops"


def measure_own(task: WalkTask) -> Row:
    """Measure PacketMesh on a walk in a fresh process; returns the row of ``measured``."""
    return run_alone(solve_own, task)


def solve_own(task: WalkTask) -> Row:
    """Measure PacketMesh on a walk in this process."""
    return measured(task, OWN[task.program])


def _tracked(frames: FramesInMemory) -> WalkAnswer:
    return WalkAnswer(poses_without_loops(drain(iterate_tracking(frames))))


def _looped(frames: FramesInMemory) -> WalkAnswer:
    track = drain(iterate_tracking(frames))
    if not track.clouds:
        return WalkAnswer((None,) * len(frames.times_s))
    return WalkAnswer(drain(iterate_loops(drain(iterate_joins(frames, track)))).T_first_depth)


def _mapped(frames: FramesInMemory) -> WalkAnswer:
    walk = drain(iterate_walk(frames)).walk
    assert walk is not None
    return WalkAnswer(walk.T_world_camera, walk.map.points_m, lambda: _rolled(walk.map))


def _rolled(points: PointCloud) -> Mesh:
    """Roll the ball over a map with the default settings."""
    cloud = replace(points, source=np.full(len(points), PointSource.SENSOR, np.uint8))
    found = roll_or_nothing(cloud, radii(PRESETS["packetmesh"].surface, *spacing(cloud.points_m)))
    return Mesh(found.vertices_m, found.triangles)


def poses_without_loops(track: Track) -> tuple[FloatArray | None, ...]:
    """Return (4, 4) poses along the links of tracking, in the first keyframe's frame.

    Frames outside the largest part have no pose, as at the end.
    """
    if not track.clouds:
        return (None,) * len(track.frames)
    poses: dict[int, FloatArray] = {parts_of(list(track.clouds), track.links)[0][0]: np.eye(4)}
    for _ in track.links:  # a keyframe that was found again may hang on a later one
        for one in track.links:
            if one.target in poses and one.source not in poses:
                poses[one.source] = poses[one.target] @ one.T_target_source
            elif one.source in poses and one.target not in poses:
                poses[one.target] = poses[one.source] @ inverse(one.T_target_source)
        if all(one.source in poses for one in track.links):
            break
    return tuple(
        None
        if frame is None or frame.keyframe not in poses
        else poses[frame.keyframe] @ frame.T_keyframe_frame
        for frame in track.frames
    )


OWN: dict[str, Program] = {OURS: _mapped, OURS_LOOPS: _looped, OURS_TRACKING: _tracked}
"""PacketMesh as far as each name says."""

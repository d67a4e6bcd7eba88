"""PacketMesh on a walk: by tracking alone, with loop closure, and with the map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.benchmarks.benchmark import run_alone
from lab.walks.held_out import FramesInMemory, WalkTask
from lab.walks.judging import Program, WalkAnswer, measured
from lab.walks.surfaces import Mesh, Row
from packetmesh.progress import drain
from pipeline.config import PRESETS
from pipeline.recording.loops import iterate_loops, poses_by_tracking
from pipeline.recording.places import Places, iterate_joins
from pipeline.recording.tracking import iterate_tracking
from pipeline.recording.walk import iterate_walk
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.radii import radii, spacing
from pipeline.types import PointCloud, PointSource

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
    track = drain(iterate_tracking(frames))
    return WalkAnswer(poses_by_tracking(track) if track.clouds else (None,) * len(frames.times_s))


def _looped(frames: FramesInMemory) -> WalkAnswer:
    track = drain(iterate_tracking(frames))
    if not track.clouds:
        return WalkAnswer((None,) * len(frames.times_s))
    places = Places(frames)
    return WalkAnswer(drain(iterate_loops(drain(iterate_joins(places, track)), places)).T_first_depth)


def _mapped(frames: FramesInMemory) -> WalkAnswer:
    walk = drain(iterate_walk(frames)).walk
    assert walk is not None
    return WalkAnswer(walk.T_world_camera, walk.map.points_m, lambda: _rolled(walk.map))


def _rolled(points: PointCloud) -> Mesh:
    """Return the mesh of the ball rolled over a map with the default radii; its holes are not closed."""
    cloud = replace(points, source=np.full(len(points), PointSource.SENSOR, np.uint8))
    found = roll_or_nothing(cloud, radii(PRESETS["packetmesh"].surface, *spacing(cloud.points_m)))
    return Mesh(found.vertices_m, found.triangles)


OWN: dict[str, Program] = {OURS: _mapped, OURS_LOOPS: _looped, OURS_TRACKING: _tracked}
"""Variants of PacketMesh by name: with loops and map, with loops, and with tracking alone."""

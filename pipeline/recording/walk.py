"""A recording's camera path and map: track, close loops, and integrate every frame (SPEC 10)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import nullcontext
from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.importing.upright import upright
from pipeline.kernels.geometry import LEVEL_POSE, inverse
from pipeline.recording.checkpoint import Checkpoint, checkpoint_of
from pipeline.recording.errors import path_note
from pipeline.recording.given import Given, checked_poses
from pipeline.recording.loops import Trajectory, iterate_loops, poses_by_tracking
from pipeline.recording.photographs import iterate_photographs
from pipeline.recording.places import Places, iterate_joins
from pipeline.recording.recording import Recording, read_ahead, spread
from pipeline.recording.tracking import REPORTED, WITHIN, Track, iterate_tracking
from pipeline.recording.volume import Volume, voxel_for
from pipeline.registration.organised import shared_shares
from pipeline.types import FloatArray, IntArray, PointCloud, Rig, Walk

LEAST_FRAMES = 2
LEAST_OBSERVATIONS = 2
"""Least number of observations of a point of the map."""
FEW_FRAMES = 10
"""With fewer frames that have a pose, one observation is enough."""
SHOWN = 0.7
"""Share of each keyframe that one of the chosen views sees, unless there are too many views."""
MOST_VIEWS, MOST_COMPARED = 12, 96
"""Most keyframes that become nodes, and from which they are chosen."""
FARTHEST_VIEW_M, FACING = 2.0, 0.5
"""Keyframes farther apart, or with more than 60 degrees (its cosine) between their axes, are not compared."""


def iterate_walk(recording: Recording) -> Generator[Progress, None, Rig]:
    """Turn a recording into a rig: a few keyframes with final poses, and the map of all frames.

    The state of tracking, if it was written, stays (``Walk.state``) until the caller has written its results.

    Raises:
        InputError: the recording has too few frames, or an image cannot be read.
    """
    if len(recording.times_s) < LEAST_FRAMES:
        raise InputError(f"{recording.name} has too few frames: a recording needs {LEAST_FRAMES}")
    yield Progress("reading the first frames", 0.0)
    given = checked_poses(recording)
    checkpoint = checkpoint_of(recording, given.T_world_camera)
    with nullcontext() if checkpoint is None else checkpoint.said():
        return (yield from _iterate_rig(recording, given, checkpoint))


def _iterate_rig(
    recording: Recording, given: Given, checkpoint: Checkpoint | None
) -> Generator[Progress, None, Rig]:
    """Track, close loops and integrate, from the poses and the state there are."""
    tracking = iterate_tracking(recording, given.T_world_camera, checkpoint)
    track = yield from part(tracking, "tracking", 0.0, 0.45, detail=True)
    if not track.clouds:
        raise InputError(f"No frame of {recording.name} has enough depth; check its depth images and scale")
    places = Places(recording)
    track = yield from part(iterate_joins(places, track), "parts", 0.45, 0.47, detail=True)
    trajectory = yield from part(iterate_loops(track, places), "loops", 0.47, 0.55, detail=True)
    T_world_first, turned = _world(recording, given.T_world_camera, trajectory)
    T_world_depth = [None if T is None else T_world_first @ T for T in trajectory.T_first_depth]
    steps = iterate_map(recording, T_world_depth)
    points, first, voxel_m = yield from part(steps, "mapping", 0.55, 0.93, detail=True)
    T_depth_color = inverse(recording.view(0).T_color_depth)
    poses = tuple(None if T is None else T @ T_depth_color for T in T_world_depth)
    tracked = tuple(
        None if T is None else T_world_first @ T @ T_depth_color for T in poses_by_tracking(track)
    )
    keyframes, links = tuple(trajectory.keyframes), trajectory.links
    views = yield from part(iterate_views(trajectory, track), "views", 0.93, 0.95, detail=True)
    reading = iterate_photographs(recording, poses, views, keyframes, points)
    seen = yield from part(reading, "photographs", 0.95, 1.0, detail=True)
    given_poses = given.T_world_camera or [None] * len(poses)
    corrected = path_note(poses, given_poses, "that of the given poses")
    notes = (*recording.notes, *given.notes, *corrected, *turned)
    colored = replace(points, colors=seen.colors)
    resumed_s = 0.0 if checkpoint is None else checkpoint.resumed_s
    state = checkpoint.path if checkpoint is not None and checkpoint.path.exists() else None
    walk = Walk(
        times_s=recording.times_s,
        T_world_camera=poses,
        keyframes=keyframes,
        links=links,
        map=colored,
        voxel_m=voxel_m,
        first_frames=first,
        T_world_tracked=tracked,
        notes=notes,
        resumed_s=resumed_s,
        without_depth=track.blind,
        apart=_apart(track, poses),
        disturbed=tuple(k for k in track.disturbed if poses[k] is not None),
        state=state,
    )
    return Rig(recording.name, seen.views, walk=walk)


def _apart(track: Track, poses: Sequence[FloatArray | None]) -> tuple[int, ...]:
    """Return the frames of parts that were not joined, with those lost just before each part began."""
    found, blind = set[int](), set(track.blind)
    for k in reversed(range(len(poses))):
        tracked = track.frames[k] is not None
        if poses[k] is None and (tracked or (k + 1 in found and k not in blind)):
            found.add(k)
    return tuple(sorted(found))


def iterate_map(
    recording: Recording, T_world_depth: Sequence[FloatArray | None]
) -> Generator[Progress, None, tuple[PointCloud, IntArray, float]]:
    """Integrate all frames with a pose.

    Returns the map's N points, (N,) the frame that measured each first, and the edge of the voxels.

    Args:
        recording: the frames.
        T_world_depth: (4, 4) pose of the depth camera at each frame; None where it is unknown.
    """
    numbers = [k for k, T in enumerate(T_world_depth) if T is not None]
    voxel_m = voxel_edge_m(recording, numbers)
    volume = Volume(voxel_m)
    for count, (k, view) in enumerate(read_ahead(recording, numbers)):
        if count % REPORTED == 0:
            yield Progress(f"frame {k} of {len(T_world_depth)}", count / len(numbers))
        T = T_world_depth[k]
        assert T is not None
        volume.integrate(view, T)
    least = LEAST_OBSERVATIONS if len(numbers) >= FEW_FRAMES else 1
    points, first = volume.dated_points(least)
    return points, np.array(numbers)[first], voxel_m


def voxel_edge_m(recording: Recording, numbers: Sequence[int]) -> float:
    """Return the edge of the map's voxels, by noise and pixels at the median depth of a few frames."""
    found = []
    for k in numbers[:: max(1, len(numbers) // 5)]:
        view = recording.view(k)
        z_m = np.median(view.depth.z_m[view.depth.valid], keepdims=True)
        found.append((view.noise.sd_m(z_m)[0], z_m[0] / view.camera.fx_px))
    noise_m, pixel_m = np.median(found, axis=0)
    return voxel_for(float(noise_m), float(pixel_m))


def _world(
    recording: Recording, given: Sequence[FloatArray | None] | None, trajectory: Trajectory
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return (4, 4) T_world_first, and a note if the given poses' world was turned so that z is up.

    The first keyframe with a given pose gets that one; without any, the first keyframe looks level.
    """
    T: FloatArray = LEVEL_POSE @ recording.view(next(iter(trajectory.keyframes))).T_color_depth
    note: tuple[str, ...] = ()
    for number, T_first_depth in trajectory.keyframes.items():
        own = None if given is None else given[number]
        if own is not None:
            T = own @ recording.view(number).T_color_depth @ inverse(T_first_depth)
            note = ("The world of the given poses was turned so that z is up",)
            break
    turn = upright([T @ pose for pose in trajectory.keyframes.values()])
    return (T, ()) if turn is None else (turn @ T, note)


def iterate_views(trajectory: Trajectory, track: Track) -> Generator[Progress, None, list[int]]:
    """Choose keyframes as views until each keyframe is seen to ``SHOWN`` by one, at most ``MOST_VIEWS``.

    In each step the keyframe is chosen that sees most of those left. Of many keyframes ``MOST_COMPARED`` are
    compared. Returns frame numbers, ascending.
    """
    numbers = spread(list(trajectory.keyframes), MOST_COMPARED)
    T = np.array([trajectory.keyframes[number] for number in numbers])
    shown = np.eye(len(numbers), dtype=bool)
    for j, target in enumerate(numbers):
        if j % REPORTED == 0:
            yield Progress(f"choosing views, keyframe {target}", j / len(numbers))
        T_target_source = inverse(T[j]) @ T
        near = np.linalg.norm(T_target_source[:, :3, 3], axis=1) <= FARTHEST_VIEW_M
        for i in np.flatnonzero(near & (T_target_source[:, 2, 2] >= FACING)):
            if i != j:
                shares = track.clouds[numbers[i]], track.clouds[target], T_target_source[i]
                overlap, agreeing = shared_shares(*shares, WITHIN)
                shown[i, j] = overlap * agreeing >= SHOWN
    chosen: list[int] = []
    left = np.ones(len(numbers), bool)
    while left.any() and len(chosen) < MOST_VIEWS:
        best = int((shown & left[:, None]).sum(axis=0).argmax())
        chosen.append(best)
        left &= ~shown[:, best]
    return [numbers[place] for place in sorted(chosen)]

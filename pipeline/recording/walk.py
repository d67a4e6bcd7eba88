"""A recording's camera path and map: track, close loops, and integrate every frame (SPEC 10)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.importing.upright import upright
from pipeline.kernels.geometry import LEVEL_POSE, apply, inverse, project
from pipeline.recording.errors import ate_m
from pipeline.recording.given import checked_poses
from pipeline.recording.loops import Trajectory, iterate_loops, poses_by_tracking
from pipeline.recording.places import iterate_joins
from pipeline.recording.recording import Recording
from pipeline.recording.tracking import REPORTED, WITHIN, Track, iterate_tracking, read_ahead
from pipeline.recording.volume import Volume, voxel_for
from pipeline.registration.organised import OrganisedCloud, shared_shares
from pipeline.types import FloatArray, IntArray, PointCloud, RgbdFrame, Rig, Walk

LEAST_FRAMES = 2
LEAST_OBSERVATIONS = 2
"""Least number of observations of a point of the map."""
FEW_FRAMES = 10
"""With fewer frames that have a pose, one observation is enough."""
SHOWN = 0.7
"""Share of each keyframe that one of the chosen views sees, unless there are too many views."""
MOST_VIEWS, FARTHEST_VIEW_M = 12, 2.0
"""Most keyframes whose colours are used; those farther apart are not compared."""
SAME_DEPTH = 0.02
"""Largest difference of a point's depth from the measured one, as a share, at a view that colours it."""


def iterate_walk(recording: Recording) -> Generator[Progress, None, Rig]:
    """Turn a recording into a rig: a few keyframes with final poses, and the map of all frames.

    Raises:
        InputError: the recording has too few frames, or an image cannot be read.
    """
    if len(recording.times_s) < LEAST_FRAMES:
        raise InputError(f"{recording.name} has too few frames: a recording needs {LEAST_FRAMES}")
    yield Progress("reading the first frames", 0.0)
    given = checked_poses(recording)
    tracking = iterate_tracking(recording, given.T_world_camera)
    track = yield from part(tracking, "tracking", 0.0, 0.45, detail=True)
    if not track.clouds:
        raise InputError(f"No frame of {recording.name} has enough depth; check its depth images and scale")
    track = yield from part(iterate_joins(recording, track), "parts", 0.45, 0.47, detail=True)
    trajectory = yield from part(iterate_loops(track), "loops", 0.47, 0.55, detail=True)
    T_world_first, turned = _world(recording, given.T_world_camera, trajectory)
    T_world_depth = [None if T is None else T_world_first @ T for T in trajectory.T_first_depth]
    steps = iterate_map(recording, T_world_depth)
    points, first, voxel_m = yield from part(steps, "mapping", 0.55, 0.95, detail=True)
    T_depth_color = inverse(recording.view(0).T_color_depth)
    poses = tuple(None if T is None else T @ T_depth_color for T in T_world_depth)
    tracked = tuple(
        None if T is None else T_world_first @ T @ T_depth_color for T in poses_by_tracking(track)
    )
    frames, unreadable = yield from _photographed(recording, poses, views_of(trajectory, track))
    colored = replace(points, colors=colors_of(points, frames))
    notes = (*recording.notes, *given.notes, *_corrected(poses, given.T_world_camera), *turned, *unreadable)
    keyframes, links = tuple(trajectory.keyframes), trajectory.links
    walk = Walk(recording.times_s, poses, keyframes, links, colored, voxel_m, first, tracked, notes)
    return Rig(recording.name, tuple(frames), walk=walk)


def _photographed(
    recording: Recording, T_world_camera: Sequence[FloatArray | None], numbers: Sequence[int]
) -> Generator[Progress, None, tuple[list[RgbdFrame], list[str]]]:
    """Read some frames, which get their poses; returns them, and a sentence on each that cannot be read.

    Raises:
        InputError: none can be read.
    """
    frames, unreadable = [], []
    for number in numbers:
        yield Progress(f"reading frame {number}", 0.95)
        T = T_world_camera[number]
        assert T is not None
        try:
            frames.append(replace(recording.frame(number), T_world_camera=T, pose_known=True))
        except InputError as error:
            unreadable.append(f"{error}: frame {number} gives no colours")
    if not frames:
        raise InputError(unreadable[0])
    return frames, unreadable


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
            yield Progress(f"mapping frame {k} of {len(T_world_depth)}", count / len(numbers))
        T = T_world_depth[k]
        assert T is not None
        volume.integrate(view.depth, view.camera, T, view.noise)
    least = LEAST_OBSERVATIONS if len(numbers) >= FEW_FRAMES else 1
    points, first = volume.dated_points(least)
    return points, np.array(numbers)[first], voxel_m


def _corrected(
    T_world_camera: Sequence[FloatArray | None], given: Sequence[FloatArray] | None
) -> tuple[str, ...]:
    """Return a sentence on how far the camera's path is from that of the given poses."""
    if given is None:
        return ()
    apart_m = ate_m(T_world_camera, given)
    if np.isnan(apart_m):
        return ()
    return (f"The path differs from that of the given poses by {100.0 * apart_m:.1f} cm (RMSE, aligned)",)


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
    recording: Recording, given: Sequence[FloatArray] | None, trajectory: Trajectory
) -> tuple[FloatArray, tuple[str, ...]]:
    """Return (4, 4) T_world_first in the world of given poses or another, with z up; and a note if turned."""
    first = next(iter(trajectory.keyframes))
    T: FloatArray = (LEVEL_POSE if given is None else given[first]) @ recording.view(first).T_color_depth
    turn = upright([T @ pose for pose in trajectory.keyframes.values()])
    if turn is None:
        return T, ()
    return turn @ T, () if given is None else ("The world of the given poses was turned so that z is up",)


def views_of(trajectory: Trajectory, track: Track) -> list[int]:
    """Choose keyframes until each keyframe shares ``SHOWN`` with one of them, at most ``MOST_VIEWS``.

    Those that most others share with come first.
    """
    numbers = list(trajectory.keyframes)
    shown = np.eye(len(numbers), dtype=bool)
    for i, source in enumerate(numbers):
        for j, target in enumerate(numbers):
            T = inverse(trajectory.keyframes[target]) @ trajectory.keyframes[source]
            if i != j and np.linalg.norm(T[:3, 3]) <= FARTHEST_VIEW_M:
                shown[i, j] = _looks_there(track.clouds[source], track.clouds[target], T)
    chosen: list[int] = []
    left = np.ones(len(numbers), bool)
    while left.any() and len(chosen) < MOST_VIEWS:
        best = int((shown & left[:, None]).sum(axis=0).argmax())
        chosen.append(best)
        left &= ~shown[:, best]
    return [numbers[place] for place in sorted(chosen)]


def _looks_there(source: OrganisedCloud, target: OrganisedCloud, T_target_source: FloatArray) -> bool:
    """Return whether the target sees ``SHOWN`` of the source."""
    if T_target_source[2, 2] < 0.5:  # the optical axes are more than 60 degrees apart
        return False
    overlap, agreeing = shared_shares(source, target, T_target_source, WITHIN)
    return overlap * agreeing >= SHOWN


def colors_of(points: PointCloud, frames: Sequence[RgbdFrame]) -> np.ndarray:
    """Return (N, 3) RGB of points, the mean over the views that measured them; grey where none did.

    A view's weight is the cosine of incidence over the squared distance.
    """
    total, weights = np.zeros((len(points), 3)), np.zeros(len(points))
    for frame in frames:
        own_m = apply(inverse(frame.T_world_camera), points.points_m)
        ahead = np.flatnonzero(own_m[:, 2] > 0.05)
        pixels = project(frame.intrinsics, own_m[ahead])
        pixels = np.nan_to_num(np.rint(pixels), nan=-1.0).astype(int)
        size = frame.intrinsics.width_px, frame.intrinsics.height_px
        inside = np.all((pixels >= 0) & (pixels < size), axis=1)
        rows, (u, v) = ahead[inside], pixels[inside].T
        z_m = own_m[rows, 2]
        seen = np.abs(frame.depth.z_m[v, u] - z_m) <= SAME_DEPTH * z_m
        rows, u, v = rows[seen], u[seen], v[seen]
        distance_m = np.linalg.norm(own_m[rows], axis=1)
        facing = (
            -np.einsum(
                "ni,ni->n", np.asarray(points.normals)[rows] @ frame.T_world_camera[:3, :3], own_m[rows]
            )
            / distance_m
        )
        weight = np.maximum(facing, 0.05) / distance_m**2
        total[rows] += weight[:, None] * frame.rgb[v, u]
        weights[rows] += weight
    known = weights > 0.0
    colors = np.full((len(points), 3), 128, np.uint8)
    colors[known] = np.rint(total[known] / weights[known, None]).astype(np.uint8)
    return colors

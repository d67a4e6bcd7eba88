"""A recording's camera path and map: track, close loops, and integrate every frame (SPEC 10)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.importing.upright import upright
from pipeline.kernels.geometry import LEVEL_POSE, apply, inverse, project
from pipeline.recording.given import checked_poses
from pipeline.recording.loops import Trajectory, iterate_loops
from pipeline.recording.places import iterate_joins
from pipeline.recording.recording import Recording
from pipeline.recording.tracking import REPORTED, WITHIN, Track, iterate_tracking, read_ahead
from pipeline.recording.volume import Volume, voxel_for
from pipeline.registration.organised import OrganisedCloud, shared_shares
from pipeline.types import FloatArray, PointCloud, RgbdFrame, Rig, Walk

LEAST_FRAMES = 2
LEAST_OBSERVATIONS = 2
"""Frames that must have seen a point of the map."""
FEW_FRAMES = 10
"""In a recording with fewer frames one observation is enough."""
SHOWN = 0.7
"""Share of each keyframe that one of the chosen views sees, at least."""
MOST_VIEWS = 12
"""Most keyframes whose colours are used."""
SAME_DEPTH = 0.02
"""Largest difference of a point's depth from the measured one, as a share, at a view that colours it."""


def iterate_walk(recording: Recording) -> Generator[Progress, None, Rig]:
    """Turn a recording into a rig: a few keyframes with final poses, and the map of all frames.

    Raises:
        InputError: the recording has too few frames, or an image cannot be read.
    """
    if len(recording.times_s) < LEAST_FRAMES:
        raise InputError(f"{recording.name} has {len(recording.times_s)} frames; a walk needs {LEAST_FRAMES}")
    yield Progress("reading the first frames", 0.0)
    given = checked_poses(recording)
    tracking = iterate_tracking(recording, given.T_world_camera)
    track = yield from part(tracking, "tracking", 0.0, 0.45, detail=True)
    if not track.clouds:
        raise InputError(f"No frame of {recording.name} has enough depth; check its depth images and scale")
    track = yield from part(iterate_joins(recording, track), "parts", 0.45, 0.47, detail=True)
    trajectory = yield from part(iterate_loops(track), "loops", 0.47, 0.55, detail=True)
    T_world_first = _world(recording, given.T_world_camera, trajectory)
    T_world_depth = [None if T is None else T_world_first @ T for T in trajectory.T_first_depth]
    steps = iterate_map(recording, T_world_depth)
    points, voxel_m = yield from part(steps, "mapping", 0.55, 0.95, detail=True)
    T_depth_color = inverse(recording.view(0).T_color_depth)
    poses = tuple(None if T is None else T @ T_depth_color for T in T_world_depth)
    frames = []
    for number in views_of(trajectory, track):
        yield Progress(f"reading frame {number}", 0.95)
        pose = poses[number]
        assert pose is not None
        frames.append(replace(recording.frame(number), T_world_camera=pose, pose_known=True))
    colored = replace(points, colors=colors_of(points, frames))
    notes = (*recording.notes, *given.notes)
    keyframes, links = tuple(trajectory.keyframes), trajectory.links
    walk = Walk(recording.times_s, poses, keyframes, links, colored, voxel_m, notes)
    return Rig(recording.name, tuple(frames), walk=walk)


def iterate_map(
    recording: Recording, T_world_depth: Sequence[FloatArray | None]
) -> Generator[Progress, None, tuple[PointCloud, float]]:
    """Integrate all frames with a pose; returns the map's points and the edge of its voxels.

    Args:
        recording: the frames.
        T_world_depth: (4, 4) pose of the depth camera at each frame; None where it is unknown.
    """
    numbers = [k for k, T in enumerate(T_world_depth) if T is not None]
    voxel_m = voxel_for(*_noise_and_pixel_m(recording, numbers))
    volume = Volume(voxel_m)
    for count, (k, view) in enumerate(read_ahead(recording, numbers)):
        if count % REPORTED == 0:
            yield Progress(f"mapping frame {k} of {len(T_world_depth)}", count / len(numbers))
        T = T_world_depth[k]
        assert T is not None
        volume.integrate(view.depth, view.camera, T, view.noise)
    least = LEAST_OBSERVATIONS if len(numbers) >= FEW_FRAMES else 1
    return volume.points(least), voxel_m


def _noise_and_pixel_m(recording: Recording, numbers: Sequence[int]) -> tuple[float, float]:
    """Return the noise and the distance of two pixels on a surface, at the median depth of a few frames."""
    found = []
    for k in numbers[:: max(1, len(numbers) // 5)]:
        view = recording.view(k)
        z_m = np.median(view.depth.z_m[view.depth.valid], keepdims=True)
        found.append((view.noise.sd_m(z_m)[0], z_m[0] / view.camera.fx_px))
    noise_m, pixel_m = np.median(found, axis=0)
    return float(noise_m), float(pixel_m)


def _world(recording: Recording, given: Sequence[FloatArray] | None, trajectory: Trajectory) -> FloatArray:
    """Return T_world_first: the world of given poses if there are any, else one with z up."""
    first = next(iter(trajectory.keyframes))
    view = recording.view(first)
    T: FloatArray = (LEVEL_POSE if given is None else given[first]) @ view.T_color_depth
    turn = upright([T @ pose for pose in trajectory.keyframes.values()])
    return T if turn is None else turn @ T


def views_of(trajectory: Trajectory, track: Track) -> list[int]:
    """Choose keyframes that together see all that the keyframes see, at most ``MOST_VIEWS``.

    Each keyframe not chosen shares ``SHOWN`` with one that is; those that many others share with come first.
    """
    numbers = list(trajectory.keyframes)
    shown = np.eye(len(numbers), dtype=bool)
    for i, source in enumerate(numbers):
        for j, target in enumerate(numbers):
            if i != j:
                T = inverse(trajectory.keyframes[target]) @ trajectory.keyframes[source]
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

    A view counts by the cosine of incidence over the squared distance.
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
        normals = np.ones((len(rows), 3)) if points.normals is None else points.normals[rows]
        facing = -np.einsum("ni,ni->n", normals @ frame.T_world_camera[:3, :3], own_m[rows]) / distance_m
        weight = np.maximum(facing, 0.05) / distance_m**2
        total[rows] += weight[:, None] * frame.rgb[v, u]
        weights[rows] += weight
    known = weights > 0.0
    colors = np.full((len(points), 3), 128, np.uint8)
    colors[known] = np.rint(total[known] / weights[known, None]).astype(np.uint8)
    return colors

"""Poses of recordings whose y axis points up, recognised by their depth.

ICL-NUIM gives fy = -480: its camera frame, and with it its world, has y up and is left-handed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.importing.depth_units import depth_in
from pipeline.importing.sequence import Candidate, Sequence
from pipeline.kernels.geometry import apply, inverse, pixel_rays, project
from pipeline.types import CameraIntrinsics, FloatArray

_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
_STEPS = (1, 2, 5, 10, 20, 50, 100)
"""Distances, in frames, between two frames that are compared."""
_EVERY_PX = 8
"""Every so many rows and columns of a depth image are compared."""
_WITHIN = 0.02
"""Share of the depth within which two frames agree."""
_CLEARLY = 1.1
"""Ratio of agreeing points, with mirrored to those with plain poses, above which poses are mirrored."""


def y_points_up(sequence: Sequence) -> bool:
    """Return whether depth of different frames agrees clearly better with mirrored poses."""
    plain = mirrored = 0
    middle = len(sequence.candidates) // 2
    for start in sorted({0, middle}):
        for other in (start + step for step in _STEPS if start + step < len(sequence.candidates)):
            pair = sequence.candidates[start], sequence.candidates[other]
            try:
                own, seen = (depth_in(candidate, sequence).depth.z_m for candidate in pair)
            except InputError:  # one frame without depth does not decide
                continue
            if (T := _relative(*pair)) is None:
                continue
            plain += _agreeing(own, seen, T, sequence.camera)
            mirrored += _agreeing(own, seen, _MIRROR @ T @ _MIRROR, sequence.camera)
    return mirrored > _CLEARLY * plain


def mirrored_poses(sequence: Sequence, note: str) -> Sequence:
    """Return the sequence with poses of a right-handed world and cameras with y down, and with a note."""
    candidates = tuple(
        candidate
        if candidate.T_world_camera is None
        else replace(candidate, T_world_camera=_MIRROR @ candidate.T_world_camera @ _MIRROR)
        for candidate in sequence.candidates
    )
    return replace(sequence, candidates=candidates, notes=(*sequence.notes, note))


def _relative(one: Candidate, other: Candidate) -> FloatArray | None:
    """Return the (4, 4) T_other_one; None if a pose is unknown."""
    if one.T_world_camera is None or other.T_world_camera is None:
        return None
    return inverse(other.T_world_camera) @ one.T_world_camera


def _agreeing(
    own_m: FloatArray, other_m: FloatArray, T_other_own: FloatArray, camera: CameraIntrinsics
) -> int:
    """Return the number of points of one depth image that agree with the depth of the other."""
    if own_m.shape != (camera.height_px, camera.width_px) or other_m.shape != own_m.shape:
        return 0
    step = slice(None, None, _EVERY_PX)
    points_m = (pixel_rays(camera) * own_m[..., None])[step, step].reshape(-1, 3)
    moved_m = apply(T_other_own, points_m[np.isfinite(points_m).all(axis=1)])
    moved_m = moved_m[moved_m[:, 2] > 0.0]
    pixels = project(camera, moved_m)
    inside = ((pixels > -0.5) & (pixels < (camera.width_px - 0.5, camera.height_px - 0.5))).all(axis=1)
    u, v = np.rint(pixels[inside]).astype(int).T
    z_m = moved_m[inside, 2]
    return int((np.abs(other_m[v, u] - z_m) < _WITHIN * z_m).sum())

"""Covariances of the nodes' relative poses, and how far all lengths may be wrong together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.kernels import geometry
from pipeline.placement.outcome import Placement
from pipeline.registration.graph.edges import PoseEdge, adjoint, cross_matrix
from pipeline.registration.graph.pose_graph import motion_covariances
from pipeline.types import FloatArray, RgbdFrame, Walk

ASSUMED_SCALE_SD = 0.01
"""Relative standard deviation of lengths without a calibration: uncalibrated depth cameras were found 1 to
3 % wrong (SPEC 1.5)."""
SLACK_OF_SCALE = 0.35
"""Error of a registration by a wrong scale of the cameras, relative to the scale's standard deviation: a turn
in rad, and a shift as a share of the distance of the points. In rendered rooms (seeds from
7,900,000 up), two nodes each, with focal lengths wrong by 0.3 % (standard deviation), the errors were
1.1 mrad and 1.05 mm per m (SPEC 11). ``python -m lab.measuring poses`` prints those of rooms from 8,000,000
up."""
UNHELD_RAD, UNHELD_M = 0.02, 0.03
"""Standard deviations of a placed node that no registration holds: it stands where its given pose says."""


def scale_of(frames: Sequence[RgbdFrame]) -> tuple[float, str]:
    """Return the relative standard deviation of all lengths together, and a sentence on where it is from."""
    known = [frame.scale_sd for frame in frames if frame.scale_sd is not None]
    if known and len(known) == len(frames):
        sd = max(known)
        return sd, f"By the calibration, lengths have a standard deviation of {100.0 * sd:.2g} %"
    some = "not all nodes have" if known else "no node has"
    return ASSUMED_SCALE_SD, (
        f"Lengths are assumed to have a standard deviation of {100.0 * ASSUMED_SCALE_SD:g} %, "
        f"because {some} a calibration of known accuracy"
    )


def of_placement(placement: Placement, seen_m: Sequence[FloatArray], scale_sd: float) -> FloatArray:
    """Return (N, 6, 6) covariances of the nodes of a rig.

    Args:
        placement: the nodes' places.
        seen_m: (K, 3) points of each node, world frame.
        scale_sd: relative standard deviation of the cameras' scales.
    """
    count = len(placement.T_world_camera)
    found = np.zeros((count, 6, 6))
    given = placement.covariances or (np.zeros((6, 6)), *(np.full((6, 6), np.nan),) * (count - 1))
    for node, (covariance, points_m, pose) in enumerate(
        zip(given, seen_m, placement.T_world_camera, strict=True)
    ):
        if not covariance.any():
            continue
        center_m = points_m.mean(axis=0) if len(points_m) else pose[:3, 3]
        if np.isfinite(covariance).all():
            away_m = float(np.linalg.norm(center_m - pose[:3, 3]))
            slack = SLACK_OF_SCALE * scale_sd * np.repeat([1.0, away_m], 3)
            found[node] = covariance + _about(center_m, slack)
        else:
            found[node] = _unheld(center_m)
    return found


def of_walk(walk: Walk) -> FloatArray:
    """Return (K, 6, 6) covariances of the keyframes of a recording, relative to the first one."""
    number = {frame: row for row, frame in enumerate(walk.keyframes)}
    edges = [
        PoseEdge(number[link.source], number[link.target], link.T_target_source, link.information)
        for link in walk.links
        if link.used and link.source in number and link.target in number
    ]
    poses = [walk.T_world_camera[frame] for frame in walk.keyframes]
    first = poses[0] if poses and poses[0] is not None else np.eye(4)
    T_first_node = [
        np.full((4, 4), np.nan) if pose is None else geometry.inverse(first) @ pose for pose in poses
    ]
    to_world = adjoint(first)
    covariances = motion_covariances(T_first_node, edges, 0)
    found = [
        to_world @ covariance @ to_world.T
        if np.isfinite(covariance).all()
        else _unheld(np.zeros(3) if pose is None else pose[:3, 3])
        for covariance, pose in zip(covariances, poses, strict=True)
    ]
    return np.array(found).reshape(-1, 6, 6)


def _unheld(center_m: FloatArray) -> FloatArray:
    """Return the (6, 6) covariance of a node around a (3,) point, if no registration holds it."""
    return _about(center_m, np.repeat([UNHELD_RAD, UNHELD_M], 3))


def _about(center_m: FloatArray, sds: FloatArray) -> FloatArray:
    """Return the (6, 6) covariance about the world's origin of turns (rad) about a point and shifts (m)."""
    to_origin = np.eye(6)
    to_origin[3:, :3] = cross_matrix(center_m)
    return to_origin @ np.diag(sds**2) @ to_origin.T

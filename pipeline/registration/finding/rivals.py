"""Other poses and clouds that could fit as well: quarter turns, slides, a mirrored source, a scaled one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.registration.finding.candidates import (
    DIRECTIONS,
    QUICK_POINTS,
    Candidate,
    candidates,
    quick_registration,
)
from pipeline.registration.finding.evidence import Evidence, Judge
from pipeline.registration.finding.starts import default_gates_m
from pipeline.registration.finding.surface import Surface
from pipeline.registration.finding.verdict import LITTLE_STIFFNESS, LITTLE_THROUGH, verdict_on
from pipeline.registration.global_start import default_voxel_m
from pipeline.registration.loop import register
from pipeline.types import FloatArray, PointCloud

QUARTERS_DEG = (90.0, 180.0, 270.0)
SLIDE_VOXELS = 2.5
"""Shift to poses nearby, in fiftieths of the target's extent."""
LEAST_SCALE_ERROR = 0.01
"""A factor nearer to 1 is within the error of a depth camera."""


def quarter_turns(
    source: PointCloud,
    target: PointCloud,
    T: FloatArray,
    gate_m: float,
    judge: Judge,
    config: RegistrationConfig,
) -> Iterator[Candidate]:
    """Turn the source by quarters about the place's own axes and register it; yields where each turn leads.

    The walls, the floor and the ceiling of a room look alike from its corners. The axes are the main
    directions of the target's normals, through its middle.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T: (4, 4) pose T_target_source of the answer.
        gate_m: gate of the registrations.
        judge: judge of these clouds.
        config: settings of the registrations.
    """
    axes = _main_axes(judge)
    along_m = judge.target.points_m @ axes
    center_m = axes @ (0.5 * np.quantile(along_m, [0.02, 0.98], axis=0).sum(axis=0))
    for axis in axes.T:
        for angle_deg in QUARTERS_DEG:
            turn = rotation_exp(np.radians(angle_deg) * axis)
            T_start = rigid(turn, center_m - turn @ center_m) @ T
            with suppress(ReconstructionError):
                found = quick_registration(source, target, T_start, gate_m, DIRECTIONS[0], config)
                yield Candidate(T_start, found, gate_m, DIRECTIONS[0], judge(found))


def better_slide(
    source: PointCloud,
    target: PointCloud,
    T: FloatArray,
    evidence: Evidence,
    judge: Judge,
    config: RegistrationConfig,
) -> Candidate | None:
    """Return a pose near an answer that passes all tests with a better score; None if there is none.

    It is searched for only if a little of the answer is in free space or its stiffness is little. Shelves and
    chairs in a row also fit when shifted by one: the source is shifted to both sides along the main
    directions of the target's normals, and registered.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T: (4, 4) pose T_target_source of the answer.
        evidence: its evidence.
        judge: judge of these clouds.
        config: settings of the registrations.
    """
    if evidence.through_share <= LITTLE_THROUGH and evidence.stiffness >= LITTLE_STIFFNESS:
        return None
    step_m = SLIDE_VOXELS * default_voxel_m(target)
    gate_m = default_gates_m(target, "surfaces", config.seed)[0]
    best = None
    for shift_m in step_m * np.vstack([_main_axes(judge).T, -_main_axes(judge).T]):
        T_start = rigid(np.eye(3), shift_m) @ T
        for other in candidates(source, target, T_start, [gate_m], judge, config):
            least = evidence if best is None else best.evidence
            if verdict_on(other.evidence, tried=True).sure and other.evidence.score > least.score:
                best = other
    return best


def _main_axes(judge: Judge) -> FloatArray:
    """Return (3, 3) main directions of the target's normals, in columns."""
    axes: FloatArray = np.linalg.eigh(judge.target.normals.T @ judge.target.normals)[1]
    return axes


def mirrored_axis(
    source: PointCloud,
    target: PointCloud,
    starts: Sequence[FloatArray],
    gates_m: Sequence[float],
    judge: Judge,
    answer: Evidence,
    config: RegistrationConfig,
) -> str:
    """Return the axis (x, y or z) whose negation makes the source fit surely and clearly better; else empty.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        starts: (4, 4) start poses; the source is mirrored at its origin and at its middle.
        gates_m: gates of the registrations.
        judge: judge of these clouds.
        answer: evidence for the pose of the source as it is.
        config: settings of the registrations.
    """
    middle_m = np.median(source.points_m, axis=0)
    for axis, name in enumerate("xyz"):
        for center_m in (0.0, float(middle_m[axis])):
            mirrored = _negated(source, axis, center_m)
            other = Judge(Surface(mirrored, config.seed), judge.target)
            for T_start in starts:
                ways = candidates(mirrored, target, T_start, gates_m, other, config)
                if any(_fits(way.evidence, answer) for way in ways):
                    return name
    return ""


def better_scale(
    source: PointCloud,
    target: PointCloud,
    T: FloatArray,
    gate_m: float,
    judge: Judge,
    answer: Evidence,
    config: RegistrationConfig,
) -> float | None:
    """Return the factor by which the source fits clearly better, without doubt, if it is not 1; else None.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T: (4, 4) start pose T_target_source.
        gate_m: gate of the registration.
        judge: judge of these clouds.
        answer: evidence for the pose of the source as it is.
        config: settings of the registration.
    """
    scaled = replace(
        config,
        method="ceicp-a",
        metric="point",
        direction="both",
        with_scale=True,
        start="given",
        gate_m=gate_m,
        max_points=QUICK_POINTS,
    )
    try:
        found = register(source, target, scaled, T).T_target_source
    except ReconstructionError:
        return None
    factor = float(np.cbrt(np.linalg.det(found[:3, :3])))
    return factor if abs(factor - 1.0) >= LEAST_SCALE_ERROR and _fits(judge(found), answer) else None


def _fits(evidence: Evidence, answer: Evidence) -> bool:
    return verdict_on(evidence).sure and evidence.clearly_better(answer)


def _negated(cloud: PointCloud, axis: int, center_m: float) -> PointCloud:
    """Return a cloud mirrored at the plane where a coordinate is ``center_m``."""
    points_m = cloud.points_m.copy()
    points_m[:, axis] = 2.0 * center_m - points_m[:, axis]
    normals = None if cloud.normals is None else cloud.normals * np.where(np.arange(3) == axis, -1.0, 1.0)
    return replace(cloud, points_m=points_m, normals=normals)

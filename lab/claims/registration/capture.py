"""Capture range: from how far away a registration still converges to the truth (SPEC 4.7, 4.8)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lab.claims.registration.cases import Condition, make_case, wrong_start
from lab.claims.registration.entrants import Entrant
from packetmesh.errors import PacketMeshError
from pipeline.config import RegistrationConfig
from pipeline.geometry import apply
from pipeline.registration import point_error_m, register, rotation_error_rad
from pipeline.registration.methods import MethodStart
from pipeline.types import FloatArray, PointCloud

ROTATIONS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0)
TRANSLATIONS_M = (0.1, 0.2, 0.3, 0.4, 0.6)
CAPTURED_RAD = float(np.radians(1.5))
CAPTURED_M = 0.05


@dataclass(frozen=True, slots=True)
class CaptureTask:
    """The map of one entrant in one room."""

    condition: Condition
    """Its clouds."""
    room: int
    entrant: Entrant
    gate_by_start: bool
    """As in ``capture_range``."""
    max_points: int


@dataclass(frozen=True, slots=True)
class CaptureCell:
    """What became of one start."""

    rotation_deg: float
    translation_m: float
    point_error_m: float
    rotation_error_rad: float
    translation_error_m: float
    """Of the source's centre."""

    @property
    def captured(self) -> bool:
        """Within 1.5 degrees and 5 cm of the truth."""
        return self.rotation_error_rad < CAPTURED_RAD and self.translation_error_m < CAPTURED_M


def map_capture(task: CaptureTask) -> list[dict[str, Any]]:
    """The cells of one map, as plain values."""
    case = make_case(task.condition, task.room).thinned(task.max_points)
    cells = capture_range(
        case.source,
        case.target,
        case.T_true,
        task.entrant.config("q2p", task.condition.gate_m, task.max_points),
        seed=task.room,
        method=task.entrant.start(),
        gate_by_start=task.gate_by_start,
    )
    return [asdict(cell) | {"entrant": task.entrant.name, "captured": cell.captured} for cell in cells]


def capture_range(
    source: PointCloud,
    target: PointCloud,
    T_true: FloatArray,
    config: RegistrationConfig,
    rotations_deg: Sequence[float] = ROTATIONS_DEG,
    translations_m: Sequence[float] = TRANSLATIONS_M,
    seed: int = 0,
    method: MethodStart | None = None,
    gate_by_start: bool = True,
) -> Generator[CaptureCell, None, None]:
    """Register from one start for every rotation and translation, any way about the source's centre.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        T_true: (4, 4) true T_target_source.
        config: method and parameters.
        rotations_deg: how far to turn.
        translations_m: how far to move, for each rotation.
        seed: chooses the axes and directions; the same ones for every method.
        method: takes the place of the config's method, as in ``register``.
        gate_by_start: the gate is twice the translation, if that is wider than the config's (SPEC 4.4 sets
            T_d so); else it is the config's.
    """
    for row, rotation_deg in enumerate(rotations_deg):
        for column, translation_m in enumerate(translations_m):
            rng = np.random.default_rng([seed, row, column])
            T_init = wrong_start(T_true, source.points_m, rotation_deg, translation_m, rng)
            gate_m = max(config.gate_m, 2.0 * translation_m) if gate_by_start else config.gate_m
            T = _pose(source, target, replace(config, gate_m=gate_m), T_init, method)
            center_m = source.points_m.mean(axis=0, keepdims=True)
            yield CaptureCell(
                rotation_deg,
                translation_m,
                point_error_m(T, T_true, source.points_m),
                rotation_error_rad(T, T_true),
                float(np.linalg.norm(apply(T - T_true, center_m))),
            )


def _pose(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    T_init: FloatArray,
    method: MethodStart | None,
) -> FloatArray:
    """The registered pose, or the start where not one pair is near enough to begin."""
    try:
        return register(source, target, config, T_init, method=method).T_target_source
    except PacketMeshError:
        return T_init

"""Capture range: the starts from which a registration still converges to the truth (SPEC 4.7, 4.8)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lab.claims.registration.cases import Condition, make_case, wrong_start
from lab.claims.registration.entrants import Entrant
from packetmesh.errors import PacketMeshError
from pipeline.kernels.geometry import apply
from pipeline.registration import point_error_m, register, rotation_error_rad

ROTATIONS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0)
TRANSLATIONS_M = (0.1, 0.2, 0.3, 0.4, 0.6)
CAPTURED_RAD = float(np.radians(1.5))
CAPTURED_M = 0.05


@dataclass(frozen=True, slots=True)
class CaptureTask:
    """The capture map of one entrant in one room."""

    condition: Condition
    """Condition of the clouds."""
    room: int
    """Seed of ``box_room``, and of the starts' axes and directions, which are equal for every entrant."""
    entrant: Entrant
    gate_by_start: bool
    """Whether a start whose doubled translation exceeds the entrant's gate widens the gate to it (SPEC 4.4);
    otherwise the gate is always the entrant's."""
    max_points: int
    rotations_deg: tuple[float, ...] = ROTATIONS_DEG
    """Rotations of the starts, about random axes through the source's centre."""
    translations_m: tuple[float, ...] = TRANSLATIONS_M
    """Translations of the starts, for each rotation."""


def map_capture(task: CaptureTask) -> list[dict[str, Any]]:
    """Register from one start for every rotation and translation; return the outcomes as plain values.

    ``translation_error_m`` is that of the source's centre; captured are results within 1.5 degrees and 5 cm
    of the truth.
    """
    case = make_case(task.condition, task.room).thinned(task.max_points)
    config = task.entrant.config("q2p", task.condition.gate_m, task.max_points)
    points_m, method = case.source.points_m, task.entrant.start()
    center_m = points_m.mean(axis=0, keepdims=True)
    cells = []
    for row, rotation_deg in enumerate(task.rotations_deg):
        for column, translation_m in enumerate(task.translations_m):
            rng = np.random.default_rng([task.room, row, column])
            T = wrong_start(case.T_true, points_m, rotation_deg, translation_m, rng)
            gate_m = max(config.gate_m, 2.0 * translation_m) if task.gate_by_start else config.gate_m
            with suppress(PacketMeshError):  # if no pair is near enough, T stays the start
                T = register(
                    case.source, case.target, replace(config, gate_m=gate_m), T, method=method
                ).T_target_source
            turned_rad = rotation_error_rad(T, case.T_true)
            moved_m = float(np.linalg.norm(apply(T - case.T_true, center_m)))
            cells.append(
                {
                    "entrant": task.entrant.name,
                    "rotation_deg": rotation_deg,
                    "translation_m": translation_m,
                    "point_error_m": point_error_m(T, case.T_true, points_m),
                    "rotation_error_rad": turned_rad,
                    "translation_error_m": moved_m,
                    "captured": turned_rad < CAPTURED_RAD and moved_m < CAPTURED_M,
                }
            )
    return cells

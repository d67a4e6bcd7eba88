"""Registration with several random draws of points, so that the answer does not depend on one draw."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.pairs.register import Answer, Pair, run_methods
from pipeline.registration import point_error_m, register
from pipeline.registration.gate import ALIKE, Misfit, best_gate_m, ladder
from pipeline.registration.global_start import default_voxel_m, global_start
from pipeline.types import FloatArray

_log = logging.getLogger(__name__)

DRAWS = 10
DRAWN_SHARE = 0.8
"""Share of a cloud that further draws take if it is so small that all its points are used."""


def with_gate(pair: Pair, config: RegistrationConfig) -> RegistrationConfig:
    """Return the settings with the gate chosen from the data.

    Raises:
        ReconstructionError: no gate leaves enough pairs at the start pose.
    """
    misfit = Misfit(pair.source, pair.target, config.seed)
    return replace(config, gate_m=best_gate_m(ladder(pair.source, pair.target, config, pair.T_init, misfit)))


def run_draws(name: str, pair: Pair, config: RegistrationConfig) -> Iterator[Answer]:
    """Run one of our methods with ten draws of the points; yields its answer, with the spread of the draws.

    If the draws disagree, the answer is the draw with the least misfit of the clouds, and a start pose from
    matched features is also tried, unless the method started there.
    """
    first = _answer(name, pair, config)
    if first.failed:
        yield first
        return
    misfit = Misfit(pair.source, pair.target, config.seed)
    answer, least = _settled(name, pair, config, first, misfit)
    if answer.spread_m > misfit.limit_m and config.start == "given":
        try:
            T_start = global_start(pair.source, pair.target, default_voxel_m(pair.target), config.seed)
        except ReconstructionError:
            yield answer
            return
        elsewhere = replace(pair, T_init=T_start)
        other, other_least = _settled(name, elsewhere, config, _answer(name, elsewhere, config), misfit)
        if other_least < least or (other.agreed and other_least <= ALIKE * least):
            _log.warning(
                "Draws of the points end in different places; a start by matched features leads to a better"
            )
            answer = other
    yield answer


def _settled(
    name: str, pair: Pair, config: RegistrationConfig, first: Answer, misfit: Misfit
) -> tuple[Answer, float]:
    """Return the first answer if all draws agree with it, else that of the least misfit; and its misfit."""
    if first.T_target_source is None:
        return first, float("inf")
    fewer = max(6, int(DRAWN_SHARE * min(len(pair.source), len(pair.target))))
    drawn: list[tuple[RegistrationConfig, FloatArray]] = [(config, first.T_target_source)]
    for seed in range(config.seed + 1, config.seed + DRAWS):
        one = replace(config, method=name, start="given", seed=seed, max_points=min(config.max_points, fewer))
        try:
            result = register(pair.source, pair.target, one, pair.T_init)
        except ReconstructionError:
            continue
        if result.steps and not result.stop_reason.startswith("degenerate"):
            drawn.append((one, result.T_target_source))
    poses = [T for _, T in drawn]
    spread_m = _spread_m(pair, poses, first.T_target_source) if len(poses) == DRAWS else float("inf")
    answer = replace(first, draws=DRAWS, spread_m=spread_m)
    if answer.agreed:
        return answer, misfit(first.T_target_source)
    misfits = [misfit(T) for T in poses]
    best = int(np.argmin(misfits))
    if best > 0:
        answer = replace(_answer(name, pair, drawn[best][0]), draws=DRAWS, spread_m=spread_m)
        if len(poses) == DRAWS:
            answer = replace(answer, spread_m=_spread_m(pair, poses, poses[best]))
    return answer, misfits[best]


def _spread_m(pair: Pair, poses: list[FloatArray], T: FloatArray) -> float:
    """Return the largest point error of any pose relative to ``T``."""
    some_m = pair.source.points_m[:: max(1, len(pair.source) // 2000)]
    return max(point_error_m(other, T, some_m) for other in poses)


def _answer(name: str, pair: Pair, config: RegistrationConfig) -> Answer:
    return next(run_methods((name,), pair, config))

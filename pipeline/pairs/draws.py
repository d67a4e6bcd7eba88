"""One method on a pair, so that the answer does not hang on which points happened to be drawn."""

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
"""Of a cloud so small that all of its points take part, a further draw takes this share."""


def with_gate(pair: Pair, config: RegistrationConfig) -> RegistrationConfig:
    """The settings with the gate that the data give.

    Raises:
        ReconstructionError: no gate holds enough pairs at the start pose.
    """
    misfit = Misfit(pair.source, pair.target, config.seed)
    return replace(config, gate_m=best_gate_m(ladder(pair.source, pair.target, config, pair.T_init, misfit)))


def run_draws(name: str, pair: Pair, config: RegistrationConfig) -> Iterator[Answer]:
    """The answer of one of our methods, with how far ten draws of the points end from each other.

    Where they end in different places, the answer is the draw after which the clouds lie best on each other,
    and a start pose by matched features is tried as well, unless that is where they started.
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
    """The first answer if all draws agree with it, else that of the least misfit; and its misfit."""
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
    """Largest point error of any pose from one of them."""
    some_m = pair.source.points_m[:: max(1, len(pair.source) // 2000)]
    return max(point_error_m(other, T, some_m) for other in poses)


def _answer(name: str, pair: Pair, config: RegistrationConfig) -> Answer:
    return next(run_methods((name,), pair, config))

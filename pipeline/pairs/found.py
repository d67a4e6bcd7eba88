"""Answers of our methods for a pair: search for the pose, registration from its start, and verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.pairs.register import Answer, Pair, run_methods
from pipeline.registration import point_error_m
from pipeline.registration.finding.candidates import QUICK_DECAY
from pipeline.registration.finding.doubts import DRAWS
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.poses import compared_points_m, length, same, turn_deg
from pipeline.registration.finding.rivals import better_scale, mirrored_axis
from pipeline.registration.finding.search import Found, search
from pipeline.registration.finding.starts import Start, by_surfaces, default_gates_m
from pipeline.registration.finding.surface import Surface
from pipeline.registration.finding.verdict import verdict_on
from pipeline.registration.global_start import default_voxel_m
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class Place:
    """Pose that the search found for a pair, and what is needed to judge other poses."""

    pair: Pair
    """The clouds; ``T_init`` is the start pose that led to the found pose."""
    config: RegistrationConfig
    """Settings with the gate and the direction that led to the found pose."""
    found: Found
    judge: Judge
    T_given: FloatArray
    """(4, 4) start pose T_target_source of the pair before the search."""


def find_place(pair: Pair, config: RegistrationConfig, gate_m: float | None) -> Place:
    """Search for the pose of a pair.

    Args:
        pair: the clouds and their start pose.
        config: settings; with ``start="global"`` the given start pose is not tried.
        gate_m: the only gate to try, metres; None tries ``default_gates_m``.

    Raises:
        ReconstructionError: no start pose leads to a registration.
    """
    judge = Judge(
        Surface(pair.source, config.seed, name="source"), Surface(pair.target, config.seed, name="target")
    )
    starts = [by_surfaces(pair.source, pair.target)]
    if config.start == "given":
        starts.insert(0, Start("given", lambda: [pair.T_init]))
    found = search(pair.source, pair.target, starts, judge, config, () if gate_m is None else (gate_m,))
    way = found.candidate
    settings = replace(config, gate_m=way.gate_m, direction=way.direction, sigma_decay=QUICK_DECAY)
    return Place(replace(pair, T_init=way.T_start), settings, found, judge, pair.T_init)


def settled_answer(name: str, place: Place) -> Answer:
    """Run one of our methods from the search's start pose, and judge its answer.

    If the answer is not the pose that the search found, the method runs again from that pose. For an answer
    that is not sure, a mirrored and a scaled source are tried as explanations.
    """
    pair, config, found = place.pair, place.config, place.found
    T_found = found.candidate.T_target_source
    answer = _answer(name, pair, config)
    if answer.T_target_source is None or not _same(answer.T_target_source, T_found, pair):
        again = _answer(name, replace(pair, T_init=T_found), config)
        answer = answer if again.T_target_source is None else again
    T = answer.T_target_source
    if answer.failed or T is None:
        return answer
    answer = judged(answer, place)
    assert answer.verdict is not None
    assert answer.evidence is not None
    if not answer.verdict.sure and (more := _other_clouds(place, T)):
        return replace(answer, verdict=replace(answer.verdict, reasons=(*answer.verdict.reasons, *more)))
    return answer


def judged(answer: Answer, place: Place) -> Answer:
    """Return an answer with the verdict on it.

    The search has tested its own pose with other draws of the points and with rival poses. An answer at
    another pose has not been tested in this way, so it is never sure.
    """
    T, found = answer.T_target_source, place.found
    if T is None:
        return answer
    evidence = place.judge(T)
    verdict = verdict_on(evidence)
    if _same(T, found.candidate.T_target_source, place.pair):
        verdict = verdict_on(evidence, tried=True)
        if not np.isnan(found.spread_m):
            answer = replace(answer, draws=1 + DRAWS, spread_m=found.spread_m)
        verdict = found.verdict if verdict.sure else verdict
    elif verdict.sure:
        some_m = compared_points_m(place.pair.source)
        apart_m = point_error_m(T, found.candidate.T_target_source, some_m)
        verdict = verdict_on(evidence, (f"the search for the pose ended {length(apart_m)} away",))
    return replace(answer, verdict=verdict, evidence=evidence, way=found.way)


def _same(T_a: FloatArray, T_b: FloatArray, pair: Pair) -> bool:
    return same(T_a, T_b, pair.source, pair.target)


def _other_clouds(place: Place, T: FloatArray) -> tuple[str, ...]:
    """Return a reason for doubt if a mirrored or scaled source surely fits, clearly better; else empty."""
    pair, config = place.pair, place.config
    starts = [place.T_given, *([] if place.found.way == "given" else [pair.T_init]), T]
    gates_m = default_gates_m(pair.target, "surfaces", config.seed)
    if axis := mirrored_axis(pair.source, pair.target, starts, gates_m, place.judge, place.judge(T), config):
        return (
            f"one cloud is mirrored, since with {axis} negated the source fits; try to export it in "
            f"right-handed coordinates, or negate its {axis}",
        )
    factor = better_scale(pair.source, pair.target, T, 2.0 * gates_m[-1], place.judge, place.judge(T), config)
    if factor is not None:
        return (
            f"the source fits if scaled by {factor:.4g}; try --scale, or multiply its metres per unit by "
            f"{factor:.4g}",
        )
    return ()


def _answer(name: str, pair: Pair, config: RegistrationConfig) -> Answer:
    return next(run_methods((name,), pair, config))


def moved_away(pair: Pair, T_given: FloatArray, T: FloatArray) -> str:
    """Return a sentence with the answer's distance and turn from the given start pose; empty if near."""
    voxel_m = default_voxel_m(pair.target)
    away_m = point_error_m(T, T_given, compared_points_m(pair.source))
    if away_m <= 5.0 * voxel_m:
        return ""
    turned_deg = turn_deg(T, T_given)
    return f"The answer is {length(away_m)} and {turned_deg:.0f} degrees from the start pose of --init"

"""Verdicts on the nodes of a rig: which are placed, and warnings about the others."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add

from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.placement.attempt import (
    LEAST_AGREEMENT,
    LEAST_OVERLAP,
    SURE_AGREEMENT,
    Attempt,
    less,
)
from pipeline.placement.given import LOOSE
from pipeline.placement.outcome import NodeVerdict


def verdicts_of(
    names: Sequence[str],
    known: Sequence[bool],
    group: Sequence[int],
    agreements: dict[tuple[int, int], Agreement],
    tried: Sequence[Attempt],
    loose: Sequence[int] = (),
) -> list[NodeVerdict]:
    """Return the verdict on each node.

    The node that contradicts the others most is excluded, one after another, until none contradicts; doubtful
    nodes are found in the same way.

    Args:
        names: names of all nodes.
        known: whether each node's pose is known.
        group: numbers of the nodes that are placed relative to each other.
        agreements: agreement of each pair (source, target) of the group at the final poses.
        tried: all registrations, which give the reason for a node outside the group.
        loose: nodes whose given pose counts where the registrations leave their place open.
    """

    shared: list[list[tuple[int, Agreement]]] = [[] for _ in names]
    for (one, other), found in agreements.items():
        if found.overlap_share >= LEAST_OVERLAP:
            shared[one].append((other, found))
            shared[other].append((one, found))

    def with_others(others: set[int], node: int) -> Agreement:
        return reduce(add, (found for other, found in shared[node] if other in others), NOTHING_SHARED)

    def without_worst(kept: set[int], least: float) -> set[int]:
        while suspects := [index for index in kept if less(with_others(kept, index), least)]:
            shares = {index: with_others(kept, index).within_2pct_share for index in suspects}
            kept = kept - {min(suspects, key=lambda index: (shares[index], -index))}
        return kept

    placed = without_worst(set(group), LEAST_AGREEMENT)
    sure = without_worst(placed, SURE_AGREEMENT)
    verdicts = []
    for index, name in enumerate(names):
        found, sentence = with_others(placed, index), ""
        if index not in group:
            sentence = _lost(names, known, index, group, tried)
        elif index not in placed:
            sentence = _contradiction(name, found)
        elif index not in sure:
            sentence = (
                f"{name} agrees badly with the others: only {found.within_2pct_share:.0%} of the commonly "
                "measured points are within 2 %; check its pose and its calibration"
            )
        elif not found.shared and len(placed) > 1:
            sentence = (
                f"{name} has a pose that no other placed camera confirms: each measured less than "
                f"{100.0 * LEAST_OVERLAP:.0f} % of what it sees"
            )
        elif index in loose:
            sentence = LOOSE.format(name)
        verdicts.append(NodeVerdict(name, index in placed, found, sentence))
    return verdicts


def _contradiction(name: str, found: Agreement) -> str:
    """Return the warning about a node that the measurements exclude."""
    return (
        f"{name} is left out: of what it and the others both measured, only {found.within_2pct_share:.0%} is "
        "within 2 %; check its pose and that all nodes saw the same scene, or try --set "
        "node_registration.start=global"
    )


def _lost(
    names: Sequence[str], known: Sequence[bool], index: int, group: Sequence[int], tried: Sequence[Attempt]
) -> str:
    """Return the warning about a node outside the group, with the reason of its best attempt to join it."""
    mine = [trial for trial in tried if index in trial.link and not set(group).isdisjoint(trial.link)]
    best = max(mine, key=lambda trial: (trial.score, trial.agreement.shared), default=None)
    why = ""
    if best is not None:
        other = names[best.target if best.source == index else best.source]
        why = f" ({_why_not(best, other)})"
    if known[index]:
        return (
            f"{names[index]} is left out: no pose of the others relative to it was found{why}, so they are "
            "not in the frame of its given pose; try to give one of their poses, or images that share more "
            "of the place"
        )
    return (
        f"{names[index]} is left out: its pose is not known, and no pose relative to the others was "
        f"found{why}; try to give its pose, or images that share more of the place"
    )


def _why_not(best: Attempt, other: str) -> str:
    """Return why the best attempt to place a node relative to another is not used."""
    if best.verdict is None:
        return f"relative to {other}: {best.result.stop_reason.partition(';')[0].rstrip('.')}"
    if not best.verdict.sure:
        return f"best pose relative to {other}: {' and '.join(best.verdict.reasons)}"
    if best.edge is None:
        return f"best pose relative to {other}: {best.result.stop_reason}"
    share = best.agreement.within_2pct_share
    return f"best pose relative to {other}: only {share:.0%} of the commonly measured points are within 2 %"

"""Search by colour for places that a camera revisits after much drift (SPEC 10.2)."""

from __future__ import annotations

from collections.abc import Generator, Mapping

from packetmesh.progress import Progress
from pipeline.kernels.geometry import inverse
from pipeline.recording.places import FOUND_GATE_M, Places
from pipeline.recording.recording import spread
from pipeline.recording.tracking import GATE_M, LEAST_AGREEMENT, agreement_at, loop_link
from pipeline.registration.organised import OrganisedCloud
from pipeline.types import FloatArray, Link

COMPARED = 32
"""Most keyframes whose colours are compared, evenly spread over the recording."""
APART = 3
"""Least distance in time of two keyframes that are compared, in keyframes."""
LEAST_SCORE = 8.0
"""Least number of features that look alike."""
OF_EACH, TRIED = 2, 12
"""Most pairs of each keyframe and of all that are registered, those that look most alike."""
ENOUGH = 5
"""After so many pairs that count the search stops; the geometric loops find the others."""


def iterate_revisits(
    places: Places, poses: Mapping[int, FloatArray], clouds: Mapping[int, OrganisedCloud]
) -> Generator[Progress, None, list[Link]]:
    """Find, by colour, pairs of keyframes that show one place although their poses are apart.

    A pair counts if the verdict on its pose is sure, if it holds as in tracking, and if a neighbour of one
    of the two, where the pair's pose puts it, holds too. The neighbours' registrations are links as well.

    Args:
        places: the keyframes' colours.
        poses: (4, 4) poses of the keyframes so far, in order of time.
        clouds: the keyframes' points.
    """
    pairs = yield from _alike(places, poses, clouds)
    found: dict[tuple[int, int], Link] = {}
    count = 0
    for number, (source, target) in enumerate(pairs):
        share = number / len(pairs)
        yield Progress(f"comparing places {number + 1} of {len(pairs)}", 0.5 + 0.5 * share)
        new = _confirmed(places, poses, clouds, source, target)
        for one in new:
            found.setdefault(one.pair, one)
        count += bool(new)
        if count == ENOUGH:
            break
    return list(found.values())


def _alike(
    places: Places, poses: Mapping[int, FloatArray], clouds: Mapping[int, OrganisedCloud]
) -> Generator[Progress, None, list[tuple[int, int]]]:
    """Return pairs of keyframes that look alike and are not neighbours by their poses, the best first."""
    order = {number: place for place, number in enumerate(poses)}
    numbers = spread(list(poses), COMPARED)
    scores: dict[tuple[int, int], float] = {}
    for later, source in enumerate(numbers):
        yield Progress(f"looking at keyframe {source}", 0.5 * later / len(numbers))
        for target in numbers[:later]:
            if order[source] - order[target] < APART or _together(poses, clouds, source, target):
                continue
            score = places.score(source, target)
            if score >= LEAST_SCORE:
                scores[source, target] = score
    chosen: list[tuple[int, int]] = []
    for pair in sorted(scores, key=lambda pair: -scores[pair]):
        if all(sum(number in other for other in chosen) < OF_EACH for number in pair):
            chosen.append(pair)
    return chosen[:TRIED]


def _together(
    poses: Mapping[int, FloatArray], clouds: Mapping[int, OrganisedCloud], source: int, target: int
) -> bool:
    """Return whether two keyframes already show one place at their poses."""
    T = inverse(poses[target]) @ poses[source]
    return agreement_at(clouds[source], clouds[target], T) >= LEAST_AGREEMENT


def _confirmed(
    places: Places,
    poses: Mapping[int, FloatArray],
    clouds: Mapping[int, OrganisedCloud],
    source: int,
    target: int,
) -> list[Link]:
    """Return the registration of two keyframes and those of their neighbours; none if it is in doubt."""
    if loop_link(clouds, source, target, places.start(source, target), FOUND_GATE_M) is None:
        return []  # the verdict takes longer
    found = loop_link(clouds, source, target, places.pose(source, target), FOUND_GATE_M)
    if found is None:
        return []
    correction = poses[target] @ found.T_target_source @ inverse(poses[source])
    confirming = []
    for later, earlier in _neighbouring_pairs(list(poses), source, target):
        T = inverse(poses[earlier]) @ correction @ poses[later]
        one = loop_link(clouds, later, earlier, T, GATE_M)
        if one is not None:
            confirming.append(one)
    return [found, *confirming] if confirming else []


def _neighbouring_pairs(order: list[int], source: int, target: int) -> list[tuple[int, int]]:
    """Return the pairs in which one of the two is replaced by its neighbour in time."""
    i, j = order.index(source), order.index(target)
    pairs = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)]
    return [(order[a], order[b]) for a, b in pairs if a < len(order) and 0 <= b < a]

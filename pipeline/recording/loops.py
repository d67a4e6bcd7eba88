"""Loops and the pose graph of a recording's keyframes (SPEC 10.2)."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.progress import Progress, part
from pipeline.kernels.geometry import inverse
from pipeline.recording.places import Places, parts_of
from pipeline.recording.revisits import iterate_revisits
from pipeline.recording.tracking import (
    LEAST_AGREEMENT,
    LESS_AGREEMENT,
    REPORTED,
    WITHIN,
    Track,
    agreement_at,
    loop_link,
)
from pipeline.registration.graph.edges import PoseEdge, small_motion
from pipeline.registration.graph.pose_graph import solve_pose_graph
from pipeline.registration.organised import OrganisedCloud, shared_shares
from pipeline.types import FloatArray, IntArray, Link

LOOP_GATE_M = 0.3
"""Gate of a loop's registration: larger than in tracking, because drift may have grown."""
MOVED_M = 0.1
"""Least shift of a pair's start pose after which the pair is tried again."""
NEAR_M, NEAR_DEG = 0.9, 45.0
"""Distance and angle of keyframes that may show the same place."""
LEAST_PREDICTED = 0.4
"""Least overlap of two keyframes at their tracked poses for a trial."""
MOST_TRIED = 8
"""Most loops tried for each keyframe, those of the largest predicted overlap."""
MOST_LOOPS, LEAST_TRIED = 1000, 3
"""About the most loops tried in a round, and the fewest for each of many keyframes; the targets of such a
keyframe are not neighbours in time."""
MOST_COMPARED = 32
"""Most earlier keyframes with which the overlap of each is predicted."""
ROUNDS = 2
"""Number of rounds: the poses after the first one predict more loops."""
DRIFTS = (3.0, 10.0, 30.0)
"""Factors of tracking's errors that are tried where they contradict places recognised by colour."""
OF_TRACKING = 1.5
"""Weight of a tracking link, relative to a loop's, where links contradict each other: two loops exceed it."""
GRAPH_POINTS = 200
"""About the number of a keyframe's points at which the pose graph measures errors."""
Pair = tuple[int, int]
"""Source and target of a link."""


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A pair of keyframes that may show the same place."""

    source: int
    target: int
    T_target_source: FloatArray
    """(4, 4) start pose."""
    predicted: float
    """Overlap at the start pose."""


@dataclass(frozen=True, slots=True)
class Trajectory:
    """The poses of a recording's frames, with the first keyframe's depth camera as the world."""

    T_first_depth: tuple[FloatArray | None, ...]
    """(4, 4) pose of the depth camera at each frame; None where the camera was lost."""
    keyframes: dict[int, FloatArray]
    """(4, 4) poses of the keyframes' depth cameras by frame number."""
    links: tuple[Link, ...]
    """Registrations of tracking, then those that close loops."""


def iterate_loops(track: Track, places: Places | None = None) -> Generator[Progress, None, Trajectory]:
    """Close loops between the keyframes of the largest part, and reconcile all links by least squares.

    Frames of other parts have no pose.

    Args:
        track: the result of tracking.
        places: the keyframes' colours, by which a place is recognised after much drift; None to do without.
    """
    loops = _Loops(track)
    yield from part(_rounds(loops), "near", 0.0, 0.5, detail=True)
    if places is not None:
        found = yield from part(loops.iterate_revisits(places), "far", 0.5, 0.75, detail=True)
        if found:
            yield from part(_rounds(loops), "near", 0.75, 1.0, detail=True)
    return Trajectory(_frame_poses(track, loops.poses), loops.poses, tuple(loops.links))


def _rounds(loops: _Loops) -> Generator[Progress, None, None]:
    """Run ``ROUNDS`` rounds of loops between keyframes that are near each other."""
    for turn in range(ROUNDS):
        begin, end = turn / ROUNDS, (turn + 1) / ROUNDS
        if not (yield from part(loops.iterate_round(), f"round {turn + 1}", begin, end, detail=True)):
            break


class _Loops:
    """Poses and links of the largest part's keyframes while loops are closed."""

    def __init__(self, track: Track) -> None:
        self.poses = _chain(track)
        self.links = [one for one in track.links if one.source in self.poses]
        self._clouds = track.clouds
        self._tried = {one.pair: one.T_target_source for one in self.links}
        self._sure: set[Pair] = set()
        """Pairs that were recognised by colour."""
        self._explained: tuple[Pair | None, float] = (None, 1.0)
        """Pair whose link is wrong, and factor of the errors of tracking."""

    def iterate_round(self) -> Generator[Progress, None, bool]:
        """Register keyframes that are near each other, then reconcile; returns False if there is no loop."""
        candidates = yield from _candidates(self.poses, self._clouds, self._tried)
        candidates = [one for one in candidates if (one.source, one.target) not in self._sure]
        for number, candidate in enumerate(candidates):
            if number % 10 == 0:
                share = 0.5 + 0.5 * number / len(candidates)
                yield Progress(f"trying loop {number} of {len(candidates)}", share)
            pair = candidate.source, candidate.target
            self._tried[pair] = candidate.T_target_source
            found = loop_link(self._clouds, *pair, candidate.T_target_source, LOOP_GATE_M)
            if found is not None:
                self._tried[pair] = found.T_target_source
                self.links = [one for one in self.links if not (one.loop and one.pair == pair)]
                self.links.append(found)
        if not any(one.loop for one in self.links):
            return False
        self._reconcile()
        return True

    def iterate_revisits(self, places: Places) -> Generator[Progress, None, bool]:
        """Close loops by colour, then reconcile; returns False if there is none."""
        found = yield from iterate_revisits(places, self.poses, self._clouds)
        linked = {one.pair for one in self.links}
        new = [one for one in found if one.pair not in linked]
        for one in new:
            self._tried[one.pair] = one.T_target_source
            self._sure.add(one.pair)
        self.links += new
        if new:
            self._reconcile()
        return bool(new)

    def _reconcile(self) -> None:
        """Set the poses by least squares over all links, and ``used`` of the links.

        If places that were recognised contradict the path, one link of tracking may be wrong, which is then
        not used; or the errors of all are larger than their pairs say, and are multiplied by one of
        ``DRIFTS``. The first such explanation is taken that leaves the fewest links in doubt.
        """
        least = len(self.links) + 1
        for explained in self._explanations():
            solved, links = _reconciled(self.poses, self.links, self._clouds, *explained)
            doubts = sum(self._in_doubt(one, solved) for one in links if not one.used)
            if doubts < least:
                least, poses, best, self._explained = doubts, solved, links, explained
            if not doubts:
                break
        self.poses, self.links = poses, best

    def _explanations(self) -> Iterator[tuple[Pair | None, float]]:
        """Yield pairs whose link may be wrong, with factors of tracking's errors; the last accepted first."""
        yield self._explained
        sure = next((one for one in self.links if one.pair in self._sure), None)
        if sure is None:
            return
        wrong = self._wrong_link(sure)
        if wrong is not None:
            yield wrong, 1.0
        for drift in DRIFTS:
            yield None, drift

    def _wrong_link(self, sure: Link) -> Pair | None:
        """Return the pair of tracking whose keyframes agree best if its link has all of a loop's error.

        None if no pair agrees, or if the keyframes would be unconnected without the link.
        """
        poses, best, most = self.poses, None, LEAST_AGREEMENT
        change = poses[sure.target] @ sure.T_target_source @ inverse(poses[sure.source])
        for one in self.links:
            if one.loop or not sure.target <= one.target < one.source <= sure.source:
                continue
            T = inverse(poses[one.target]) @ change @ poses[one.source]
            agreeing = agreement_at(self._clouds[one.source], self._clouds[one.target], T)
            others = [own for own in self.links if own is not one]
            if agreeing >= most and len(parts_of(list(poses), others)) == 1:
                best, most = one.pair, agreeing
        return best

    def _in_doubt(self, unused: Link, poses: Mapping[int, FloatArray]) -> bool:
        """Return whether it is doubtful not to use a link.

        It is if colours recognised the pair, or if tracking made the link and the poses do not agree either.
        """
        source, target = unused.source, unused.target
        T = inverse(poses[target]) @ poses[source]
        agrees = agreement_at(self._clouds[source], self._clouds[target], T) >= LESS_AGREEMENT
        return unused.pair in self._sure or not (agrees or unused.loop)


def _chain(track: Track) -> dict[int, FloatArray]:
    """Return (4, 4) poses of the largest part's keyframes in the first one's frame, along the links."""
    main = parts_of(list(track.clouds), track.links)[0]
    poses: dict[int, FloatArray] = {main[0]: np.eye(4)}
    waiting = [main[0]]
    while waiting:
        here = waiting.pop(0)
        for one in track.links:
            if one.target == here and one.source not in poses:
                poses[one.source] = poses[here] @ one.T_target_source
                waiting.append(one.source)
            elif one.source == here and one.target not in poses:
                poses[one.target] = poses[here] @ inverse(one.T_target_source)
                waiting.append(one.target)
    return dict(sorted(poses.items()))


def _candidates(
    poses: Mapping[int, FloatArray],
    clouds: Mapping[int, OrganisedCloud],
    tried: Mapping[Pair, FloatArray],
) -> Generator[Progress, None, list[_Candidate]]:
    """Return pairs of keyframes that should show the same place, for each the ``MOST_TRIED`` best.

    A pair that was tried before is tried again only if its start pose has moved by ``MOVED_M``.
    """
    numbers, found = list(poses), list[_Candidate]()
    T = np.array([poses[number] for number in numbers])
    for later, source in enumerate(numbers):
        if later % REPORTED == 0:
            yield Progress(f"comparing keyframe {later} of {len(numbers)}", 0.5 * later / len(numbers))
        own = []
        for place in _nearest(T, later):
            target, T_start = numbers[place], inverse(T[place]) @ T[later]
            before = tried.get((source, target))
            if before is not None and np.linalg.norm(T_start[:3, 3] - before[:3, 3]) < MOVED_M:
                continue
            predicted, _ = shared_shares(clouds[source], clouds[target], T_start, WITHIN)
            if predicted >= LEAST_PREDICTED:
                own.append(_Candidate(source, target, T_start, predicted))
        found += _best(own, numbers)
    return found


def _best(candidates: Sequence[_Candidate], keyframes: Sequence[int]) -> list[_Candidate]:
    """Return a keyframe's candidates of the largest predicted overlap, in this order.

    Where not all keyframes can have ``MOST_TRIED``, two targets next to each other in time count as one.
    """
    ordered = sorted(candidates, key=lambda candidate: -candidate.predicted)
    most = min(MOST_TRIED, max(LEAST_TRIED, MOST_LOOPS // len(keyframes)))
    if most == MOST_TRIED or len(ordered) <= most:
        return ordered[:MOST_TRIED]
    places = {number: place for place, number in enumerate(keyframes)}
    chosen: list[_Candidate] = []
    for one in ordered:
        if len(chosen) < most and all(abs(places[one.target] - places[own.target]) > 1 for own in chosen):
            chosen.append(one)
    return chosen


def _nearest(T: FloatArray, later: int) -> IntArray:
    """Return the indices of earlier keyframes, except the previous one, near in position and direction.

    At most ``MOST_COMPARED``, those whose shift and turn together are least.
    """
    motion = small_motion(np.linalg.inv(T[: max(0, later - 1)]) @ T[later])
    turn_deg = np.degrees(np.linalg.norm(motion[:, :3], axis=1))
    shift_m = np.linalg.norm(motion[:, 3:], axis=1)
    near = np.flatnonzero((shift_m <= NEAR_M) & (turn_deg <= NEAR_DEG))
    apart = shift_m[near] / NEAR_M + turn_deg[near] / NEAR_DEG
    return np.sort(near[np.argsort(apart, kind="stable")[:MOST_COMPARED]])


def _reconciled(
    poses: Mapping[int, FloatArray],
    links: Sequence[Link],
    clouds: Mapping[int, OrganisedCloud],
    wrong: Pair | None = None,
    drift: float = 1.0,
) -> tuple[dict[int, FloatArray], list[Link]]:
    """Return the keyframes' poses by least squares over all links, and the links with ``used`` set.

    The link of the pair ``wrong`` is not used; the errors of tracking's links are multiplied by ``drift``.
    """
    numbers = list(poses)
    places = {number: place for place, number in enumerate(numbers)}
    edges = []
    for one in links:
        information = one.information if one.loop else one.information / drift**2
        ends = places[one.source], places[one.target]
        strength = 1.0 if one.loop else OF_TRACKING
        edges.append(PoseEdge(*ends, one.T_target_source, information, strength, one.pair != wrong))
    points_m = [clouds[k].points_m[:: max(1, len(clouds[k]) // GRAPH_POINTS)] for k in numbers]
    graph = solve_pose_graph(points_m, edges)
    solved = dict(zip(numbers, graph.T_reference_node, strict=True))
    used = [replace(one, used=use) for one, use in zip(links, graph.used, strict=True)]
    return solved, used


def poses_by_tracking(track: Track) -> tuple[FloatArray | None, ...]:
    """Return the poses ``Trajectory.T_first_depth`` of all frames, by the links of tracking alone."""
    return _frame_poses(track, _chain(track))


def _frame_poses(track: Track, poses: Mapping[int, FloatArray]) -> tuple[FloatArray | None, ...]:
    """Return every frame's pose, by that of its keyframe; None for lost frames and other parts."""
    return tuple(
        None if one is None or one.keyframe not in poses else poses[one.keyframe] @ one.T_keyframe_frame
        for one in track.frames
    )

"""Loops and the pose graph of a recording's keyframes (SPEC 10.2)."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.progress import Progress
from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.recording.places import parts_of
from pipeline.recording.tracking import TRACKING, WITHIN, Track, link, registered
from pipeline.registration.graph.edges import PoseEdge
from pipeline.registration.graph.pose_graph import solve_pose_graph
from pipeline.registration.organised import OrganisedCloud, shared_shares
from pipeline.types import FloatArray, Link

LOOP_GATE_M = 0.3
"""Gate of a loop's registration: larger than in tracking, because drift may have grown."""
MOVED_M = 0.1
NEAR_M, NEAR_DEG = 0.9, 45.0
"""Distance and angle of keyframes that may show the same place."""
LEAST_PREDICTED = 0.4
"""Least overlap of two keyframes at their tracked poses for a trial."""
MOST_TRIED = 8
"""Most loops tried for each keyframe, those of the largest predicted overlap."""
ROUNDS = 2
"""Number of rounds: the poses after the first one predict more loops."""
GRAPH_POINTS = 200
"""About the number of a keyframe's points at which the pose graph measures errors."""


@dataclass(frozen=True, slots=True)
class _Candidate:
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


def iterate_loops(track: Track) -> Generator[Progress, None, Trajectory]:
    """Close loops between the keyframes of the largest part, and reconcile all links by least squares.

    Frames of other parts have no pose.
    """
    poses, clouds = _chain(track), track.clouds
    links = [one for one in track.links if one.source in poses]
    tried = {(one.source, one.target): one.T_target_source for one in links}
    for _ in range(ROUNDS):
        candidates = _candidates(poses, clouds, tried)
        before = len(links)
        for number, candidate in enumerate(candidates):
            if number % 10 == 0:
                yield Progress(f"trying loop {number} of {len(candidates)}", number / len(candidates))
            tried[candidate.source, candidate.target] = candidate.T_target_source
            found = _closed(candidate, clouds)
            if found is not None:
                tried[candidate.source, candidate.target] = found.T_target_source
                links.append(found)
        if len(links) == before and not any(one.loop for one in links):
            break
        poses, links = _reconciled(poses, links, clouds)
    return Trajectory(tuple(_frame_poses(track, poses)), poses, tuple(links))


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
    tried: Mapping[tuple[int, int], FloatArray],
) -> list[_Candidate]:
    """Return pairs of keyframes that should show the same place, for each the ``MOST_TRIED`` best.

    A pair that was tried before is tried again only if its start pose has moved by ``MOVED_M``.
    """
    numbers = list(poses)
    found: list[_Candidate] = []
    for later, source in enumerate(numbers):
        own = []
        for target in numbers[: max(0, later - 1)]:
            T = inverse(poses[target]) @ poses[source]
            if np.linalg.norm(T[:3, 3]) > NEAR_M or np.degrees(rotation_angle_rad(T[:3, :3])) > NEAR_DEG:
                continue
            before = tried.get((source, target))
            if before is not None and np.linalg.norm(T[:3, 3] - before[:3, 3]) < MOVED_M:
                continue
            predicted, _ = shared_shares(clouds[source], clouds[target], T, WITHIN)
            if predicted >= LEAST_PREDICTED:
                own.append(_Candidate(source, target, T, predicted))
        own.sort(key=lambda candidate: -candidate.predicted)
        found += own[:MOST_TRIED]
    return found


def _closed(candidate: _Candidate, clouds: Mapping[int, OrganisedCloud]) -> Link | None:
    """Register two keyframes from their poses; None if they do not show the same place."""
    source, target = candidate.source, candidate.target
    config = replace(TRACKING, gate_m=LOOP_GATE_M)
    found = registered(clouds[source], clouds[target], config, candidate.T_target_source)
    if found is None or not found.holds:
        return None
    return link(source, target, found, loop=True)


def _reconciled(
    poses: Mapping[int, FloatArray], links: Sequence[Link], clouds: Mapping[int, OrganisedCloud]
) -> tuple[dict[int, FloatArray], list[Link]]:
    """Return the keyframes' poses by least squares over all links, and the links with ``used`` set."""
    numbers = list(poses)
    places = {number: place for place, number in enumerate(numbers)}
    edges = [
        PoseEdge(places[one.source], places[one.target], one.T_target_source, one.information)
        for one in links
    ]
    points_m = [clouds[k].points_m[:: max(1, len(clouds[k]) // GRAPH_POINTS)] for k in numbers]
    graph = solve_pose_graph(points_m, edges)
    solved = dict(zip(numbers, graph.T_reference_node, strict=True))
    used = [replace(one, used=use) for one, use in zip(links, graph.used, strict=True)]
    return solved, used


def poses_by_tracking(track: Track) -> tuple[FloatArray | None, ...]:
    """Return (4, 4) poses of all frames along the links of tracking alone, as in ``Trajectory``."""
    return tuple(_frame_poses(track, _chain(track)))


def _frame_poses(track: Track, poses: Mapping[int, FloatArray]) -> Iterator[FloatArray | None]:
    """Yield the pose of every frame, which hangs on its keyframe."""
    for frame in track.frames:
        yield (
            None
            if frame is None or frame.keyframe not in poses
            else (poses[frame.keyframe] @ frame.T_keyframe_frame)
        )

"""Joining the parts of a recording, between which the camera was lost, by colour features."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import replace

from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress
from pipeline.acquisition import back_project
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse
from pipeline.recording.recording import Recording
from pipeline.recording.tracking import TRACKING, Track, link, registered
from pipeline.registration.colour import LiftedFeatures, lifted_features, match_score
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.search import search
from pipeline.registration.finding.starts import by_colour
from pipeline.registration.finding.surface import Surface
from pipeline.registration.graph.loops import Groups
from pipeline.types import FloatArray, Link, RgbdFrame

COMPARED = 8
"""Most keyframes of a part that are compared with those of another part."""
TRIED = 3
"""Most pairs of keyframes that are registered to join two parts."""
GATE_M = 0.1
"""Gate of the registration from the pose that was found."""


def parts_of(keyframes: Sequence[int], links: Iterable[Link]) -> list[list[int]]:
    """Return the groups of keyframes that used links connect, the largest first."""
    places = {number: place for place, number in enumerate(keyframes)}
    groups = Groups(len(keyframes), [(places[one.source], places[one.target]) for one in links if one.used])
    parts: dict[int, list[int]] = {}
    for number, place in places.items():
        parts.setdefault(groups.of(place), []).append(number)
    return sorted(parts.values(), key=lambda part: -len(part))


def iterate_joins(recording: Recording, track: Track) -> Generator[Progress, None, Track]:
    """Link the parts of a track whose relative pose has a sure verdict.

    Args:
        recording: the frames.
        track: the result of tracking.
    """
    places = _Places(recording)
    links = list(track.links)
    main, *others = parts_of(list(track.clouds), links)
    for number, part in enumerate(others):
        yield Progress(f"looking for part {number + 1} of {len(others)}", number / len(others))
        found = _join(places, track, main, part)
        if found is not None:
            links.append(found)
            main = sorted([*main, *part])
    return replace(track, links=tuple(links))


class _Places:
    """Reads keyframes and keeps their colour features."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._features: dict[int, LiftedFeatures] = {}
        self.T_color_depth = recording.view(0).T_color_depth

    def frame(self, number: int) -> RgbdFrame:
        return self._recording.frame(number)

    def features(self, number: int) -> LiftedFeatures:
        if number not in self._features:
            self._features[number] = lifted_features(self.frame(number))
        return self._features[number]

    def pose(self, source: int, target: int) -> FloatArray | None:
        """Return the depth camera's pose T_target_source if the verdict on it is sure."""
        clouds = [back_project(self.frame(number)) for number in (source, target)]
        judge = Judge(Surface(clouds[0]), Surface(clouds[1]))
        start = by_colour(self.features(source), self.features(target))
        try:
            found = search(clouds[0], clouds[1], [start], judge, RegistrationConfig())
        except PacketMeshError:
            return None
        if not found.verdict.sure:
            return None
        return inverse(self.T_color_depth) @ found.candidate.T_target_source @ self.T_color_depth


def _join(places: _Places, track: Track, main: list[int], part: list[int]) -> Link | None:
    """Return a registration of two keyframes of two parts; None if no pair has a sure verdict that holds."""
    pairs = [
        (match_score(places.features(source), places.features(target)), source, target)
        for source in _spread(part)
        for target in _spread(main)
    ]
    for _, source, target in sorted(pairs, key=lambda pair: -pair[0])[:TRIED]:
        T = places.pose(source, target)
        if T is None:
            continue
        found = registered(track.clouds[source], track.clouds[target], replace(TRACKING, gate_m=GATE_M), T)
        if found is not None and found.holds:
            return link(source, target, found, loop=True)
    return None


def _spread(numbers: list[int]) -> list[int]:
    """Return at most ``COMPARED`` of some numbers, evenly."""
    return numbers[:: max(1, -(-len(numbers) // COMPARED))]

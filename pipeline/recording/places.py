"""Keyframes recognised by their colours, and the parts of a recording joined by them (SPEC 10.2)."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import replace

from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import Progress
from pipeline.acquisition import back_project
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse
from pipeline.recording.brightness import shrunk
from pipeline.recording.recording import Recording, spread
from pipeline.recording.tracking import Track, loop_link
from pipeline.registration.colour import LiftedFeatures, colour_start, lifted_features, match_score
from pipeline.registration.finding.evidence import Judge
from pipeline.registration.finding.search import search
from pipeline.registration.finding.starts import Way, by_colour, by_surfaces
from pipeline.registration.finding.surface import Surface
from pipeline.registration.graph.loops import Groups
from pipeline.types import FloatArray, Link, RgbdFrame

COMPARED = 8
"""Most keyframes of a part that are compared with those of another part."""
TRIED = 3
"""Most pairs of keyframes that are registered to join two parts, by colour and then by their surfaces."""
MOST_PARTS = 12
"""Most parts, the largest first, that are looked for in the largest one."""
FOUND_GATE_M = 0.1
"""Gate of the registration from a pose that was found."""


def parts_of(keyframes: Sequence[int], links: Iterable[Link]) -> list[list[int]]:
    """Return the groups of keyframes that used links connect, the largest first."""
    places = {number: place for place, number in enumerate(keyframes)}
    groups = Groups(len(keyframes), [(places[one.source], places[one.target]) for one in links if one.used])
    parts: dict[int, list[int]] = {}
    for number, place in places.items():
        parts.setdefault(groups.of(place), []).append(number)
    return sorted(parts.values(), key=lambda part: -len(part))


def iterate_joins(places: Places, track: Track) -> Generator[Progress, None, Track]:
    """Link the parts of a track whose relative pose has a sure verdict.

    Args:
        places: the keyframes' colours.
        track: the result of tracking.
    """
    links = list(track.links)
    main, *others = parts_of(list(track.clouds), links)
    others = others[:MOST_PARTS]
    for number, part in enumerate(others):
        found = yield from _join(places, track, main, part, number, len(others))
        if found is not None:
            links.append(found)
            main = sorted([*main, *part])
    return replace(track, links=tuple(links))


class Places:
    """Reads keyframes in colour, and keeps their features."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._features: dict[int, LiftedFeatures | None] = {}
        self._T_color_depth = recording.view(0).T_color_depth

    def features(self, number: int) -> LiftedFeatures | None:
        """Return the features of a frame; None if its images cannot be read."""
        if number not in self._features:
            try:
                self._features[number] = lifted_features(self._frame(number))
            except InputError:
                self._features[number] = None
        return self._features[number]

    def score(self, source: int, target: int) -> float:
        """Return how many features of two frames look alike; 0 if images cannot be read."""
        one, other = self.features(source), self.features(target)
        return 0.0 if one is None or other is None else match_score(one, other)

    def start(self, source: int, target: int) -> FloatArray | None:
        """Return the depth camera's pose T_target_source on which colour features agree, unchecked."""
        one, other = self.features(source), self.features(target)
        if one is None or other is None:
            return None
        T = colour_start(one, other).T_target_source
        return None if T is None else self._of_depth(T)

    def pose(self, source: int, target: int, way: Way = "colour") -> FloatArray | None:
        """Return the depth camera's pose T_target_source if the verdict on it is sure.

        Args:
            source: number of a frame.
            target: number of another.
            way: kind of features from which the search starts.
        """
        one, other = self.features(source), self.features(target)
        if one is None or other is None:
            return None
        try:
            moving, fixed = (back_project(self._frame(number)) for number in (source, target))
            judge = Judge(*(Surface(cloud, from_camera=True) for cloud in (moving, fixed)))
            start = by_colour(one, other) if way == "colour" else by_surfaces(moving, fixed, True)
            found = search(moving, fixed, [start], judge, RegistrationConfig())
        except PacketMeshError:
            return None
        return self._of_depth(found.candidate.T_target_source) if found.verdict.sure else None

    def _frame(self, number: int) -> RgbdFrame:
        return shrunk(self._recording.frame(number))

    def _of_depth(self, T_target_source: FloatArray) -> FloatArray:
        """Return the depth camera's motion for one of the colour camera."""
        T: FloatArray = inverse(self._T_color_depth) @ T_target_source @ self._T_color_depth
        return T


def _join(
    places: Places, track: Track, main: Sequence[int], part: Sequence[int], number: int, parts: int
) -> Generator[Progress, None, Link | None]:
    """Return a registration of two keyframes of two parts; None if no pair has a sure verdict that holds.

    Pairs that look alike are tried by colour, then by their surfaces; of equal ones those near in time first.
    """
    yield Progress(f"looking for part {number + 1} of {parts}", number / parts)
    pairs = [(source, target) for source in spread(part, COMPARED) for target in spread(main, COMPARED)]
    order = {pair: (-places.score(*pair), abs(pair[0] - pair[1])) for pair in pairs}
    best = sorted(pairs, key=lambda pair: order[pair])[:TRIED]
    ways: tuple[Way, ...] = ("colour", "surfaces")
    for k, (way, (source, target)) in enumerate([(way, pair) for way in ways for pair in best]):
        done = (number + k / (len(ways) * len(best))) / parts
        yield Progress(f"looking for part {number + 1} of {parts}", done)
        T = places.pose(source, target, way)
        found = loop_link(track.clouds, source, target, T, FOUND_GATE_M)
        if found is not None:
            return found
    return None

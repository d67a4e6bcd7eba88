"""Places recognised by colour after much drift: a camera turns round in a room with patterned walls."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.kernels.geometry import inverse, look_at, pixel_rays
from pipeline.recording.loops import Trajectory, iterate_loops
from pipeline.recording.places import Places, iterate_joins
from pipeline.recording.revisits import iterate_revisits
from pipeline.recording.tracking import Track, Tracked
from pipeline.registration.organised import organised
from pipeline.types import FloatArray, Link, RgbdFrame
from tests.pipeline.recording.rendered import CAMERA, Rendered, errors, living_room, moved

STEP = 3
"""Every third frame is a keyframe."""
INFORMATION = np.diag([1.0 / np.radians(0.3) ** 2] * 3 + [1.0 / 0.01**2] * 3)
DRIFT = moved([0, 1, 0], -1.0, [0.02, -0.08, 0.02])
"""1 degree further than it turns, and 8 cm upwards."""


def pattern_at(points_m: FloatArray) -> np.ndarray:
    """Return (N, 3) uint8 colours of (N, 3) points: patches of 6 to 48 cm, of random colours."""
    total = np.zeros((len(points_m), 3))
    for scale_m, share in ((0.06, 0.3), (0.12, 0.3), (0.48, 0.4)):
        cells = np.floor(np.nan_to_num(points_m) / scale_m).astype(np.int64)
        mixed = (cells * [73856093, 19349663, 83492791]).sum(axis=1)[:, None] + [0, 7919, 104729]
        total += share * ((mixed * 2654435761) % 4294967296 >> 16) % 256
    return np.clip(total, 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class Patterned(Rendered):
    """Rendered frames with patterns that tell places apart."""

    plain: bool = False
    """Whether the colour images are grey."""
    damaged: frozenset[int] = frozenset()
    """Frames whose colour image cannot be read."""

    def frame(self, index: int) -> RgbdFrame:
        if index in self.damaged:
            raise InputError("the colour image is damaged")
        own = super().frame(index)
        T, z_m = self.T_true[index], own.depth.z_m
        points_m = (pixel_rays(CAMERA) * z_m[..., None]) @ T[:3, :3].T + T[:3, 3]
        rgb = pattern_at(points_m.reshape(-1, 3)).reshape(*z_m.shape, 3)
        return replace(own, rgb=np.full_like(rgb, 128) if self.plain else rgb)


def turning(count: int, turn_deg: float = 30.0) -> list[FloatArray]:
    """Poses of a camera in the middle of the room that turns to the left."""
    here = look_at([2.3, 2.2, 1.5], [4.6, 2.2, 1.0])
    up = here[:3, :3].T @ [0.0, 0.0, 1.0]
    return [here @ moved(up, turn_deg * k, [0.02 * k, 0.0, 0.0]) for k in range(count)]


def recorded(keyframes: Sequence[FloatArray], **options) -> Patterned:
    """The keyframes, every third frame of the recording."""
    return Patterned(*living_room(), [T for T in keyframes for _ in range(STEP)], noise_m=0.001, **options)


def tracked(recording: Rendered, drift: FloatArray, apart: Sequence[int] = ()) -> Track:
    """Links from each keyframe to the one before, with a drift; none before the keyframes ``apart``."""
    count = len(recording.T_true) // STEP
    clouds = {STEP * k: organised(recording.view(STEP * k).depth, CAMERA) for k in range(count)}
    T = recording.T_true
    links = [
        Link(
            STEP * k,
            STEP * k - STEP,
            inverse(T[STEP * k - STEP]) @ T[STEP * k] @ drift,
            INFORMATION,
            0.5,
            0.99,
        )
        for k in range(1, count)
        if k not in apart
    ]
    frames = [Tracked(STEP * (k // STEP), np.eye(4)) for k in range(len(T))]
    return Track(tuple(frames), clouds, tuple(links))


def largest_m(trajectory: Trajectory, recording: Rendered) -> float:
    """Return the largest error of a keyframe's position."""
    truth = [recording.T_true[number] for number in trajectory.keyframes]
    return float(errors(list(trajectory.keyframes.values()), truth)[0].max())


@pytest.fixture(scope="module")
def round_trip() -> Patterned:
    """A turn and a quarter, 30 degrees from one keyframe to the next."""
    return recorded(turning(16))


def test_a_drift_of_a_metre_over_a_turn_is_put_right_by_colour(round_trip):
    """It is spread over all links: none is wrong enough to be left out."""
    track = tracked(round_trip, DRIFT)
    without = drain(iterate_loops(track))
    found = drain(iterate_loops(track, Places(round_trip)))
    assert without.links == track.links
    assert largest_m(without, round_trip) > 1.0
    assert largest_m(found, round_trip) < 0.12
    assert all(one.used for one in found.links)
    loops = [one for one in found.links if one.loop]
    assert len(loops) >= 4
    for one in loops:
        T = inverse(round_trip.T_true[one.target]) @ round_trip.T_true[one.source]
        shifts_m, turns_deg = errors([np.eye(4), one.T_target_source], [np.eye(4), T])
        assert shifts_m[1] < 0.01
        assert turns_deg[1] < 0.2


def test_one_wrong_link_is_found_by_colour_and_left_out(round_trip):
    track = tracked(round_trip, np.eye(4))
    links = list(track.links)
    links[6] = replace(
        links[6], T_target_source=links[6].T_target_source @ moved([0, 1, 0], 15.0, [0.8, 0, 0.4])
    )
    found = drain(iterate_loops(replace(track, links=tuple(links)), Places(round_trip)))
    assert [one.used for one in found.links if not one.loop] == [k != 6 for k in range(15)]
    assert largest_m(found, round_trip) < 0.02


@pytest.mark.parametrize("drift", [np.eye(4), DRIFT])
def test_a_wrong_loop_does_not_bend_the_path(round_trip, drift):
    """It claims that the camera looks ahead where it looks back, with the certainty of right ones."""
    track = tracked(round_trip, drift)
    wrong = Link(18, 0, moved([0, 1, 0], 20.0, [0.5, 0.1, -0.3]), 10.0 * INFORMATION, 0.8, 0.97, loop=True)
    right = drain(iterate_loops(track, Places(round_trip)))
    found = drain(iterate_loops(replace(track, links=(*track.links, wrong)), Places(round_trip)))
    assert [one.used for one in found.links if (one.source, one.target) == (18, 0)] == [False]
    assert largest_m(found, round_trip) < largest_m(right, round_trip) + 0.01


def test_without_a_place_seen_twice_nothing_is_found():
    recording = recorded(turning(8))
    track = tracked(recording, DRIFT)
    trajectory = drain(iterate_loops(track, Places(recording)))
    assert trajectory.links == track.links


def test_a_right_path_needs_no_colour(round_trip, monkeypatch):
    """Pairs that show one place at their poses are not searched."""
    track = tracked(round_trip, np.eye(4))
    poses = {number: round_trip.T_true[number] for number in track.clouds}
    compared = []
    places = Places(round_trip)
    monkeypatch.setattr(Places, "pose", lambda self, source, target: compared.append((source, target)))
    assert drain(iterate_revisits(places, poses, track.clouds)) == []
    assert compared == []


def test_grey_or_damaged_images_give_no_loops_and_no_error(round_trip):
    for options in ({"plain": True}, {"damaged": frozenset(range(48))}):
        recording = replace(round_trip, **options)
        track = tracked(recording, DRIFT)
        assert drain(iterate_loops(track, Places(recording))).links == track.links


def joined(recording: Patterned, apart: Sequence[int]) -> tuple[Track, tuple[Link, ...]]:
    """Return the track with its parts joined, and the links that join them."""
    track = tracked(recording, np.eye(4), apart)
    found = drain(iterate_joins(Places(recording), track))
    return found, found.links[len(track.links) :]


def test_parts_of_one_place_are_joined_by_colour(round_trip):
    _, (one,) = joined(round_trip, [12])
    assert one.loop
    T = inverse(round_trip.T_true[one.target]) @ round_trip.T_true[one.source]
    assert errors([np.eye(4), one.T_target_source], [np.eye(4), T])[0][1] < 0.01


def test_parts_without_colours_are_joined_by_their_surfaces_where_the_camera_was_lost():
    recording = recorded(turning(8, 12.0), plain=True)
    _, (one,) = joined(recording, [4])
    T = inverse(recording.T_true[one.target]) @ recording.T_true[one.source]
    assert errors([np.eye(4), one.T_target_source], [np.eye(4), T])[0][1] < 0.01


@pytest.mark.parametrize("plain", [False, True])
def test_parts_of_two_places_are_not_joined(plain):
    """Keyframes 4 and 5 look back: they share nothing with the first four."""
    poses = turning(8)
    recording = recorded([*poses[:3], *poses[6:]], plain=plain)
    assert joined(recording, [3])[1] == ()

"""Loops between keyframes of a rendered walk, whose links were disturbed by a known drift."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.kernels.geometry import inverse, look_at, rotation_angle_rad
from pipeline.recording.loops import (
    LEAST_PREDICTED,
    LOOP_GATE_M,
    Trajectory,
    _best,
    _Candidate,
    _nearest,
    iterate_loops,
)
from pipeline.recording.tracking import (
    LEAST_AGREEMENT,
    LEAST_OVERLAP,
    TRACKING,
    WITHIN,
    Track,
    Tracked,
    iterate_tracking,
)
from pipeline.registration.organised import OrganisedCloud, organised, shared_shares
from pipeline.types import FloatArray, Link
from tests.pipeline.recording.rendered import CAMERA, MIDDLE_M, around, errors, in_the_living_room, moved

DRIFT = moved([1, 2, -1], 0.3, [0.006, -0.006, 0.005])
"""0.3 degrees and 1 cm."""
INFORMATION = np.diag([1.0 / np.radians(0.3) ** 2] * 3 + [1.0 / 0.01**2] * 3)


def clouds_at(poses: Sequence[FloatArray]) -> list[OrganisedCloud]:
    room = in_the_living_room(poses, noise_m=0.001)
    return [organised(room.view(k).depth, CAMERA) for k in range(len(poses))]


def chain(clouds: Sequence[OrganisedCloud], poses: Sequence[FloatArray], drift: FloatArray) -> Track:
    """Every tenth frame is a keyframe, linked to the one before with a drift; four frames hang on each."""
    numbers = [10 * k for k in range(len(poses))]
    links = [
        Link(10 * k, 10 * k - 10, inverse(poses[k - 1]) @ poses[k] @ drift, INFORMATION, 0.7, 0.99)
        for k in range(1, len(poses))
    ]
    frames: list[Tracked | None] = []
    for number in numbers:
        frames += [Tracked(number, moved([0, 1, 0], 0.5 * j, [0.01 * j, 0, 0])) for j in range(5)]
        frames += [None] * 5
    return Track(tuple(frames), dict(zip(numbers, clouds, strict=True)), tuple(links))


def closed(track: Track) -> Trajectory:
    return drain(iterate_loops(track))


def along(track: Track) -> list[FloatArray]:
    """Poses of the keyframes along the links."""
    poses = [np.eye(4)]
    for one in track.links:
        poses.append(poses[-1] @ one.T_target_source)
    return poses


@pytest.fixture(scope="module")
def ring() -> tuple[Track, list[FloatArray]]:
    """Twelve keyframes around a closed path, and their true poses."""
    poses = around(12)
    return chain(clouds_at(poses), poses, DRIFT), poses


@pytest.fixture(scope="module")
def trajectory(ring) -> Trajectory:
    return closed(ring[0])


def test_loops_put_a_drift_right(ring, trajectory):
    track, truth = ring
    before_m, before_deg = errors(along(track), truth)
    after_m, after_deg = errors(list(trajectory.keyframes.values()), truth)
    assert before_m.max() > 0.08
    assert before_deg.max() > 3.0
    assert after_m.max() < 0.005 < 0.2 * before_m.max()
    assert after_deg.max() < 0.15 < 0.2 * before_deg.max()


def test_loops_join_keyframes_that_show_the_same_place(ring, trajectory):
    track, truth = ring
    loops = [one for one in trajectory.links if one.loop]
    assert [replace(one, used=True) for one in trajectory.links[: len(track.links)]] == list(track.links)
    assert len(loops) > 6
    assert len({(one.source, one.target) for one in trajectory.links}) == len(trajectory.links)
    for one in loops:
        assert one.source - one.target >= 20
        assert one.used
        assert one.overlap_share >= LEAST_OVERLAP
        assert one.agreeing_share >= LEAST_AGREEMENT
        T = inverse(truth[one.target // 10]) @ truth[one.source // 10]
        shift_m, turn_deg = errors([np.eye(4), one.T_target_source], [np.eye(4), T])
        assert shift_m[1] < 0.005
        assert turn_deg[1] < 0.15


def test_frames_hang_on_their_keyframes(ring, trajectory):
    track, _ = ring
    assert len(trajectory.T_first_depth) == len(track.frames)
    for frame, T in zip(track.frames, trajectory.T_first_depth, strict=True):
        if frame is None:
            assert T is None
        else:
            np.testing.assert_allclose(
                T, trajectory.keyframes[frame.keyframe] @ frame.T_keyframe_frame, atol=1e-12
            )


def test_the_first_keyframe_is_the_world(trajectory):
    assert list(trajectory.keyframes) == list(range(0, 120, 10))
    np.testing.assert_allclose(trajectory.keyframes[0], np.eye(4), atol=1e-12)
    for T in trajectory.keyframes.values():
        np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)


def test_without_loops_the_chain_stays_as_it_is():
    """A camera that turns by 30 degrees from one keyframe to the next."""
    here = look_at([2.3, 1.2, 1.5], MIDDLE_M)
    poses = [here @ moved([0, 1, 0], 30.0 * k, [0, 0, 0]) for k in range(4)]
    track = chain(clouds_at(poses), poses, DRIFT)
    trajectory = closed(track)
    assert trajectory.links == track.links
    for T, expected in zip(trajectory.keyframes.values(), along(track), strict=True):
        np.testing.assert_allclose(T, expected, atol=1e-12)


def test_keyframes_hang_on_the_one_that_they_are_linked_to():
    """After the camera was lost, a keyframe may be linked to any earlier one."""
    here = look_at([2.3, 1.2, 1.5], MIDDLE_M)
    steps = [moved([0, 1, 0], angle_deg, [0.1, 0, 0]) for angle_deg in (50.0, -50.0)]
    poses = [here, here @ steps[0], here @ steps[1]]
    clouds = dict(zip((0, 5, 9), clouds_at(poses), strict=True))
    links = [Link(5, 0, steps[0], INFORMATION, 0.4, 0.9), Link(9, 0, steps[1], INFORMATION, 0.4, 0.9)]
    frames = [Tracked(9, np.eye(4)) if k == 9 else None for k in range(10)]
    trajectory = closed(Track(tuple(frames), clouds, tuple(links)))
    np.testing.assert_allclose(trajectory.keyframes[9], steps[1], atol=1e-12)
    np.testing.assert_allclose(trajectory.T_first_depth[9], steps[1], atol=1e-12)


def test_frames_of_a_smaller_part_have_no_pose():
    """Keyframes 0 and 5 are joined to no other; of the larger part one link leads to an earlier frame."""
    here = look_at([2.3, 1.2, 1.5], MIDDLE_M)
    step = moved([0, 1, 0], 50.0, [0.1, 0, 0])
    poses = [here @ np.linalg.matrix_power(step, k) for k in range(5)]
    clouds = dict(zip((0, 5, 10, 15, 20), clouds_at(poses), strict=True))
    links = [Link(5, 0, step, INFORMATION, 0.4, 0.95)]
    links += [Link(20, 15, step, INFORMATION, 0.4, 0.95), Link(10, 15, inverse(step), INFORMATION, 0.4, 0.95)]
    frames = [Tracked(k, np.eye(4)) if k in clouds else None for k in range(21)]
    trajectory = closed(Track(tuple(frames), clouds, tuple(links)))
    assert list(trajectory.keyframes) == [10, 15, 20]
    assert trajectory.links == tuple(links[1:])
    assert trajectory.T_first_depth[0] is trajectory.T_first_depth[5] is None
    for k, expected in ((10, np.eye(4)), (15, step), (20, step @ step)):
        np.testing.assert_allclose(trajectory.keyframes[k], expected, atol=1e-12)
        np.testing.assert_allclose(trajectory.T_first_depth[k], expected, atol=1e-12)


def test_two_places_that_look_different_make_no_loop():
    """The chain leads back to the first keyframe, but the camera sees another corner."""
    truth = [
        look_at([1.0, 1.5, 1.5], MIDDLE_M),
        look_at([2.3, 1.2, 1.5], [4.5, 0.5, 0.5]),
        look_at([3.6, 3.2, 1.5], MIDDLE_M),
    ]
    clouds = clouds_at(truth)
    claimed = [
        truth[0],
        truth[0] @ moved([0, 1, 0], 60.0, [0, 0, 0]),
        truth[0] @ moved([0, 1, 0], 5.0, [0.05, 0, 0]),
    ]
    predicted, _ = shared_shares(clouds[2], clouds[0], inverse(claimed[0]) @ claimed[2], WITHIN)
    assert predicted >= LEAST_PREDICTED  # so that it is tried
    track = chain(clouds, claimed, np.eye(4))
    trajectory = closed(track)
    assert trajectory.links == track.links
    np.testing.assert_allclose(trajectory.keyframes[20], inverse(claimed[0]) @ claimed[2], atol=1e-12)


def test_a_wrong_link_is_outvoted(ring):
    """One link is wrong by 20 cm: it is not used, and the poses are right."""
    track, truth = ring
    links = list(chain(list(track.clouds.values()), truth, np.eye(4)).links)
    links[5] = replace(
        links[5], T_target_source=links[5].T_target_source @ moved([0, 1, 0], 2.0, [0.2, 0, 0])
    )
    trajectory = closed(replace(track, links=tuple(links)))
    assert [one.used for one in trajectory.links[:11]] == [k != 5 for k in range(11)]
    assert errors(list(trajectory.keyframes.values()), truth)[0].max() < 0.005


def test_each_pair_is_tried_once_if_it_is_near_and_looks_the_same_way(ring, monkeypatch):
    """Of each keyframe the two that should share most, and never two in a row."""
    track, _ = ring
    clouds = list(track.clouds.values())
    places = {id(cloud): k for k, cloud in enumerate(clouds)}
    tried = []

    def counted(source, target, config, start):
        assert config == replace(TRACKING, gate_m=LOOP_GATE_M)
        tried.append((places[id(source)], places[id(target)], start))

    monkeypatch.setattr("pipeline.recording.tracking.registered", counted)
    for name, value in (("MOST_TRIED", 2), ("NEAR_M", 0.5), ("NEAR_DEG", 28.0)):
        monkeypatch.setattr(f"pipeline.recording.loops.{name}", value)
    closed(track)
    poses, pairs, refused = along(track), [pair[:2] for pair in tried], [0, 0, 0]
    shares: dict[tuple[int, int], float] = {}
    for i in range(12):
        for j in range(i - 1):
            T = inverse(poses[j]) @ poses[i]
            far = np.linalg.norm(T[:3, 3]) > 0.5
            turned = np.degrees(rotation_angle_rad(T[:3, :3])) > 28.0
            share = shared_shares(clouds[i], clouds[j], T, WITHIN)[0]
            if far or turned or share < LEAST_PREDICTED:
                refused[0 if far else 1 if turned else 2] += share >= LEAST_PREDICTED
            else:
                shares[i, j] = share
    assert min(refused[:2]) > 0  # each rule decides of some pair
    for i in range(12):
        own = sorted((share for (source, _), share in shares.items() if source == i), reverse=True)
        assert [shares[pair] for pair in pairs if pair[0] == i] == own[:2]
    for i, j, start in tried:
        np.testing.assert_allclose(start, inverse(poses[j]) @ poses[i], atol=1e-12)
    assert len(set(pairs)) == len(pairs) < len(shares)


def test_a_rejected_loop_that_is_found_again_counts_once(ring, monkeypatch):
    """Two that agree with each other would outvote a link of tracking."""
    track, truth = ring
    right = chain(list(track.clouds.values()), truth, np.eye(4))
    T = inverse(truth[0]) @ truth[2] @ moved([0, 1, 0], 0.0, [0.2, 0, 0])
    wrong, tried = Link(20, 0, T, INFORMATION, 0.5, 0.95, loop=True), []

    def found(clouds, source, target, T_target_source, gate_m):
        tried.append((source, target))
        return wrong if (source, target) == wrong.pair else None

    monkeypatch.setattr("pipeline.recording.loops.loop_link", found)
    trajectory = closed(right)
    assert tried.count(wrong.pair) == 2
    assert [one.used for one in trajectory.links] == [*[True] * 11, False]
    assert errors(list(trajectory.keyframes.values()), truth)[0].max() < 1e-6


def test_a_tracked_walk_closes(ring):
    """Tracking and loops together, from the images alone."""
    walk = in_the_living_room(around(24), noise_m=0.002)
    trajectory = closed(drain(iterate_tracking(walk)))
    shifts_m, turns_deg = errors(trajectory.T_first_depth, walk.T_true)
    assert shifts_m.max() < 0.005
    assert turns_deg.max() < 0.1
    assert any(one.loop for one in trajectory.links)
    assert all(one.used for one in trajectory.links)


def test_of_many_keyframes_fewer_loops_are_tried_and_from_different_times():
    """Targets 0, 10, 20, ... by falling overlap: of 600 keyframes each has three, no two in a row."""
    own = [_Candidate(900, 10 * k, np.eye(4), 0.9 - 0.01 * k) for k in range(10)]
    assert [one.target for one in _best(own[::-1], range(0, 1000, 10))] == [10 * k for k in range(8)]
    assert [one.target for one in _best(own[::-1], range(0, 6000, 10))] == [0, 20, 40]
    assert [one.target for one in _best(own[::-1], range(0, 2000, 10))] == [0, 20, 40, 60, 80]
    assert [one.target for one in _best(own[:2], range(0, 6000, 10))] == [0, 10]


def test_of_many_keyframes_targets_of_different_times_are_all_tried():
    """Two targets without a keyframe between them that is a candidate are still of different times."""
    own = [_Candidate(900, target, np.eye(4), 0.9) for target in (0, 300, 310, 600)]
    assert [one.target for one in _best(own, range(0, 6000, 10))] == [0, 300, 600]


def test_the_nearest_earlier_keyframes_are_compared():
    """Those of .9 m and 45 degrees, without the one before; at most 32, the nearest in place and angle."""
    T = np.array([moved([0, 1, 0], 0.5 * k, [0.01 * k, 0, 0]) for k in range(101)])
    assert _nearest(T, 100).tolist() == list(range(67, 99))
    assert _nearest(T[::11], 9).tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert _nearest(T, 1).tolist() == []

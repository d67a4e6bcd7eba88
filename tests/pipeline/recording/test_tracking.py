"""Tracking through a rendered room, whose camera poses are known."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.importing.recorded import DepthView
from pipeline.kernels.geometry import inverse, look_at, rigid
from pipeline.recording.brightness import Brightness
from pipeline.recording.recording import read_ahead
from pipeline.recording.tracking import (
    LEAST_AGREEMENT,
    LEAST_OVERLAP,
    LESS_AGREEMENT,
    NEW_BELOW,
    PATIENCE,
    STEP_DEG,
    STEP_M,
    TRACKING,
    WITHIN,
    Registered,
    Track,
    iterate_tracking,
    link,
    registered,
    steadied,
)
from pipeline.registration.organised import OrganisedCloud, organised, shared_shares
from pipeline.types import DepthMap, FloatArray, Link
from tests.pipeline.recording.rendered import (
    CAMERA,
    MIDDLE_M,
    NOISE,
    Rendered,
    around,
    errors,
    in_the_living_room,
    moved,
)
from tests.pipeline.registration.test_photometric import painted, seen

EYE_M = (1.0, 1.5, 1.5)
TURNED = moved([0, 1, 0], 180.0, [0, 0, 0])
"""Motion of a camera that looks back over its shoulder."""


def tracked(recording: Rendered) -> Track:
    return drain(iterate_tracking(recording, recording.T_world_camera))


def chained(track: Track) -> list[FloatArray | None]:
    """Poses in the first keyframe, along the links, of all frames that they reach."""
    poses = {next(iter(track.clouds)): np.eye(4)}
    for one in track.links:
        if one.target in poses:
            poses[one.source] = poses[one.target] @ one.T_target_source
    return [
        poses[own.keyframe] @ own.T_keyframe_frame if own is not None and own.keyframe in poses else None
        for own in track.frames
    ]


def assert_right(track: Track, truth: Sequence[FloatArray]) -> None:
    """All that was found, in every part, is where it should be."""
    found = [(k, own.keyframe, own.T_keyframe_frame) for k, own in enumerate(track.frames) if own is not None]
    found += [(one.source, one.target, one.T_target_source) for one in track.links]
    for source, target, T in found:
        shifts_m, turns_deg = errors([np.eye(4), T], [truth[target], truth[source]])
        assert shifts_m[1] < 0.005
        assert turns_deg[1] < 0.1


def assert_shares(found: Link | Registered, source: OrganisedCloud, target: OrganisedCloud) -> None:
    overlap, agreeing = shared_shares(source, target, found.T_target_source, WITHIN)
    _, back = shared_shares(target, source, inverse(found.T_target_source), WITHIN)
    assert (found.overlap_share, found.agreeing_share) == (overlap, min(agreeing, back))


def sideways(steps_m: Sequence[float]) -> list[FloatArray]:
    """Poses of a camera that looks at the room's middle, and moves by these steps to its right."""
    T = look_at(EYE_M, MIDDLE_M)
    return [T @ moved([1, 0, 0], 0.0, [along, 0, 0]) for along in np.cumsum([0.0, *steps_m])]


@pytest.fixture(scope="module")
def walk() -> Rendered:
    return in_the_living_room(around(24), noise_m=0.001)


@pytest.fixture(scope="module")
def track(walk) -> Track:
    return tracked(walk)


def test_a_closed_walk_is_followed_within_five_millimetres(walk, track):
    shifts_m, turns_deg = errors(chained(track), walk.T_true)
    assert len(track.frames) == 24
    assert shifts_m.max() < 0.005
    assert turns_deg.max() < 0.1


def test_a_keyframe_is_renewed_once_it_shares_too_little(walk, track):
    """All others share more with theirs; each keyframe is linked to the one before it."""
    numbers = list(track.clouds)
    assert numbers[0] == 0
    assert 4 < len(numbers) < 12
    assert [(one.source, one.target) for one in track.links] == list(zip(numbers[1:], numbers, strict=False))
    for one in track.links:
        assert LEAST_OVERLAP < one.overlap_share < NEW_BELOW
        assert one.agreeing_share > 0.95
        assert not one.loop
        assert_shares(one, track.clouds[one.source], track.clouds[one.target])
    for k, frame in enumerate(track.frames):
        assert frame.keyframe == max(number for number in numbers if number <= k)
        if k in numbers:
            np.testing.assert_array_equal(frame.T_keyframe_frame, np.eye(4))
        else:
            view = walk.view(k)
            own, keyframe = organised(view.depth, view.camera), track.clouds[frame.keyframe]
            assert shared_shares(own, keyframe, frame.T_keyframe_frame, WITHIN)[0] >= NEW_BELOW


def test_a_camera_that_stands_has_one_keyframe():
    track = tracked(in_the_living_room([look_at(EYE_M, MIDDLE_M)] * 4, noise_m=0.002))
    assert list(track.clouds) == [0]
    assert track.links == ()
    assert errors(chained(track), [np.eye(4)] * 4)[0].max() < 0.001


def test_poses_stay_rigid_after_sixty_frames():
    """Each pose is the start of the next but one through the motion: its rounding errors must not be."""
    here = look_at(EYE_M, MIDDLE_M)
    three = [here, here @ moved([0, 1, 0], 1.0, [0.01, 0, 0]), here @ moved([1, 0, 0], 1.0, [0, 0.01, 0])]
    room = in_the_living_room(three)
    views = [room.view(k) for k in range(3)]

    @dataclass(frozen=True)
    class Repeated(Rendered):
        def view(self, index: int) -> DepthView:
            return views[index % 3]

    track = tracked(Repeated(room.vertices_m, room.triangles, three * 20))
    assert list(track.clouds) == [0]
    for frame in track.frames:
        turn = frame.T_keyframe_frame[:3, :3]
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-9)
        np.testing.assert_array_equal(frame.T_keyframe_frame[3], [0, 0, 0, 1])
    assert errors(chained(track), three * 20)[0].max() < 0.003


def started(monkeypatch, walk: Rendered, missed: int | None = None) -> list[float]:
    """Place, in centimetres to the right, at which each registration starts; one of them may find nothing."""
    starts_cm: list[float] = []

    def recorded(source, target, config, start, predicted=None):
        starts_cm.append(round(100.0 * start[0, 3], 0))
        return None if len(starts_cm) - 1 == missed else registered(source, target, config, start, predicted)

    monkeypatch.setattr("pipeline.recording.tracking.registered", recorded)
    track = tracked(walk)
    assert list(track.clouds) == [0]
    shifts_m, _ = errors(chained(track), walk.T_true)
    assert np.nanmax(shifts_m) < 0.005
    return starts_cm


def test_the_start_continues_the_motion(monkeypatch):
    """Of 5 cm a frame; after a frame without a pose the motion is unknown, once."""
    poses = sideways([0.05] * 6)
    assert started(monkeypatch, in_the_living_room(poses)) == [0, 10, 15, 20, 25, 30]
    blind = in_the_living_room(poses, blind=frozenset({3}))
    assert started(monkeypatch, blind) == [0, 10, 15, 20, 30]


def test_a_lost_frame_is_looked_for_where_the_camera_was_last(monkeypatch):
    """Frame 3 looks back: the second registration of it is the search, from the last pose."""
    poses = sideways([0.05] * 6)
    turned = in_the_living_room([*poses[:3], poses[3] @ TURNED, *poses[4:]])
    assert started(monkeypatch, turned) == [0, 10, 15, 10, 10, 20, 30]
    assert started(monkeypatch, in_the_living_room(poses), missed=2) == [0, 10, 15, 10, 15, 25, 30]


def test_frames_without_depth_have_no_pose_and_the_next_ones_are_found_again():
    walk = in_the_living_room(around(36)[:14], blind=frozenset({5, 6, 7}))
    track = tracked(walk)
    assert [k for k, frame in enumerate(track.frames) if frame is None] == [5, 6, 7]
    shifts_m, turns_deg = errors(chained(track), walk.T_true)
    assert np.nanmax(shifts_m) < 0.005
    assert np.nanmax(turns_deg) < 0.1


def test_the_first_keyframe_is_the_first_frame_with_depth():
    walk = in_the_living_room(around(36)[:5], blind=frozenset({0, 1}))
    track = tracked(walk)
    assert track.frames[:2] == (None, None)
    assert next(iter(track.clouds)) == 2
    assert errors(chained(track)[2:], walk.T_true[2:])[0].max() < 0.005
    nothing = tracked(in_the_living_room(around(3), blind=frozenset({0, 1, 2})))
    assert nothing == Track((None, None, None), {}, (), blind=(0, 1, 2))


@pytest.mark.parametrize("given", [False, True])
def test_a_camera_that_turns_away_is_lost_and_found_again_when_it_is_back(given):
    poses = sideways([0.03] * 13)
    poses[5:10] = [T @ TURNED for T in poses[5:10]]
    walk = in_the_living_room(poses, noise_m=0.001, given=given)
    track = tracked(walk)
    assert [k for k, frame in enumerate(track.frames) if frame is None] == [5, 6, 7, 8, 9]
    assert np.nanmax(errors(chained(track), walk.T_true)[0]) < 0.005


def test_a_lost_camera_is_not_found_where_it_is_not():
    """The camera swings to a wall without structure. Another corner agrees with 0.78 of the last keyframe."""
    walk = in_the_living_room(around(24, 0.6, 1.4))
    track = tracked(walk)
    assert None in track.frames
    assert_right(track, walk.T_true)


def test_a_camera_that_is_lost_for_long_begins_anew():
    """And goes back to the first part when it is there again."""
    poses = sideways([0.03] * 16)
    poses[5:13] = [T @ TURNED for T in poses[5:13]]
    track = tracked(in_the_living_room(poses, noise_m=0.001))
    assert list(track.clouds) == [0, 5 + PATIENCE]
    assert track.links == ()
    keyframes = [None if frame is None else frame.keyframe for frame in track.frames]
    assert keyframes == [0] * 5 + [None] * PATIENCE + [10] * 3 + [0] * 4
    assert_right(track, poses)


@pytest.mark.parametrize("portrait", [False, True])
def test_a_jump_is_followed_from_poses_that_came_with_the_recording(portrait):
    """Of 0.6 m and 30 degrees. The poses are of the colour camera, and wrong by 2 cm and a degree."""
    jump = moved([0, 1, 0], -30.0, [0.6, 0, 0])
    here = look_at(EYE_M, MIDDLE_M)
    poses = [
        here,
        here @ moved([0, 1, 0], 2.0, [0.02, 0, 0]),
        here @ jump,
        here @ jump @ moved([1, 0, 0], 2.0, [0, 0, 0.02]),
    ]
    T_color_depth = moved([0, 0, 1], 90.0, [0.05, -0.02, 0.01]) if portrait else np.eye(4)
    walk = in_the_living_room(poses, T_color_depth=T_color_depth)
    shaken = [T @ moved([1, 1, 0], 1.0 * (k % 2), [0.0, 0.02 * (k % 2), 0.0]) for k, T in enumerate(poses)]

    @dataclass(frozen=True)
    class WithPoses(Rendered):
        @property
        def T_world_camera(self) -> tuple[FloatArray, ...]:
            return tuple(shaken)

    with_poses = WithPoses(walk.vertices_m, walk.triangles, poses, T_color_depth=T_color_depth)
    shifts_m, turns_deg = errors(chained(tracked(with_poses)), walk.T_true_depth)
    assert shifts_m.max() < 0.005
    assert turns_deg.max() < 0.1
    without_m, _ = errors(chained(tracked(walk)), walk.T_true_depth)
    assert np.isnan(without_m[2])


@dataclass(frozen=True)
class Counting(Rendered):
    """Counts what is read."""

    read: list[int] = field(default_factory=list)

    def view(self, index: int) -> DepthView:
        if index == 99:
            raise InputError("frame 99 is damaged")
        self.read.append(index)
        return super().view(index)


def counting(count: int, **options) -> Counting:
    room = in_the_living_room([])
    return Counting(room.vertices_m, room.triangles, around(count), **options)


def test_read_ahead_yields_the_frames_in_order_and_reads_one_ahead():
    recording, numbers = counting(9), [3, 4, 8, 0, 1]
    got = []
    for k, view in read_ahead(recording, numbers):
        got.append(k)
        assert len(recording.read) <= len(got) + 1
        np.testing.assert_array_equal(view.depth.z_m, in_the_living_room(around(9)).view(k).depth.z_m)
    assert got == recording.read == numbers
    assert list(read_ahead(recording, [])) == []
    assert [k for k, _ in read_ahead(recording, [7])] == [7]


def test_two_readers_yield_the_frames_in_order_and_read_two_ahead():
    """The first of every three frames takes longest."""

    class Slow(Counting):
        def view(self, index: int) -> DepthView:
            time.sleep(0.0 if index % 3 else 0.03)
            return super().view(index)

    room = in_the_living_room([])
    recording = Slow(room.vertices_m, room.triangles, around(7))
    got = []
    for k, view in read_ahead(recording, range(7), 2):
        got.append(k)
        assert len(recording.read) <= len(got) + 2
        np.testing.assert_array_equal(view.depth.z_m, in_the_living_room(around(7)).view(k).depth.z_m)
    assert got == list(range(7))
    assert sorted(recording.read) == got


def test_the_error_of_a_damaged_frame_comes_at_its_turn():
    frames = read_ahead(counting(3), [0, 99, 1])
    assert next(frames)[0] == 0
    with pytest.raises(InputError, match="frame 99 is damaged"):
        next(frames)


def test_every_frame_is_read_once_and_progress_grows():
    recording = counting(12, given=True)
    steps = list(iterate_tracking(recording, recording.T_world_camera))
    assert sorted(recording.read)[1:] == list(range(12))  # the first one also for the depth camera's pose
    assert [step.fraction for step in steps] == sorted(step.fraction for step in steps)
    assert steps[0].stage == "frame 0 of 12"
    assert len(steps) == 2


def test_two_views_are_registered_or_not():
    room = in_the_living_room(sideways([0.05, 0.0]))
    clouds = [organised(room.view(k).depth, CAMERA) for k in range(2)]
    found = registered(clouds[1], clouds[0], TRACKING, np.eye(4))
    assert found.holds
    np.testing.assert_allclose(found.T_target_source[:3, 3], [0.05, 0, 0], atol=0.001)
    assert np.linalg.eigvalsh(found.information).min() > 0.0
    assert_shares(found, clouds[1], clouds[0])
    assert registered(clouds[1], clouds[0], TRACKING, moved([1, 0, 0], 0.0, [0, 0, 50])) is None


@pytest.mark.parametrize(
    ("overlap", "agreement", "holds", "near"),
    [
        (LEAST_OVERLAP, LEAST_AGREEMENT, True, True),
        (LEAST_OVERLAP - 0.01, 1.0, False, False),
        (1.0, LEAST_AGREEMENT - 0.01, False, True),
        (LEAST_OVERLAP, LESS_AGREEMENT, False, True),
        (1.0, LESS_AGREEMENT - 0.01, False, False),
    ],
)
def test_less_agreement_is_enough_where_the_motion_leads(overlap, agreement, holds, near):
    T = moved([1, 2, 3], 40.0, [0.5, 0.6, 0.7])
    found = Registered(T, np.eye(6), overlap, agreement)
    assert found.holds == holds
    for angle_deg, shift_m, is_near in (
        (0.9 * STEP_DEG, 0.9 * STEP_M, True),
        (1.1 * STEP_DEG, 0.0, False),
        (0.0, 1.1 * STEP_M, False),
    ):
        predicted = T @ moved([0, 1, 1], angle_deg, [0, shift_m, 0])
        assert found.holds_near(predicted) == (near if is_near else holds)


def test_a_link_is_a_registration_with_the_keyframes_numbers():
    found = Registered(moved([1, 2, 3], 4.0, [0.5, 0.6, 0.7]), np.diag(np.arange(1.0, 7.0)), 0.7, 0.9)
    joined = link(8, 5, found)
    assert (joined.source, joined.target, joined.loop, joined.used) == (8, 5, False, True)
    assert joined.T_target_source is found.T_target_source
    assert joined.information is found.information
    assert (joined.overlap_share, joined.agreeing_share) == (0.7, 0.9)
    assert link(8, 5, found, loop=True).loop


def test_a_prediction_decides_where_the_surfaces_leave_the_motion_open():
    """Known to 1 mm along x and y, open along z: the pose takes the prediction's z and keeps its own x."""
    open_z = np.diag([1e8, 1e8, 1e8, 1e6, 1e6, 1e-6])
    T = steadied(np.eye(4), open_z, moved([0, 0, 1], 0.0, [0.1, 0.0, 0.3]))
    assert T[:3, 3] == pytest.approx([0.1 / (1.0 + 400.0), 0.0, 0.3], abs=1e-4)
    np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-9)


def test_a_prediction_is_given_in_the_targets_frame():
    """The open direction is that of the source, turned by 90 degrees about y against the target."""
    T_registered = moved([0, 1, 0], 90.0, [1.0, 0.0, 0.0])
    open_x = np.diag([1e8, 1e8, 1e8, 1e-6, 1e6, 1e6])
    predicted = T_registered @ moved([0, 0, 1], 0.0, [0.2, 0.0, 0.0])
    np.testing.assert_allclose(steadied(T_registered, open_x, predicted), predicted, atol=1e-6)


@pytest.mark.parametrize(("radius_m", "turn_m"), [(0.4, 0.9), (0.5, 1.2)])
def test_noise_and_bare_walls_do_not_make_the_camera_slip(radius_m, turn_m):
    """Without the prediction links slip by up to 33 cm, though nearly all that both measured agrees."""
    walk = in_the_living_room(around(24, radius_m, turn_m), noise_m=0.002)
    for one in tracked(walk).links:
        true = inverse(walk.T_true[one.target]) @ walk.T_true[one.source]
        assert np.linalg.norm((inverse(true) @ one.T_target_source)[:3, 3]) < 0.06


class WallFrames:
    """A camera that slides along a painted wall, and turns back; has what ``recording.Recording`` has."""

    name, T_world_camera, notes = "wall", None, ()

    def __init__(self, paint):
        self._paint = paint
        self.places_m = 0.05 * np.sin(0.35 * np.arange(24))
        self.times_s = np.arange(24) / 30.0

    def pose(self, index):
        return rigid(np.eye(3), np.array([self.places_m[index], -0.4 * self.places_m[index], 0.0]))

    def view(self, index):
        frame = self.frame(index)
        noise_m = 0.002 * np.random.default_rng(index).standard_normal(frame.depth.z_m.shape)
        z_m = (frame.depth.z_m + noise_m).astype(np.float32)
        return DepthView(DepthMap(z_m), frame.intrinsics, np.eye(4), NOISE)

    def frame(self, index):
        return seen(self.pose(index), self._paint, seed=index)


def test_a_painted_wall_holds_the_camera_and_a_bare_one_does_not():
    """Depth shows no slide along a wall, and the motion so far is wrong where the camera turns back."""

    assert worst_m(WallFrames(painted)) < 0.003
    assert worst_m(WallFrames(lambda x_m, y_m: np.full_like(x_m, 120.0))) > 0.03


def test_photographs_do_not_move_the_camera_to_where_depth_denies_it(monkeypatch):
    """Two metres along the wall, where the images no longer overlap."""
    far = rigid(np.eye(3), np.array([2.0, 0.0, 0.0]))
    monkeypatch.setattr(
        Brightness, "corrected", lambda self, source, keyframe, T, motions: (T @ far, np.eye(6))
    )
    assert worst_m(WallFrames(painted)) < 0.2


def worst_m(recording):
    track = tracked(recording)
    assert all(one is not None for one in track.frames)
    return max(np.linalg.norm((inverse(recording.pose(k)) @ T)[:3, 3]) for k, T in enumerate(chained(track)))

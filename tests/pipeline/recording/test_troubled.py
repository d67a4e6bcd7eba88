"""Recordings as they should not be: the poses that are found are right, and the other frames have none."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.importing.recorded import DepthView
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import inverse, pixel_rays
from pipeline.recording.errors import ate_m
from pipeline.recording.walk import iterate_walk
from pipeline.types import DepthMap, FloatArray, RgbdFrame, Walk
from tests.pipeline.recording.rendered import (
    CAMERA,
    Rendered,
    around,
    errors,
    in_the_living_room,
    living_room,
    moved,
)


def walked(recording: Rendered) -> Walk:
    walk = drain(iterate_walk(recording)).walk
    assert walk is not None
    return walk


def assert_right(walk: Walk, truth: Sequence[FloatArray], within_m: float = 0.01) -> list[int]:
    """Compare the poses that were found, from the first of them on; returns the frames without a pose."""
    found = [k for k, T in enumerate(walk.T_world_camera) if T is not None]
    first = inverse(walk.T_world_camera[found[0]])
    shifts_m, turns_deg = errors([first @ walk.T_world_camera[k] for k in found], [truth[k] for k in found])
    assert shifts_m.max() < within_m
    assert turns_deg.max() < 0.5
    return sorted(set(range(len(truth))) - set(found))


@dataclass(frozen=True)
class Changed(Rendered):
    """Depth images that ``change`` has changed."""

    change: Any = None
    """Function of a frame's number, its (H, W) depth, metres, and its (H, W, 3) points in the world."""

    def view(self, index: int) -> DepthView:
        view = super().view(index)
        T, z_m = self.T_true[index], view.depth.z_m
        points_m = (pixel_rays(CAMERA) * z_m[..., None]) @ T[:3, :3].T + T[:3, 3]
        return replace(view, depth=DepthMap(self.change(index, z_m, points_m).astype(np.float32)))


def changed(poses: Sequence[FloatArray], change: Any) -> Changed:
    return Changed(*living_room(), poses, noise_m=0.001, change=change)


def test_a_third_without_depth_in_the_middle():
    recording = in_the_living_room(around(36), noise_m=0.001, blind=frozenset(range(12, 24)))
    walk = walked(recording)
    lost = assert_right(walk, recording.T_true)
    assert set(range(12, 24)) <= set(lost)
    assert walk.without_depth == tuple(range(12, 24))
    assert not set(range(12)) & set(lost)


def test_a_camera_that_sees_nothing_from_some_frame_on():
    recording = in_the_living_room(around(36)[:20], noise_m=0.001, blind=frozenset(range(8, 20)))
    assert assert_right(walked(recording), recording.T_true) == list(range(8, 20))


def test_frames_in_no_order():
    order = np.random.default_rng(4).permutation(24)
    recording = in_the_living_room([around(24)[k] for k in order], noise_m=0.001)
    lost = assert_right(walked(recording), recording.T_true)
    assert len(lost) < 12


def test_two_rooms_are_not_one():
    """The second half is from another room: it has no poses, as no jump leads there."""
    office = load_demo("office").truth
    poses = around(36)[:12]

    @dataclass(frozen=True)
    class TwoRooms(Rendered):
        @property
        def other(self) -> Rendered:
            return Rendered(office.vertices_m, office.triangles, self.T_true, self.noise_m)

        def view(self, index: int) -> DepthView:
            return super().view(index) if index < len(poses) else self.other.view(index)

        def frame(self, index: int) -> RgbdFrame:
            return super().frame(index) if index < len(poses) else self.other.frame(index)

    recording = TwoRooms(*living_room(), [*poses, *poses], noise_m=0.001)
    walk = walked(recording)
    rooms = {k >= len(poses) for k, T in enumerate(walk.T_world_camera) if T is not None}
    assert len(rooms) == 1
    assert walk.apart == tuple(k for k, T in enumerate(walk.T_world_camera) if T is None)
    assert_right(walk, recording.T_true)


def test_a_window_without_depth():
    """A part of the room of 1.4 x 1.2 m, seen in most frames, has no depth."""

    def pierced(index: int, z_m: FloatArray, points_m: FloatArray) -> FloatArray:
        window = (np.abs(points_m[..., 1] - 2.2) < 0.7) & (np.abs(points_m[..., 2] - 1.0) < 0.6)
        return np.where(window & (points_m[..., 0] > 2.0), np.nan, z_m)

    recording = changed(around(24), pierced)
    assert assert_right(walked(recording), recording.T_true) == []


def test_somebody_who_walks_through():
    """A body of 0.24 m, 1.3 m ahead, crosses the image by 8 pixels a frame, and hides a sixth of it."""
    v, u = np.mgrid[0 : CAMERA.height_px, 0 : CAMERA.width_px]

    def crossed(index: int, z_m: FloatArray, points_m: FloatArray) -> FloatArray:
        body = np.abs(u - 8.0 * (index - 4)) < 12
        return np.where(body & (v > 15), np.fmin(1.3, z_m), z_m)

    recording = changed(around(30), crossed)
    assert len(assert_right(walked(recording), recording.T_true, 0.02)) < 6


@pytest.mark.parametrize("late", [3, -3])
def test_depth_and_colour_a_tenth_of_a_second_apart(late):
    """The poses are those of the depth; the photographs are of another moment."""
    poses = around(60)

    @dataclass(frozen=True)
    class Apart(Rendered):
        def frame(self, index: int) -> RgbdFrame:
            other = super().frame((index + late) % len(poses))
            return replace(super().frame(index), rgb=other.rgb)

    recording = Apart(*living_room(), poses, noise_m=0.001)
    assert assert_right(walked(recording), poses) == []


def test_a_jump_to_another_corner_and_back():
    poses = around(36)[:20]
    poses[8:14] = [T @ moved([0, 1, 0], 150.0, [0.5, 0, 0]) for T in poses[8:14]]
    recording = in_the_living_room(poses, noise_m=0.001)
    walk = walked(recording)
    lost = assert_right(walk, poses)
    assert not set(lost) & set(range(8))
    assert ate_m(walk.T_world_camera, poses) < 0.01

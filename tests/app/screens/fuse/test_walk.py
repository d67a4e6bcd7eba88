"""What the Fuse screen makes of a walk: numbers, pieces of the map, pictures, and lanes of the dock."""

from __future__ import annotations

import base64
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from app.drawing.colors import DELIVERED, LOSS
from app.screens.fuse import walk_job
from app.screens.fuse.walk_draw import MOST_SEGMENTS, enlarging, pieces, segments, shifted, viewpoint
from app.screens.fuse.walk_job import MOST_PICTURES, PICTURE_PX, pictures_of, view_of
from app.screens.fuse.walk_lane import ARCS_PX, KEYFRAME, TRACKED, WalkLane, drift_lane
from app.screens.fuse.walk_lesson import WalkLook, loop_of
from app.screens.fuse.walk_numbers import frame_line, loop_html, loop_line, loop_name, moment_html, walk_table
from app.screens.fuse.walk_view import NO_PICTURES
from packetmesh.errors import InputError
from packetmesh.progress import drain
from tests.app.screens.fuse.walks import (
    CAMERA,
    DRIFT_M,
    FRAME_S,
    FRAMES,
    KEYFRAMES,
    T_COLOR_DEPTH,
    link,
    walk,
)

FRAME_NS = round(1e9 * FRAME_S)


@pytest.fixture(scope="module")
def view():
    return view_of(walk(), CAMERA, T_COLOR_DEPTH)


def test_a_loop_is_off_by_what_tracking_has_drifted_between_its_keyframes(view):
    used, wrong = view.loops
    assert (used.source, used.target, used.used) == (39, 0, True)
    assert used.moved_m == pytest.approx(39 * DRIFT_M)
    assert used.turned_rad == pytest.approx(0.0, abs=1e-6)
    assert (used.left_m, used.left_rad) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert (wrong.source, wrong.target, wrong.used) == (30, 10, False)
    assert (wrong.left_m, np.degrees(wrong.left_rad)) == pytest.approx((0.3, 5.0))


def test_drift_is_the_distance_from_the_final_path_and_unknown_where_the_camera_was_lost(view):
    known = np.isfinite(view.drift_m)
    np.testing.assert_array_equal(np.flatnonzero(~known), [21, 22, 23])
    np.testing.assert_allclose(view.drift_m[known], DRIFT_M * np.flatnonzero(known), atol=1e-12)
    assert view.lost == ((21, 23),)
    assert view.last == FRAMES - 1


def test_the_map_at_a_frame_is_what_frames_up_to_it_measured(view):
    made = walk()
    for frame in (0, 20, 22, FRAMES - 1):
        measured = made.map.points_m[made.first_frames <= frame].astype(np.float32)
        shown = view.points_m[: view.until[frame]]
        np.testing.assert_array_equal(np.sort(shown, axis=0), np.sort(measured, axis=0))
    row = np.flatnonzero((made.map.points_m.astype(np.float32) == view.points_m[7]).all(axis=1))[0]
    np.testing.assert_array_equal(view.colors[7], made.map.colors[row])


def test_a_large_map_is_thinned_evenly_over_the_frames(monkeypatch):
    monkeypatch.setattr(walk_job, "SCREEN_POINTS", 1000)
    made = walk(count=20_000)
    thin = view_of(made, CAMERA, T_COLOR_DEPTH)
    assert len(thin.points_m) == thin.until[-1] == 1000
    assert thin.map_points == 20_000
    assert thin.spacing_m == pytest.approx(0.02 * np.sqrt(20.0))
    assert thin.until[20] / 1000 == pytest.approx((made.first_frames <= 20).mean(), abs=0.05)


def test_the_first_view_shows_both_paths_and_most_of_the_map_in_any_window(view):
    for fov_rad, aspect in ((1.3, 1.5), (1.3, 0.6), (0.8, 3.0)):
        center_m, stand_m = viewpoint(view, fov_rad, aspect)
        forward = (center_m - stand_m) / np.linalg.norm(center_m - stand_m)
        right = np.cross(forward, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(forward, (0.0, 0.0, 1.0)))
        axes = np.stack([right, np.cross(right, forward), forward], axis=1)
        least = {"paths": 1.0, "map": 0.9}
        paths_m = np.concatenate([view.at_m, shifted(view, enlarging(view))])
        for name, points_m in (("paths", paths_m[np.isfinite(paths_m[:, 0])]), ("map", view.points_m)):
            across, up, away = ((points_m - stand_m) @ axes).T
            half = np.tan(0.5 * fov_rad) * away
            assert np.mean((away > 0) & (np.abs(up) < half) & (np.abs(across) < aspect * half)) >= least[name]


def test_pieces_of_the_map_end_with_frames(view):
    ends = pieces(view.until)
    assert ends[-1] == len(view.points_m)
    assert np.all(np.diff(ends) > 0)
    assert set(ends.tolist()) <= set(view.until.tolist())
    assert pieces(np.array([5, 5, 5])).tolist() == [5]


def test_the_drift_is_enlarged_until_it_can_be_seen_and_no_further(view):
    most_m = 39 * DRIFT_M
    assert enlarging(view) == max(n for n in (1, 2, 5, 10, 20, 50) if n * most_m <= 0.2 * 2 * np.sqrt(2))


@pytest.mark.parametrize("frames", [1, 2, 40, 1001, 1999, 2000, 54_321])
@pytest.mark.parametrize("lost", [(), (0,), (20,), (17, 20, 21, 39), (500, 501, 998, 1999)])
def test_a_path_reaches_its_last_frame_and_crosses_no_lost_one(frames, lost):
    """A camera on a straight line: the lengths of its segments add up to those of the parts between."""
    at_m = np.outer(np.arange(frames, dtype=float), (0.0, 3.0, 4.0))
    at_m[[frame for frame in lost if frame < frames]] = np.nan
    drawn_m = segments(at_m)
    known = np.flatnonzero(np.isfinite(at_m[:, 0]))
    parts = np.split(known, np.flatnonzero(np.diff(known) > 1) + 1)
    length_m = np.linalg.norm(drawn_m[:, 1] - drawn_m[:, 0], axis=1).sum()
    assert length_m == 5.0 * sum(np.ptp(part) for part in parts if len(part))
    assert len(drawn_m) <= MOST_SEGMENTS + len(parts)
    if frames <= MOST_SEGMENTS:
        assert len(drawn_m) == sum(len(part) - 1 for part in parts if len(part))


class Images:
    """A recording of grey images, brighter from frame to frame; some cannot be read."""

    def __init__(self, frames, broken=()):
        self.times_s, self.broken = np.arange(frames) / 30.0, broken

    def frame(self, index):
        if index in self.broken:
            raise InputError("broken")
        return SimpleNamespace(rgb=np.full((240, 320, 3), 40 + index % 200, np.uint8))


def test_every_frame_has_a_small_picture_and_one_that_is_broken_that_before_it():
    found = drain(pictures_of(Images(30, broken=(7,)), (0, 12)))
    np.testing.assert_array_equal(found.frames, [k for k in range(30) if k != 7])
    assert found.of(7) == found.of(6) != found.of(8)
    shown = cv2.imdecode(np.frombuffer(found.of(20), np.uint8), cv2.IMREAD_COLOR)
    assert shown.shape == (120, PICTURE_PX, 3)
    assert abs(int(shown.mean()) - 60) <= 2
    assert NO_PICTURES.of(3) is None


def test_a_long_recording_has_every_nth_picture_and_those_of_the_keyframes():
    found = drain(pictures_of(Images(1000), (0, 501)))
    assert len(found.frames) <= MOST_PICTURES + 2
    assert 501 in found.frames
    assert found.of(999) is not None


def drawn(lane, start_ns=0, end_ns=FRAMES * FRAME_NS, width=800):
    picture = np.empty((lane.height_px, width, 3), np.uint8)
    lane.draw(picture, start_ns, end_ns)
    return picture


def test_lost_frames_are_red_and_keyframes_have_ticks(view):
    band = drawn(WalkLane(view))[-5]
    frame_px = 800 // FRAMES
    for frame in range(FRAMES):
        color = tuple(band[frame * frame_px + frame_px // 2].tolist())
        assert color == (LOSS if frame in (21, 22, 23) else TRACKED)
        assert (tuple(band[frame * frame_px].tolist()) == KEYFRAME) == (frame in KEYFRAMES)


def test_a_chosen_loop_is_thick_and_one_that_contradicts_is_dashed(view):
    plain, chosen = drawn(WalkLane(view)), drawn(WalkLane(view, 0))
    assert not (plain == DELIVERED).all(axis=2).any()
    assert (chosen == DELIVERED).all(axis=2).sum() > 500
    red = (drawn(WalkLane(view, 1))[: ARCS_PX - 1] == LOSS).all(axis=2).any(axis=0)
    inside = red[200:600]
    assert not red[:195].any()
    assert inside.any()
    assert np.count_nonzero(np.diff(inside.astype(int)) == 1) >= 8


def test_a_click_on_an_arc_picks_its_loop_and_one_beside_it_none(view):
    lane = WalkLane(view)
    near_ns = FRAME_NS // 4
    top = [
        np.flatnonzero((drawn(WalkLane(view, k))[:, x] == color).all(axis=1))[0]
        for k, x, color in ((0, 390, DELIVERED), (1, 400, LOSS))
    ]
    assert lane.pick(int(19.5 * FRAME_NS), int(top[0]), near_ns) == 0
    assert lane.pick(20 * FRAME_NS, int(top[1]), near_ns) == 1
    assert lane.pick(20 * FRAME_NS, ARCS_PX - 3, near_ns) == -1
    assert lane.pick(20 * FRAME_NS, ARCS_PX + 3, near_ns) == -1
    assert lane.place(1)[:2] == (10 * FRAME_NS, 30 * FRAME_NS)


def test_the_dock_says_the_frame_and_the_drift(view):
    lane = WalkLane(view)
    texts = [label.text for label in lane.labels(22 * FRAME_NS + 1)]
    assert texts == ["2 loops", "frame 22: lost"]
    assert lane.labels(20 * FRAME_NS)[1].text == "frame 20: keyframe"
    tip = lane.tip(12 * FRAME_NS, ARCS_PX + 5, 1)
    assert tip == "Frame 12, 1.20 s: tracked; tracking alone is 2.4 cm off"
    assert [word.text for word in lane.words(0, FRAMES * FRAME_NS, 1000)] == ["lost"]
    assert drift_lane(view).labels(30 * FRAME_NS)[0].text == "drift 6.0 cm"
    assert drift_lane(view).labels(22 * FRAME_NS)[0].text == "drift –"


def test_the_table_has_frames_loops_and_drift_with_units(view):
    html = walk_table(view)
    for value in ("40 (10 per second)", "37", "1 of 2", "7.8 cm"):
        assert f">{value}</td>" in html
    assert "lost" in frame_line(view, 22)


def test_the_moment_has_its_picture_and_the_share_of_the_map(view):
    pictures = drain(pictures_of(Images(FRAMES), ()))
    html = moment_html(view, 20, pictures)
    assert base64.b64encode(pictures.of(20)).decode() in html
    assert f"{100 * view.until[20] / 500:.0f} % of its points" in html
    assert "<img" not in moment_html(view, 20, NO_PICTURES)


def test_a_stop_shows_no_loop_that_contradicts_where_all_agree(view):
    agreeing = view_of(walk(loops=(link(39, 0, loop=True),)), CAMERA, T_COLOR_DEPTH)
    without = view_of(walk(loops=()), CAMERA, T_COLOR_DEPTH)
    shown = [
        [loop_of(WalkLook(loop=which), one) for which in ("none", "largest", "contradicting")]
        for one in (view, agreeing, without)
    ]
    assert shown == [[-1, 0, 1], [-1, 0, -1], [-1, -1, -1]]


def test_a_loop_that_contradicts_says_why_it_does_not_count(view):
    used, wrong = view.loops
    assert loop_name(wrong) == "frames 10 and 30"
    assert "not used" in loop_line(wrong)
    html = loop_html(view, wrong, NO_PICTURES)
    assert "30.0 cm and 5.00° elsewhere" in html
    assert "elsewhere" not in loop_html(view, used, NO_PICTURES)
    assert "7.8 cm, 0.00°" in loop_html(view, used, NO_PICTURES)


def test_a_loop_names_how_many_motions_it_fixes():
    """A floor fixes its own normal's shift and two turns, and leaves two shifts and a turn open."""
    floor = replace(link(39, 0, loop=True), information=np.diag([1e6, 1e6, 1.0, 1.0, 1.0, 1e6]))
    (loop,) = view_of(walk(loops=(floor,)), CAMERA, T_COLOR_DEPTH).loops
    assert loop.held == 3
    assert "3 of 6" in loop_html(view_of(walk(), CAMERA, T_COLOR_DEPTH), loop, NO_PICTURES)

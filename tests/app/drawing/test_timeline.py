"""Lanes of a timeline: nothing is lost in a picture, at any zoom."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.drawing.colors import LOSS, TARGET
from app.drawing.levels import counts_of, levels_of
from app.drawing.timeline import Curve, CurvesLane, FramesLane, round_up

ROWS = 3
CAUSES = ("", "collision", "bit errors")


@st.composite
def frames(draw):
    """Columns of frames in three rows, which may touch, overlap and take no time."""
    some = st.tuples(
        st.integers(0, 1000), st.integers(0, 80), st.integers(0, ROWS - 1), st.integers(0, len(CAUSES) - 1)
    )
    start, took, row, cause = np.array(draw(st.lists(some, min_size=1, max_size=60)), np.int64).T
    return start, start + took, row, cause


@st.composite
def windows(draw):
    """Start, end and number of parts of a window."""
    start = draw(st.integers(-50, 1100))
    return start, start + draw(st.integers(1, 1200)), draw(st.integers(1, 200))


def overlap(start, end, begin, stop):
    """How much of each frame lies in a span."""
    return np.maximum(np.minimum(end, stop) - np.maximum(start, begin), 0)


@given(frames(), windows())
def test_a_window_holds_all_that_begins_in_it_and_all_air_time_at_every_zoom(columns, window):
    start, end, row, cause = columns
    begin, stop, parts = window
    counts = counts_of(levels_of(*columns, ROWS), begin, stop, parts)
    inside = (start >= begin) & (start < stop)
    for r in range(ROWS):
        mine, lost = row == r, (row == r) & (cause > 0)
        assert counts.frames[r].sum() == np.count_nonzero(inside & mine)
        assert counts.lost[r].sum() == np.count_nonzero(inside & lost)
        taken = overlap(start, end, begin, stop)
        assert counts.taken_ns[r].sum() == taken[mine].sum()
        assert counts.lost_ns[r].sum() == taken[lost].sum()


@given(frames(), windows(), st.integers(2, 5))
def test_zooming_out_adds_up_what_is_seen_from_near(columns, window, factor):
    begin, _, parts = window
    levels = levels_of(*columns, ROWS)
    stop = begin + parts * factor * 3
    near, far = (counts_of(levels, begin, stop, n) for n in (parts * factor, parts))
    for name in ("frames", "lost", "taken_ns", "lost_ns"):
        fine = getattr(near, name).reshape(ROWS, parts, factor).sum(axis=2)
        assert np.array_equal(fine, getattr(far, name))


def test_times_of_hours_do_not_spoil_the_air_time_of_microseconds():
    start = np.full(200_000, 18_000_000_000_000) + np.arange(200_000) * 2000
    levels = levels_of(start, start + 700, np.zeros(200_000, int), np.zeros(200_000, int), 1)
    counts = counts_of(levels, int(start[1000]), int(start[1100]), 100)
    assert (counts.taken_ns == 700).all()
    assert (counts.frames == 1).all()


def lane_of(columns, rows=ROWS):
    return FramesLane(
        levels_of(*columns, rows), [f"node {i}" for i in range(rows)], "frame {}".format, CAUSES
    )


@given(frames(), st.integers(-50, 1150), st.integers(0, ROWS - 1), st.integers(0, 100))
def test_what_is_picked_is_the_nearest_frame_of_the_row(columns, t, wanted, tolerance):
    # At most as many frames overlap as are looked at.
    start, end, row, cause = (column[:8] for column in columns)
    lane = lane_of((start, end, row, cause))
    picked = lane.pick(t, int((wanted + 0.5) * lane.height_px / ROWS), tolerance)
    away = np.maximum(np.maximum(start - t, t - end), 0)
    away = np.where(row == wanted, away, 10**6)
    if away.min() > tolerance:
        assert picked == -1
    else:
        assert away[picked] == away.min()


def test_nothing_is_picked_outside_the_rows():
    lane = lane_of((np.array([0]), np.array([100]), np.array([0]), np.array([0])))
    assert lane.pick(50, 3, 0) == 0
    assert lane.pick(50, lane.height_px, 0) == -1
    assert lane.pick(50, -1, 0) == -1


def test_a_frame_is_placed_where_it_is_picked():
    rng = np.random.default_rng(3)
    start = np.sort(rng.choice(10_000, 300, replace=False)) * 10
    lane = lane_of((start, start + 9, rng.integers(0, ROWS, 300), np.zeros(300, int)))
    for item in range(0, 300, 7):
        begin, end, top, bottom = lane.place(item)
        assert (begin, end) == (start[item], start[item] + 9)
        for y_px in (top, bottom - 1):
            assert lane.pick((begin + end) // 2, y_px, 0) == item


def painted(lane, start, end, width=400):
    picture = np.zeros((lane.height_px, width, 3), np.uint8)
    lane.draw(picture, start, end)
    return picture.astype(int)


def like(picture, color):
    """Where a picture has a colour, nearly."""
    return np.abs(picture - color).max(axis=-1) < 12


def test_from_near_each_frame_stands_where_it_is_and_only_the_lost_one_is_red():
    start = np.array([100, 200, 300])
    lane = lane_of((start, start + 50, np.array([0, 0, 1]), np.array([0, 1, 0])))
    picture = painted(lane, 0, 400)
    row_px = lane.height_px // ROWS
    red, blue = like(picture, LOSS), like(picture, TARGET)
    assert np.flatnonzero(red.any(axis=0)).tolist() == list(range(200, 250))
    assert np.flatnonzero(red.any(axis=1)).max() < row_px
    assert np.flatnonzero(blue[:row_px].any(axis=0)).tolist() == list(range(100, 150))
    assert np.flatnonzero(blue[row_px : 2 * row_px].any(axis=0)).tolist() == list(range(300, 350))


@pytest.mark.parametrize("share", [0.01, 0.1, 0.5])
def test_from_afar_losses_are_a_rate_and_no_wall_of_red(share):
    rng = np.random.default_rng(0)
    start = np.arange(100_000) * 10
    cause = (rng.random(100_000) < share).astype(int)
    picture = painted(lane_of((start, start + 6, np.zeros(100_000, int), cause), 1), 0, 1_000_000)
    height = len(picture)
    redder = picture[..., 0] - picture[..., 2]
    assert (redder[: height // 2] < 0).all()
    strip = redder[height - 4].mean()
    assert strip > redder[0].mean()
    less = painted(
        lane_of((start, start + 6, np.zeros(100_000, int), np.roll(cause, 1) & (start % 20 == 0)), 1),
        0,
        1_000_000,
    )
    assert (less[..., 0] - less[..., 2])[height - 4].mean() < strip - 5


def test_pointing_from_afar_says_how_many_were_lost_and_why():
    start = np.arange(1000) * 10
    cause = np.zeros(1000, int)
    cause[500:520] = 1
    cause[520:523] = 2
    lane = lane_of((start, start + 6, np.zeros(1000, int), cause), 1)
    text = lane.tip(5100, 3, 300)
    assert "60 frames" in text
    assert "23 of them lost (collision 20, bit errors 3)" in text
    assert lane.tip(5005, 3, 4) == "frame 500"
    assert lane.tip(50_000, 3, 4) == ""


def test_a_cause_is_written_into_a_lost_frame_that_is_wide_enough():
    start = np.array([0, 500, 1000])
    lane = lane_of((start, start + 400, np.array([0, 0, 1]), np.array([0, 2, 1])))
    assert [(word.start_ns, word.text) for word in lane.words(0, 1500, 600)] == [
        (500, "bit errors"),
        (1000, "collision"),
    ]
    assert not lane.words(0, 100_000, 600)


def test_names_of_many_rows_do_not_cover_each_other():
    columns = (np.arange(60), np.arange(60) + 1, np.arange(60), np.zeros(60, int))
    lane = lane_of(columns, 60)
    y_px = [label.y_px for label in lane.labels(0)]
    assert min(np.diff(y_px)) >= 12
    assert 100 <= lane.height_px <= 240


TEMPERATURE = Curve("warmth", "°C", (0, 158, 115), np.array([100, 200, 300]), np.array([1.0, 3.0, 2.0]), 0, 4)


def test_a_curve_says_what_was_known_at_the_clock():
    lane = CurvesLane("Weather", [TEMPERATURE])
    said = [lane.labels(now)[0].text for now in (99, 100, 199, 200, 1000)]
    assert said == ["warmth –", "warmth 1 °C", "warmth 1 °C", "warmth 3 °C", "warmth 2 °C"]


def test_a_curve_begins_with_its_first_value_and_is_higher_where_it_is_larger():
    lane = CurvesLane("Weather", [TEMPERATURE], height_px=81)
    drawn = like(painted(lane, 0, 400), TEMPERATURE.color)
    assert not drawn[:, :98].any()
    height = [81 - np.flatnonzero(drawn[:, x]).mean() for x in (150, 250, 390)]
    assert height == pytest.approx([81 * v / 4 for v in (1, 3, 2)], abs=4)


def test_a_curve_has_a_gap_where_it_has_no_value():
    gap = Curve("warmth", "", (0, 0, 0), np.array([0, 100, 200]), np.array([1.0, np.nan, 1.0]), 0, 2)
    drawn = like(painted(CurvesLane("Weather", [gap]), 0, 400), (0, 0, 0)).any(axis=0)
    assert drawn[:98].all()
    assert not drawn[103:197].any()
    assert drawn[203:].all()


def test_curves_on_one_scale_have_its_values_at_their_edge_and_others_have_none():
    lane = CurvesLane("Weather", [TEMPERATURE, TEMPERATURE], height_px=81)
    assert [(tick.y_px, tick.text) for tick in lane.ticks] == [(7.0, "4 °C"), (40.5, "2 °C"), (74.0, "0 °C")]
    assert CurvesLane("Weather", [TEMPERATURE, replace(TEMPERATURE, high=9.0)]).ticks == []


def test_a_dashed_curve_is_drawn_here_and_there_along_its_whole_way():
    whole, dashed = (
        like(painted(CurvesLane("W", [curve]), 100, 500), curve.color).any(axis=0)
        for curve in (TEMPERATURE, replace(TEMPERATURE, dashed=True))
    )
    assert whole.all()
    assert 0.4 < dashed.mean() < 0.9
    assert dashed[:100].any()
    assert dashed[-100:].any()


@pytest.mark.parametrize(("value", "high"), [(8.6, 10), (0.3, 0.4), (10, 10), (101, 200), (2.0, 2), (5.5, 6)])
def test_a_scale_ends_at_the_next_number_that_can_be_halved(value, high):
    assert round_up(value) == pytest.approx(high)


def test_a_number_that_runs_keeps_its_digits():
    curve = replace(TEMPERATURE, values=np.array([0.0328, 10.4, 2.0]), digits=2)
    assert [curve.text(now) for now in (100, 200, 300)] == [
        "warmth 0.03 °C",
        "warmth 10.40 °C",
        "warmth 2.00 °C",
    ]

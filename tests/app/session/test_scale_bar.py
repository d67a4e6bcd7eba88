"""The scale bar in a picture of the view: read from the page's text, and as long as it says."""

from __future__ import annotations

import numpy as np
import pytest

from app.session.scale_bar import COLORS, INK, bar_of, draw_bar

TEXT = "120.0 50 cm 2.4 z,0.10,-0.05;x,0.99,0.00;y,-0.30,0.90"


def test_the_bar_of_the_page_is_read_and_nonsense_is_none():
    bar = bar_of(TEXT)
    assert (bar.width, bar.length, bar.away_m) == (120.0, "50 cm", "2.4")
    assert bar.axes == (("z", 0.1, -0.05), ("x", 0.99, 0.0), ("y", -0.3, 0.9))
    wrong = ("", "720", TEXT.replace("cm", "km"), TEXT.replace("z,", "q,"), TEXT.replace("120.0", "5000"))
    wrong += (TEXT.replace("120.0", "0"), f"{TEXT};x,1,1", TEXT.replace("0.99", "999999999"))
    assert [bar_of(text) for text in wrong] == [None] * 8


@pytest.mark.parametrize(("width", "times"), [(120.0, 2), (60.0, 2), (120.0, 1)])
def test_the_drawn_bar_has_its_length_and_the_axes_their_directions(width, times):
    rgb = np.full((300 * times, 500 * times, 3), 90, np.uint8)
    draw_bar(rgb, bar_of(TEXT.replace("120.0", f"{width}")), times)
    dark = np.abs(rgb.astype(int) - INK).max(axis=2) < 40
    rows = [np.flatnonzero(row) for row in dark]
    longest = max(
        (part for row in rows for part in np.split(row, np.flatnonzero(np.diff(row) > 1) + 1)), key=len
    )
    assert len(longest) == pytest.approx(times * width, abs=3 * times)
    places = {
        name: np.argwhere(np.abs(rgb.astype(int) - color).max(axis=2) < 40).mean(axis=0)
        for name, color in COLORS.items()
    }
    assert places["x"][1] > places["z"][1] + 5 * times  # x to the right
    assert places["y"][0] < places["x"][0] - 5 * times  # y up
    assert (rgb[: 200 * times] == 90).all()
    assert (rgb[:, 400 * times :] == 90).all()


def test_a_picture_smaller_than_the_bar_is_drawn_as_far_as_it_goes():
    rgb = np.full((60, 80, 3), 90, np.uint8)
    draw_bar(rgb, bar_of(TEXT), 2)
    assert rgb.shape == (60, 80, 3)

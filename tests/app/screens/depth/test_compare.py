"""The split picture, its captions, and the sensor, residual and confidence pictures it is made of."""

import numpy as np
import pytest

from app.compute.records import ColorBar, Picture, ResidualView
from app.drawing.colors import CONFIDENCE_STOPS, HOLE
from app.drawing.pictures import (
    EQUAL,
    FARTHER,
    NEARER,
    UNKNOWN,
    confidence_colors,
    confidence_picture,
    depth_picture,
    difference_picture,
)
from app.screens.depth.numbers import residual_figure
from app.window.compare import CompareArea, captions_html, split
from pipeline.types import DepthMap
from tests.app.fakes import ui_of

RED, BLUE = (200, 10, 20), (5, 60, 190)


def plain(color, shape=(4, 20)):
    return np.full((*shape, 3), color, np.uint8)


def depth_of(*z_m):
    return DepthMap(np.array([z_m], np.float32))


@pytest.mark.parametrize(("share", "column"), [(0.25, 5), (0.5, 10), (0.77, 15)])
def test_left_of_the_line_is_one_picture_and_right_of_it_the_other(share, column):
    left, right = plain(RED), plain(BLUE)
    shown = split(left, right, share)
    assert np.all(shown[:, : column - 1] == RED)
    assert np.all(shown[:, column + 2 :] == BLUE)
    assert np.all(shown[:, column] == 255)
    assert np.all(shown[:, [column - 1, column + 1]] == 0)
    assert np.all(left == RED)
    assert np.all(right == BLUE)


def test_at_the_ends_there_is_no_line():
    np.testing.assert_array_equal(split(plain(RED), plain(BLUE), 0.0), plain(BLUE))
    np.testing.assert_array_equal(split(plain(RED), plain(BLUE), 1.0), plain(RED))


@pytest.mark.parametrize("share", [0.05, 0.94])
def test_the_line_is_whole_beside_the_border(share):
    shown = split(plain(RED), plain(BLUE), share)
    assert np.all(shown[:, round(20 * share)] == 255)
    assert np.all(shown == 0, axis=2).sum() == 4 * 2


def test_depth_has_the_colours_of_its_bar_and_holes_are_magenta():
    picture = depth_picture(depth_of(1.0, 2.0, 3.0, np.nan, 0.5, 9.0), (1.0, 3.0), "Depth")
    bar = picture.bar
    assert bar.labels == ("1.00 m", "2.00 m", "3.00 m")
    row = [tuple(int(value) for value in pixel) for pixel in picture.rgb[0]]
    assert [row[0], row[1], row[2]] == [bar.stops[0], bar.stops[4], bar.stops[-1]]
    assert row[3:] == [HOLE, bar.stops[0], bar.stops[-1]]


def test_a_difference_is_blue_nearer_white_equal_orange_farther():
    picture = difference_picture(depth_of(1.7, 2.0, 2.3, 9.0, np.nan), depth_of(*5 * [2.0]))
    row = picture.rgb[0].tolist()
    expected = [NEARER, EQUAL, FARTHER, FARTHER, UNKNOWN]
    np.testing.assert_allclose(row, expected, atol=1)
    assert picture.bar.labels == ("−30 cm", "0 cm", "+30 cm")


def test_confidence_is_bright_where_sure_and_marks_what_is_left_out():
    confidence = np.array([[0.0, 0.5, 1.0, 1.0, 0.5, np.nan]])
    flying = np.array([[False, False, False, True, False, False]])
    far = np.array([[False, False, False, False, True, False]])
    row = confidence_picture(confidence, flying, far).rgb[0].tolist()
    middle = CONFIDENCE_STOPS[len(CONFIDENCE_STOPS) // 2]
    expected = [CONFIDENCE_STOPS[0], middle, CONFIDENCE_STOPS[-1], HOLE, UNKNOWN, UNKNOWN]
    assert row == [list(color) for color in expected]
    assert confidence_colors(np.array([np.nan])).tolist() == [list(CONFIDENCE_STOPS[0])]


def test_captions_name_both_sides_and_only_what_has_colours_has_a_bar():
    bar = ColorBar((RED, BLUE), ("0 cm", "7 cm"))
    text = captions_html(Picture(plain(RED), "A <b>"), Picture(plain(BLUE), "B", bar))
    assert text.index("A &lt;b&gt;.") < text.index("Right:") < text.index("B.") < text.index("0 cm")
    assert text.count("linear-gradient(to right, #c80a14, #053cbe)") == text.count("linear-gradient") == 1


def test_residuals_have_their_median_and_rms_marked_in_centimetres():
    view = ResidualView(np.array([-0.2, 0.0, 0.2]), np.array([30, 10]), -0.012, 0.05)
    figure = residual_figure(view)
    assert figure.data[0].x.tolist() == pytest.approx([-10.0, 10.0])
    assert figure.data[0].y.tolist() == [30, 10]
    marks = {mark.text: mark.x for mark in figure.layout.annotations}
    assert marks == pytest.approx({"median": -1.2, "−RMS": -5.0, "+RMS": 5.0})
    empty = ResidualView(view.edges_m, np.zeros(2, int), float("nan"), float("nan"))
    assert not residual_figure(empty).layout.annotations
    assert not residual_figure(None).data


NAMES = {"one": "the first", "two": "the second", "three": "the third"}


class Screen:
    """The area, and what a person does with it and sees of it."""

    def __init__(self, **keywords):
        ui = ui_of()
        self.area, self.gui = CompareArea(ui, NAMES, "one", "two", **keywords), ui.gui

    @property
    def shown(self):
        (image,) = self.gui.all("image")
        return image.image


PICTURES_OF = {
    "one": Picture(plain(RED), "First"),
    "two": Picture(plain(BLUE), "Second", ColorBar((RED, BLUE), ("0 m", "1 m"))),
    "three": Picture(plain((9, 9, 9)), "Third"),
}


def test_the_area_shows_what_is_chosen_and_moves_the_line():
    screen = Screen()
    screen.area.load(PICTURES_OF)
    np.testing.assert_array_equal(screen.shown, split(plain(RED), plain(BLUE), 0.5))
    screen.gui.set("Split (%)", 20.0)
    np.testing.assert_array_equal(screen.shown, split(plain(RED), plain(BLUE), 0.2))
    screen.gui.set("Right", "the third")
    np.testing.assert_array_equal(screen.shown, split(plain(RED), plain((9, 9, 9)), 0.2))
    assert "Third" in screen.gui.text()
    assert "Second" not in screen.gui.text()
    screen.area.set("two", "one", 1.0)
    np.testing.assert_array_equal(screen.shown, plain(BLUE))


def test_pictures_of_the_same_names_replace_those_before():
    screen = Screen()
    screen.area.load(PICTURES_OF)
    screen.area.load({**PICTURES_OF, "one": Picture(plain((1, 2, 3)), "New")})
    assert np.all(screen.shown[:, 0] == (1, 2, 3))
    assert "New" in screen.gui.text()


def test_a_burst_of_the_same_change_is_drawn_once(monkeypatch):
    drawn = []
    monkeypatch.setattr("app.window.compare.split", lambda *a: drawn.append(a) or split(*a))
    screen = Screen()
    screen.area.load(PICTURES_OF)
    for _ in range(9):
        screen.gui.set("Split (%)", 33.0)
    assert len(drawn) == 2


def test_the_area_is_hidden_until_there_is_something():
    screen = Screen(visible=False)
    assert not any(handle.seen for handle in screen.gui.handles)
    screen.area.load({"two": PICTURES_OF["two"], "three": PICTURES_OF["three"]})
    assert all(handle.seen for handle in screen.gui.handles)
    assert screen.gui.find("Left").options == ("the second", "the third")
    np.testing.assert_array_equal(screen.shown, split(plain(BLUE), plain(BLUE), 0.5))
    screen.area.load(None)
    assert not any(handle.seen for handle in screen.gui.handles)

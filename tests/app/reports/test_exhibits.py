"""Tables and pictures of experiments in a report."""

import base64
import re

import cv2
import numpy as np
import pytest

from app.reports.exhibits import HEIGHT, WIDTH, Axis, chart_svg, exhibit_html, ticks
from lab.claims.exhibits import Chart, Curve, HeatMap, Picture, Table, exhibit_record

CURVE = Curve("ours", (0.0, 1.0, 2.0), (4.0, 2.0, 1.0), (3.0, 1.5, 0.5), (5.0, 2.5, 1.5))
CHART = Chart("error", "iterations", "cm", (CURVE, Curve("a plane", *[(0.0, 2.0)] * 4)))
MAP = HeatMap("range", "metres", (0.1, 0.6), "degrees", (5.0, 45.0), ((1.0, 0.5), (0.25, 0.0)), "all told")


@pytest.mark.parametrize("high", [0.037, 0.4, 1.0, 7.0, 60.0, 1234.0])
def test_ticks_are_few_and_round_and_reach_nearly_to_the_top(high):
    values = ticks(high)
    assert values[0] == 0.0
    assert 3 <= len(values) <= 7
    assert high / 2 < values[-1] <= high + 1e-9


def test_a_curve_runs_through_its_points_within_the_frame():
    lines = re.findall(r'<polyline points="([^"]+)"', chart_svg(CHART))
    points = [tuple(map(float, point.split(","))) for point in lines[0].split()]
    assert len(points) == 3
    assert [x for x, _ in points] == sorted(x for x, _ in points)
    heights = [y for _, y in points]
    assert heights == sorted(heights)  # the error falls, and y runs downwards
    assert (heights[1] - heights[0]) == pytest.approx(2 * (heights[2] - heights[1]), abs=0.2)
    assert all(0 <= x <= WIDTH and 0 <= y <= HEIGHT for x, y in points)


def test_plane_curves_are_dashed_and_every_curve_has_its_name():
    svg = chart_svg(CHART)
    assert svg.count("stroke-dasharray") == 2
    assert ">ours</text>" in svg
    assert ">a plane</text>" in svg


def test_a_heat_map_writes_every_share_into_its_cell():
    html = exhibit_html(MAP)
    assert re.findall(r">(\d+%)<", html) == ["100%", "50%", "25%", "0%"]
    lightness = [int(share) for share in re.findall(r"hsl\(204 70% (\d+)%\)", html)]
    assert lightness == sorted(lightness), "the more, the darker"
    assert len(set(lightness)) == 4
    assert "all told" in html


def test_a_table_shows_what_is_missing_and_no_markup_from_outside():
    html = exhibit_html(Table("<b>", ("name", "x"), (("<i>", None), ("y", 0.123456)), "<u>"))
    assert "–" in html
    assert "0.1235" in html
    for tag in ("<b>", "<i>", "<u>"):
        assert tag not in html


def test_a_power_law_is_a_straight_line_on_logarithmic_axes():
    x = (1e4, 1e5, 1e6)
    curve = Curve("ours", x, *[tuple(3e-6 * value for value in x)] * 3)
    svg = chart_svg(Chart("time", "points", "s", (curve,), logarithmic=True))
    (line,) = re.findall(r'<polyline points="([^"]+)"', svg)
    points = np.array([tuple(map(float, point.split(","))) for point in line.split()])
    steps = np.diff(points, axis=0)
    np.testing.assert_allclose(steps[0], steps[1], atol=0.2)
    assert steps[0][0] > 0 > steps[0][1]
    assert np.all((points >= 0) & (points <= (WIDTH, HEIGHT)))
    for text in ("10,000", "100,000", "1,000,000", "0.1"):
        assert f">{text}</text>" in svg


@pytest.mark.parametrize(("low", "high"), [(1e4, 1e6), (0.03, 4.0), (2.0, 60.0), (1.3, 4.0)])
def test_logarithmic_ticks_are_round_and_within_the_axis(low, high):
    values = [value for value, _ in Axis(low, high, True).ticks()]
    assert values == sorted(values)
    assert 1 <= len(values) <= 10
    assert all(low <= value <= high for value in values)
    assert {f"{value:e}"[0] for value in values} <= {"1", "2", "5"}


def test_images_come_back_from_the_page_as_they_were():
    rgb = np.random.default_rng(0).integers(0, 256, (6, 8, 3), dtype=np.uint8)
    html = exhibit_html(Picture("six", (("<b>first", rgb), ("second", rgb[::-1])), "a note"))
    data = re.findall(r'src="data:image/png;base64,([^"]+)"', html)
    assert len(data) == 2
    for text, expected in zip(data, (rgb, rgb[::-1]), strict=True):
        bgr = cv2.imdecode(np.frombuffer(base64.b64decode(text), np.uint8), cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(bgr[..., ::-1], expected)
    assert "<b>" not in html
    assert "repeat(2, 1fr)" in html
    assert "a note" in html


def test_a_record_of_images_holds_captions_and_sizes_only():
    record = exhibit_record(Picture("six", (("first", np.zeros((6, 8, 3), np.uint8)),), "note"))
    assert record == {
        "title": "six",
        "images": [{"caption": "first", "width_px": 8, "height_px": 6}],
        "note": "note",
    }
    assert exhibit_record(MAP)["shares"] == MAP.shares

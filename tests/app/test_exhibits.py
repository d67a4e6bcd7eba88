"""Tables and pictures of experiments in a report."""

import re

import pytest

from app.reports.exhibits import HEIGHT, WIDTH, chart_svg, exhibit_html, ticks
from pipeline.experiments.exhibits import Chart, Curve, HeatMap, Table

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

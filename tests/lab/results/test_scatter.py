"""The chart of programs on logarithmic axes."""

import re
import xml.etree.ElementTree as ElementTree

from lab.results.recordings import PICTURE, pictures
from lab.results.scatter import Mark, scatter
from tests.lab.results.test_recordings import RUN


def circles(svg):
    """Positions of the marks, without the legend's."""
    found = [
        one
        for one in ElementTree.fromstring(svg).iter()
        if one.tag.endswith("circle") and one.get("r") == "5"
    ]
    return [(float(one.get("cx")), float(one.get("cy")), one.get("fill")) for one in found]


def test_equal_ratios_are_equal_distances_and_less_is_lower():
    svg = scatter(
        "x", "y", [Mark("a", 1.0, 0.1, 0.1), Mark("b", 10.0, 1.0, None), Mark("a", 100.0, 10.0, None, True)]
    )
    (x0, y0, color), (x1, y1, _), (x2, y2, hollow) = circles(svg)
    assert abs((x1 - x0) - (x2 - x1)) < 0.2
    assert abs((y0 - y1) - (y1 - y2)) < 0.2
    assert x0 < x1
    assert y0 > y1
    assert (color != "#ffffff", hollow) == (True, "#ffffff")
    assert {"1", "2", "5", "10", "100"} <= set(re.findall(r">([\d.]+)</text>", svg))


def test_a_program_without_a_trajectory_is_not_in_the_picture_of_recordings():
    runs = [RUN | {"program": "a", "every": 1}, RUN | {"program": "b", "every": 1, "ate_m": None}]
    svg = pictures({"recording: every frame": {"runs": runs}})[PICTURE]
    assert len(circles(svg)) == 1
    assert ">b</text>" not in svg

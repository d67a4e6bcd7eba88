"""Rows of answers become recalls by overlap and verdicts by bins; table and picture say the same."""

import xml.etree.ElementTree as ET
from types import SimpleNamespace

import pytest

from lab.benchmarks.places import DIFFERENT, NOTHING, by_overlap, by_verdict
from lab.places.ours import OURS
from lab.results.chart import BOTTOM, HEIGHT, TOP, Series, chart
from lab.results.pages import PLACES, readme_results
from lab.results.places import ANY_OVERLAP, BY_OVERLAP, VERDICT, pictures, places

SVG = "{http://www.w3.org/2000/svg}"


def row(overlap, right, verdict="sure", program=OURS, share=None, elapsed_s=1.0):
    return {
        "program": program,
        "overlap": overlap,
        "overlap_share": overlap if share is None else share,
        "right": right,
        "verdict": verdict,
        "elapsed_s": elapsed_s,
    }


ROWS = [
    *[row(0.6, True, elapsed_s=s) for s in (1.0, 2.0, 9.0)],
    row(0.6, False),
    row(0.15, False, "none"),
    row(0.15, True, "doubtful"),
    *[row(0.6, right, None, "peer") for right in (True, False)],
]


def test_recall_is_counted_by_program_and_overlap_and_peers_are_never_sure():
    ours, few, peer = by_overlap(ROWS)
    assert (ours["overlap"], ours["pairs"], ours["right"], ours["sure"], ours["sure_wrong"]) == (
        0.6,
        4,
        3,
        4,
        1,
    )
    assert ours["median_s"] == pytest.approx(1.5)
    assert ours["recall_ci95"] == pytest.approx((0.3006, 0.9544), abs=1e-4)
    assert (few["overlap"], few["pairs"], few["right"], few["sure"]) == (0.15, 2, 1, 0)
    assert (peer["program"], peer["right"], peer["sure"], peer["sure_wrong"]) == ("peer", 1, None, None)


def test_verdicts_are_binned_by_the_true_overlap():
    rows = [
        row(None, False, share=0.0),
        row(0.0, False, "none"),
        row(0.31, True, share=0.29),
        row(0.3, True, "doubtful", share=0.31),
    ]
    groups = {group["overlap"]: group for group in by_verdict(rows)}
    assert list(groups) == ["all", DIFFERENT, NOTHING, "20 to 30 %", "30 to 40 %"]
    assert (groups["all"]["pairs"], groups["all"]["sure"], groups["all"]["sure_wrong"]) == (4, 2, 1)
    assert (groups[DIFFERENT]["sure"], groups[DIFFERENT]["sure_wrong"]) == (1, 1)
    assert groups[NOTHING]["sure"] == 0
    assert (groups["20 to 30 %"]["sure"], groups["20 to 30 %"]["sure_wrong"]) == (1, 0)
    assert (groups["30 to 40 %"]["right"], groups["30 to 40 %"]["sure"]) == (1, 0)


def test_the_table_says_what_was_counted():
    text = places({BY_OVERLAP: {"runs": by_overlap(ROWS)}})
    assert f"| {OURS} | 60 % | 4 | 75.0 % | 30 to 95 % | 4 | 1 (25.0 %) | 1.5 |" in text
    assert "| peer | 60 % | 2 | 50.0 % | 9 to 91 % | – | – | 1 |" in text
    assert text.startswith("6 pairs")


def test_views_without_overlap_are_said_to_share_at_most_the_tolerance():
    numbers = {
        BY_OVERLAP: {"runs": by_overlap(ROWS)},
        ANY_OVERLAP: {"runs": by_verdict([row(0.0, False, "none"), row(0.31, True)])},
    }
    assert "| none (at most 2 %) | 1 | 0.0 % |" in places(numbers)
    assert ">none</text>" in pictures(numbers)[VERDICT]


def test_the_readme_says_how_many_are_placed_at_the_least_and_the_largest_overlap():
    numbers = {BY_OVERLAP: {"runs": by_overlap(ROWS)}}
    (line,) = readme_results({PLACES: SimpleNamespace(numbers=numbers)})
    assert "50 % of the pairs that share 15 % are placed, and 75 % of those that share 60 %" in line


def test_the_picture_has_a_line_for_each_program_with_a_mark_where_it_was_measured():
    (text,) = pictures({BY_OVERLAP: {"runs": by_overlap(ROWS)}}).values()
    marks = ET.fromstring(text).findall(f"{SVG}circle")
    assert len(marks) == 3 + 2  # and one for each program in the legend
    assert {OURS, "peer", "15 %", "60 %"} <= {element.text for element in ET.fromstring(text).iter()}


def test_marks_and_bars_are_at_their_shares():
    text = chart("x", "y", ["a", "b", "c"], [Series("s", (0.0, None, 1.0), (None, None, (0.5, 1.0)))])
    root = ET.fromstring(text)
    bottom, top = HEIGHT - BOTTOM, TOP
    marks = [(float(m.get("cx")), float(m.get("cy"))) for m in root.findall(f"{SVG}circle")][:-1]
    assert [y for _, y in marks] == [bottom, top]
    assert marks[0][0] < marks[1][0]
    paths = [p.get("d") for p in root.findall(f"{SVG}path")]
    assert f"M{marks[1][0]:.1f} {0.5 * (top + bottom):.1f}V{top:.1f}" in paths
    assert not any("L" in d for d in paths)  # the gap breaks the line

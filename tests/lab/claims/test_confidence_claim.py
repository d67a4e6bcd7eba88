"""D10: confidence and correct share are compared bin by bin, and the verdict follows them."""

import json

import numpy as np
import pytest

from app.reports.reproduction import write_reproduction_report
from lab.claims.claim import Verdict
from lab.claims.depth.confidence import (
    D10,
    LARGEST_GAP,
    binned,
    confidence_trial,
    gap_of,
    judge_confidence,
    reliabilities,
)
from lab.claims.depth.scenes import Site
from lab.claims.exhibits import Chart, Table
from lab.training.evaluate import Example
from packetmesh.files import finite
from pipeline.io.demos import load_demo


def image(said, true, pixels=1000, place="a", group="g"):
    """All pixels of one confidence, a share of them right."""
    right = np.arange(pixels) < round(true * pixels)
    counts = binned(np.full(pixels, said, np.float32), right)
    return {"group": group, "place": place, "counts": counts.tolist()}


def test_every_pixel_is_in_the_bin_of_its_confidence():
    counts = binned(np.array([0.0, 0.05, 0.95, 1.0], np.float32), np.array([True, False, True, True]))
    assert counts[0].tolist() == [2, *[0] * 8, 2]
    assert counts[1, [0, 9]] == pytest.approx([0.05, 1.95])
    assert counts[2].tolist() == [1, *[0] * 8, 2]


def test_the_gap_has_its_known_answer():
    (exact,) = reliabilities([image(0.75, 0.75)])
    assert exact.gap == pytest.approx(0.0, abs=1e-6)
    (off,) = reliabilities([image(0.95, 0.75), image(0.15, 0.25, pixels=3000)])
    assert off.gap == pytest.approx(0.25 * 0.2 + 0.75 * 0.1, abs=1e-6)
    assert gap_of(off.counts) == off.gap


def test_over_and_under_confidence_in_different_bins_do_not_cancel():
    (both,) = reliabilities([image(0.95, 0.75), image(0.55, 0.75)])
    assert both.gap == pytest.approx(0.2, abs=1e-6)


def test_an_interval_of_places_spans_them():
    (one,) = reliabilities([image(0.75, 0.5, place="a"), image(0.75, 1.0, place="b")])
    assert one.true_ci95(7) == (0.5, 1.0)
    assert one.gap_ci95 == (pytest.approx(0.0, abs=1e-6), pytest.approx(0.25, abs=1e-6))
    (same,) = reliabilities([image(0.75, 0.5), image(0.75, 1.0)])
    assert same.true_ci95(7) == (0.75, 0.75)


def test_one_group_beyond_the_limit_is_enough_to_fail():
    near, far = image(0.75, 0.75 - 0.9 * LARGEST_GAP), image(0.75, 0.75 - 1.1 * LARGEST_GAP, group="h")
    assert D10.judge(reliabilities([near])).verdict == "holds"
    verdict = D10.judge(reliabilities([near, far]))
    assert verdict.verdict == "does not hold"
    assert "h: confidence 75%, correct share 64%, 11.0 points apart bin by bin" in verdict.why


def test_the_exhibits_show_every_filled_bin_and_the_report_draws_them(tmp_path):
    outcome = judge_confidence(
        reliabilities([image(0.75, 0.5), image(0.35, 0.5), image(0.75, 0.5, group="h")])
    )
    chart, table = outcome.exhibits
    assert isinstance(chart, Chart)
    assert isinstance(table, Table)
    assert chart.curves[0].x == chart.curves[0].y == (0.0, 1.0)
    assert chart.curves[1].x == pytest.approx((0.35, 0.75))
    assert chart.curves[1].y == pytest.approx((0.5, 0.5))
    assert [row[:3] for row in table.rows] == [
        ("g", "30% to 40%", 1000),
        ("g", "70% to 80%", 1000),
        ("h", "70% to 80%", 1000),
    ]
    verdict: Verdict = D10.judge(reliabilities([image(0.75, 0.5)]))
    write_reproduction_report([verdict], tmp_path / "r.html")
    assert "Correct share against confidence" in (tmp_path / "r.html").read_text()
    json.dumps(finite(verdict.record()), allow_nan=False)


def test_a_site_s_counts_are_of_its_holes_and_most_of_them_are_right():
    frame = load_demo("box-on-table").frames[0]
    site = Site("s", "g", lambda: iter([Example(frame.rgb, frame.depth, frame.depth.z_m)]), truth=False)
    hidden, *others = confidence_trial(site)
    pixels, said, right = np.array(hidden["counts"]).sum(axis=1)
    assert hidden["group"] == "g, hidden"
    assert 0.1 < pixels / frame.depth.valid.sum() < 0.2
    assert 0.5 < right / pixels < 1.0
    assert 0.0 < said / pixels < 1.0
    assert others

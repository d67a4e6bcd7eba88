"""Measures of a rendered room beside the truth, and their summary."""

from itertools import islice

import numpy as np
import pytest

from lab.benchmarks import measuring
from lab.measuring.clicks import away_from_edges, clicks, is_flat
from lab.measuring.judging import RoomTask, judged_room, summaries
from lab.measuring.rooms import FOCAL_SD, TUNING, TrueView, measured_room
from lab.results.measuring import measuring as measuring_table
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics.pinhole(130.0, 130.0, 79.5, 59.5, 160, 120)


@pytest.fixture(scope="module")
def room():
    return measured_room(TUNING + 40)


def test_clicks_hit_what_the_same_pixel_truly_shows(room):
    found = list(islice(clicks(room, np.random.default_rng(0)), 400))
    measured = [click for click in found if not click.mark.guessed]
    off_m = np.array([np.linalg.norm(click.mark.point_m - click.true_m) for click in measured])
    raw_m = np.array(
        [np.linalg.norm(click.raw_m - click.true_m) for click in measured if click.raw_m is not None]
    )
    assert np.median(off_m) < np.median(raw_m) < 0.05
    assert {click.mark.node for click in found} >= {0, 1}
    assert room.surface.scale_sd == FOCAL_SD


def test_errors_are_those_of_the_calibration_and_differ_by_camera(room):
    ratios = [
        frame.intrinsics.fx_px / view.camera.fx_px for frame, view in zip(room.frames, room.true, strict=True)
    ]
    assert ratios[0] != ratios[1]
    assert np.abs(np.array(ratios) - 1.0).max() < 5 * FOCAL_SD


def test_no_click_is_at_a_depth_edge_and_flat_is_flat():
    z_m = np.full((120, 160), 2.0)
    z_m[:, 80:] = 1.0
    normals = np.tile([0.0, 0.0, -1.0], (120, 160, 1))
    view = TrueView(CAMERA, np.eye(4), z_m, normals)
    away = away_from_edges(view)
    assert away[60, 20]
    assert away[60, 140]
    assert not away[60, 76:84].any()
    assert is_flat(view, 40, 60)
    assert not is_flat(view, 75, 60)
    assert not is_flat(view, 5, 60)


def row(room, covered, value=1.01, guessed=False, raw=0.02):
    low, high = (0.9, 1.1) if covered else (1.005, 1.1)
    return {
        "room": room, "kind": "distance", "guessed": guessed, "value": value, "true": 1.0, "low": low,
        "high": high, "covered": covered, "elapsed_s": 0.01, "raw_error": raw,
    }  # fmt: skip


def test_a_summary_counts_what_holds_and_resamples_rooms():
    rows = [row(0, True)] * 10 + [row(1, True)] * 9 + [row(1, False)] + [row(2, True, guessed=True, raw=None)]
    measured, guessed = summaries(rows)
    assert (measured["measures"], measured["rooms"], measured["guessed"]) == (20, 2, False)
    assert measured["coverage"] == pytest.approx(0.95)
    assert measured["coverage_ci95"] == pytest.approx((0.9, 1.0))
    assert measured["error_over_raw"] == pytest.approx(0.5)
    assert measured["median_half_width"] == pytest.approx(0.1)
    assert guessed["guessed"]
    assert guessed["error_over_raw"] is None


def test_a_room_without_two_views_gives_no_row(monkeypatch):
    monkeypatch.setattr("lab.measuring.judging.measured_room", lambda seed: None)
    assert judged_room(RoomTask(1)) is None


def test_the_benchmark_goes_on_until_it_has_its_rooms(monkeypatch, tmp_path):
    def room_of(task):
        return None if task.seed % 2 else [row(task.seed, True)]

    monkeypatch.setattr(measuring, "FOLDER", tmp_path)
    monkeypatch.setattr(
        measuring, "iterate_trials", lambda name, work, tasks, *_, **__: iter_done(work, tasks)
    )
    monkeypatch.setattr(measuring, "judged_room", room_of)
    record = measuring.benchmark(rooms=5).record()
    assert record["runs"][0]["rooms"] == 5
    assert record["ours_s"] == 0.01
    text = measuring_table({"measuring": record})
    assert "| length | measured | 5 | 100.0 % [100.0 %, 100.0 %] | 10.00 mm | 0.5 | 100.00 mm | 10 |" in text


def iter_done(work, tasks):
    """As ``iterate_trials``, without files and processes."""
    return [work(task) for task in tasks]
    yield

"""Sessions are what they claim to be, the truth about a camera is the true camera's, and counts are right."""

import importlib
import json
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lab.results.verdicts import calibration_verdicts
from lab.verdicts import __main__ as command
from lab.verdicts.rules import judge
from lab.verdicts.session import LENSES, draw_session
from lab.verdicts.truth import true_error_m, truly_good
from pipeline.calibration.lens import Optics


@pytest.fixture(scope="module")
def sessions():
    return [draw_session(7, number) for number in range(40)]


def test_all_kinds_of_sessions_are_drawn_and_equal_numbers_give_equal_ones(sessions):
    assert {one.optics.lens for one in sessions} == {one.chosen for one in sessions} == set(LENSES)
    assert {one.kind for one in sessions} == {"good", "few", "similar"}
    assert 0 < sum(one.bend_m > 0.0 for one in sessions) < 30
    assert 0 < sum(one.blurred > 0 for one in sessions) < 30
    assert min(one.noise_px for one in sessions) < 0.2 < 0.6 < max(one.noise_px for one in sessions)
    again = draw_session(7, 3)
    for view, other in zip(sessions[3].views, again.views, strict=True):
        np.testing.assert_array_equal(view.points_px, other.points_px)


def test_points_are_the_true_cameras_with_noise_of_the_given_size(sessions):
    for one in sessions:
        seen_px = one.optics.project(one.boards_m)
        off_px = np.concatenate(
            [view.points_px for view in sorted(one.views, key=lambda view: int(view.name.split()[1]))]
        )
        kept = slice(one.blurred * len(one.board.points_m), None)
        assert np.std(off_px[kept] - seen_px[kept]) == pytest.approx(one.noise_px, rel=0.2)
        assert ((seen_px >= 0.0) & (seen_px <= np.array(one.size_px) - 1.0)).all()


def test_a_right_lens_model_can_hold_the_true_lens(sessions):
    right = {(one.optics.lens, one.chosen) for one in sessions if one.right_lens}
    assert ("thesis", "fisheye") not in right
    assert replace(
        sessions[0], optics=replace(sessions[0].optics, lens="thesis"), chosen="rational"
    ).right_lens
    assert not replace(
        sessions[0], optics=replace(sessions[0].optics, lens="brown"), chosen="thesis"
    ).right_lens


def test_the_true_camera_has_no_error_and_a_longer_one_has_its_share(sessions):
    """1 % more focal length, with boards at about the range: at half the radius r, 1 % of its distance r."""
    for one in sessions[:6]:
        assert true_error_m(one, one.optics).max() < 1e-6
        assert truly_good(one, one.optics)
    one = next(one for one in sessions if one.optics.lens == "thesis" and one.kind == "similar")
    matrix = one.optics.matrix.copy()
    matrix[:2, 2] += 0.01 * matrix[0, 0]
    turned_m = true_error_m(one, Optics("thesis", matrix, one.optics.distortion))
    assert np.median(turned_m) < 0.2 * 0.01 * 2**0.5 * one.range_m  # a rotation makes up for most of it


def test_a_session_is_judged_by_each_rule():
    told = judge((7, 0, False))
    assert set(told["verdicts"]) == {"packetmesh", "OpenCV, RMS below 0.5 px", "OpenCV, RMS below 1 px"}
    for rule in told["verdicts"].values():
        assert rule["word"] in {"pass", "fail", "not decided"}
        assert rule["good"] == told["good"]
    json.dumps(told)


@pytest.fixture
def script(monkeypatch):
    """``mrcal_script`` with pinhole cameras in place of mrcal, which only another Python has."""

    def project(points_m, kind, values):
        return values[0] * points_m[..., :2] / points_m[..., 2:] + values[1:]

    def unproject(points_px, kind, values, normalize):
        rays = np.insert((points_px - values[1:]) / values[0], 2, 1.0, axis=-1)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def projection_diff(models, gridn_width, gridn_height, distance):
        own = np.zeros((gridn_height, gridn_width))
        return own, own, own, np.vstack([np.eye(3), np.zeros(3)])

    fake = SimpleNamespace(
        project=project,
        unproject=unproject,
        projection_diff=projection_diff,
        projection_uncertainty=lambda points_m, model, what: np.full(len(points_m), 1.0 / 2.4477),
        transform_point_Rt=lambda Rt, points_m: points_m @ Rt[:3].T + Rt[3],
    )
    monkeypatch.setitem(sys.modules, "mrcal", fake)
    monkeypatch.delitem(sys.modules, "lab.verdicts.mrcal_script", raising=False)
    yield importlib.import_module("lab.verdicts.mrcal_script")
    del sys.modules["lab.verdicts.mrcal_script"]


def test_the_halves_of_mrcal_are_compared_at_the_given_pixels(script, monkeypatch):
    """The odd views' focal length is 1 % longer: a pixel r from the centre moves by 1 % of r."""

    def camera(points_px, rt, *how):
        longer = 1.01 if points_px[0, 0, 0, 0] else 1.0
        return SimpleNamespace(intrinsics=lambda: ("pinhole", np.array([500.0 * longer, 320.0, 240.0])))

    monkeypatch.setattr(script, "camera", camera)
    grid_px = np.array([[320.0, 240.0], [420.0, 240.0], [20.0, 640.0]])
    views_px = np.tile(np.arange(6.0)[:, None, None, None] % 2.0, (1, 2, 2, 2))
    given = {"points_px": views_px, "rt": np.zeros((6, 6)), "grid_px": grid_px, "columns": 3, "rows": 1}
    given |= {"lens": "thesis", "start": [], "size_px": [640, 480], "spacing_m": 0.1, "range_m": 2.0}
    told = script.judged(given)
    pixel_m = np.array(told["uncertainty_m"])  # the uncertainty is one pixel
    assert pixel_m[0] == pytest.approx(2.0 / 500.0, rel=1e-3)
    assert told["apart_m"] == pytest.approx(0.01 * np.array([0.0, 100.0, 500.0]) * pixel_m, abs=1e-9)


def answer(word, good, probability=0.5):
    groups = {"right_lens": True, "bent": False, "views": "few", "blurred": False}
    verdicts = {"packetmesh": {"word": word, "good": good}}
    return {**groups, "probability": probability, "good": good, "verdicts": verdicts}


ANSWERS = [
    *(answer("pass", True, 1.0), answer("pass", False, 0.9), answer("fail", False, 0.0)),
    *(answer("fail", True, 0.1), answer("fail", True, 0.1), answer("not decided", True, 0.5)),
    {"right_lens": False, "bent": False, "views": "good", "blurred": False, "verdicts": {}},
]


def test_counts_on_paper():
    told = command.summary(ANSWERS)
    assert (told["sessions"], told["without_a_camera"]) == (7, 1)
    assert told["rules"]["packetmesh"] == {
        "judged": 6,
        "pass": 2,
        "pass, wrong": 1,
        "fail": 3,
        "fail, wrong": 2,
        "not decided": 1,
        "not decided, good": 1,
    }
    assert told["groups"]["few views"]["judged"] == 6
    assert told["groups"]["wrong lens model"]["judged"] == 0
    bins = told["probabilities"]
    assert sum(one["sessions"] for one in bins) == 6
    assert (bins[-1]["sessions"], bins[-1]["good"]) == (1, 1)
    assert bins[1]["mean_probability"] == pytest.approx(0.1)


def test_the_page_has_the_counts():
    page = calibration_verdicts({"seed": 1, "mrcal": False, **command.summary(ANSWERS)})
    assert "| packetmesh | 6 | 2 | 1 (50.0 %) | 3 | 2 (66.7 %) | 1 | 1 (100.0 %) |" in page
    assert "a pass of ours is false in 14.3 %" in page
    assert page.endswith("mrcal was not installed on this machine.")


def test_the_command_prints_json_and_an_interrupted_run_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "mrcal_installed", lambda: False)
    words = ["verdicts", "--seed", "7", "--sessions", "2", "--processes", "1", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    command.main()
    told = capsys.readouterr()
    assert json.loads(told.out)["sessions"] == 2
    command.main()
    again = capsys.readouterr()
    assert again.out == told.out
    assert "2 of 2 stored" in again.err

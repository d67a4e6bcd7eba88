"""Plain words that agree with the draws behind them, and advice that works when it is followed."""

import re
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.assess import assess
from pipeline.calibration.estimate import calibrate
from pipeline.calibration.likely_error import LikelyError, likely_error
from pipeline.calibration.verdict import FAIL, PASS, percent, verdict
from tests.pipeline.calibration.test_likely_error import TANGENTIAL, bent_views
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views


@pytest.fixture(scope="module")
def found():
    return calibrate(views(0.2, 0), SIZE)


@pytest.fixture(scope="module")
def likely(found):
    return likely_error(found, 2.0)


@pytest.mark.parametrize(
    ("probability", "word"),
    [(1.0, "pass"), (PASS, "pass"), (0.5, "not decided"), (FAIL, "fail"), (0.0, "fail")],
)
def test_the_word_follows_from_the_probability(found, probability, word):
    """Of 100 draws, this share is within 5 mm everywhere, the others nowhere."""
    error_m = np.full((100, 20), 0.02)
    error_m[: round(100 * probability)] = 0.001
    judged = verdict(found, LikelyError(2.0, (4, 5), error_m, 0.0, 0.0), 0.005)
    assert judged.probability == pytest.approx(probability)
    assert (judged.passed, judged.failed) == (word == "pass", word == "fail")
    assert judged.word == word
    assert "At 2 m a point is placed within 5 mm over 95 % of the image with a" in judged.sentence
    assert f"with a probability of {percent(probability)}, and within" in judged.sentence
    assert re.search(rf": {word}\.", judged.sentence)


def test_it_passes_where_the_error_is_small_enough_and_not_where_it_is_not(found, likely):
    of_most_m = verdict(found, likely, 1.0).error_of_most_m
    good, bad = (verdict(found, likely, share * of_most_m) for share in (1.01, 0.3))
    assert good.passed
    assert good.probability >= 0.95
    assert good.share >= 0.95
    assert good.sentence.endswith("pass.")
    assert not bad.passed
    assert bad.share < 0.95
    assert f"and within {1000.0 * of_most_m:.2g} mm with a probability of 95 %" in bad.sentence


def test_a_lens_that_the_model_cannot_hold_leads_to_another_model_which_passes():
    given = views(0.05, 0, 16, TANGENTIAL)
    wrong = calibrate(given, SIZE)
    judged = verdict(wrong, likely_error(wrong, 2.0), 0.005)
    assert judged.failed
    lens = re.search(r"try --lens (\w+)", judged.sentence)[1]
    better = calibrate(given, SIZE, lens)
    assert verdict(better, likely_error(better, 2.0), 0.005).passed


def test_a_bent_board_leads_to_a_flat_plate_which_passes():
    given, _ = bent_views(0, 0.004)
    bent = calibrate(given, SIZE)
    judged = verdict(bent, likely_error(bent, 2.0), 0.004)
    assert not judged.passed
    assert (
        "The residuals have the pattern of a bent board: glue it onto a flat plate, or try --board-warp"
        in judged.sentence
    )
    plate = calibrate(bent_views(0, 0.0)[0], SIZE)
    assert verdict(plate, likely_error(plate, 2.0), 0.004).passed


def test_a_failed_verdict_says_what_to_do_next(found):
    told = assess(found, views(0.2, 0), BOARD, 2.0, 1e-4)
    assert f"hold the board {told.following.distance_m:.2f} m away" in told.verdict.sentence
    metrics = told.metrics()
    assert (metrics["passed"], metrics["failed"]) == (False, True)
    assert metrics["probability"] == 0.0
    assert metrics["next_view"]["error_after_m"] < metrics["next_view"]["error_before_m"]
    assert metrics["uncertainty_px"]["median"] < metrics["uncertainty_px"]["most"]


def test_where_the_lens_has_no_ray_no_point_is_placed(found, likely):
    error_m = likely.error_m.copy()
    error_m[:, : 4 * likely.shape[1]] = np.inf
    judged = verdict(found, replace(likely, error_m=error_m), 1.0)
    assert judged.failed
    assert "not at all in 22 % of it, where this lens has no rays" in judged.sentence


def test_with_few_views_there_are_no_halves_and_still_a_verdict():
    given = views(0.2, 0, 4)
    told = assess(calibrate(given, SIZE), given, BOARD, 2.0, 0.005)
    assert told.halves is None
    assert told.metrics()["halves"] is None


def test_an_impossible_accuracy_is_refused(found, likely):
    for accuracy_m in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="accuracy"):
            verdict(found, likely, accuracy_m)


def test_a_view_of_another_camera_is_not_taken_for_a_wrong_lens(found):
    given = views(0.05, 0, 12)
    other = views(0.05, 1, 12)[4]
    center = other.points_px.mean(axis=0)
    away_px = other.points_px - center
    given[4] = replace(other, points_px=center + away_px * (1.0 + 0.03 * (away_px**2).sum(1)[:, None] / 1e4))
    wrong = calibrate(given, SIZE)
    trust = assess(wrong, given, BOARD, 2.0, 0.005)
    assert trust.verdict.failed
    assert trust.verdict.wrong_lens >= 0.95
    assert [one.name for one in trust.outliers] == [given[4].name]
    assert f"{given[4].name} does not fit the others: leave out what is wrong" in trust.verdict.sentence
    assert "--lens" not in trust.verdict.sentence
    right = given[:4] + given[5:]
    assert assess(calibrate(right, SIZE), right, BOARD, 2.0, 0.005).verdict.passed

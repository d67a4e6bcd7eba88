"""Plain words that agree with the maps behind them."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.assess import assess
from pipeline.calibration.estimate import calibrate
from pipeline.calibration.trust import CIRCLE95, half_difference_px, projected_sd_px
from pipeline.calibration.verdict import verdict
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views


@pytest.fixture(scope="module")
def found():
    return calibrate(views(0.2, 0), SIZE)


def test_it_passes_where_the_error_is_small_enough_and_not_where_it_is_not(found):
    sd = projected_sd_px(found, 2.0)
    of_most_m = verdict(found, sd, None, 1.0).error_of_most_m
    assert (CIRCLE95 * sd.error_m <= of_most_m).mean() == pytest.approx(0.95, abs=0.005)
    good, bad = (verdict(found, sd, None, share * of_most_m) for share in (1.01, 0.5))
    assert good.passed
    assert good.share >= 0.95
    assert good.sentence.endswith("pass.")
    assert not bad.passed
    assert bad.share == pytest.approx((CIRCLE95 * sd.error_m <= bad.accuracy_m).mean())
    assert "fail. Take more views" in bad.sentence


def test_halves_that_disagree_count_and_lead_to_another_lens():
    given = views(0.05, 0, 16, [-0.3, 0.15, 0.005, -0.003, 0.0])
    wrong = calibrate(given, SIZE)
    sd, halves = projected_sd_px(wrong, 2.0), half_difference_px(given, SIZE, 2.0)
    accuracy_m = verdict(wrong, sd, None, 1.0).error_of_most_m
    assert verdict(wrong, sd, None, accuracy_m).passed
    judged = verdict(wrong, sd, halves, accuracy_m)
    assert not judged.passed
    assert (judged.error_m >= halves.map.error_m).all()
    assert "try --lens brown" in judged.sentence


def test_halves_that_agree_within_noise_change_nothing(found):
    sd, halves = projected_sd_px(found, 2.0), half_difference_px(views(0.2, 0), SIZE, 2.0)
    assert not halves.beyond_noise
    with_halves, without = (verdict(found, sd, one, 0.005) for one in (halves, None))
    np.testing.assert_array_equal(with_halves.error_m, without.error_m)


def test_a_failed_verdict_says_what_to_do_next(found):
    told = assess(found, views(0.2, 0), BOARD, 2.0, 1e-4)
    assert f"hold the board {told.following.distance_m:.2f} m away" in told.verdict.sentence
    metrics = told.metrics()
    assert metrics["passed"] is False
    assert metrics["next_view"]["error_after_m"] < metrics["next_view"]["error_before_m"]
    assert metrics["uncertainty_px"]["median"] < metrics["uncertainty_px"]["most"]


def test_where_the_lens_has_no_ray_no_point_is_placed(found):
    sd = projected_sd_px(found, 2.0)
    error_m = sd.error_m.copy()
    error_m[:4] = np.nan
    judged = verdict(found, replace(sd, error_m=error_m), None, 1.0)
    assert not judged.passed
    assert "nowhere in 22 % of it, where the lens folds back" in judged.sentence


def test_with_few_views_there_are_no_halves_and_still_a_verdict():
    given = views(0.2, 0, 4)
    told = assess(calibrate(given, SIZE), given, BOARD, 2.0, 0.005)
    assert told.halves is None
    assert told.metrics()["halves"] is None


def test_an_impossible_accuracy_is_refused(found):
    for accuracy_m in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="accuracy"):
            verdict(found, projected_sd_px(found, 2.0), None, accuracy_m)

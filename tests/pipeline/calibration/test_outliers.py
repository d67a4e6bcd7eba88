"""Views that do not belong are named, and only those."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import ReconstructionError
from pipeline.calibration.estimate import View, best_fit, calibrate
from pipeline.calibration.outliers import outlier_views
from tests.pipeline.calibration.test_trust import BOARD, SIZE, views


def spoiled(kind, row, given):
    """The views with one that went wrong."""
    rng, one = np.random.default_rng(5), given[row]
    if kind == "blurred":
        points_px = one.points_px + rng.normal(0.0, 1.0, one.points_px.shape)
    elif kind == "another board":
        points_px = given[(row + 1) % len(given)].points_px.copy()
        points_px[::2] += 6.0
    else:  # a column too few: every row is read one place on
        points_px = np.roll(one.points_px.reshape(BOARD.rows, BOARD.columns, 2), 1, axis=1).reshape(-1, 2)
    return [
        View(v.name, points_px if index == row else v.points_px, v.board_m) for index, v in enumerate(given)
    ]


@pytest.mark.parametrize("kind", ["blurred", "another board", "wrong order"])
@pytest.mark.parametrize("row", [0, 6])
def test_the_view_that_went_wrong_is_named_and_no_other(kind, row):
    given = spoiled(kind, row, views(0.2, 1))
    told = outlier_views(best_fit(given, SIZE), given)
    assert [one.name for one in told] == [str(row)]
    assert told[0].rms_px > 2.0 * told[0].others_px
    assert told[0].rms_without_px == pytest.approx(0.2 * 2**0.5, rel=0.1)
    assert f"{row} has" in told[0].reason


def test_two_bad_views_are_both_found_the_worst_first():
    given = spoiled("blurred", 2, spoiled("wrong order", 7, views(0.2, 2)))
    assert [one.name for one in outlier_views(best_fit(given, SIZE), given)] == ["7", "2"]


def test_a_rig_orders_the_views_by_moments_and_the_right_one_is_left_out():
    given = spoiled("blurred", 2, views(0.2, 1))
    found = best_fit(given, SIZE)
    reordered = replace(found, views=found.views[3:] + found.views[:3])
    assert outlier_views(reordered, given) == outlier_views(found, given)


@pytest.mark.parametrize("row", [0, 6])
def test_a_view_that_spoils_the_camera_is_named_and_leaving_it_out_gives_the_camera(row):
    given = spoiled("wrong order", row, views(0.2, 1))
    with pytest.raises(ReconstructionError, match=rf"more than 5 px.* worst image, {row} "):
        calibrate(given, SIZE)
    assert calibrate([one for one in given if one.name != str(row)], SIZE).rms_px < 0.4


def test_views_that_are_alike_give_no_outlier():
    for seed in range(10):
        given = views(0.2, seed)
        assert outlier_views(calibrate(given, SIZE), given) == ()

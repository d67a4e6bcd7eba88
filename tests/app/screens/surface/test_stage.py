"""The place of the ball of a quick look: the clicked point, whichever surfaces are shown, and where."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.cuts import Top
from app.compute.records import Stage
from app.screens.surface.labels import AFTER, BEFORE, BOTH
from app.screens.surface.stage import APART, ChosenBall, SurfaceStage

MIDDLE_M = np.array([2.0, 5.0, 1.0])
PLACE = Stage(np.array([2.0, 0.0, 2.5]), MIDDLE_M, np.array([1.0, 0.0, 0.0]), 3.0, MIDDLE_M)
POINTS_M = MIDDLE_M + np.array([[0.0, 0.0, 0.0], [-1.4, 0.5, -0.9], [1.4, -0.3, 0.8]])
"""Points of both surfaces, which are as wide as the scene."""
ASIDE_M = APART * PLACE.width_m * PLACE.right
OFFSETS_M = {AFTER: (0.0 * ASIDE_M,), BEFORE: (0.0 * ASIDE_M,), BOTH: (ASIDE_M, -ASIDE_M)}
"""Where the shown surfaces stand."""


@pytest.fixture
def stage(server):
    return SurfaceStage(server.scene)


def show(stage, shown):
    stage.shown = shown
    stage.arrange(PLACE, loops=False, unused=False, hidden=False)


def away_m(ray, point_m):
    """Distance of a point from a ray."""
    arm_m, direction = point_m - np.array(ray.origin_m), np.array(ray.direction)
    return np.linalg.norm(np.cross(arm_m, direction)) / np.linalg.norm(direction)


@pytest.mark.parametrize(("at_click", "later"), itertools.product(OFFSETS_M, OFFSETS_M))
def test_the_ball_stays_at_the_clicked_point_whatever_is_shown_later(stage, at_click, later):
    ball = ChosenBall(SimpleNamespace(clients=list), stage)
    for offset_m, point_m in itertools.product(OFFSETS_M[at_click], POINTS_M):
        show(stage, at_click)
        ball.clicked(PLACE.viewpoint_m, point_m + offset_m - PLACE.viewpoint_m, None)
        show(stage, later)
        assert away_m(ball._ray(), point_m) < 1e-9


@pytest.mark.parametrize("offset_m", OFFSETS_M[BOTH])
def test_a_click_side_by_side_begins_where_the_cut_ends(stage, offset_m):
    ball = ChosenBall(SimpleNamespace(clients=list), stage)
    show(stage, BOTH)
    ball.clicked(PLACE.viewpoint_m, MIDDLE_M + offset_m - PLACE.viewpoint_m, Top(2.0))
    ray = ball._ray()
    assert ray.origin_m[2] == pytest.approx(2.0)
    assert away_m(ray, MIDDLE_M) < 1e-9


@pytest.mark.parametrize("shown", OFFSETS_M)
def test_without_a_click_the_ball_is_in_the_middle_of_the_view(stage, shown):
    for offset_m in OFFSETS_M[shown]:
        show(stage, shown)
        camera = SimpleNamespace(position=PLACE.viewpoint_m, look_at=MIDDLE_M + offset_m)
        ball = ChosenBall(SimpleNamespace(clients=lambda seen=camera: [SimpleNamespace(camera=seen)]), stage)
        assert away_m(ball._ray(), MIDDLE_M) < 1e-9

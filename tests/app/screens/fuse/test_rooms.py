"""Made rooms in which a wrong registration fits, and what the verdict says of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.compute.state import Spec
from app.lesson.reading import read_lesson
from app.screens.fuse.board import score
from app.screens.fuse.lesson import KIND, SHIPPED
from app.screens.fuse.race_job import race_job
from app.screens.fuse.rooms import ROOMS
from app.screens.fuse.view import Start
from packetmesh.progress import drain
from pipeline.kernels.geometry import apply, rotation_angle_rad
from pipeline.sources import Demo

SPEC = Spec(Demo("box-on-table"))
RACES = {
    stop.look.race.mode: stop.look.race
    for stop in read_lesson(SHIPPED, KIND).stops
    if stop.look.race.mode in ROOMS
}


@pytest.fixture(scope="module")
def ends(store):
    """Each room's ICP and CEICP-A lanes."""
    return {mode: drain(race_job(store, SPEC, race)).lanes for mode, race in RACES.items()}


def turn_deg(mode, lane):
    T = ROOMS[mode]().T_home[:3, :3].T @ lane.steps[-1].T_target_source[:3, :3]
    return np.degrees(rotation_angle_rad(T))


@pytest.mark.parametrize("mode", ROOMS)
def test_at_home_the_clouds_are_of_one_surface(mode):
    scans = ROOMS[mode]()
    moved_m = apply(scans.T_home, scans.source.points_m)
    near_m = cKDTree(scans.target.points_m).query(moved_m)[0]
    assert np.median(near_m) < 0.05
    assert np.linalg.det(scans.T_home[:3, :3]) == pytest.approx(-1.0 if mode == "mirrored" else 1.0)
    assert np.linalg.det(scans.T_aligned[:3, :3]) == pytest.approx(1.0)


def test_both_methods_stay_down_the_corridor_and_the_free_slide_is_named(ends):
    for lane in ends["corridor"]:
        assert lane.steps[-1].point_error_m == pytest.approx(2.0, abs=0.02)
        assert lane.verdict_text == "doubtful: the overlap does not determine sliding along x"


def test_down_the_corridor_the_rmse_is_as_low_as_at_the_true_pose(ends, store):
    at_home = replace(RACES["corridor"], start=Start())
    true = drain(race_job(store, SPEC, at_home)).lanes[1]
    assert true.steps[-1].point_error_m < 0.05
    assert ends["corridor"][1].steps[-1].rmse_m == pytest.approx(true.steps[-1].rmse_m, rel=0.1)


def test_both_methods_end_a_quarter_off_in_the_square_room_and_another_quarter_fits_as_well(ends):
    for lane in ends["square"]:
        assert turn_deg("square", lane) == pytest.approx(90.0, abs=0.5)
        assert lane.steps[-1].point_error_m > 2.0
        assert lane.verdict_text == "doubtful: turned by 90 degrees, the source fits as well"


def test_a_mirrored_cloud_is_found_out_although_ceicp_has_a_low_rmse(ends):
    icp, ceicp = ends["mirrored"]
    assert ceicp.steps[-1].rmse_m < 0.03 < 0.1 < icp.steps[-1].rmse_m
    assert ceicp.steps[-1].point_error_m > 1.0
    assert ceicp.verdict == "doubtful"
    assert ceicp.reasons[-1] == "one cloud is mirrored, since with x negated the source fits"
    assert icp.verdict == "none"


def test_the_board_has_the_verdict_beside_the_rmse_at_the_end_only(ends):
    lane = ends["square"][1]
    said = score(lane, len(lane.steps) - 1)["verdict"]
    assert said == f"RMSE {100 * lane.steps[-1].rmse_m:.2f} cm · verdict {lane.verdict_text}"
    assert score(lane, 0)["verdict"] == ""

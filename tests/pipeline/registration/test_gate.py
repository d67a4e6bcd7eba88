"""The gate from the data, and draws of the points that agree or say that they do not."""

from dataclasses import replace

import numpy as np
import pytest

from lab.worlds import box_room
from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.pairs.draws import DRAWS, run_draws, with_gate
from pipeline.pairs.register import AGREEMENT_M, Pair, config_for
from pipeline.registration import point_error_m
from pipeline.registration.gate import Misfit, best_gate_m, ladder
from pipeline.types import PointCloud
from tests.pipeline.registration.rooms import seen_by

CONFIG = RegistrationConfig()


@pytest.fixture(scope="module")
def room():
    """Two views of a room, and the true pose of the second in the first."""
    scene = box_room(3, nodes=2)
    first, second = seen_by(scene, 0.002)
    return second, first, inverse(scene.cameras[0]) @ scene.cameras[1]


def beside(pair, turn_deg: float, shift_m: float) -> Pair:
    """The pair with a start pose so far from the true one, turned about the source's centre."""
    source, target, T_true = pair
    center_m = source.points_m.mean(axis=0)
    turn = rotation_exp(np.radians(turn_deg) * np.array([0.6, -0.48, 0.64]))
    way = shift_m * np.array([0.64, 0.6, -0.48])
    return Pair(source, target, T_true @ rigid(turn, center_m - turn @ center_m + way), T_true)


def test_misfit_is_least_at_the_true_pose_and_knows_no_unit(room):
    source, target, T_true = room
    misfit = Misfit(source, target)
    off = [misfit(beside(room, turn, shift).T_init) for turn, shift in ((2, 0.02), (5, 0.1), (20, 0.5))]
    assert misfit(T_true) < off[0] < off[1] <= 1.0
    assert off[1] < off[2]
    inches = [PointCloud(cloud.points_m / 0.0254) for cloud in (source, target)]
    T = T_true.copy()
    T[:3, 3] /= 0.0254
    assert Misfit(*inches)(T) == pytest.approx(misfit(T_true), abs=1e-6)


def test_misfit_does_not_depend_on_which_cloud_moves(room):
    source, target, T_true = room
    assert Misfit(target, source)(inverse(T_true)) == pytest.approx(Misfit(source, target)(T_true), abs=0.02)


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_the_gate_grows_with_the_place(room, size):
    pair = beside(room, 8.0, 0.2)
    source, target = (PointCloud(size * cloud.points_m) for cloud in (pair.source, pair.target))
    T_init = pair.T_init.copy()
    T_init[:3, 3] *= size
    gate_m = with_gate(Pair(source, target, T_init), CONFIG).gate_m
    assert gate_m / size == pytest.approx(with_gate(pair, CONFIG).gate_m, rel=1e-6)


def test_a_far_start_gets_a_gate_that_leads_home(room):
    """From where the smallest gate misses, the chosen one arrives."""
    pair = beside(room, 25.0, 0.6)
    misfit = Misfit(pair.source, pair.target)
    rungs = ladder(pair.source, pair.target, CONFIG, pair.T_init, misfit)
    errors_m = [point_error_m(rung.T_target_source, pair.T_true, pair.source.points_m) for rung in rungs]
    assert errors_m[0] > 0.1
    chosen = [rung.gate_m for rung in rungs].index(best_gate_m(rungs))
    assert errors_m[chosen] < 0.01


def test_ten_draws_agree_where_the_place_determines_the_pose(room):
    pair = beside(room, 5.0, 0.1)
    (answer,) = run_draws("ceicp-a", pair, with_gate(pair, CONFIG))
    assert answer.draws == DRAWS
    assert answer.agreed
    assert answer.spread_m <= AGREEMENT_M
    assert answer.point_error_m < 0.01


def test_draws_that_do_not_agree_say_so(room):
    """Points with as much noise as the clouds have structure: each draw ends elsewhere."""
    rng = np.random.default_rng(0)
    clouds = (PointCloud(rng.uniform(0.0, 1.0, (400, 3))) for _ in range(2))
    (answer,) = run_draws("ceicp-a", Pair(*clouds, np.eye(4)), replace(CONFIG, start="global"))
    assert not answer.agreed
    assert answer.spread_m > AGREEMENT_M


def test_a_start_where_draws_part_is_left_for_one_by_features(room):
    pair = beside(room, 60.0, 1.0)
    config = with_gate(pair, config_for(("ceicp-a",), None, None, "given", False))
    (answer,) = run_draws("ceicp-a", pair, config)
    assert answer.agreed
    assert answer.point_error_m < 0.01


def test_clouds_far_apart_have_no_gate(room):
    source, target, _ = room
    far = PointCloud(apply(rigid(np.eye(3), [500.0, 0.0, 0.0]), source.points_m))
    with pytest.raises(ReconstructionError, match="No point of the source lies within"):
        with_gate(Pair(far, target, np.eye(4)), CONFIG)

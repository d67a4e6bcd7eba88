"""A fit is compared with the spacing of the points; a mirrored cloud is found."""

import numpy as np
import pytest

from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.pairs.fit import fit_doubt
from pipeline.pairs.register import Pair, config_for, run_methods
from pipeline.types import PointCloud
from tests.pipeline.pairs.rooms import room

T_TRUE = rigid(rotation_exp(np.radians(3.0) * np.array([0.6, -0.48, 0.64])), [0.03, -0.02, 0.03])


def doubt_of(source_m, target_m):
    config = config_for(("ceicp-a",), None, 1.0, "given", False)
    pair = Pair(PointCloud(source_m), PointCloud(target_m), np.eye(4))
    answer = next(run_methods(("ceicp-a",), pair, config))
    return answer, fit_doubt(pair, answer, config)


def test_a_good_fit_is_not_doubted():
    answer, doubt = doubt_of(apply(inverse(T_TRUE), room(1)), room(2))
    assert doubt is None
    assert answer.rmse_m < 0.05


@pytest.mark.parametrize("away_m", [0.0, 4.0])
def test_a_mirrored_source_is_named_with_its_fit(away_m):
    """Also if its plane of reflection is not at the origin."""
    mirrored_m = apply(inverse(T_TRUE), room(1)) * [-1.0, 1.0, 1.0] + np.array([away_m, 0.0, 0.0])
    _, doubt = doubt_of(mirrored_m, room(2))
    assert doubt is not None
    assert "because one is mirrored: with x negated the source fits to" in doubt
    fit_cm = float(doubt.split("fits to ")[1].split(" cm")[0])
    spacing_cm = float(doubt.split("points are ")[1].split(" cm")[0])
    assert fit_cm < 1.2 * spacing_cm


def test_clouds_that_do_not_fit_are_said_to_and_not_called_mirrored():
    rng = np.random.default_rng(3)
    _, doubt = doubt_of(rng.uniform(0.0, 2.0, (30_000, 3)), room(2))
    assert "The fit is bad: rmse" in doubt
    assert "mirrored" not in doubt
    assert "% of the source points are near the target" in doubt


def test_clouds_that_overlap_in_part_are_not_said_to_fit_badly():
    """Half of the source is beside the target, up to the gate: the RMSE is many spacings."""
    whole_m = room(1)
    _, doubt = doubt_of(apply(inverse(T_TRUE), whole_m), room(2)[room(2)[:, 0] < 3.0])
    assert doubt is None

"""When a registration ends (SPEC 4.2): 1e-4 rad and 1e-4 m, or the same error to 1e-6 twice."""

import numpy as np
import pytest

from pipeline.config import RegistrationConfig
from pipeline.registration.stop import TRANSLATION_TOLERANCE_OF_GATE, StopRule
from pipeline.types import RegistrationStep


def reasons(*steps, tolerance=1.0):
    """Of a rule with 1e-4 m, after each of steps (error, turn, move)."""
    rule, empty = StopRule(1e-4), np.empty(0)
    return [
        rule.reason(
            RegistrationStep(
                index, np.eye(4), empty, empty, empty, 0.0, 0.0, 0.0, rmse_m, 0.0, 0.0, 0.0, turn_rad, move_m
            ),
            tolerance,
        )
        for index, (rmse_m, turn_rad, move_m) in enumerate(steps)
    ]


def test_the_tolerance_is_a_tenth_of_a_millimetre_at_the_default_gate():
    assert TRANSLATION_TOLERANCE_OF_GATE * RegistrationConfig().gate_m == pytest.approx(1e-4)


@pytest.mark.parametrize(
    ("turn_rad", "move_m", "reason"),
    [(0.9e-4, 0.9e-4, "converged"), (1.1e-4, 0.9e-4, None), (0.9e-4, 1.1e-4, None), (0.0, 1.0, None)],
)
@pytest.mark.parametrize("tolerance", [1.0, 4.0])
def test_both_turn_and_move_must_be_small(turn_rad, move_m, reason, tolerance):
    assert reasons((1.0, tolerance * turn_rad, tolerance * move_m), tolerance=tolerance) == [reason]


@pytest.mark.parametrize(
    ("errors_m", "stalls"),
    [
        ((5.0, 5.0), False),
        ((5.0, 5.0, 5.0), True),
        ((5.0, 5.0 + 4e-6, 5.0), True),
        ((5.0, 5.0 + 6e-6, 5.0), False),
        ((5.0, 5.0, 4.0, 4.0), False),
        ((5.0, 5.0, 4.0, 4.0, 4.0), True),
    ],
)
def test_an_error_stalls_that_stays_the_same_twice_running(errors_m, stalls):
    told = reasons(*((rmse_m, 1.0, 1.0) for rmse_m in errors_m))
    assert told == [None] * (len(errors_m) - 1) + ["stalled" if stalls else None]

"""Limits of a board's numbers."""

import pytest

from packetmesh.errors import InputError
from pipeline.calibration.board import Board


def test_a_spacing_may_be_the_least_that_the_refusal_names_and_not_the_most():
    with pytest.raises(InputError, match=r"from 0\.1 to below 10000, for example 35"):
        Board("circles", 5, 4, 10.0)
    assert Board("circles", 5, 4, 1e-4).spacing_m == 1e-4
    with pytest.raises(InputError, match=r"A spacing of 0\.099 mm"):
        Board("circles", 5, 4, 0.99e-4)

"""Walls found in a room whose walls are known."""

import numpy as np
import pytest

from pipeline.planning.walls import walls_of
from tests.pipeline.planning.rooms import box_room, place, sheet, targets_at

CELL_M = 0.03
"""Walls end at the middle of their last triangle: at most two thirds of a cell from the corner."""


def walls(sheets):
    found = walls_of(place(sheets, targets_at([(1, 1, 1)], (0, 0, 1))))
    return sorted(sorted(tuple(end) for end in wall) for wall in found.tolist())


def test_the_walls_of_a_room_to_the_centimetre_or_two():
    found = walls(box_room(4.0, 3.0, cell_m=CELL_M)[:5])
    truth = [[(0, 0), (0, 3)], [(0, 0), (4, 0)], [(0, 3), (4, 3)], [(4, 0), (4, 3)]]
    assert len(found) == 4
    for wall in truth:
        assert min(np.abs(np.array(wall) - np.array(one)).max() for one in found) < CELL_M


def test_a_door_parts_a_wall():
    floor = sheet((0, 0, 0), (4, 0, 0), (0, 3, 0), 0.2)
    sides = [((x_m + 1.5, 0, 0), (-1.5, 0, 0), (0, 0, 2.5)) for x_m in (0.0, 2.5)]
    found = walls([floor, *(sheet(*side, 0.05) for side in sides)])
    assert np.allclose(found, [[(0, 0), (1.5, 0)], [(2.5, 0), (4, 0)]], atol=0.05)


@pytest.mark.parametrize(
    "side",
    [
        ((2, 0, 0), (-2, 0, 0), (0, 0, 0.9)),  # as low as a sideboard
        ((0.8, 0, 0), (-0.8, 0, 0), (0, 0, 2.5)),  # as narrow as a pillar
        ((2, 0, 0), (-2, 0, 0), (0, 1.5, 1.5)),  # a slope
    ],
)
def test_low_narrow_and_sloping_surface_is_no_wall(side):
    floor = sheet((0, 0, 0), (4, 0, 0), (0, 3, 0), 0.2)
    seen = place([floor, sheet(*side, 0.05)], targets_at([(1, 1, 1)], (0, 0, 1)))
    assert walls_of(seen).shape == (0, 2, 2)

"""Level planes that things stand on: a table with chairs, a box on it."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.measuring import measures
from tests.pipeline.measuring.scenes import BOX_M, TABLE_M, box_on_table, joined, measured, table_in_room

CHAIR_M = (0.45, 0.45)
TUCKED = ((0.4, -0.2, 0.45), CHAIR_M)
"""The seat of a chair of which more than half is under the table."""
NEXT = ((1.55, 0.2, 0.45), CHAIR_M)
"""The seat of a chair at the table's short side."""
BENCH = ((-0.05, -0.3, 0.45), (1.6, 0.28))


def box_at(surface, x_m, y_m, z_m):
    """Width, depth and height of the thing at a point."""
    return measures.box_of_part(surface, np.array([x_m, y_m, z_m])).values


@pytest.mark.parametrize("others", [(), (NEXT,), (TUCKED,), (TUCKED, NEXT), (BENCH,)])
@pytest.mark.parametrize("at_m", [(0.75, 0.45), (0.45, 0.1), (1.4, 0.4)])
def test_a_table_stands_on_the_floor_and_not_on_the_seat_of_a_chair(others, at_m):
    for one, true_m in zip(box_at(measured(table_in_room(*others)), *at_m, 0.74), TABLE_M, strict=True):
        assert one.value == pytest.approx(true_m, abs=0.03)  # a spacing
        assert one.ci95[0] <= true_m <= one.ci95[1]


@pytest.mark.parametrize("others", [(NEXT,), (TUCKED,), (BENCH,)])
def test_without_a_floor_the_height_of_a_table_is_unknown(others):
    with pytest.raises(InputError, match="height is unknown; mark three faces"):
        box_at(measured(table_in_room(*others, floor=False)), 0.75, 0.45, 0.74)


def test_seats_along_two_sides_leave_the_height_of_a_table_unknown():
    behind = ((-0.05, 0.92, 0.45), (1.6, 0.28))
    with pytest.raises(InputError, match="Planes of different heights continue around"):
        box_at(measured(table_in_room(BENCH, behind)), 0.75, 0.45, 0.74)


@pytest.mark.parametrize("away_m", [0.0, 0.2])
def test_a_box_on_a_table_stands_on_the_table_and_not_on_the_floor_below(away_m):
    """Also where the table ends right at the front of the box, and the floor follows."""
    table_m, triangles, normals = table_in_room()
    box_m, box_triangles, box_normals = box_on_table()
    own = box_m[:, 2] > 0.0
    own |= np.abs(box_normals[:, 2]) < 0.5  # without the table of that scene
    kept = own[box_triangles].all(axis=1)
    moved_m = box_m + np.array([0.6, away_m, TABLE_M[2]])
    mesh = joined((table_m, triangles, normals), (moved_m, box_triangles[kept], box_normals))
    values = box_at(measured(mesh), 0.7, away_m + 0.1, TABLE_M[2] + BOX_M[2])
    assert values[2].value == pytest.approx(BOX_M[2], abs=0.002)


def test_a_point_on_a_side_gives_the_height_over_the_same_plane():
    assert box_at(measured(box_on_table()), 0.0, 0.1, 0.12)[2].value == pytest.approx(BOX_M[2], abs=0.002)

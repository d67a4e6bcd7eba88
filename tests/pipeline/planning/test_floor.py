"""A room from above: outlines with known areas, aims and fields of view on paper."""

import cv2
import numpy as np
import pytest

from pipeline.planning.floor import footprint, wedge_m
from tests.pipeline.planning.rooms import LENS, at, box_room, place, sheet, targets_at


def area_m2(rings_m):
    """Areas of outlines."""
    return [cv2.contourArea(ring.astype(np.float32)) for ring in rings_m]


def test_the_outlines_of_a_table_and_of_the_floor_have_their_areas():
    table = sheet((1, 1, 0.75), (1, 0, 0), (0, 0.8, 0), 0.1)
    floor = box_room()[0]
    found = footprint(place([floor, table], targets_at([(1, 1, 1)], (0, 0, 1))))
    assert area_m2(found.floor_m) == pytest.approx([12.0], rel=0.02)
    assert area_m2(found.things_m) == pytest.approx([0.8], rel=0.05)
    assert np.allclose(found.things_m[0].min(axis=0), (1, 1), atol=0.02)
    assert np.allclose(found.things_m[0].max(axis=0), (2, 1.8), atol=0.02)


def test_ceilings_and_guesses_are_not_drawn():
    guess = sheet((1, 1, 0.75), (1, 0, 0), (0, 0.8, 0), 0.1)
    sheets = [box_room()[0], box_room()[5]]
    found = footprint(place(sheets, targets_at([(1, 1, 1)], (0, 0, 1)), guessed_sheets=[guess]))
    assert found.things_m == ()


def test_the_wedge_has_the_lenss_angle_and_its_radius():
    outline_m = wedge_m(at((1, 2, 1.5), (1, 5, 1.5)), LENS, 1.2)
    assert outline_m[0] == pytest.approx((1, 2))
    ways_m = outline_m[1:] - outline_m[0]
    assert np.linalg.norm(ways_m, axis=1) == pytest.approx(1.2)
    angles_deg = np.degrees(np.arctan2(ways_m[:, 0], ways_m[:, 1]))
    half_deg = np.degrees(np.arctan(0.795))  # 79.5 pixels at a focal length of 100
    assert angles_deg[[0, -1]] == pytest.approx([-half_deg, half_deg])
    assert np.all(np.diff(angles_deg) > 0.0)

"""Overlap of views before surfaces for which it can be worked out on paper."""

import numpy as np
import pytest

from lab.places.overlap import OverlapMeter
from lab.places.pairs import CAMERA
from lab.worlds.primitives import box
from lab.worlds.raycast import RayCaster
from lab.worlds.scene import Light, Material, Part, Scene
from lab.worlds.textures import paint
from pipeline.kernels.geometry import look_at, rigid

WIDTH_AT_1_M = 320.0 / CAMERA.fx_px


def meter(*boxes):
    """Boxes of a size at a place, as one scene."""
    gray = Material(paint(np.array([0.5, 0.5, 0.5])))
    parts = tuple(Part(*box(size), gray, rigid(np.eye(3), np.array(place))) for size, place in boxes)
    light = Light(np.zeros(3), np.ones(3), 0.1)
    return OverlapMeter(RayCaster(Scene("wall", parts, (light,), np.ones(3), (), CAMERA), 1), CAMERA)


def overlap(*others, distances_m=(2.0, 2.0), shift_m=0.0, way=1.0):
    """Overlap of two views of a wall whose face is at y = 0; the second is shifted, and looks ``way`` y."""
    tool = meter(((60.0, 0.2, 60.0), (0.0, 0.1, 0.0)), *others)
    eyes = (np.array([0.0, -distances_m[0], 0.0]), np.array([shift_m, -distances_m[1], 0.0]))
    first, second = look_at(eyes[0], eyes[0] + [0.0, 1.0, 0.0]), look_at(eyes[1], eyes[1] + [0.0, way, 0.0])
    return tool.share(first, tool.look(first), second, tool.look(second))


def test_a_view_overlaps_itself_whole():
    assert overlap() == 1.0


@pytest.mark.parametrize("moved", [0.25, 0.5, 0.8])
def test_a_shift_along_a_wall_leaves_the_other_part_of_the_width(moved):
    assert overlap(shift_m=moved * 2.0 * WIDTH_AT_1_M) == pytest.approx(1.0 - moved, abs=0.5 / 64)


def test_beyond_the_width_and_with_the_back_to_it_there_is_none():
    assert overlap(shift_m=1.02 * 2.0 * WIDTH_AT_1_M) == 0.0
    assert overlap(way=-1.0) == 0.0


def test_the_smaller_of_both_shares_counts():
    """From twice as far four times as much wall is seen, of which the nearer view sees a quarter."""
    assert overlap(distances_m=(1.0, 2.0)) == pytest.approx(0.25, abs=0.02)
    assert overlap(distances_m=(2.0, 1.0)) == pytest.approx(0.25, abs=0.02)


def test_what_the_sensor_cannot_reach_is_no_overlap():
    assert overlap(distances_m=(4.6, 2.0)) == 0.0


def test_what_stands_between_hides_the_wall():
    """A board close before the second camera hides all that both would see of the wall."""
    board = ((1.4, 0.02, 1.4), (0.5, -1.0, 0.0))
    assert overlap(board, distances_m=(0.9, 2.0), shift_m=0.5) == 0.0

"""Rulers, boxes and labels of measures, and what a scene holds of them."""

import numpy as np
import pytest

from app.compute.measures import End, Face, Made, Quantity, Taken
from app.drawing.colors import INFERRED
from app.measuring.draw import (
    INK,
    PAPER,
    MeasureDrawing,
    box_edges,
    label_place_m,
    lines_of,
    mark_m,
    ruler,
    spread_m,
)
from pipeline.kernels.geometry import rotation_exp

UP = np.array([0.0, 0.0, 1.0])
ENDS_M = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])
LENGTH = Taken("distance", "surface", ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))


def made(ends_m=ENDS_M, guessed=False, unit="m"):
    ends = tuple(End(point_m, UP, guessed) for point_m in ends_m)
    return Made((Quantity("length", 0.3, unit, 0.29, 0.31, guessed),), ends_m, ends)


@pytest.mark.parametrize(
    ("length_m", "step_m"), [(0.3, 0.05), (0.29, 0.02), (1.0, 0.1), (7.0, 1.0), (0.02, 0.002)]
)
def test_a_ruler_has_parts_of_round_lengths(length_m, step_m):
    assert mark_m(length_m) == pytest.approx(step_m)
    segments, colors = ruler(np.array([[0.0, 0.0, 0.0], [0.0, length_m, 0.0]]), INK)
    lengths_m = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    assert lengths_m[:-1] == pytest.approx(step_m, abs=1e-6)
    assert lengths_m.sum() == pytest.approx(length_m, abs=1e-6)
    np.testing.assert_array_equal(colors[::2], np.broadcast_to(np.array(INK), colors[::2].shape))
    np.testing.assert_array_equal(colors[1::2], np.broadcast_to(np.array(PAPER), colors[1::2].shape))


def test_a_ruler_follows_a_line_around_its_corners():
    line_m = np.array([[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.25, 0.35, 0.0]])
    segments, _ = ruler(line_m, INK)
    np.testing.assert_allclose(segments[1:, 0], segments[:-1, 1], atol=1e-6)
    assert np.linalg.norm(segments - line_m[1], axis=2).min() < 1e-6


@pytest.mark.parametrize("seed", range(8))
def test_a_box_has_twelve_edges_whatever_the_order_of_its_corners(seed):
    rng = np.random.default_rng(seed)
    sides_m = [rng.uniform(0.05, 2.0, 3), np.array([2.0, 1.0, 0.0015]), np.array([5.0, 1.0, 0.004])][
        max(0, seed - 5)
    ]
    unit = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
    rows = rng.permutation(8)
    corners_m = (unit * sides_m)[rows] @ rotation_exp(rng.normal(size=3)).T + rng.normal(size=3)
    edges = box_edges(corners_m)
    assert len(edges) == 12
    assert all(np.abs(unit[rows[one]] - unit[rows[other]]).sum() == 1 for one, other in edges)


def test_lines_are_lifted_off_the_surface_and_rims_are_closed():
    (line_m,) = lines_of(LENGTH, made())
    assert np.all(line_m[:, 2] > 0.0)
    np.testing.assert_array_equal(line_m[:, :2], ENDS_M[:, :2])
    rim_m = np.random.default_rng(0).normal(size=(9, 3))
    (loop_m,) = lines_of(Taken("hole", "surface", ((0.0, 0.0, 0.0),)), made(rim_m, unit="m2"))
    np.testing.assert_array_equal(loop_m[-1], loop_m[0])
    assert lines_of(LENGTH, Made(trouble="gone")) == []


def test_a_label_is_at_an_angles_corner_at_the_upper_end_of_a_line_or_in_its_middle():
    three_m = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    np.testing.assert_array_equal(label_place_m(Taken("angle", "edge", ()), [three_m]), three_m[1])
    np.testing.assert_allclose(label_place_m(LENGTH, [ENDS_M]), [0.15, 0.0, 0.0])
    steep_m = ENDS_M + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.2]])
    np.testing.assert_allclose(label_place_m(LENGTH, [steep_m]), steep_m[1])


def test_the_scene_holds_what_is_listed_and_violet_marks_a_guess(server):
    drawing = MeasureDrawing(server.scene, "/drawn/measures")
    length, guess = made(), made(guessed=True)
    face = Face(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), UP, False)
    plane = Made(length.quantities, ENDS_M, (), (face,))

    def nodes():
        found = server.scene._handle_from_node_name
        return [handle for name, handle in found.items() if name.startswith("/drawn/measures/")]

    def texts():
        return [handle.text for handle in nodes() if hasattr(handle, "text")]

    drawing.draw([(LENGTH, "Table", length), (LENGTH, "2", guess), (LENGTH, "3", plane)])
    assert texts() == ["Table: 30.0 ± 1.0 cm", "2: 30.0 ± 1.0 cm · guessed", "3: 30.0 ± 1.0 cm"]
    before = {handle.name for handle in nodes()}
    drawing.draw([(LENGTH, "Table", length), (LENGTH, "3", plane)], length.ends[:1])
    assert texts() == ["Table: 30.0 ± 1.0 cm", "3: 30.0 ± 1.0 cm"]
    assert sum(handle.name in before for handle in nodes()) == len(nodes()) - 1
    drawing.draw([(LENGTH, "Top", length)])
    assert texts() == ["Top: 30.0 ± 1.0 cm"]
    drawing.draw([])
    assert nodes() == []
    assert INFERRED != INK


def test_labels_are_lifted_in_the_picture_until_none_covers_another_one():
    view = np.array([0.0, -4.0, 0.0]), np.zeros(3)
    places_m = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.01], [0.0, 0.1, 0.02], [2.0, 0.0, 0.0]])
    lifted_m = spread_m(places_m, [20, 20, 20, 20], view, 500.0)
    np.testing.assert_allclose(lifted_m[:, :2], places_m[:, :2], atol=1e-12)
    height_px = 500.0 * lifted_m[:, 2] / (lifted_m[:, 1] + 4.0)
    assert np.all(np.diff(np.sort(height_px[:3])) > 25.0)
    assert np.all(lifted_m[:, 2] > places_m[:, 2])
    assert height_px[3] < 13.0  # far beside the others

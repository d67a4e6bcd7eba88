"""Clicks on surfaces of known lengths: the points, the numbers, and the reasons where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from app.compute.cuts import Box, Plane, Top
from app.compute.measures import Click, Clicked, MeasureRequest, Scale, Taken
from app.measuring.work import CUT_OFF, NO_HOLE, NO_PART, answer
from tests.app.measuring.surfaces import steps, towards

SURFACE = steps()
ON_TOP, ALSO_ON_TOP = (0.1, 0.1, 0.5), (0.7, 0.1, 0.5)
ON_FLOOR, ON_WALL = (-0.3, -0.3, 0.0), (0.4, 1.0, 1.0)
LENGTH = Taken("distance", "surface", (ON_TOP, ALSO_ON_TOP))


def clicked(kind, *points_m, snap="surface", surfaces=(SURFACE,), cut=None):
    clicks = tuple(replace(towards(*point_m), cut=cut) for point_m in points_m)
    return answer(surfaces, MeasureRequest((), Clicked(kind, snap), clicks))


def value(made):
    (one,) = made.quantities
    assert one.low < one.value < one.high
    return one.value


def only(answered):
    ((taken, made),) = answered.made
    assert answered.completed == (taken,)
    return made


@pytest.mark.parametrize(
    ("kind", "points_m", "true"),
    [
        ("distance", (ON_TOP, ALSO_ON_TOP), 0.6),
        ("distance", (ON_TOP, ON_FLOOR), np.sqrt(0.16 + 0.16 + 0.25)),
        ("point-plane", (ON_TOP, ON_FLOOR), 0.5),
        ("plane-plane", (ON_TOP, ON_FLOOR), 0.5),
        ("angle", (ALSO_ON_TOP, ON_TOP, (0.1, 0.7, 0.5)), 90.0),
    ],
)
def test_clicks_give_the_true_number(kind, points_m, true):
    made = only(clicked(kind, *points_m))
    assert value(made) == pytest.approx(true, abs=2e-3)
    assert made.trouble == ""
    assert not made.guessed


def test_two_planes_give_their_angle_if_clicks_snap_to_planes():
    made = only(clicked("angle", ON_TOP, ON_WALL, snap="plane"))
    assert value(made) == pytest.approx(90.0, abs=0.1)
    assert len(made.faces) == 2


def test_a_plane_is_drawn_on_its_part_of_the_surface():
    made = only(clicked("point-plane", ON_FLOOR, ON_TOP))
    (face,) = made.faces
    np.testing.assert_allclose(face.corners_m[:, 2], 0.5, atol=1e-6)
    sides_m = np.linalg.norm(face.corners_m - np.roll(face.corners_m, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides_m, 0.8, atol=0.06)


def test_points_stay_as_they_were_clicked_and_are_rounded_to_a_millimetre():
    answered = clicked("distance", (0.11111, 0.2, 0.5), (0.7, 0.2, 0.5), snap="vertex")
    (taken,) = answered.completed
    assert taken.points_m == ((0.111, 0.2, 0.5), (0.7, 0.2, 0.5))
    assert only(answered).ends[0].point_m == pytest.approx((0.12, 0.2, 0.5), abs=1e-6)


def test_the_first_click_of_two_is_a_point_that_waits():
    answered = clicked("distance", ON_TOP)
    assert (answered.made, answered.completed, answered.missed) == ((), (), "")
    assert answered.pending == Clicked("distance", "surface", (ON_TOP,))
    assert answered.ends[0].point_m == pytest.approx(ON_TOP, abs=1e-3)
    more = answer([SURFACE], MeasureRequest((), answered.pending, (towards(*ALSO_ON_TOP),)))
    assert value(only(more)) == pytest.approx(0.6, abs=1e-3)
    assert more.pending == Clicked("distance", "surface")


def test_a_click_into_the_air_is_no_point_and_the_next_one_counts():
    answered = clicked("distance", ON_TOP, (9.0, -2.0, 9.0))
    assert "no surface" in answered.missed
    assert answered.pending.points_m == (ON_TOP,)
    assert clicked("distance", (9.0, -2.0, 9.0), ON_TOP).missed == ""


def test_snapping_to_an_edge_needs_one():
    answered = clicked("distance", ON_FLOOR, snap="edge")
    assert "edge" in answered.missed
    assert answered.pending.points_m == ()


def test_a_click_without_a_hole_says_so_and_one_into_a_hole_means_it():
    assert clicked("hole", ON_TOP).missed == NO_HOLE
    away_m = np.linalg.norm(SURFACE.vertices_m - np.array([0.4, 0.4, 0.5]), axis=1)
    gone = np.isin(SURFACE.triangles, np.flatnonzero(away_m < 0.05)).any(axis=1)
    holed = replace(SURFACE, triangles=SURFACE.triangles[~gone])
    made = only(clicked("hole", (0.4, 0.4, 0.5), surfaces=(holed,)))
    assert value(made) == pytest.approx(gone.sum() * 0.5 * 0.02**2, rel=1e-6)


TABLE = Box((0.4, 0.4, 0.5), (0.9, 0.9, 0.1))


@pytest.mark.parametrize(
    "cut", [Top(0.3), replace(TABLE, inside=True), Plane((0.0, 0.0, 0.4), (0.0, 0.0, -1.0))]
)
def test_a_click_through_what_is_cut_off_meets_what_is_behind_it(cut):
    ((x_m, y_m, z_m),) = clicked("distance", ON_TOP, cut=cut).pending.points_m
    assert z_m == pytest.approx(0.0, abs=1e-3)
    assert (x_m, y_m) == pytest.approx((0.025, 0.625), abs=2e-3)  # on the same line of sight


@pytest.mark.parametrize(
    ("click", "cut"),
    [
        (towards(*ON_FLOOR), TABLE),  # behind the far side of a kept box
        (towards(*ON_FLOOR), Plane((0.0, 0.0, 0.2), (0.0, 0.0, 1.0))),
        (Click((0.1, 0.1, 0.2), (0.0, 0.0, 1.0)), Top(0.4)),  # up at a ceiling that is cut off
        (Click((0.1, 0.1, 0.7), (0.0, 0.0, 2.0)), None),
    ],
)
def test_what_is_cut_off_cannot_be_clicked(click, cut):
    request = MeasureRequest((), Clicked("distance", "surface"), (replace(click, cut=cut),))
    answered = answer([SURFACE], request)
    assert answered.pending.points_m == ()
    assert answered.missed == CUT_OFF if cut is not None else "no surface" in answered.missed


def test_a_hole_that_is_cut_off_cannot_be_clicked():
    away_m = np.linalg.norm(SURFACE.vertices_m - np.array([0.4, 0.4, 0.5]), axis=1)
    gone = np.isin(SURFACE.triangles, np.flatnonzero(away_m < 0.05)).any(axis=1)
    holed = replace(SURFACE, triangles=SURFACE.triangles[~gone])
    up = Click((0.4, 0.4, 0.1), (0.0, 0.05, 1.0))
    for cut, points in ((Top(0.6), 1), (Top(0.45), 0)):
        request = MeasureRequest((), Clicked("hole", "surface"), (replace(up, cut=cut),))
        assert len(answer([holed], request).completed) == points


def test_what_is_no_longer_on_a_surface_has_a_reason_and_no_number():
    lower = replace(SURFACE, vertices_m=SURFACE.vertices_m - np.array([0.0, 0.0, 0.4]))
    made = dict(answer([lower], MeasureRequest((LENGTH,), Clicked("hole", "surface"))).made)[LENGTH]
    assert made.quantities == ()
    assert "near" in made.trouble
    elsewhere = replace(LENGTH, part=1)
    answered = answer([SURFACE], MeasureRequest((elsewhere,), Clicked("hole", "surface")))
    assert answered.made[0][1].trouble == NO_PART


def test_of_two_surfaces_the_nearer_is_clicked_and_the_measure_stays_on_it():
    nearer = replace(SURFACE, vertices_m=SURFACE.vertices_m + np.array([0.0, 0.0, 0.1]))
    ends_m = (0.2, 0.5, 0.5), (0.6, 0.5, 0.5)
    (taken,) = clicked("distance", *ends_m, surfaces=(SURFACE, nearer)).completed
    assert taken.part == 1
    assert [point_m[2] for point_m in taken.points_m] == pytest.approx([0.6, 0.6], abs=1e-3)
    pending = Clicked("distance", "surface", (ON_TOP,), 0)
    request = MeasureRequest((), pending, (towards(*ALSO_ON_TOP),))
    assert answer([SURFACE, nearer], request).completed[0].part == 0


def test_a_true_length_checks_the_scale_or_scales_all_numbers_but_no_drawing():
    surface = steps(scale_sd=0.01)
    height = Taken("plane-plane", "surface", (ON_TOP, ON_FLOOR))
    nothing = Clicked("distance", "surface")
    checked = answer([surface], MeasureRequest((), nothing, check=Scale(height, 0.505))).checked
    assert (checked.agrees, checked.ratio) == (True, pytest.approx(1.01, abs=2e-3))
    assert not answer([surface], MeasureRequest((), nothing, check=Scale(height, 0.55))).checked.agrees
    request = MeasureRequest((LENGTH, height), nothing, scale=Scale(height, 0.55))
    answered = answer([surface], request)
    made = dict(answered.made)
    assert value(made[LENGTH]) == pytest.approx(0.66, abs=2e-3)
    (known,) = made[height].quantities
    assert (known.low, known.value, known.high) == (0.55, 0.55, 0.55)
    np.testing.assert_allclose(made[LENGTH].ends_m, [ON_TOP, ALSO_ON_TOP], atol=1e-3)
    np.testing.assert_allclose(made[height].faces[0].corners_m[:, 2], 0.5, atol=1e-3)
    assert answered.scaled.factor == pytest.approx(1.1, abs=2e-3)
    again = answer([surface], replace(request, check=Scale(LENGTH, 0.66)))
    assert again.checked.agrees


def test_an_angle_sets_no_scale_and_says_why():
    angle = Taken("angle", "surface", (ALSO_ON_TOP, ON_TOP, (0.1, 0.7, 0.5)))
    request = MeasureRequest((LENGTH,), Clicked("distance", "surface"), scale=Scale(angle, 0.5))
    answered = answer([SURFACE], request)
    assert "length" in answered.scaled.trouble
    assert value(dict(answered.made)[LENGTH]) == pytest.approx(0.6, abs=1e-3)


def test_a_guessed_end_is_marked():
    made = only(clicked("distance", ON_TOP, ALSO_ON_TOP, surfaces=(steps(guessed=True),)))
    assert made.guessed
    assert all(end.guessed for end in made.ends)

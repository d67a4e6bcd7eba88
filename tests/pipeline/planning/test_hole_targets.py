"""Targets in a hole: where they are, which way they face, and what a camera measures of them."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.planning.chances import judge
from pipeline.planning.hole_targets import SAMPLES, hole_targets
from pipeline.planning.promise import promise
from pipeline.surface.holes import find_holes
from pipeline.types import Surface
from tests.pipeline.planning.rooms import PLAIN, at, joined, place, sheet, targets_at

LOW_M, HIGH_M = 1.0, 1.2
"""Corners of the hole in x and y."""


@pytest.fixture(scope="module")
def table():
    """A level sheet of 2.4 m with a square hole; its normal is up."""
    whole = joined([sheet((0, 0, 1), (2.4, 0, 0), (0, 2.4, 0), 0.1)])
    middles_m = whole.vertices_m[whole.triangles].mean(axis=1)
    inside = np.all((middles_m[:, :2] > LOW_M) & (middles_m[:, :2] < HIGH_M), axis=1)
    return Surface(whole.vertices_m, whole.triangles[~inside], None)


def hole_of(table, rim):
    (found,) = (hole for hole in find_holes(table.vertices_m, table.triangles) if hole.rim == rim)
    return found


def seen_with(table, targets):
    seen = place([(table.vertices_m, table.triangles)], targets_at([0, 0, 0], [0, 0, 1]))
    return replace(seen, targets=targets)


def test_the_points_fill_the_hole_face_as_the_surface_does_and_share_it_evenly(table):
    targets = hole_targets(table, hole_of(table, rim=False), (), 0.05)
    points_m = targets.points_m
    assert len(points_m) >= SAMPLES
    assert np.allclose(points_m[:, 2], 1.0)
    assert np.all((points_m[:, :2] > LOW_M - 1e-9) & (points_m[:, :2] < HIGH_M + 1e-9))
    quarters = points_m[:, :2] > 0.5 * (LOW_M + HIGH_M)
    counts = np.bincount(quarters @ [1, 2], minlength=4)
    assert counts.min() > 0.15 * len(points_m)
    assert np.allclose(targets.normals, [0.0, 0.0, 1.0])
    assert targets.share * len(points_m) == pytest.approx(1.0)
    assert not targets.dark_return.any()


def test_a_camera_above_measures_the_whole_hole_one_below_nothing_and_one_aside_a_part(table):
    seen = seen_with(table, hole_targets(table, hole_of(table, rim=False), (), 0.05))
    middle = 0.5 * (LOW_M + HIGH_M)

    def share(eye_m, target_m):
        return promise(judge(seen, at(eye_m, target_m), PLAIN).chance, seen.targets).gain_share

    target_m = middle, middle, 1.0
    assert share((middle, middle + 0.01, 2.0), target_m) == pytest.approx(1.0)
    assert share((middle, middle + 0.01, 0.1), target_m) == 0.0
    aside = middle + 0.768  # half of a 1.6 m wide image, less its border
    assert 0.3 < share((aside, middle, 2.0), (aside, middle - 0.01, 1.0)) < 0.7


def test_a_rims_points_are_outside_its_edges(table):
    targets = hole_targets(table, hole_of(table, rim=True), (), 0.05)
    outside_m = np.abs(targets.points_m[:, :2] - 1.2).max(axis=1) - 1.2
    assert np.allclose(outside_m, 0.05)
    assert np.allclose(targets.points_m[:, 2], 1.0)
    assert np.allclose(targets.normals, [0.0, 0.0, 1.0])

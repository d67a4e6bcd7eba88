"""Normals that come with a cloud: how far neighbours agree, and what is done with bad ones."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.surface.given_normals import agreement, without_bad_normals
from pipeline.surface.mesh_cloud import (
    ESTIMATED_OUTWARDS,
    GIVEN,
    GIVEN_AGREEING,
    GIVEN_TURNED,
    MeshOptions,
    iterate_mesh_cloud,
    mesh_report,
)
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import sphere

BALL = sphere(2000)
RNG = np.random.default_rng(4)


def with_signs(share: float) -> PointCloud:
    """The ball with a share of its normals turned round at random."""
    signs = np.where(RNG.random(len(BALL)) < share, -1.0, 1.0)
    return replace(BALL, normals=BALL.normals * signs[:, None])


def random_normals() -> PointCloud:
    normals = RNG.normal(size=(len(BALL), 3))
    return replace(BALL, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def meshed(cloud, **options):
    return drain(iterate_mesh_cloud(cloud, MeshOptions(**options)), lambda _: None)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 1.0])
def test_the_share_of_opposite_neighbours_is_that_of_two_random_signs(share):
    cloud = with_signs(share)
    found = agreement(cloud.points_m, cloud.normals)
    assert found.opposite_share == pytest.approx(2.0 * share * (1.0 - share), abs=0.04)
    assert found.along_share > 0.99


def test_random_normals_are_along_one_axis_by_chance():
    """The cosine of random directions is uniform: half of them are within 60 degrees of one axis."""
    cloud = random_normals()
    found = agreement(cloud.points_m, cloud.normals)
    assert found.along_share == pytest.approx(0.5, abs=0.08)
    assert found.opposite_share == pytest.approx(0.5, abs=0.05)


def test_the_two_sides_of_a_sheet_do_not_disagree():
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    side = np.stack([x.ravel(), y.ravel(), np.zeros(1600)], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (1600, 1))
    points_m = np.vstack([side, side - [0.0, 0.0, 0.5]])
    assert agreement(points_m, np.vstack([up, -up])).opposite_share == 0.0


def test_flipped_normals_are_turned_to_agree_with_a_sentence(caplog):
    caplog.set_level(logging.WARNING)
    answer = meshed(with_signs(0.5))
    assert answer.normals == GIVEN_AGREEING
    report = mesh_report(answer)
    assert (report["genus"], report["components"], report["unused_points"]) == (0, 1, 0)
    assert np.all(np.sum(answer.surface.normals * answer.surface.vertices_m, axis=1) > 0)
    assert "% of neighbouring normals point against each other; they are turned to agree" in caplog.text
    assert "--viewpoint" in caplog.text


@pytest.mark.parametrize(
    ("options", "says"),
    [({"viewpoint_m": (0.0, 0.0, 0.0)}, GIVEN_TURNED), ({"estimate_normals": True}, ESTIMATED_OUTWARDS)],
)
def test_both_remedies_work_and_silence_the_warning(caplog, options, says):
    caplog.set_level(logging.WARNING)
    for cloud in (with_signs(0.5), with_signs(0.06)):
        answer = meshed(cloud, **options)
        assert answer.normals == says
        assert mesh_report(answer)["genus"] == 0
    assert not caplog.records


def test_some_flipped_normals_stay_with_a_warning(caplog):
    caplog.set_level(logging.WARNING)
    assert meshed(with_signs(0.06)).normals == GIVEN
    assert "the surface may be torn there; try --viewpoint X Y Z" in caplog.text
    assert "--estimate-normals" in caplog.text


def test_good_normals_stay_without_a_word(caplog):
    caplog.set_level(logging.WARNING)
    assert meshed(BALL).normals == GIVEN
    assert not caplog.records


def test_random_normals_are_estimated_with_a_sentence(caplog):
    caplog.set_level(logging.WARNING)
    answer = meshed(random_normals())
    assert answer.normals == ESTIMATED_OUTWARDS
    assert mesh_report(answer)["genus"] == 0
    assert "The normals of the file are not perpendicular to the surface; they are estimated" in caplog.text


@pytest.mark.parametrize("of_frame", ["constant", "axes swapped", "tangent"])
def test_normals_of_another_frame_are_estimated(caplog, of_frame):
    """Neighbours agree, so only the planes through the points show it."""
    caplog.set_level(logging.WARNING)
    up = np.array([0.0, 0.0, 1.0])
    normals = {
        "constant": np.tile(up, (len(BALL), 1)),
        "axes swapped": BALL.normals[:, [0, 2, 1]] * (1.0, -1.0, 1.0),
        "tangent": np.cross(BALL.normals, up) + 1e-9,
    }[of_frame]
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    assert agreement(BALL.points_m, normals).along_share > 0.9
    cloud = replace(BALL, normals=normals)
    answer = meshed(cloud)
    assert answer.normals == ESTIMATED_OUTWARDS
    assert mesh_report(answer)["genus"] == 0
    assert without_bad_normals(cloud, "target").normals is None
    assert "target cloud cannot be used (they are not perpendicular to the surface)" in caplog.text


def test_noise_as_large_as_the_spacing_does_not_cost_a_cloud_its_normals():
    x, y = np.meshgrid(np.arange(150.0), np.arange(150.0))
    points = np.stack([x.ravel(), y.ravel(), RNG.normal(size=x.size)], axis=1)
    assert agreement(points, np.tile([0.0, 0.0, 1.0], (len(points), 1))).axes_fit


def test_many_unknown_normals_cost_no_points(caplog):
    caplog.set_level(logging.WARNING)
    normals = BALL.normals.copy()
    normals[::3] = np.nan
    answer = meshed(replace(BALL, normals=normals))
    assert (answer.points, answer.normals) == (2000, ESTIMATED_OUTWARDS)
    assert "667 of 2000 normals of the file are zero or not finite; all are estimated" in caplog.text


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
@pytest.mark.parametrize("count", [3, 2000])
def test_unknown_normals_are_left_out_with_a_sentence(caplog, value, count):
    caplog.set_level(logging.WARNING)
    normals = BALL.normals.copy()
    normals[:count] = value
    assert without_bad_normals(replace(BALL, normals=normals), "target").normals is None
    assert f"normals of {count} of the 2000 points of the target cloud are zero or not finite" in caplog.text


def test_normals_of_a_registration_have_unit_length_or_are_left_out(caplog):
    caplog.set_level(logging.WARNING)
    scaled = without_bad_normals(replace(BALL, normals=3.0 * BALL.normals), "source")
    np.testing.assert_allclose(scaled.normals, BALL.normals)
    assert without_bad_normals(BALL, "source").normals is not None
    assert not caplog.records
    assert without_bad_normals(with_signs(0.5), "source").normals is None
    assert "normals of the source cloud cannot be used (" in caplog.text


def test_pieces_of_a_surface_whose_normals_point_to_both_sides_are_a_warning_with_a_remedy(caplog):
    halves = np.where(BALL.points_m[:, 2:] > 0.0, 1.0, -1.0)
    torn = drain(iterate_mesh_cloud(replace(BALL, normals=halves * BALL.normals), MeshOptions()))
    assert torn.surface.quality.components > 1
    assert "try --estimate-normals" in caplog.text
    caplog.clear()
    options = MeshOptions(estimate_normals=True)
    whole = drain(iterate_mesh_cloud(replace(BALL, normals=halves * BALL.normals), options))
    assert whole.surface.quality.components == 1
    assert not caplog.text

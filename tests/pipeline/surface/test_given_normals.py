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
    assert "The normals of the file disagree with their neighbours; they are estimated" in caplog.text


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
    assert "source cloud disagree with their neighbours" in caplog.text

"""From any cloud to a mesh: which points are used, which normals, which balls."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.surface.cloud_checks import doubtful_unit, usable_points, width_of
from pipeline.surface.mesh_cloud import (
    ESTIMATED_OUTWARDS,
    ESTIMATED_VIEWPOINT,
    GIVEN,
    GIVEN_TURNED,
    MeshOptions,
    chosen_radii,
    iterate_mesh_cloud,
    mesh_report,
)
from pipeline.surface.radii import spacing
from pipeline.surface.surrounding import surrounding_radii
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import lidar_room, perforated_plane, sphere, with_outliers


def meshed(cloud, **options):
    reports = []
    answer = drain(iterate_mesh_cloud(cloud, MeshOptions(**options)), reports.append)
    fractions = [report.fraction for report in reports]
    assert fractions == sorted(fractions)
    return answer


def test_points_alone_become_a_closed_surface_seen_from_outside():
    answer = meshed(PointCloud(sphere(2000).points_m))
    report = mesh_report(answer)
    assert report["normals"] == ESTIMATED_OUTWARDS
    assert (report["euler"], report["genus"], report["unused_points"]) == (2, 0, 0)
    assert (report["points"], report["vertices"], report["triangles"]) == (2000, 2000, 3996)
    a, b, c = answer.surface.vertices_m[answer.surface.triangles].swapaxes(0, 1)
    assert np.all(np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0)


def test_a_torus_has_genus_one_and_an_open_sheet_none():
    around, across = np.meshgrid(2 * np.pi * np.arange(90) / 90, 2 * np.pi * np.arange(30) / 30)
    ring = 1.0 + 0.35 * np.cos(across)
    points_m = np.stack([ring * np.cos(around), ring * np.sin(around), 0.35 * np.sin(across)], axis=-1)
    assert mesh_report(meshed(PointCloud(points_m.reshape(-1, 3)), radii_m=(0.08, 0.12)))["genus"] == 1
    assert mesh_report(meshed(perforated_plane(0.5, 0.02, 0.1)))["genus"] is None


@pytest.mark.parametrize(
    ("given", "viewpoint_m", "says", "outwards"),
    [
        (True, None, GIVEN, True),
        (True, (0.0, 0.0, 0.0), GIVEN_TURNED, False),
        (False, (0.0, 0.0, 0.0), ESTIMATED_VIEWPOINT, False),
        (False, None, ESTIMATED_OUTWARDS, True),
    ],
)
def test_the_side_of_the_normals(given, viewpoint_m, says, outwards):
    cloud = sphere(1500) if given else PointCloud(sphere(1500).points_m)
    answer = meshed(cloud, viewpoint_m=viewpoint_m, radii_m=(0.15,))
    assert answer.normals == says
    sides = np.sum(answer.surface.normals * answer.surface.vertices_m, axis=1)
    assert np.all(sides > 0 if outwards else sides < 0)


def test_every_point_is_used_unless_thinning_is_asked_for():
    cloud = sphere(6000)
    assert len(meshed(cloud).surface.vertices_m) == 6000
    thin = meshed(cloud, max_points=1000)
    assert thin.points == pytest.approx(1000, rel=0.1)
    assert mesh_report(thin)["genus"] == 0
    assert meshed(cloud, max_points=6000).points == 6000


def test_vertices_stay_where_the_points_were_unless_smoothing_is_asked_for():
    noise = np.random.default_rng(0).normal(scale=0.01, size=(3000, 1))
    cloud = sphere(3000)
    cloud = replace(cloud, points_m=cloud.points_m + noise * cloud.normals)
    rough, smooth = (meshed(cloud, smoothing_passes=passes, radii_m=(0.12,)) for passes in (0, 2))
    assert {tuple(v) for v in rough.surface.vertices_m} <= {tuple(p) for p in cloud.points_m}
    spread_m = [np.std(np.linalg.norm(m.surface.vertices_m, axis=1)) for m in (rough, smooth)]
    assert spread_m[1] < 0.7 * spread_m[0]


def test_colours_stay_with_their_points():
    cloud = perforated_plane(0.4, 0.02, 0.1)
    surface = meshed(cloud).surface
    row = {tuple(point): tuple(color) for point, color in zip(cloud.points_m, cloud.colors, strict=True)}
    assert [row[tuple(v)] for v in surface.vertices_m] == [tuple(color) for color in surface.colors]


def test_repeated_points_are_left_out_the_first_of_them_stays(caplog):
    cloud = perforated_plane(0.2, 0.02, 0.0)
    again = replace(cloud.select(np.arange(40)), colors=np.full((40, 3), 9, np.uint8))
    caplog.set_level(logging.WARNING)
    kept = usable_points(PointCloud.concatenate([cloud, again]))
    np.testing.assert_array_equal(kept.points_m, cloud.points_m)
    np.testing.assert_array_equal(kept.colors, cloud.colors)
    assert "40 repeated points are left out" in caplog.text


def test_normals_are_made_unit_and_points_without_one_left_out(caplog):
    cloud = sphere(500)
    normals = 3.0 * cloud.normals
    normals[:5], normals[5:8] = 0.0, np.nan
    kept = usable_points(replace(cloud, normals=normals))
    np.testing.assert_allclose(kept.normals, cloud.normals[8:])
    assert "8 points are left out: their normals are zero" in caplog.text


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_file_whose_normals_say_nothing_counts_as_one_without(caplog, value):
    answer = meshed(replace(sphere(1500), normals=np.full((1500, 3), value)))
    assert answer.normals == ESTIMATED_OUTWARDS
    assert mesh_report(answer)["genus"] == 0
    assert "estimated from the points" in caplog.text


def test_radii_come_from_the_points_and_none_is_larger_than_the_cloud():
    plane = perforated_plane(0.5, 0.02, 0.0)
    chosen_m = chosen_radii(plane, None)
    assert chosen_m == surrounding_radii(plane.points_m, plane.normals)
    assert 0.018 < chosen_m[0] < chosen_m[-1] < 0.025
    assert chosen_radii(plane, (0.2, 0.1)) == (0.1, 0.2)
    lonely_m = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [1.0, 0.0, 0.0]])
    lonely = PointCloud(lonely_m, normals=np.tile([0.0, 0.0, 1.0], (4, 1)))
    r_F_m, sigma_D_m = spacing(lonely_m)
    assert max(chosen_radii(lonely, None)) <= np.sqrt(1.0 + 0.01**2) < r_F_m + 4.0 * sigma_D_m


def test_outliers_stay_unused_and_do_not_spoil_the_surface():
    report = mesh_report(meshed(with_outliers(PointCloud(sphere(4000).points_m), 0.05)))
    assert report["area_m2"] == pytest.approx(4.0 * np.pi, rel=0.02)
    assert (report["components"], report["genus"]) == (1, 0)
    assert 190 < report["unused_points"] <= 200  # a few lie on the sphere


def test_the_rings_of_a_lidar_become_one_surface():
    room = lidar_room(32, 0.005)
    seen_m2 = 126.0  # what lies between its lowest and highest ring
    surface = meshed(PointCloud(room.points_m)).surface
    assert surface.quality.area_m2 > 0.8 * seen_m2
    assert surface.quality.components < 10


def test_a_cloud_as_large_as_a_town_is_named_with_what_to_try_and_millimetres_are_turned_into_metres(caplog):
    caplog.set_level(logging.WARNING)
    small = mesh_report(meshed(PointCloud(sphere(800).points_m)))
    assert "millimetres" not in caplog.text
    assert small["unit_doubt"] is None
    assert small["width_m"] == pytest.approx(2.0, rel=0.03)
    large = PointCloud(1000.0 * sphere(800).points_m)
    doubt = mesh_report(meshed(large))["unit_doubt"]
    assert (
        doubt == "The cloud is 1.96e+03 m wide; if its numbers are millimetres, try --metres-per-unit 0.001"
    )
    assert doubt in caplog.text
    again = mesh_report(meshed(large, metres_per_unit=0.001))
    assert again["area_m2"] == pytest.approx(small["area_m2"])
    assert again["unit_doubt"] is None
    tiny = mesh_report(meshed(PointCloud(0.01 * sphere(800).points_m)))
    assert "0.0196 m wide; if it is wider in truth" in tiny["unit_doubt"]
    with_stray = np.vstack([sphere(800).points_m, [[500.0, 0.0, 0.0]]])
    assert doubtful_unit(width_of(PointCloud(with_stray)), 1.0) is None  # one outlier is no town
    with pytest.raises(InputError, match=r"0 metres in a unit.*try 0\.001"):
        MeshOptions(metres_per_unit=0.0)


def test_a_ball_larger_than_the_cloud_is_refused_with_a_radius_to_try():
    with pytest.raises(
        InputError, match=r"radius 50 m is larger than the cloud, which is 0\.7\d* m across; try about 0\.0"
    ):
        meshed(perforated_plane(0.5, 0.02, 0.0), radii_m=(0.02, 50.0))


@pytest.mark.parametrize(
    ("points_m", "says"),
    [
        (np.zeros((1, 3)), "in one place"),
        (1e-200 * sphere(50).points_m, "in one place"),
        (1e200 * sphere(50).points_m, "has a coordinate of 9.9.*e\\+199 m; check its file"),
        (np.vstack([sphere(50).points_m, [[0.0, 1e30, 0.0]]]), r"a coordinate of 1e\+30 m"),
        (np.ones((500, 3)), "in one place"),
        (np.eye(3)[[0, 1, 0, 1, 0]], "2 distinct points; a surface needs at least 3"),
        (np.outer(np.arange(400.0), [0.1, 0.2, 0.3]), "The 400 points of the cloud lie on one line"),
        (np.outer(np.arange(9.0), [1.0, 0.0, 0.0]) + 1e5, "The 9 points of the cloud lie on one line"),
        (np.outer(np.arange(99), [0.1, 0.7, 0.3]).astype(np.float32), "lie on one line"),
    ],
)
def test_points_that_span_nothing_are_refused(points_m, says):
    with pytest.raises(InputError, match=says):
        meshed(PointCloud(np.asarray(points_m, dtype=np.float64)))


@pytest.mark.parametrize("with_normals", [True, False])
@pytest.mark.parametrize("viewpoint_m", [None, (4e5, 5e6, 300.0)])
def test_a_cloud_far_away_has_the_mesh_of_the_same_cloud_at_the_origin(with_normals, viewpoint_m):
    far_m = np.array([4e5, 5e6, 300.0])
    near = sphere(2000) if with_normals else PointCloud(sphere(2000).points_m)
    near_view_m = None if viewpoint_m is None else (0.0, 0.0, 0.0)
    there = meshed(replace(near, points_m=near.points_m + far_m), viewpoint_m=viewpoint_m)
    here = meshed(near, viewpoint_m=near_view_m)
    np.testing.assert_array_equal(there.surface.triangles, here.surface.triangles)
    np.testing.assert_allclose(there.surface.vertices_m - far_m, here.surface.vertices_m, atol=1e-8)
    assert there.normals == here.normals


def test_tiny_balls_where_floats_are_coarse_are_refused():
    """1 mm of a surface at 900 m, where floats are 0.06 mm apart."""
    tiny = PointCloud(1e-3 * sphere(2000).points_m + np.array([900.0, 0.0, 0.0]))
    with pytest.raises(InputError, match=r"is 900 m from the origin.* 6\.1e-05 m apart; try to move it"):
        meshed(tiny)
    assert mesh_report(meshed(PointCloud(sphere(2000).points_m + 1000.0)))["genus"] == 0


def test_points_of_a_line_and_one_beside_it_are_a_surface():
    fan = np.vstack([np.outer(np.arange(5.0), [0.01, 0.0, 0.0]), [[0.02, 0.03, 0.0]]])
    assert len(meshed(PointCloud(fan), radii_m=(0.05,)).surface.triangles) >= 1


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"radii_m": (0.1, 0.0)}, "A ball radius is 0.0 m"),
        ({"radii_m": (-0.1,)}, "A ball radius is -0.1 m"),
        ({"radii_m": (float("nan"),)}, "A ball radius is nan m"),
        ({"radii_m": (float("inf"),)}, "A ball radius is inf m"),
        ({"viewpoint_m": (0.0, float("nan"), 0.0)}, "three finite numbers"),
        ({"max_points": 2}, "At most 2 points make no surface"),
        ({"smoothing_passes": -1}, "There cannot be -1 smoothing passes"),
    ],
)
def test_options_that_cannot_be_are_refused(options, says):
    with pytest.raises(InputError, match=says):
        MeshOptions(**options)


def test_a_grid_of_heights_with_whole_coordinates_is_meshed_in_its_place(caplog):
    """Its coordinates are exact 32-bit numbers, 0.5 m apart so far from the origin."""
    caplog.set_level(logging.WARNING)
    x, y = np.meshgrid(np.arange(30.0), np.arange(40.0))
    points_m = np.stack([5e5 + x.ravel(), 5.4e6 + y.ravel(), 200.0 + 0.1 * x.ravel()], axis=1)
    surface = meshed(PointCloud(points_m)).surface
    assert len(surface.triangles) == 2 * 29 * 39
    np.testing.assert_allclose(surface.vertices_m[:, 1].min(), 5.4e6)
    assert "rounded to them" not in caplog.text


def test_a_cloud_that_was_rounded_to_floats_far_away_is_named(caplog):
    points_m = sphere(3000).points_m + np.array([5e5, 5.4e6, 0.0])
    meshed(PointCloud(points_m.astype(np.float32).astype(np.float64)))
    assert "32-bit numbers are 0.5 m apart, and its positions are rounded to them" in caplog.text


def test_a_stray_point_moves_nothing():
    cloud = sphere(1500)
    stray = PointCloud(np.vstack([cloud.points_m, [1e7, 0.0, 0.0]]))
    assert len(meshed(stray).surface.triangles) == 2 * 1500 - 4

"""What rays meet, and what cameras know of a place: closed forms."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at
from pipeline.kernels.rays import Camera
from pipeline.surface.quality import measure_quality
from pipeline.surface.ray_parts import View, known_there, ray_parts
from pipeline.types import CameraIntrinsics, PointSource, SurfaceResult
from tests.pipeline.surface.shapes import rectangle

INTRINSICS = CameraIntrinsics.pinhole(100.0, 100.0, 79.5, 59.5, 160, 120)
DOWN = look_at(np.array([0.0, 0.0, 2.0]), np.zeros(3), up=np.array([0.0, 1.0, 0.0]))
CAMERA = Camera(INTRINSICS, DOWN)
ALL = np.ones((120, 160), dtype=bool)
COLUMN = np.broadcast_to(np.arange(160), (120, 160))
ROW = np.broadcast_to(np.arange(120)[:, None], (120, 160))


def surface_of(*meshes, source=None):
    vertices_m = np.concatenate([mesh[0] for mesh in meshes])
    firsts = np.cumsum([0] + [len(mesh[0]) for mesh in meshes[:-1]])
    triangles = np.concatenate([mesh[1] + first for mesh, first in zip(meshes, firsts, strict=True)])
    quality = measure_quality(vertices_m, triangles, [], len(vertices_m))
    return SurfaceResult(vertices_m, triangles, None, (0.05,), quality=quality, source=source)


def half_plane(column_px):
    """The plane z = 0 under the pixels left of a column."""
    return rectangle((-50.0, (column_px - INTRINSICS.cx_px) / 100.0 * 2.0), (-50.0, 50.0))


def test_each_pixel_counts_where_it_belongs():
    """Columns 0-39 meet sensor triangles, 40-79 inferred ones; the rest miss and are known by thirds."""
    sensor_part, inferred_part = half_plane(39.5), rectangle((-0.8, 0.0), (-50.0, 50.0))
    source = np.repeat([PointSource.SENSOR, PointSource.INFERRED], 4).astype(np.uint8)
    view = View(CAMERA, (COLUMN >= 90) & (ROW < 30), COLUMN >= 140)
    parts = ray_parts(surface_of(sensor_part, inferred_part, source=source), [view])
    assert parts.on_sensor == pytest.approx(40 / 160)
    assert parts.on_inferred == pytest.approx(40 / 160)
    assert parts.missed_measured == pytest.approx(70 * 30 / (160 * 120))
    assert parts.missed_inferred == pytest.approx(20 * 90 / (160 * 120))
    assert sum(astuple(parts)) == pytest.approx(1.0)


@pytest.mark.parametrize(("inferred", "share"), [(0, 0.0), (1, 0.0), (2, 1.0), (3, 1.0)])
def test_most_of_a_triangles_corners_decide(inferred, share):
    big = np.array([[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [0.0, 50.0, 0.0]]), np.array([[0, 1, 2]])
    source = (np.arange(3) < inferred).astype(np.uint8)
    parts = ray_parts(surface_of(big, source=source), [View(CAMERA, ALL, None)])
    assert (parts.on_sensor, parts.on_inferred) == (1.0 - share, share)


def test_without_a_source_all_is_the_sensors():
    parts = ray_parts(surface_of(half_plane(79.5)), [View(CAMERA, ~ALL, ~ALL)])
    assert astuple(parts) == (0.5, 0.0, 0.0, 0.0, 0.5)


def test_rays_of_all_views_count_and_the_misses_are_the_headline():
    """As many miss as the quality says."""
    surface = surface_of(half_plane(100.5))
    small = Camera(CameraIntrinsics.pinhole(50.0, 50.0, 39.5, 29.5, 80, 60), DOWN)
    views = [View(CAMERA, ALL, None), View(small, np.zeros((60, 80), bool), np.ones((60, 80), bool))]
    parts = ray_parts(surface, views)
    quality = measure_quality(surface.vertices_m, surface.triangles, [CAMERA, small], 4)
    missed = parts.missed_measured + parts.missed_inferred + parts.missed_unknown
    assert missed == pytest.approx(quality.no_hit_ray_share)
    assert sum(astuple(parts)) == pytest.approx(1.0)
    assert parts.missed_measured == pytest.approx(4 * parts.missed_inferred, rel=0.02)


def test_a_surface_without_triangles_is_missed_by_all():
    nothing = replace(surface_of(half_plane(0.0)), triangles=np.empty((0, 3), np.int32))
    assert astuple(ray_parts(nothing, [View(CAMERA, ALL, None)])) == (0.0, 0.0, 1.0, 0.0, 0.0)


def test_without_views_nothing_is_known():
    surface = surface_of(half_plane(79.5))
    assert np.isnan(astuple(ray_parts(surface, []))).all()
    assert np.isnan(astuple(known_there(np.zeros((3, 3)), surface, [], 0.1))).all()


def test_a_mask_of_another_size_gets_its_sentence():
    for view in (View(CAMERA, ALL[:, :80], None), View(CAMERA, ALL, ALL.T)):
        with pytest.raises(InputError, match=r"shape \(\d+, \d+\) and the camera's image \(120, 160\)"):
            ray_parts(surface_of(half_plane(79.5)), [view])


def test_places_are_outside_hidden_or_seen():
    """One place of four each: outside, behind a lid, in front of the ground, and with nothing behind."""
    ground, lid = rectangle((-1.0, 0.5), (-50.0, 50.0)), rectangle((-0.4, 0.1), (-0.2, 0.2), z_m=1.0)
    places_m = np.array([[9.0, 0.0, 0.0], [0.0, 0.0, 0.5], [-0.6, 0.5, 0.5], [1.0, 0.0, 0.2]])
    known = known_there(places_m, surface_of(ground, lid), [View(CAMERA, COLUMN < 80, ALL)], 0.1)
    assert (known.outside_share, known.hidden_share, known.past_share) == (0.25, 0.25, 0.25)
    assert (known.sensor_share, known.inferred_share, known.unknown_share) == (0.5, 0.5, 0.0)


def test_a_place_that_one_camera_sees_is_neither_outside_nor_hidden():
    lid = rectangle((-0.4, 0.4), (-0.4, 0.4), z_m=1.0)
    places_m = np.zeros((1, 3))
    up = look_at(np.array([0.0, 0.0, -2.0]), np.zeros(3), up=np.array([0.0, 1.0, 0.0]))
    views = [View(CAMERA, ALL, None), View(Camera(INTRINSICS, up), ~ALL, None)]
    one, both = (known_there(places_m, surface_of(lid), views[:n], 0.1) for n in (1, 2))
    assert (one.hidden_share, both.hidden_share, both.outside_share) == (1.0, 0.0, 0.0)
    assert np.isnan(one.sensor_share)
    assert (both.sensor_share, both.unknown_share) == (0.0, 1.0)


def test_what_the_surface_does_within_the_slack_does_not_count():
    surface = surface_of(rectangle((-50.0, 50.0), (-50.0, 50.0)))
    for height_m, hidden, past in ((-0.2, 1.0, 0.0), (-0.05, 0.0, 0.0), (0.05, 0.0, 0.0), (0.2, 0.0, 1.0)):
        known = known_there(np.array([[0.0, 0.0, height_m]]), surface, [View(CAMERA, ALL, None)], 0.1)
        assert (known.hidden_share, known.past_share) == (hidden, past)


def test_a_place_behind_the_camera_is_outside():
    known = known_there(
        np.array([[0.0, 0.0, 3.0]]), surface_of(half_plane(79.5)), [View(CAMERA, ALL, None)], 0.1
    )
    assert known.outside_share == 1.0


def test_distortion_does_not_fold_far_places_into_the_image():
    """With k1 < 0 the radius r (1 + k1 r^2) comes back to 0 at r = 1 / sqrt(-k1)."""
    folding = CameraIntrinsics(INTRINSICS.matrix, np.array([-0.25, 0.0, 0.0, 0.0, 0.0]), 160, 120)
    near_m, far_m = np.array([[0.2, 0.0, 0.0]]), np.array([[3.9, 0.0, 0.0]])
    surface = surface_of(half_plane(79.5))
    views = [View(Camera(folding, DOWN), ALL, None)]
    assert known_there(near_m, surface, views, 0.1).outside_share == 0.0
    assert known_there(far_m, surface, views, 0.1).outside_share == 1.0

"""What the present cameras know, in a reconstructed room and where it is known on paper."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, inverse, project
from pipeline.kernels.rays import Camera
from pipeline.planning.promise import measured_share
from pipeline.planning.seen import seen_place
from pipeline.planning.space import BEFORE_M, STANDS_FREE_M, free_space
from pipeline.planning.views import Meets, depth_at
from tests.pipeline.planning.rooms import LENS, at, place, sheet, targets_at

WALL = sheet((-3, 2, 0), (6, 0, 0), (0, 0, 2), 0.5)


def test_every_unmeasured_ray_with_a_depth_is_a_target(office):
    targets, views = office.seen.targets, office.seen.views
    wanted = sum(
        int((np.isin(view.meets, (Meets.GUESSED, Meets.NOTHING)) & (view.z_m > 0)).sum()) for view in views
    )
    rays = sum(view.meets.size for view in views)
    assert len(targets.points_m) * targets.share == pytest.approx(wanted / rays, rel=0.1)


def test_a_target_is_on_its_own_ray_and_its_normal_looks_back(office):
    targets, met = office.seen.targets, set()
    for row, view in enumerate(office.seen.views):
        mine = targets.view == row
        in_camera_m = apply(inverse(view.camera.T_world_camera), targets.points_m[mine])
        pixels = project(view.camera.intrinsics, in_camera_m)
        assert np.abs(pixels - np.rint(pixels)).max() < 1e-6
        ways_m = targets.points_m[mine] - view.camera.T_world_camera[:3, 3]
        assert np.all(np.sum(ways_m * targets.normals[mine], axis=1) <= 1e-9)
        u, v = np.rint(pixels).astype(int).T
        met |= set(view.meets[v, u].tolist())
    assert met == {Meets.GUESSED, Meets.NOTHING}


def test_the_measured_share_is_that_of_the_surfaces_quality(office):
    cameras = [view.camera for view in office.seen.views]
    assert office.seen.measured_share == pytest.approx(measured_share(office.done, cameras), abs=0.002)


def test_the_angle_to_the_nearest_depth_is_that_to_the_nearest_of_all_pixels(office):
    view, node = office.seen.views[0], office.done.nodes[0]
    valid = node.frame.depth.valid
    depth_px = np.argwhere(valid)
    without_px = np.argwhere(~valid)[:: np.count_nonzero(~valid) // 20]
    nearest_px = np.linalg.norm(without_px[:, None] - depth_px, axis=2).min(axis=1)
    assert view.apart_rad[tuple(without_px.T)] * view.camera.intrinsics.fx_px == pytest.approx(
        nearest_px, rel=1e-4
    )
    assert not view.apart_rad[valid].any()


def test_without_a_triangle_no_place_can_be_judged(office):
    after = office.done.after
    nothing = replace(office.done, after=replace(after, triangles=after.triangles[:0]))
    with pytest.raises(InputError, match="has no surface, so no place for a camera can be judged"):
        seen_place(nothing)


def test_the_depth_at_a_pixel_is_that_of_the_wall():
    camera = Camera(LENS, at((0, 0, 1), (0, 1, 1)))
    view = place([WALL], targets_at([(0, 2, 1)], (0, -1, 0)), cameras=[camera.T_world_camera]).views[0]
    points_m = np.array([(0.3, 1.5, 1.2), (0.0, 5.0, 1.0), (0.0, -1.0, 1.0), (4.0, 1.0, 1.0)])
    depth_m, wall_m = depth_at(points_m, camera, view.z_m)
    assert depth_m == pytest.approx([1.5, 5.0, -1.0, 1.0])
    assert wall_m == pytest.approx([2.0, 2.0, np.nan, np.nan], nan_ok=True)


def test_free_space_ends_at_the_wall_and_at_the_edge_of_the_view():
    seen = place([WALL], targets_at([(0, 2, 1)], (0, -1, 0)), cameras=[at((0, 0, 1), (0, 1, 1))])
    space = free_space(seen.surface.vertices_m, seen.views)
    before_m, cell_m = 2.0 - BEFORE_M, 0.1
    ahead = [(0.0, before_m - cell_m, 1.0), (0.0, 2.0 + cell_m, 1.0)]
    assert space.is_free(np.array(ahead)).tolist() == [True, False]
    edge = [(0.8 * 1.4 - cell_m, 1.4, 1.0), (0.8 * 1.4 + 2 * cell_m, 1.4, 1.0)]
    assert space.is_free(np.array(edge)).tolist() == [True, False]
    around = [(0.0, -STANDS_FREE_M + cell_m, 1.0), (0.0, -STANDS_FREE_M - cell_m, 1.0), (99.0, 0.0, 0.0)]
    assert space.is_free(np.array(around)).tolist() == [True, False, False]

"""Tiles that another camera's tiles replace: walls of which the right answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.acquisition import depth_sigma_m
from pipeline.delivery import tiled
from pipeline.delivery.base_points import BaseView, block_centers, surface_at
from pipeline.delivery.coding import Images
from pipeline.delivery.left_out import base_view, pixels_of, tile_bytes, whole_tiles, without_tiles
from pipeline.delivery.shared_views import STRICT, request_bytes, shared_views
from pipeline.types import CameraIntrinsics, DepthNoise

CAMERA = CameraIntrinsics.pinhole(260.0, 260.0, 159.5, 127.5, 320, 256)
BLOCKS, TILES = (32, 40), (8, 10)
WALL_M = 2.0


def pose(x_m: float = 0.0, z_m: float = 0.0, yaw_rad: float = 0.0) -> np.ndarray:
    """A camera at (x, 0, z), turned about y."""
    T = np.eye(4)
    T[:3, :3] = [
        [np.cos(yaw_rad), 0, np.sin(yaw_rad)],
        [0, 1, 0],
        [-np.sin(yaw_rad), 0, np.cos(yaw_rad)],
    ]
    T[:3, 3] = (x_m, 0.0, z_m)
    return T


def wall(T: np.ndarray, box: tuple[float, float, float] | None = None, camera=CAMERA) -> BaseView:
    """The plane z = ``WALL_M``, before it a board from x = ``box[0]`` to ``box[1]`` at z = ``box[2]``."""
    u, v = np.meshgrid(block_centers(camera.width_px), block_centers(camera.height_px))
    rays = np.stack(
        [(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, np.ones_like(u)], axis=-1
    )
    ways = rays @ T[:3, :3].T
    z_m = (WALL_M - T[2, 3]) / ways[..., 2]
    if box is not None:
        nearer_m = (box[2] - T[2, 3]) / ways[..., 2]
        x_m = T[0, 3] + nearer_m * ways[..., 0]
        z_m = np.where((x_m >= box[0]) & (x_m <= box[1]), nearer_m, z_m)
    return BaseView(z_m, camera, T)


def left_out(*views: BaseView, **limits: float) -> list[np.ndarray]:
    return list(shared_views(views, limits=replace(STRICT, **limits)).leave_out)


def test_of_two_cameras_at_one_place_the_second_sends_nothing_but_its_rim():
    first, second = left_out(wall(pose()), wall(pose()))
    assert not first.any()
    assert second.all()


def test_beside_the_first_a_camera_sends_the_part_of_the_wall_that_only_it_sees():
    # 0.41 m at 2 m and 260 px are 53.3 px: block 6 of 8 px is the first whole one outside, in tile 8 of 10.
    first, second = left_out(wall(pose()), wall(pose(x_m=0.41)))
    assert not first.any()
    expected = np.zeros(TILES, bool)
    expected[:, :8] = True
    np.testing.assert_array_equal(second, expected)


def test_the_order_names_the_camera_that_sends_all():
    views = [wall(pose()), wall(pose(x_m=0.41))]
    first, second = shared_views(views, order=[1, 0], limits=STRICT).leave_out
    assert not second.any()
    np.testing.assert_array_equal(first[:, 2:], np.ones((8, 8), bool))
    assert not first[:, :2].any()


def test_what_the_first_camera_cannot_see_behind_a_board_is_sent():
    board = (-0.2, 0.2, 1.0)
    views = [wall(pose(), board), wall(pose(x_m=0.6), board)]
    second = left_out(*views)[1]
    # The first camera's shadow on the wall is x in [-0.4, 0.4].
    u = block_centers(CAMERA.width_px)
    x_m = 0.6 + WALL_M * (u - CAMERA.cx_px) / CAMERA.fx_px
    on_wall = views[1].z_m[0] > 1.5
    hidden = (np.abs(x_m) < 0.4) & on_wall
    assert hidden.any()
    tiles = hidden.reshape(-1, 4).any(axis=1)
    assert not second[:, tiles].any()
    assert second.any()


def test_tiles_at_a_depth_edge_are_sent_though_both_cameras_see_the_same():
    board = (-0.2, 0.3, 1.5)
    view = wall(pose(), board)
    second = left_out(view, view)[1]
    edge = np.abs(np.diff(view.z_m[0])) > 0.05
    edge = np.append(edge, False) | np.insert(edge, 0, False)
    np.testing.assert_array_equal(second, np.tile(~edge.reshape(-1, 4).any(axis=1), (8, 1)))


@pytest.mark.parametrize(("distance", "same"), [(0.9, True), (1.1, False)])
def test_the_noise_law_decides_whether_two_surfaces_are_one(distance, same):
    sigmas = 2.0
    off_m = distance * sigmas * np.sqrt(2.0) * depth_sigma_m(WALL_M)
    view = wall(pose())
    farther = replace(view, z_m=view.z_m + off_m)
    second = left_out(view, farther, sigmas=sigmas, least_share=0.1)[1]
    assert second.all() == same
    assert second.any() == same
    assert shared_views((view, farther)).leave_out[1].all() == same  # the default is two as well


def test_a_sensor_with_less_noise_is_judged_by_its_own_law():
    view = replace(wall(pose()), noise=DepthNoise(1e-4, 1e-5, 1.0, 0.0))
    assert left_out(view, replace(view, z_m=view.z_m + 1e-4))[1].all()
    assert not left_out(view, replace(view, z_m=view.z_m + 1e-3))[1].any()


def test_one_base_point_off_the_wall_keeps_its_tile():
    view = wall(pose())
    z_m = view.z_m.copy()
    z_m[13, 22] -= 0.04
    second = left_out(view, replace(view, z_m=z_m))[1]
    assert not second[3, 5]
    assert second.sum() >= second.size - 4


@pytest.mark.parametrize(("z_m", "shared"), [(0.5, True), (-0.5, False)])
def test_a_camera_farther_away_does_not_replace_a_nearer_one(z_m, shared):
    """Points per area grow with the inverse square of the distance: 1.78 times as many, or .64 as many."""
    first, second = left_out(wall(pose(z_m=z_m)), wall(pose()), least_share=0.9)
    assert second[3:5, 4:6].all() == shared
    assert first.any() != shared  # the farther camera is replaced by the nearer one


def test_a_grazing_view_does_not_replace_a_frontal_one():
    turned = pose(x_m=-3.4, yaw_rad=np.radians(60.0))
    front = wall(pose())
    assert not left_out(wall(turned), front, sigmas=50.0)[1].any()


def test_a_tile_that_replaces_another_is_sent():
    views = [wall(pose(x_m=x_m)) for x_m in (0.0, 0.2, 0.4, 0.6)]
    masks = left_out(*views)
    assert sum(int(mask.sum()) for mask in masks) > 100
    for index, view in enumerate(views):
        x_m = view.T_world_camera[0, 3] + WALL_M * (block_centers(320) - CAMERA.cx_px) / CAMERA.fx_px
        for row, column in np.argwhere(masks[index]):
            middle_m = x_m[4 * column : 4 * column + 4].mean()
            sees = False
            for other, mask in zip(views, masks, strict=True):
                u = CAMERA.cx_px + CAMERA.fx_px * (middle_m - other.T_world_camera[0, 3]) / WALL_M
                sees |= bool(0 <= u < 320 and not mask[row, int(u // 32)])
            assert sees


def test_a_camera_that_looks_away_or_measures_nothing_replaces_nothing():
    view, behind = wall(pose()), wall(pose())
    away = replace(behind, T_world_camera=pose(yaw_rad=np.pi))
    nothing = replace(view, z_m=np.full(BLOCKS, np.nan))
    for other in (away, nothing):
        assert not any(mask.any() for mask in left_out(other, view))
    assert request_bytes(shared_views([nothing, nothing]).leave_out) == (0, 0)


def test_tiles_with_missing_blocks_are_sent_unless_the_limits_allow_them():
    view = wall(pose())
    z_m = view.z_m.copy()
    z_m[12:14, 20] = np.nan
    holed = replace(view, z_m=z_m)
    assert not left_out(view, holed, missing_blocks=1)[1][3, 5]
    assert left_out(view, holed, missing_blocks=2)[1][3, 5]


def test_a_share_of_the_points_and_some_edges_suffice_if_the_limits_allow_them():
    view = wall(pose())
    z_m = view.z_m.copy()
    z_m[12, 20:22] = 1.0
    odd = replace(view, z_m=z_m)
    assert not left_out(view, odd, edge_blocks=16)[1][3, 5]
    assert left_out(view, odd, edge_blocks=16, shared=0.5)[1][3, 5]
    assert not left_out(view, odd, shared=0.5)[1][3, 5]


def test_no_camera_and_one_camera():
    assert shared_views([]).leave_out == ()
    assert not left_out(wall(pose()))[0].any()


def test_the_request_takes_a_bit_a_tile():
    assert request_bytes(shared_views([wall(pose())] * 2).leave_out) == (0, 10)


def test_sizes_at_which_tiles_and_blocks_are_cut_off():
    camera = CameraIntrinsics.pinhole(60.0, 60.0, 41.0, 26.0, 83, 53)
    second = left_out(*[wall(pose(), camera=camera)] * 2)[1]
    assert second.shape == (2, 3)


def test_wrong_sizes_and_orders_are_refused():
    view = wall(pose())
    with pytest.raises(InputError, match=r"camera 1 has the shape \(31, 40\)"):
        shared_views([view, replace(view, z_m=view.z_m[:-1])])
    with pytest.raises(InputError, match="does not name each of 2 cameras"):
        shared_views([view, view], order=[0, 0])


def test_between_blocks_a_slanted_plane_is_exact():
    view = wall(pose(yaw_rad=0.4))
    pixels = np.array([[20.3, 40.0], [160.0, 100.9], [300.0, 200.0]])
    rays = np.column_stack([(pixels - (CAMERA.cx_px, CAMERA.cy_px)) / CAMERA.fx_px, np.ones(3)])
    true_m = WALL_M / (rays @ view.T_world_camera[:3, :3].T)[:, 2]
    np.testing.assert_allclose(surface_at(view, pixels).z_m, true_m, rtol=1e-12)
    outside = surface_at(view, np.array([[-1.0, 50.0], [np.nan, 0.0]])).z_m
    assert np.isnan(outside).all()


def images(seed: int = 0) -> Images:
    rng = np.random.default_rng(seed)
    depth = np.full((96, 160), 1500, np.uint16) + rng.integers(0, 5, (96, 160)).astype(np.uint16)
    depth[:32, 32:64] = 0
    return Images(rng.integers(0, 256, (96, 160, 3)).astype(np.uint8), depth)


def test_the_sink_has_the_base_layer_in_tiles_that_are_left_out():
    sent, mask = images(), np.zeros((3, 5), bool)
    mask[2, :4] = True
    received = without_tiles(sent, mask, color_side_px=64)
    missing = pixels_of(mask, (96, 160), 32)
    assert not received.depth[missing].any()
    np.testing.assert_array_equal(received.depth[~missing], sent.depth[~missing])
    np.testing.assert_allclose(received.coarse[missing], 1502, atol=2)
    assert not received.coarse[~missing].any()
    # Of the colour tiles of 64 pixels, the last row has only the lower half in the image.
    gone = np.zeros((96, 160), bool)
    gone[64:, :128] = True
    np.testing.assert_array_equal(received.rgb[~gone], sent.rgb[~gone])
    assert not np.array_equal(received.rgb[gone], sent.rgb[gone])
    assert received.rgb_known.all()


def test_bytes_are_those_that_the_coding_no_longer_sends():
    sent = images()
    sizes, nothing = tile_bytes(sent, tiled.JPEG), np.zeros((3, 5), bool)
    assert sizes.depth[0, 1] == 0  # nothing was measured there
    assert sizes.of(nothing) == (0, 0)
    assert sizes.of(~nothing) == (sizes.depth.sum(), sizes.color.sum())
    whole = tiled.Tiled("tiles", "", tiled.JPEG, base=False, repair_every=64).encode(sent, 100)
    assert 0 < len(whole) - sizes.depth.sum() - sizes.color.sum() < 0.2 * len(whole)


def test_a_larger_tile_is_left_out_only_as_a_whole():
    mask = np.ones((3, 5), bool)
    mask[0, 0] = False
    np.testing.assert_array_equal(whole_tiles(mask, (2, 3)), [[False, True, True], [True, True, True]])


def test_a_mask_of_another_size_is_refused():
    with pytest.raises(InputError, match="3 x 5 tiles"):
        without_tiles(images(), np.zeros((5, 3), bool))
    with pytest.raises(InputError, match="3 x 5 tiles"):
        tile_bytes(images(), tiled.JPEG).of(np.zeros((5, 3), bool))


def test_the_base_layer_is_in_metres():
    sent = images()
    view = base_view(sent, 1000.0, CAMERA, np.eye(4))
    assert view.z_m.shape == (12, 20)
    assert np.isnan(view.z_m[:4, 4:8]).all()
    np.testing.assert_allclose(view.z_m[4:], 1.502, atol=0.003)

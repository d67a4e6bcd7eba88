"""The chain through every kind of lens: one scene, photographed again through each, gives the same mesh."""

from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from pipeline.config import PRESETS
from pipeline.io.demos import load_demo
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import inverse, pixel_rays, project, scaled
from pipeline.kernels.rays import hit_depth, tensor, triangle_scene
from pipeline.nodes import infer_depth
from pipeline.reconstruct import reconstruct
from pipeline.registration.visibility import hidden_from
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, Rig
from tests.pipeline.lenses import RATIONAL

pytestmark = pytest.mark.xdist_group("lenses")
SIZE_PX = 320, 240
LENSES = {
    "pinhole": np.zeros(5),
    "rational": np.array(RATIONAL),
    "fisheye": np.array([-0.02, 0.01, 0.0, 0.0]),
}


def lens_of(kind):
    """A camera that sees about as much as the demo's, of half its size."""
    demo = scaled(load_demo("box-on-table").frames[0].intrinsics, 0.5)
    return CameraIntrinsics(demo.matrix, LENSES[kind], *SIZE_PX, kind == "fisheye")


def photographed(kind, rig):
    """The rig with true depth on the lens's pixels, a hole in it, and its photographs warped to them."""
    lens = lens_of(kind)
    rays = pixel_rays(lens)
    hole = np.abs(rays[..., :2] - (0.05, 0.0)).max(axis=-1) < 0.04
    frames = []
    for frame, T_world_camera in zip(rig.frames, rig.truth.T_world_camera, strict=True):
        pixels = project(frame.intrinsics, rays.reshape(-1, 3)).reshape(240, 320, 2)
        rgb = cv2.remap(frame.rgb, *np.moveaxis(pixels.astype(np.float32), -1, 0), cv2.INTER_LINEAR)
        depth = hit_depth(rig.truth.vertices_m, rig.truth.triangles, lens, T_world_camera)
        depth = replace(depth, z_m=np.where(hole, np.float32(np.nan), depth.z_m))
        frames.append(replace(frame, rgb=rgb, depth=depth, intrinsics=lens, T_world_camera=T_world_camera))
    return Rig(kind, tuple(frames))


@pytest.fixture(scope="module")
def rig():
    rig = load_demo("box-on-table")
    truth = replace(rig.truth, T_world_camera=rig.truth.T_world_camera[:2])
    return Rig("two nodes", rig.frames[:2], truth)


@pytest.fixture(scope="module")
def found(rig, tmp_path_factory):
    """Reconstructions by lens, of rigs that were written and read again."""
    folder = tmp_path_factory.mktemp("lenses")
    for kind in LENSES:
        save_rig(folder / kind, photographed(kind, rig))
    return {kind: reconstruct(load_rig(folder / kind), PRESETS["packetmesh"]) for kind in LENSES}


def off_m(points_m, vertices_m, triangles):
    """(N,) distances of points from a mesh."""
    return triangle_scene(vertices_m, triangles).compute_distance(tensor(points_m, np.float32)).numpy()


@pytest.mark.parametrize("kind", LENSES)
def test_the_mesh_is_on_the_true_surface_and_fills_the_hole(kind, rig, found):
    quality = found[kind].after.quality
    for surface in (found[kind].before, found[kind].after):
        distances_m = off_m(surface.vertices_m, rig.truth.vertices_m, rig.truth.triangles)
        assert np.median(distances_m) < 0.0005
        assert np.quantile(distances_m, 0.9) < 0.004
    assert quality.guessed_ray_share > 0.5 * hole_share(kind)
    assert quality.within_2pct_share > 0.94


def hole_share(kind):
    return float(np.mean(np.abs(pixel_rays(lens_of(kind))[..., :2] - (0.05, 0.0)).max(axis=-1) < 0.04))


@pytest.mark.parametrize("kind", ["rational", "fisheye"])
def test_the_mesh_is_that_of_a_pinhole_camera_where_both_see(kind, found):
    straight, points_m = found["pinhole"], found[kind].after.vertices_m
    seen = np.zeros(len(points_m), bool)
    for frame, pose in zip(straight.rig.frames, straight.placement.T_world_camera, strict=True):
        cloud = PointCloud(points_m)
        seen |= ~hidden_from(cloud, inverse(pose), frame.intrinsics, frame.depth)
    assert seen.mean() > 0.5
    distances_m = off_m(points_m[seen], straight.after.vertices_m, straight.after.triangles)
    assert np.median(distances_m) < 0.0005
    assert np.quantile(distances_m, 0.9) < 0.003


class GreenIsDepth:
    """A depth network that gives the green of every pixel."""

    convention = SimpleNamespace(kind="scale")
    provider = "test"

    def infer(self, rgb, crop=False):
        self.seen = rgb
        return DepthMap(rgb[..., 1].astype(np.float32), "relative")


@pytest.mark.parametrize("kind", LENSES)
def test_the_depth_network_gets_a_straight_image_and_its_depth_comes_back_to_the_lens(kind, rig):
    rays, lens = pixel_rays(lens_of(kind)), lens_of(kind)
    green = 120.0 + 60.0 * np.sin(rays[..., 0]) * np.cos(rays[..., 1])
    rgb = np.stack([green] * 3, axis=-1).astype(np.uint8)
    frame = replace(rig.frames[0], rgb=rgb, intrinsics=lens)
    network = GreenIsDepth()
    depth = infer_depth(network, frame).depth
    assert depth.kind == "relative"
    assert np.array_equal(network.seen, rgb) == (kind == "pinhole")
    inner = np.s_[5:-5, 5:-5]
    assert depth.valid[inner].mean() > 0.95
    np.testing.assert_allclose(depth.z_m[inner], green[inner], atol=3.0)

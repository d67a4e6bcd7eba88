"""A measurement is never replaced by a guess: fusion must not spoil what the sensor has measured.

Of all measured pixels, the shares whose ray meets the surface within 2 and within 5 % of the measurement may
not fall by fusion, on any rig that ships, on any of its nodes alone, and on real frames (``tests/real``).
"""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.config import PRESETS, AcquisitionConfig
from pipeline.io.demos import DEMO_SCENES
from pipeline.kernels.rays import Camera, hit_depths
from pipeline.merging import merge_fused
from pipeline.reconstruct import Reconstruction, iterate_reconstruction, reconstruct
from pipeline.sources import Demo, LoadedRig
from pipeline.spec import Spec
from pipeline.stages import run
from pipeline.surface.ray_parts import View, ray_parts
from pipeline.types import PointSource, Rig


def frames_of(scene, store):
    return drain(run(Spec(Demo(scene)), store, stages=("rig",)))["rig"].value.frames


def reconstructed(rig: Rig) -> Reconstruction:
    return reconstruct(replace(rig, truth=None), PRESETS["packetmesh"])


def assert_nothing_measured_is_spoilt(kept) -> None:
    assert kept.kept_share > 0.99
    assert kept.within_2pct_after >= kept.within_2pct_before > 0.85
    assert kept.within_5pct_after >= kept.within_5pct_before > 0.9


@pytest.mark.parametrize("scene", DEMO_SCENES)
def test_fusion_keeps_what_a_rig_has_measured(scene, store):
    assert_nothing_measured_is_spoilt(drain(iterate_reconstruction(Spec(Demo(scene)), store)).kept)


@pytest.mark.parametrize("scene", DEMO_SCENES)
def test_fusion_keeps_what_each_node_alone_has_measured(scene, store):
    for frame in frames_of(scene, store):
        assert_nothing_measured_is_spoilt(reconstructed(Rig(frame.name, (frame,))).kept)


@pytest.fixture(scope="module")
def pair(store) -> tuple[Rig, Reconstruction]:
    rig = Rig("pair", frames_of("box-on-table", store)[:1])
    return rig, reconstructed(rig)


def test_no_inferred_point_lies_in_a_measured_pixel(pair):
    """Not even where the outlier filter has dropped the measurement."""
    rig, harsh = pair[0], replace(PRESETS["packetmesh"], acquisition=AcquisitionConfig("thesis"))
    done = drain(run(Spec(LoadedRig(rig), config=harsh), stages=("nodes",)))
    (node,), (frame,) = done["nodes"].value, rig.frames
    assert len(node.filtered.outliers) > 1000
    u, v = node.fused.select(node.fused.source == PointSource.INFERRED).pixels.T
    assert len(u) > 1000
    assert not frame.depth.valid[v, u].any()


def test_no_measured_point_is_averaged_with_a_guess(pair):
    """The fused cloud begins with the sensors' own, to the last bit, and guesses keep a voxel away."""
    fused, sensor = pair[1].clouds.fused, pair[1].clouds.sensor
    np.testing.assert_array_equal(fused.points_m[: len(sensor)], sensor.points_m)
    np.testing.assert_array_equal(fused.source, np.arange(len(fused)) >= len(sensor))


def test_only_what_is_measured_alone_has_the_sensors_noise(pair):
    """Averages of both kinds, and guesses, have none, and so no rim of theirs is moved by it."""
    rig, result = pair
    fused = result.clouds.fused
    np.testing.assert_array_equal(np.isnan(fused.sigma_m), fused.source == PointSource.INFERRED)
    nodes = drain(run(Spec(LoadedRig(rig)), stages=("nodes",)))["nodes"].value
    assert merge_fused(rig.frames, nodes, [np.eye(4)], "union", 3000, 0).fused.sigma_m is None


def test_the_shares_are_those_of_rays_near_their_measurement(pair):
    """Counted anew from the surfaces and the measurements."""
    rig, result = pair
    camera = Camera(rig.frames[0].intrinsics, result.placement.T_world_camera[0])
    measured = rig.frames[0].depth
    for when, surface in (("before", result.before), ("after", result.after)):
        (seen,) = hit_depths(surface.vertices_m, surface.triangles, [camera])
        off = np.abs(seen.z_m / measured.z_m - 1.0)[measured.valid]
        for percent in (2, 5):
            share = getattr(result.kept, f"within_{percent}pct_{when}")
            assert share == pytest.approx((off <= percent / 100.0).mean(), abs=1e-5)


def test_every_ray_is_closed_by_measurement_or_by_guess_or_stays_open(pair):
    rig, result = pair
    camera = Camera(rig.frames[0].intrinsics, result.placement.T_world_camera[0])
    parts = ray_parts(result.after, [View(camera, rig.frames[0].depth.valid, None)])
    assert result.kept.guessed_ray_share == pytest.approx(parts.on_inferred, abs=1e-9)
    assert result.kept.measured_ray_share == pytest.approx(parts.on_sensor, abs=1e-9)
    assert result.before.quality.guessed_ray_share == 0.0

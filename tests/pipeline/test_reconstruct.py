"""The whole way through the stages on demo rigs: what must hold whatever the scene."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress, drain
from packetmesh.settings import with_settings
from pipeline.config import PRESETS, AcquisitionConfig, SurfaceConfig
from pipeline.io.demos import load_demo
from pipeline.kernels import geometry
from pipeline.reconstruct import iterate_reconstruction, reconstruct
from pipeline.registration import point_error_m
from pipeline.sources import Demo, LoadedRig
from pipeline.spec import CHAIN, Spec
from pipeline.stages import RunCache, run
from pipeline.types import DepthMap, PointSource, Rig

pytestmark = pytest.mark.xdist_group("reconstruct")  # one worker makes the shared reconstruction once


@pytest.fixture(scope="module")
def rig():
    return load_demo("living-room")


@pytest.fixture(scope="module")
def ours(store):
    return drain(iterate_reconstruction(Spec(Demo("living-room")), store))


def stage(name, rig, config=PRESETS["packetmesh"]):
    """The result of one stage, without those after it."""
    return drain(run(Spec(LoadedRig(rig), config=config), stages=(name,)))[name].value


def test_fusion_fills_holes_and_keeps_what_the_sensor_measured(ours):
    before, after = ours.before.quality, ours.after.quality
    assert after.no_hit_ray_share < before.no_hit_ray_share
    for node in ours.nodes:
        from_sensor = node.fused.select(node.fused.source == PointSource.SENSOR)
        np.testing.assert_array_equal(from_sensor.points_m, node.sensor.points_m)


def test_registration_corrects_the_poses_that_the_nodes_believe_in(rig, ours):
    for index in (1, 2):
        points_m = ours.nodes[index].sensor.points_m
        truth = rig.truth.T_world_camera[index]
        believed = point_error_m(rig.frames[index].T_world_camera, truth, points_m)
        assert point_error_m(ours.placement.T_world_camera[index], truth, points_m) < 0.5 * believed


def test_moving_the_whole_rig_moves_the_answer(rig, ours):
    motion = geometry.rigid(geometry.rotation_exp([0.1, -0.4, 0.8]), [1.0, -2.0, 0.5])
    moved_frames = tuple(replace(f, T_world_camera=motion @ f.T_world_camera) for f in rig.frames)
    moved = stage("placement", replace(rig, frames=moved_frames, truth=None))
    for pose, moved_pose in zip(ours.placement.T_world_camera, moved.T_world_camera, strict=True):
        np.testing.assert_allclose(moved_pose, motion @ pose, atol=1e-9)


def test_the_same_input_gives_the_same_bits(rig):
    pair = Rig("pair", rig.frames[:1])
    first, second = (reconstruct(pair, PRESETS["thesis"]).after for _ in range(2))
    assert first.vertices_m.tobytes() == second.vertices_m.tobytes()
    assert first.triangles.tobytes() == second.triangles.tobytes()


def test_the_thesis_preset_joins_both_clouds_whole(rig):
    (node,) = stage("nodes", Rig("pair", rig.frames[:1]), PRESETS["thesis"])
    assert len(node.fused) == len(node.sensor) + len(node.inferred)
    assert node.inferred_registration is not None


def test_progress_rises_and_an_abandoned_run_stops(rig):
    steps = iterate_reconstruction(Spec(LoadedRig(Rig("pair", rig.frames[:1]))))
    fractions = []
    for progress in steps:
        assert isinstance(progress, Progress)
        fractions.append(progress.fraction)
        if len(fractions) == 3:
            steps.close()
    assert fractions == sorted(fractions)
    assert len(fractions) == 3


@pytest.mark.parametrize(
    "stages", [CHAIN, ("after", "before", "truth"), ("clouds", "alpha"), ("after", "alpha")]
)
def test_progress_never_falls_in_whatever_order_the_stages_are_computed(rig, stages):
    config = with_settings(PRESETS["packetmesh"], ["surface.max_points=3000"])
    steps = run(Spec(LoadedRig(Rig("pair", rig.frames[:1])), config=config), RunCache(), stages)
    fractions = [progress.fraction for progress in steps]
    assert fractions == sorted(fractions)
    assert fractions[-1] < 1.0


def test_a_node_that_overlaps_nothing_keeps_its_believed_pose_and_says_so(rig):
    away = geometry.rigid(np.eye(3), [500.0, 0.0, 0.0])
    frames = (rig.frames[0], replace(rig.frames[1], T_world_camera=away))
    placement = stage("placement", Rig("apart", frames))
    assert not placement.registrations[0].result.converged
    np.testing.assert_allclose(placement.T_world_camera[1], away, atol=1e-9)
    assert all(verdict.placed for verdict in placement.verdicts)
    assert all("that no other placed camera confirms" in sentence for sentence in placement.sentences)
    assert len(placement.sentences) == 2


def test_depth_without_a_value_is_one_sentence(rig):
    frame = rig.frames[0]
    blind = replace(frame, depth=DepthMap(np.full_like(frame.depth.z_m, np.nan)))
    with pytest.raises(PacketMeshError) as error:
        reconstruct(Rig("blind", (blind,)), PRESETS["packetmesh"])
    assert "\n" not in str(error.value)


def test_a_ball_that_falls_through_leaves_an_empty_surface_and_all_rays_miss(store):
    config = replace(PRESETS["packetmesh"], surface=SurfaceConfig("manual", (1e-5,)))
    result = drain(iterate_reconstruction(Spec(Demo("living-room"), config=config), store))
    for surface in (result.before, result.after):
        assert len(surface.triangles) == 0
        assert surface.quality.no_hit_ray_share == 1.0
        assert surface.quality.within_2pct_share == 0.0
    assert result.truth_after is None


def test_a_harsher_filter_keeps_fewer_points(rig):
    def kept(t: float) -> int:
        acquisition = AcquisitionConfig(outlier_mode="thesis", outlier_t=t)
        config = replace(PRESETS["packetmesh"], acquisition=acquisition)
        return len(stage("nodes", Rig("pair", rig.frames[:1]), config)[0].sensor)

    assert kept(0.5) < kept(3.0)

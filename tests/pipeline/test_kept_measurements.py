"""A measurement is never replaced by a guess: fusion must not spoil what the sensor has measured.

Of all measured pixels, the share whose ray meets the surface within 2 % of the measurement may not fall
by fusion, on any rig that ships and on real frames.
"""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import PRESETS
from pipeline.io.demos import CALIBRATED_SCENES, load_demo
from pipeline.io.rigs import load_frame
from pipeline.rays import Camera, hit_depths
from pipeline.reconstruct import reconstruct
from pipeline.types import PointSource, Rig


def shares(rig, **settings):
    config = PRESETS["packetmesh"]
    result = reconstruct(replace(rig, truth=None), replace(config, **settings))
    return result, (result.before.quality.kept_measurement_share, result.after.quality.kept_measurement_share)


@pytest.mark.parametrize("scene", CALIBRATED_SCENES)
def test_fusion_keeps_what_a_rig_has_measured(scene):
    _, (before, after) = shares(load_demo(scene))
    assert after >= before > 0.85


@pytest.mark.parametrize("frame", ["kinect_desk", "kinect_basket"])
def test_fusion_keeps_what_a_real_frame_has_measured(shared_data, frame):
    folder = shared_data / frame
    pair = load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json")
    _, (before, after) = shares(Rig(frame, (pair,)))
    assert after >= before > 0.85


def test_no_inferred_point_lies_in_a_measured_pixel():
    """Not even where the outlier filter has dropped the measurement."""
    rig = load_demo("box-on-table")
    result, _ = shares(Rig("pair", rig.frames[:1]))
    (node,), (frame, *_) = result.nodes, rig.frames
    assert len(node.filtered.outliers) > 100
    u, v = node.fused.select(node.fused.source == PointSource.INFERRED).pixels.T
    assert len(u) > 1000
    assert not frame.depth.valid[v, u].any()


def test_the_share_is_that_of_rays_within_two_per_cent():
    """Counted anew from the surface and the measurements."""
    rig = load_demo("box-on-table")
    result, (_, after) = shares(Rig("pair", rig.frames[:1]))
    camera = Camera(rig.frames[0].intrinsics, result.placement.T_world_camera[0])
    (seen,) = hit_depths(result.after.vertices_m, result.after.triangles, [camera])
    measured = rig.frames[0].depth
    near = np.abs(seen.z_m / measured.z_m - 1.0) <= 0.02
    assert after == pytest.approx(near[measured.valid].mean(), abs=1e-6)

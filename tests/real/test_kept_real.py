"""On every real frame there is, fusion leaves what was measured where it was (SPEC 4.9)."""

import pytest

from lab.claims.depth.scenes import load_real, real_folders
from pipeline.acquisition import acquire
from pipeline.config import PRESETS
from pipeline.reconstruct import reconstruct
from pipeline.types import Rig

FOLDERS = real_folders()


@pytest.mark.parametrize("folder", FOLDERS, ids=[folder.name for folder in FOLDERS])
def test_fusion_keeps_what_a_real_frame_has_measured(folder):
    frame = load_real(folder)
    kept = reconstruct(Rig(folder.name, (frame,)), PRESETS["packetmesh"]).kept
    assert kept.kept_share > 0.999
    assert kept.within_2pct_after >= kept.within_2pct_before > 0.94
    assert kept.within_5pct_after >= kept.within_5pct_before > 0.95
    assert kept.measured_ray_share > 0.7 > 0.25 > kept.guessed_ray_share


@pytest.mark.parametrize("folder", FOLDERS, ids=[folder.name for folder in FOLDERS])
def test_a_measured_depth_is_moved_by_a_few_steps_at_most(folder):
    """A first Kinect's, an eighth of a pixel of disparity: 2.9 mm at 1 m, with the square of the depth."""
    frame = load_real(folder)
    moved_m = abs(acquire(frame, PRESETS["packetmesh"].acquisition).depth.z_m - frame.depth.z_m)
    known = frame.depth.valid
    steps = moved_m[known] / (0.0029 * frame.depth.z_m[known] ** 2)
    assert (steps <= 1.0).mean() > 0.8
    assert (steps <= 3.0).mean() > 0.99

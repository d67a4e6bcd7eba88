"""The compared programs solve an easy pair of clouds, and their refinement ends at the truth."""

from dataclasses import replace

import numpy as np
import pytest

from lab.places.colmap import colmap_pose, lifted
from lab.places.cuts import cut_pair
from lab.places.judging import RIGHT_DEG, RIGHT_M, pose_errors
from lab.places.pairs import CAMERA, VALIDATION, PlacesPair
from lab.places.peers import PLACE_PEERS, available_place_peers, refined
from pipeline.acquisition import back_project
from pipeline.kernels.geometry import LEVEL_POSE, rigid, rotation_exp
from pipeline.types import DepthMap, PointCloud, RgbdFrame


@pytest.fixture(scope="module")
def cut():
    """A room at half its size, so that voxels leave a quarter of the points."""
    made = cut_pair(VALIDATION, 1, 0.9, start_deg=4.0, start_m=0.1)
    source, target = (PointCloud(0.5 * cloud.points_m) for cloud in (made.source, made.target))
    T = rigid(made.T_target_source[:3, :3], 0.5 * made.T_target_source[:3, 3])
    return replace(made, source=source, target=target, T_target_source=T)


@pytest.fixture(scope="module")
def frame():
    rng = np.random.default_rng(3)
    z_m = rng.uniform(1.0, 2.0, (240, 320)).astype(np.float32)
    z_m[100:120] = np.nan
    return RgbdFrame("view", np.zeros((240, 320, 3), np.uint8), DepthMap(z_m), CAMERA, LEVEL_POSE)


@pytest.mark.parametrize("name", [name for name in available_place_peers() if PLACE_PEERS[name].start])
def test_a_program_of_geometry_solves_an_easy_pair(cut, name):
    T = refined(cut.source, cut.target, PLACE_PEERS[name].start(cut.source, cut.target))
    turn_deg, shift_m = pose_errors(T, cut.T_target_source)
    assert turn_deg < RIGHT_DEG
    assert shift_m < RIGHT_M


def test_the_refinement_grows_with_the_clouds(cut):
    """A place ten times as large is refined from ten times as far, to ten times the error."""
    off = rigid(rotation_exp(np.array([0.0, 0.01, 0.02])), np.array([0.03, 0.0, -0.04])) @ cut.T_target_source
    for scale in (1.0, 100.0):
        source, target = (PointCloud(scale * cloud.points_m) for cloud in (cut.source, cut.target))
        start, true = (rigid(T[:3, :3], scale * T[:3, 3]) for T in (off, cut.T_target_source))
        turn_deg, shift_m = pose_errors(refined(source, target, start), true)
        assert turn_deg < 0.2
        assert shift_m < 0.01 * scale


def test_pixels_are_lifted_to_the_points_of_the_cloud(frame):
    cloud = back_project(frame)
    assert np.allclose(lifted(frame, cloud.pixels + 0.5), cloud.points_m)
    assert np.isnan(lifted(frame, np.array([[5.5, 110.5]]))).all()


def test_images_without_features_have_no_pose(frame):
    pytest.importorskip("pycolmap")
    assert colmap_pose(PlacesPair(frame, frame, None, 0.0, 0)) is None

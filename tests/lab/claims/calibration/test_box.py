"""The box of Table 4.5: it is measured as it is, and the verdict can come out either way."""

import numpy as np
import pytest

from lab.claims.calibration import box_views
from lab.claims.calibration.box_claim import STATES, BoxStudy, judge
from lab.claims.calibration.box_size import box_size_m
from lab.claims.calibration.box_views import SIZES_M, box_depth, calibrated, measured_m, uncalibrated_camera
from lab.claims.registry import CLAIMS
from lab.worlds.primitives import box, merged, moved
from packetmesh.errors import ReconstructionError
from pipeline.kernels.geometry import apply, inverse, look_at, pixel_rays, rigid, rotation_exp
from pipeline.kernels.rays import hit_depth
from pipeline.types import CameraIntrinsics, DepthMap

LENS = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)


def cloud(size_m, azimuth_deg, away_m=1.0):
    """(N, 3) points of a perfect sensor in the camera's frame."""
    mesh = merged([moved(box((2.0, 2.0, 0.02)), z_m=-0.01), moved(box(size_m), z_m=size_m[2] / 2.0)])
    azimuth, elevation = np.radians([azimuth_deg, 25.0])
    flat, up = np.cos(elevation), np.sin(elevation)
    way = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), up])
    depth = hit_depth(*mesh, LENS, look_at(away_m * way, (0.0, 0.0, 0.5 * size_m[2])))
    return (pixel_rays(LENS) * depth.z_m[..., None])[depth.valid]


@pytest.mark.parametrize("size_m", SIZES_M)
@pytest.mark.parametrize("azimuth_deg", [-90.0, -45.0, 0.0, 17.0])
def test_a_box_seen_perfectly_has_its_size(size_m, azimuth_deg):
    found_m = box_size_m(cloud(size_m, azimuth_deg))
    np.testing.assert_allclose(found_m, size_m, atol=0.005)


def test_the_size_does_not_depend_on_the_frame_nor_on_a_few_wild_points():
    points_m = cloud(SIZES_M[0], -45.0)
    rng = np.random.default_rng(0)
    wild = points_m[rng.choice(len(points_m), 300)] * rng.uniform(0.6, 0.9, (300, 1))
    np.testing.assert_allclose(box_size_m(np.concatenate([points_m, wild])), SIZES_M[0], atol=0.005)
    rolled = rigid(rotation_exp(np.array([0.0, 0.0, 0.7])), np.zeros(3))
    np.testing.assert_allclose(box_size_m(apply(inverse(rolled), points_m)), SIZES_M[0], atol=0.005)


def test_without_a_box_it_says_so():
    flat = cloud((0.001, 0.001, 0.001), 0.0)
    with pytest.raises(ReconstructionError, match="Nothing stands on the plane"):
        box_size_m(flat)


def test_the_sensor_leaves_a_known_camera_a_centimetre():
    rng = np.random.default_rng(5)
    camera = uncalibrated_camera(rng)
    assert 0.01 < abs(camera.intrinsics.fx_px / LENS.fx_px - 1.0) < 0.03
    raw, right = box_depth(SIZES_M[0], 45.0, camera, rng)
    assert np.abs(measured_m(right, camera.intrinsics) - SIZES_M[0]).max() < 0.012
    np.testing.assert_array_equal(raw.valid, right.valid)
    assert 0.001 < np.nanmean(np.abs(raw.z_m - right.z_m)) < 0.05


def study(error_m):
    rng = np.random.default_rng(0)
    return BoxStudy({state: rng.normal(0.0, error_m[state], (20, 3, 3, 3)) for state in STATES})


@pytest.mark.parametrize(
    ("raw_m", "calibrated_m", "verdict"), [(0.014, 0.005, True), (0.005, 0.005, False), (0.05, 0.02, False)]
)
def test_the_verdict_follows_the_numbers(raw_m, calibrated_m, verdict):
    outcome = judge(study(dict(zip(STATES, (raw_m, raw_m, calibrated_m, 0.003), strict=True))))
    assert outcome.reproduced is verdict
    table = outcome.exhibits[0]
    thesis = [dict(zip(table.header, row, strict=True)) for row in table.rows if row[1] == "thesis"]
    means_cm = {name: np.mean([row[name] for row in thesis]) for name in ("width", "length", "height")}
    assert means_cm == pytest.approx({"width": 0.67, "length": 0.66, "height": 0.697}, abs=0.0005)  # SPEC 7


def test_it_is_a_claim():
    assert CLAIMS["C25"].judge(study(dict.fromkeys(STATES, 0.001))).verdict == "not reproduced"


def test_what_is_calibrated_is_calibrated_from_photographs(monkeypatch):
    monkeypatch.setattr(box_views, "MOMENTS", 6)
    camera = uncalibrated_camera(np.random.default_rng(8))
    lens, correction = calibrated(camera, seed=8)
    assert lens.fx_px == pytest.approx(camera.intrinsics.fx_px, rel=0.003)
    flat = DepthMap(np.full((480, 640), 1.0, np.float32))
    biased = camera.bias.measured(flat)
    off_m = [float(np.abs(depth.z_m - 1.0).mean()) for depth in (biased, correction.apply(biased))]
    assert off_m[1] < 0.5 * off_m[0]

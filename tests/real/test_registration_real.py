"""Registration of real sensors' points against poses that are known."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from pipeline.acquisition import back_project, filter_outliers
from pipeline.config import AcquisitionConfig, RegistrationConfig
from pipeline.geometry import apply, inverse, rigid, rotation_exp
from pipeline.io.clouds import read_cloud
from pipeline.io.poses import read_pose
from pipeline.io.rigs import load_frame
from pipeline.registration import point_error_m, register, rotation_error_rad
from pipeline.types import PointCloud

MOTION = rigid(rotation_exp(np.radians(6.0) * np.array([0.36, 0.8, -0.48])), [0.10, -0.03, 0.08])
"""6 degrees and 13 cm."""


@pytest.fixture(scope="module")
def desk(shared_data) -> PointCloud:
    """A desk by a Kinect v1, in its camera frame."""
    folder = shared_data / "kinect_desk"
    if not folder.is_dir():
        pytest.skip(f"no kinect_desk in {shared_data}; set PACKETMESH_SHARED_DATA")
    frame = load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json")
    return filter_outliers(back_project(frame), AcquisitionConfig(), frame.intrinsics.fx_px).kept


@pytest.mark.parametrize("seed", range(5))
def test_a_real_frame_is_brought_back_from_a_known_motion(desk, seed):
    """Source and target share no pixel, and the source has the Kinect's depth noise a second time."""
    rng = np.random.default_rng(seed)
    half = rng.random(len(desk)) < 0.5
    z_m = desk.points_m[half, 2]
    noise_m = (0.0012 + 0.0019 * (z_m - 0.4) ** 2) * rng.standard_normal(len(z_m))
    noisy_m = desk.points_m[half] * (1.0 + noise_m / z_m)[:, None]
    source, target = PointCloud(apply(inverse(MOTION), noisy_m)), desk.select(~half)
    result = register(source, target, RegistrationConfig(seed=seed))
    assert point_error_m(np.eye(4), MOTION, source.points_m) > 0.1
    assert result.converged
    assert point_error_m(result.T_target_source, MOTION, source.points_m) < 0.01


@pytest.fixture(scope="module")
def lidar() -> Path:
    """The two scans that come with small_gicp's source archive: 69,000 points each, half a metre apart."""
    name = "PACKETMESH_LIDAR_PAIR"
    if name not in os.environ:
        pytest.skip(f"set {name} to a folder with source.ply, target.ply and T_target_source.txt")
    return Path(os.environ[name])


@pytest.mark.parametrize(
    "options",
    [(), ("--gate-m", "1.5", "--voxel-m", "0.25"), ("--start", "global")],
    ids=["defaults", "thinned", "global"],
)
def test_a_lidar_pair_is_registered_to_five_centimetres_and_half_a_degree(capsys, tmp_path, lidar, options):
    truth = lidar / "T_target_source.txt"
    clouds = [str(lidar / f"{name}.ply") for name in ("source", "target")]
    main(["register", *clouds, "--truth", str(truth), *options, "--json", "--out", str(tmp_path)])
    row = json.loads(capsys.readouterr().out)["ceicp-a"]
    T, T_true = np.array(row["T_target_source"]), read_pose(truth)
    center_m = read_cloud(clouds[0]).points_m.mean(axis=0, keepdims=True)
    assert row["stop_reason"] in ("converged", "stalled")
    assert np.linalg.norm(apply(T - T_true, center_m)) < 0.05
    assert np.degrees(rotation_error_rad(T, T_true)) < 0.5

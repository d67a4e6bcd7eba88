"""Registration of real sensors' points against poses that are known."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from pipeline.acquisition import acquire, depth_sigma_m
from pipeline.config import AcquisitionConfig, RegistrationConfig
from pipeline.io.clouds import read_cloud
from pipeline.io.poses import read_pose
from pipeline.io.rigs import load_frame
from pipeline.kernels.geometry import apply, pixel_rays, rigid, rotation_exp
from pipeline.kernels.rays import hit_depth
from pipeline.registration import point_error_m, register, rotation_error_rad
from pipeline.types import DepthMap, PointCloud, RgbdFrame

STEP = 0.03
"""Neighbouring pixels that differ by more than this share of their depth are not of one surface."""


@pytest.fixture(scope="module", params=["kinect_desk", "kinect_basket"])
def frame(request, shared_data) -> RgbdFrame:
    """What a Kinect v1 really measured."""
    folder = shared_data / request.param
    if not folder.is_dir():
        pytest.skip(f"no {request.param} in {shared_data}; set PACKETMESH_SHARED_DATA")
    return load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json")


def _cloud(frame: RgbdFrame, z_m: np.ndarray) -> PointCloud:
    seen = replace(frame, depth=DepthMap(z_m.astype(np.float32)))
    return acquire(seen, AcquisitionConfig()).cloud(seen).kept


def _seen_from(frame: RgbdFrame, T: np.ndarray, rng: np.random.Generator) -> PointCloud:
    """A second camera's cloud of the surface through every second pixel of every second row.

    It samples that surface on its own pixel grid, has its own shadows, and the Kinect's noise once more.
    """
    z_m = frame.depth.z_m[::2, ::2]
    rows = np.arange(z_m.size).reshape(z_m.shape)
    squares = np.stack([rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    corners_m = z_m.ravel()[triangles]
    triangles = triangles[np.ptp(corners_m, axis=1) < STEP * corners_m.min(axis=1)]  # False where one is NaN
    vertices_m = (pixel_rays(frame.intrinsics)[::2, ::2] * np.nan_to_num(z_m)[..., None]).reshape(-1, 3)
    seen_m = hit_depth(vertices_m, triangles, frame.intrinsics, T).z_m
    return _cloud(frame, seen_m + depth_sigma_m(seen_m) * rng.standard_normal(seen_m.shape))


@pytest.mark.parametrize("seed", range(3))
def test_a_second_view_of_a_real_surface_is_registered_to_two_millimetres(frame, seed):
    """The place is real, the second camera is not: it sees a surface through measurements that the target
    does not contain. This shows that real depth, with its holes, steps and noise, determines the pose; it
    does not show what two exposures have in common that is wrong.
    """
    rng = np.random.default_rng(seed)
    axis, way = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
    T_true = rigid(rotation_exp(np.radians(8.0) * axis), 0.12 * way)
    source = _seen_from(frame, T_true, rng)
    others_m = frame.depth.z_m.copy()
    others_m[::2, ::2] = np.nan
    result = register(source, _cloud(frame, others_m), RegistrationConfig(seed=seed))
    assert point_error_m(np.eye(4), T_true, source.points_m) > 0.06
    assert result.converged
    assert point_error_m(result.T_target_source, T_true, source.points_m) < 0.002


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

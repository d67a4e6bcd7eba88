"""Our plain ICP against Open3D's from the same start on the same clouds: an independent answer."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.kernels.open3d_runtime import o3d
from pipeline.registration import register
from pipeline.registration.neighbourhood import pca_normals
from pipeline.types import PointCloud

ICP = RegistrationConfig("icp", "point", "q2p")


@pytest.fixture(scope="module")
def clouds() -> tuple[PointCloud, PointCloud]:
    """A wavy box corner seen twice through different random points and noise, 4 degrees and 5 cm apart."""
    rng = np.random.default_rng(5)

    def look(count):
        a, b = rng.uniform(0.0, 1.0, (2, count))
        wave = 0.05 * np.sin(9.0 * a) * np.cos(7.0 * b)
        faces = [np.stack(face, axis=1) for face in ((a, wave, b), (wave, a, b), (a, b, wave))]
        return (
            np.concatenate(faces) + rng.normal(scale=0.002, size=(3 * count, 3)) + np.array([0.0, 0.0, 1.5])
        )

    T = rigid(rotation_exp(np.deg2rad(4.0) * np.array([0.6, -0.48, 0.64])), [0.03, -0.02, 0.03])
    target = look(1000)
    return (
        PointCloud(look(900)).transformed(inverse(T)),
        PointCloud(target, normals=pca_normals(target)),
    )


def _open3d(cloud: PointCloud):
    peer = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    if cloud.normals is not None:
        peer.normals = o3d.utility.Vector3dVector(cloud.normals)
    return peer


def _peer_icp(clouds, estimation, iterations: int) -> np.ndarray:
    """Open3D's ICP without a gate and without an early stop."""
    never = o3d.pipelines.registration.ICPConvergenceCriteria(0.0, 0.0, iterations)
    return o3d.pipelines.registration.registration_icp(
        *map(_open3d, clouds), 100.0, np.eye(4), estimation, never
    ).transformation


@pytest.mark.parametrize("iterations", [1, 5, 10])
def test_point_to_point_takes_the_same_steps(clouds, iterations):
    peer = o3d.pipelines.registration.TransformationEstimationPointToPoint()
    result = register(*clouds, replace(ICP, max_iterations=iterations))
    assert len(result.steps) == iterations
    np.testing.assert_allclose(result.T_target_source, _peer_icp(clouds, peer, iterations), atol=1e-9)


def test_point_to_point_arrives_at_the_same_pose(clouds):
    peer = o3d.pipelines.registration.TransformationEstimationPointToPoint()
    result = register(*clouds, ICP)
    assert result.converged
    np.testing.assert_allclose(result.T_target_source, _peer_icp(clouds, peer, 300), atol=1e-3)


def test_point_to_plane_arrives_at_the_same_pose(clouds):
    peer = o3d.pipelines.registration.TransformationEstimationPointToPlane()
    result = register(*clouds, replace(ICP, metric="plane"))
    assert result.converged
    np.testing.assert_allclose(result.T_target_source, _peer_icp(clouds, peer, 100), atol=1e-3)


def test_a_scale_takes_the_same_steps(clouds):
    peer = o3d.pipelines.registration.TransformationEstimationPointToPoint(with_scaling=True)
    result = register(*clouds, replace(ICP, with_scale=True, max_iterations=5))
    np.testing.assert_allclose(result.T_target_source, _peer_icp(clouds, peer, 5), atol=1e-9)

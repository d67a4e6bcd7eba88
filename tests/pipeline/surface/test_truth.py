"""Comparison with truths that are known in closed form."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import apply, look_at, rigid, rotation_exp
from pipeline.kernels.rays import Camera, hit_depth
from pipeline.surface.truth import compare_with_truth, sample_surface, yardstick_of
from pipeline.types import CameraIntrinsics, RigTruth
from tests.pipeline.surface.shapes import rectangle

CAMERA = CameraIntrinsics.pinhole(60.0, 60.0, 79.5, 59.5, 160, 120)
POSES = tuple(look_at(np.array([x, -2.5, 1.5]), np.array([0.0, 0.3, 0.4])) for x in (-0.4, 0.5))
KEYS = {f"{what}_{cm}cm" for what in ("coverage", "accuracy", "f_score") for cm in (1, 3, 5)}


def joined(*meshes):
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    triangles = [t + offset for (_, t), offset in zip(meshes, offsets, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(triangles)


def truth_of(vertices_m, triangles) -> RigTruth:
    depth = tuple(hit_depth(vertices_m, triangles, CAMERA, pose) for pose in POSES)
    return RigTruth(vertices_m, triangles, POSES, depth, (CAMERA,) * len(POSES))


FLOOR = rectangle((-8, 8), (-2, 12))
TABLE = rectangle((-0.5, 0.5), (-0.2, 0.8), z_m=0.5)
SCENE = joined(FLOOR, TABLE)
CAMERAS = [Camera(CAMERA, pose) for pose in POSES]


def test_the_truth_itself_is_perfect():
    result = compare_with_truth(*SCENE, truth_of(*SCENE), CAMERAS)
    assert set(result) == KEYS | {"no_hit_ray_share", "within_5pct_depth_share", "median_depth_error_m"}
    assert {result[key] for key in KEYS} == {1.0}
    assert result["no_hit_ray_share"] == 0.0
    assert result["within_5pct_depth_share"] == 1.0
    assert result["median_depth_error_m"] < 1e-6


@pytest.mark.parametrize(("offset_m", "perfect"), [(0.02, {3, 5}), (0.04, {5}), (0.06, set())])
def test_a_floor_that_lies_too_high_fails_below_its_offset(offset_m, perfect):
    raised = FLOOR[0] + [0.0, 0.0, offset_m]
    result = compare_with_truth(raised, FLOOR[1], truth_of(*FLOOR), CAMERAS)
    for cm in (1, 3, 5):
        for what in ("coverage", "accuracy", "f_score"):
            assert result[f"{what}_{cm}cm"] == pytest.approx(float(cm in perfect), abs=0.01)


def test_half_the_truth_is_half_covered_and_wholly_accurate():
    """Both cameras see more floor than fits here; a strip of it is the truth, half of that the mesh."""
    truth = truth_of(*rectangle((-0.2, 0.2), (-0.5, 0.5)))
    result = compare_with_truth(*rectangle((-0.2, 0.2), (-0.5, 0.0)), truth, CAMERAS)
    assert result["coverage_1cm"] == pytest.approx(0.51, abs=0.015)
    assert result["accuracy_1cm"] == 1.0
    assert result["f_score_1cm"] == pytest.approx(2 * 0.51 / 1.51, abs=0.015)
    assert 0.3 < result["no_hit_ray_share"] < 0.6
    assert result["within_5pct_depth_share"] == pytest.approx(1 - result["no_hit_ray_share"])


def test_what_no_camera_sees_need_not_be_covered():
    """A shelf close under the table top is hidden from both cameras."""
    hidden = rectangle((-0.3, 0.3), (0.1, 0.5), z_m=0.4)
    scene = joined(FLOOR, TABLE, hidden)
    truth = truth_of(*scene)
    result = compare_with_truth(*SCENE, truth, CAMERAS)
    assert result["coverage_1cm"] == 1.0


def test_the_mesh_may_live_in_a_moved_world():
    """Only the nodes' relative places can be known: a common motion of mesh and cameras changes nothing."""
    T = rigid(rotation_exp(np.array([0.1, -0.2, 0.7])), np.array([1.0, -2.0, 0.5]))
    moved = [Camera(CAMERA, T @ pose) for pose in POSES]
    result = compare_with_truth(apply(T, SCENE[0]), SCENE[1], truth_of(*SCENE), moved)
    assert result["f_score_1cm"] == 1.0
    assert result["median_depth_error_m"] < 1e-5


def test_depth_errors_are_those_along_the_rays():
    """A mesh scaled by 1.04 (1.06) about the camera has every depth 4 % (6 %) too long."""
    truth = RigTruth(*FLOOR, POSES[:1], (hit_depth(*FLOOR, CAMERA, POSES[0]),), (CAMERA,))
    for scale, share in ((1.04, 1.0), (1.06, 0.0)):
        eye_m = POSES[0][:3, 3]
        result = compare_with_truth(eye_m + scale * (FLOOR[0] - eye_m), FLOOR[1], truth, CAMERAS[:1])
        assert result["within_5pct_depth_share"] == share
        z_m = truth.depth[0].z_m[truth.depth[0].valid]
        assert result["median_depth_error_m"] == pytest.approx((scale - 1) * np.median(z_m), rel=1e-3)


def test_the_same_seed_gives_the_same_numbers():
    half = rectangle((-8, 0), (-2, 12))
    truth = truth_of(*FLOOR)
    one, two = yardstick_of(truth, seed=1), yardstick_of(truth, seed=2)
    first, second, other = (compare_with_truth(*half, truth, CAMERAS, by) for by in (one, one, two))
    assert first == second != other
    assert compare_with_truth(*half, truth, CAMERAS, yardstick_of(truth)) == compare_with_truth(
        *half, truth, CAMERAS
    )
    assert first["coverage_3cm"] == pytest.approx(other["coverage_3cm"], abs=0.03)


def test_a_mesh_without_triangles_cannot_be_compared():
    with pytest.raises(InputError, match="no triangle to compare"):
        compare_with_truth(FLOOR[0], FLOOR[1][:0], truth_of(*FLOOR), CAMERAS)


def test_samples_are_uniform_by_area_and_on_the_surface():
    vertices_m, triangles = joined(rectangle((0, 1), (0, 1)), rectangle((0, 3), (0, 1), z_m=1.0))
    points_m = sample_surface(vertices_m, triangles, 40_000, np.random.default_rng(0))
    high = points_m[:, 2] > 0.5
    np.testing.assert_allclose(points_m[:, 2], high, atol=1e-12)
    assert high.mean() == pytest.approx(0.75, abs=0.01)
    counts = np.histogram2d(points_m[high, 0], points_m[high, 1], bins=(6, 2), range=((0, 3), (0, 1)))[0]
    assert counts.std() / counts.mean() < 0.06

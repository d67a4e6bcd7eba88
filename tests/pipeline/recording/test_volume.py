"""The volume of signed distances on planes and spheres, whose points are known in closed form."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.importing.depth_views import DepthView
from pipeline.kernels.geometry import inverse, look_at, pixel_rays, rigid, rotation_exp
from pipeline.kernels.open3d_runtime import o3d
from pipeline.recording.volume import LEAST_SD, TRUNCATION_VOXELS, Volume, voxel_for
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, PointCloud

VOXEL_M = 0.01
CAMERA = CameraIntrinsics.pinhole(400.0, 400.0, 159.5, 119.5, 320, 240)
RAYS = pixel_rays(CAMERA)
ORIGIN = np.eye(4)
NOISE = DepthNoise(0.002, 0.0, 0.0, 0.0)
RADIUS_M = 0.2
SIX_VIEWS = [
    look_at(1.0 * side * axis, np.zeros(3), up=np.roll(axis, 1)) for axis in np.eye(3) for side in (1, -1)
]


def wall(z_m: float) -> DepthMap:
    return DepthMap(np.full((240, 320), z_m, dtype=np.float32))


def plane(normal: np.ndarray, offset_m: float) -> DepthMap:
    """Depth of the plane normal . p = offset in the camera's frame."""
    return DepthMap((offset_m / (RAYS @ normal)).astype(np.float32))


def sphere(T_world_camera: np.ndarray) -> DepthMap:
    """Depth of a sphere around the world's origin; NaN next to it."""
    centre_m = inverse(T_world_camera)[:3, 3]
    squared, along = np.sum(RAYS**2, axis=-1), RAYS @ centre_m
    root = along**2 - squared * (centre_m @ centre_m - RADIUS_M**2)
    hit = np.where(root > 0.0, root, np.nan)
    return DepthMap(((along - np.sqrt(hit)) / squared).astype(np.float32))


def volume_of(*frames, voxel_m: float = VOXEL_M, noise: DepthNoise = NOISE) -> Volume:
    volume = Volume(voxel_m)
    for depth, T_world_camera in frames:
        volume.integrate(view(depth, noise), T_world_camera)
    return volume


def view(depth: DepthMap, noise: DepthNoise = NOISE, weight: np.ndarray | None = None) -> DepthView:
    return DepthView(depth, CAMERA, np.eye(4), noise, weight)


def points(volume: Volume, least_observations: int = 2) -> PointCloud:
    return volume.dated_points(least_observations)[0]


def test_the_voxel_is_twice_the_noise_but_not_below_five_millimetres():
    assert voxel_for(0.006, 0.004) == pytest.approx(0.012)
    assert voxel_for(0.001, 0.015) == 0.015
    assert voxel_for(0.0005, 0.0005) == 0.002
    assert Volume(0.012).truncation_m == pytest.approx(TRUNCATION_VOXELS * 0.012)
    assert Volume(0.012, 0.05).truncation_m == 0.05


def test_a_wall_becomes_a_grid_of_points_that_face_the_camera():
    cloud = points(volume_of((wall(1.5034), ORIGIN)), 1)
    np.testing.assert_allclose(cloud.points_m[:, 2], 1.5034, atol=1e-5)
    np.testing.assert_allclose(cloud.normals, np.tile([0.0, 0.0, -1.0], (len(cloud), 1)), atol=1e-5)
    np.testing.assert_allclose(cloud.points_m[:, :2] / VOXEL_M, np.round(cloud.points_m[:, :2] / VOXEL_M))
    size_m = np.array([320, 240]) / 400.0 * 1.5034
    assert len(cloud) == pytest.approx(np.prod(size_m) / VOXEL_M**2, rel=0.02)
    assert len(np.unique(cloud.points_m.round(6), axis=0)) == len(cloud)


def test_each_point_knows_the_image_that_measured_it_first():
    left = wall(1.5034).z_m.copy()
    left[:, 160:] = np.nan
    cloud, first = volume_of((DepthMap(left), ORIGIN), (wall(1.5034), ORIGIN)).dated_points(1)
    x_m = cloud.points_m[:, 0]
    assert set(first[x_m < -0.01]) == {0}
    assert set(first[x_m > 0.01]) == {1}
    assert min(np.sum(x_m < -0.01), np.sum(x_m > 0.01)) > 1000


@pytest.mark.parametrize("angle_deg", [20.0, 50.0])
def test_a_tilted_plane_stays_where_it_is(angle_deg):
    """Of one view with nearest pixels: within half a pixel's slope, and in the mean exact."""
    normal = np.array([np.sin(np.radians(angle_deg)), 0.0, np.cos(np.radians(angle_deg))])
    T = rigid(rotation_exp(np.array([0.3, 0.2, 0.1])), np.ones(3))
    cloud = points(volume_of((plane(normal, 0.7), T)), 1).transformed(inverse(T))
    away_m = cloud.points_m @ normal - 0.7
    half_pixel_m = 0.5 * cloud.points_m[:, 2] / 400.0 * np.sin(np.radians(angle_deg))
    assert np.mean(np.abs(away_m) < 1.1 * half_pixel_m) > 0.98
    assert abs(away_m.mean()) < 0.01 * VOXEL_M
    assert np.median(cloud.normals @ -normal) > np.cos(np.radians(5.0))
    assert np.percentile(cloud.normals @ -normal, 5) > np.cos(np.radians(15.0))
    assert len(cloud) > 2_000


def test_a_sphere_seen_from_six_sides_has_its_radius_and_outward_normals():
    cloud = points(volume_of(*((sphere(T), T) for T in SIX_VIEWS)), 1)
    radii_m = np.linalg.norm(cloud.points_m, axis=1)
    outward = np.sum(cloud.normals * cloud.points_m, axis=1) / radii_m
    assert abs(np.median(radii_m) - RADIUS_M) < 0.02 * VOXEL_M
    assert np.percentile(np.abs(radii_m - RADIUS_M), 93) < 0.1 * VOXEL_M
    assert np.abs(radii_m - RADIUS_M).max() < 0.25 * VOXEL_M
    assert np.median(outward) > np.cos(np.radians(3.0))
    assert outward.min() > np.cos(np.radians(15.0))
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0)
    for axis in range(3):
        assert np.mean(cloud.points_m[:, axis] > 0.0) == pytest.approx(0.5, abs=0.02)


def test_noise_falls_with_the_root_of_the_number_of_frames():
    frames = 16
    rng = np.random.default_rng(7)
    noisy = [
        (DepthMap((1.505 + 0.002 * rng.standard_normal((240, 320))).astype(np.float32)), ORIGIN)
        for _ in range(frames)
    ]
    one, all_of_them = points(volume_of(noisy[0]), 1), points(volume_of(*noisy), frames)
    rms_m = []
    for cloud in (one, all_of_them):  # near the axis, where both neighbours of a crossing see the same pixel
        away_m = cloud.points_m[np.hypot(*cloud.points_m[:, :2].T) < 0.08, 2] - 1.505
        rms_m.append(np.sqrt(np.mean(away_m**2)))
    assert rms_m[0] == pytest.approx(0.002, rel=0.1)
    assert rms_m[1] == pytest.approx(0.002 / np.sqrt(frames), rel=0.15)
    assert np.median(all_of_them.sigma_m) == pytest.approx(0.002 / np.sqrt(frames), rel=0.1)


def test_two_frames_meet_at_the_mean_that_the_noise_law_gives():
    """At 1 and 2 m, sd is 1 and 4 mm: the weights are 16 to 1."""
    noise = DepthNoise(0.0, 0.001, 2.0, 0.0)
    near, far = (wall(1.0), ORIGIN), (wall(2.008), rigid(np.eye(3), np.array([0.0, 0.0, -1.0])))
    sd_m = noise.sd_m(np.array([1.0, 2.008]))
    weights = 1.0 / sd_m**2
    for frames in ([near, far], [far, near]):
        cloud = points(volume_of(*frames, noise=noise))
        expected_m = (weights @ [1.0, 1.008]) / weights.sum()
        central = np.hypot(*cloud.points_m[:, :2].T) < 0.1
        np.testing.assert_allclose(cloud.points_m[central, 2], expected_m, atol=2e-5)
        np.testing.assert_allclose(cloud.sigma_m[central], 1.0 / np.sqrt(weights.sum()), rtol=1e-2)
    assert expected_m == pytest.approx(1.0 + 0.008 / 17.2, abs=2e-5)


def test_depth_of_medium_confidence_counts_a_quarter():
    """The left half of the second image, 8 mm behind the first: there the mean is a fifth of the way."""
    weight = np.full((240, 320), 1.0, np.float32)
    weight[:, :160] = 0.25
    volume = Volume(VOXEL_M)
    volume.integrate(view(wall(1.502)), ORIGIN)
    volume.integrate(view(wall(1.510), weight=weight), ORIGIN)
    cloud = points(volume)
    central = np.hypot(*cloud.points_m[:, :2].T) < 0.2
    left, right = (central & (side * cloud.points_m[:, 0] > 0.01) for side in (-1.0, 1.0))
    assert min(left.sum(), right.sum()) > 500
    np.testing.assert_allclose(cloud.points_m[left, 2], 1.5036, atol=2e-5)
    np.testing.assert_allclose(cloud.points_m[right, 2], 1.506, atol=2e-5)
    np.testing.assert_allclose(cloud.sigma_m[left], 0.002 / np.sqrt(1.25), rtol=1e-2)
    np.testing.assert_allclose(cloud.sigma_m[right], 0.002 / np.sqrt(2.0), rtol=1e-2)


def test_full_confidence_gives_the_bytes_of_none():
    ones = np.ones((240, 320), np.float32)
    found = []
    for weight in (None, ones):
        volume = Volume(VOXEL_M)
        for T in SIX_VIEWS:
            volume.integrate(view(sphere(T), weight=weight), T)
        cloud = points(volume)
        found.append([part.tobytes() for part in (cloud.points_m, cloud.normals, cloud.sigma_m)])
    assert found[0] == found[1]


def test_a_point_is_known_to_a_voxel_and_sigma_has_a_floor():
    noise = DepthNoise(0.0, 0.004, 2.0, 0.0)
    assert len(points(volume_of((wall(1.55), ORIGIN), noise=noise), 1))
    assert not len(points(volume_of((wall(1.6), ORIGIN), noise=noise), 1))  # 1.02 voxels
    assert len(points(volume_of((wall(1.6), ORIGIN), (wall(1.6), ORIGIN), noise=noise), 1))
    exact = points(volume_of((wall(1.5), ORIGIN), noise=DepthNoise(0.0, 0.0, 1.0, 0.0)), 1)
    assert exact.sigma_m.min() == pytest.approx(LEAST_SD * VOXEL_M, rel=1e-3)


def test_depth_much_noisier_than_a_voxel_is_ignored():
    noise = DepthNoise(0.0, 0.004, 2.0, 0.0)
    assert volume_of((wall(2.45), ORIGIN), noise=noise).blocks
    assert not volume_of((wall(2.55), ORIGIN), noise=noise).blocks  # 2.6 voxels


@pytest.mark.parametrize("q", [0.0, 1.0, 2.0])
def test_a_grazing_view_weighs_less_by_the_noise_law(q):
    """Its exponent is at least 1."""
    normal = np.array([np.sin(1.0), 0.0, np.cos(1.0)])
    cloud = points(volume_of((plane(normal, 1.0), ORIGIN), noise=DepthNoise(0.001, 0.0, 0.0, q)), 1)
    to_camera = -cloud.points_m / np.linalg.norm(cloud.points_m, axis=1, keepdims=True)
    ratio = cloud.sigma_m * (np.sum(to_camera * -normal, axis=1)) ** max(q, 1.0) / 0.001
    assert np.median(ratio) == pytest.approx(1.0, abs=0.05)


def test_unknown_and_impossible_depth_changes_nothing():
    z_m = wall(1.5).z_m.copy()
    z_m[:, :160], z_m[:20], z_m[-20:] = np.nan, np.inf, -1.0
    z_m[20:40] = 0.0
    cloud = points(volume_of((DepthMap(z_m), ORIGIN)), 1)
    np.testing.assert_allclose(cloud.points_m[:, 2], 1.5, atol=1e-5)
    v_px = cloud.points_m[:, 1] / 1.5 * 400.0 + 119.5
    assert cloud.points_m[:, 0].min() >= 0.0
    assert v_px.min() > 39.4
    assert v_px.max() < 219.6
    assert volume_of((DepthMap(np.full_like(z_m, np.nan)), ORIGIN)).blocks == 0


def test_one_observation_gives_no_points_but_the_second_does():
    frame = wall(1.5034), ORIGIN
    assert len(points(volume_of(frame))) == 0
    twice = volume_of(frame, frame)
    np.testing.assert_array_equal(points(twice).points_m, points(volume_of(frame), 1).points_m)
    assert len(points(twice, 3)) == 0


def test_points_do_not_depend_on_the_order_in_which_blocks_were_made():
    frames = [(sphere(T), T) for T in SIX_VIEWS]
    one, other = volume_of(*frames), volume_of(*frames[::-1])
    assert one.blocks == other.blocks
    a, b = points(one), points(other)
    np.testing.assert_allclose(a.points_m, b.points_m, atol=1e-5)
    np.testing.assert_allclose(a.normals, b.normals, atol=1e-3)


def test_many_blocks_are_found_again_after_the_storage_has_grown():
    """A room of 4 m: more blocks than there is room for at first, on both sides of the origin."""
    volume = Volume(VOXEL_M)
    centre = np.array([0.013, 0.007, 0.021])
    for axis in np.eye(3):
        for side in (1.0, -1.0):
            T = look_at(centre, centre + side * axis, up=np.roll(axis, 1))
            volume.integrate(view(wall(2.0)), T)
    assert volume.blocks > 2048
    away_m = np.abs(points(volume, 1).points_m - centre).max(axis=1)
    np.testing.assert_allclose(away_m, 2.0, atol=1e-4)
    assert len(away_m) == pytest.approx(6 * 1.6 * 1.2 / VOXEL_M**2, rel=0.03)


def theirs(frames, least_weight: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of Open3D's volume."""
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight"),
        attr_dtypes=(o3d.core.float32, o3d.core.float32),
        attr_channels=((1,), (1,)),
        voxel_size=VOXEL_M,
        block_resolution=8,
        block_count=1000,
    )
    matrix = o3d.core.Tensor(CAMERA.matrix)
    for depth, T in frames:
        image = o3d.t.geometry.Image(o3d.core.Tensor(np.nan_to_num(depth.z_m)))
        pose = o3d.core.Tensor(inverse(T))
        blocks = grid.compute_unique_block_coordinates(image, matrix, pose, 1.0, 3.0, TRUNCATION_VOXELS)
        grid.integrate(blocks, image, matrix, pose, 1.0, 3.0, TRUNCATION_VOXELS)
    cloud = grid.extract_point_cloud(least_weight)
    return cloud.point.positions.numpy(), cloud.point.normals.numpy()


def test_open3d_finds_the_same_sphere():
    frames = [(sphere(SIX_VIEWS[0]), SIX_VIEWS[0])]
    ours = points(volume_of(*frames), 1)
    places_m, normals = theirs(frames, 0.5)
    _, nearest = cKDTree(places_m).query(ours.points_m)
    away_m = np.abs(np.sum((ours.points_m - places_m[nearest]) * normals[nearest], axis=1))
    assert np.percentile(away_m, 90) < 0.2 * VOXEL_M
    assert len(ours) == pytest.approx(len(places_m), rel=0.1)


def test_six_views_agree_better_than_in_open3d_which_weighs_all_angles_alike():
    frames = [(sphere(T), T) for T in SIX_VIEWS]
    ours, (places_m, _) = points(volume_of(*frames)), theirs(frames, 1.5)
    errors_m = [np.abs(np.linalg.norm(p, axis=1) - RADIUS_M) for p in (ours.points_m, places_m)]
    assert len(ours) == pytest.approx(len(places_m), rel=0.1)
    assert np.percentile(errors_m[0], 95) < 0.5 * np.percentile(errors_m[1], 95)

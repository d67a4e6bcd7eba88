"""Poisson and alpha shapes on clouds whose surface is known."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from pipeline.surface.baselines import TRIM_SPACINGS, alpha_surface, poisson_depth, poisson_surface
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.radii import spacing
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import perforated_plane, sphere

RADIUS_M = 0.7


@pytest.fixture(scope="module")
def cloud():
    plain = sphere(5000, RADIUS_M)
    colors = np.random.default_rng(0).integers(0, 256, (5000, 3), dtype=np.uint8)
    return replace(plain, colors=colors, source=(colors[:, 0] % 2).astype(np.uint8))


@pytest.fixture(scope="module", params=["poisson", "alpha"])
def make(request):
    """The method, with a length that suits a sphere of 5,000 points."""
    if request.param == "alpha":
        return lambda cloud: alpha_surface(cloud, 1.01 * RADIUS_M)
    return lambda cloud: poisson_surface(cloud, spacing(cloud.points_m)[0])


@pytest.fixture(scope="module")
def surface(make, cloud):
    return make(cloud)


def test_a_sphere_is_closed_and_of_its_area(surface):
    edges, faces = edges_and_faces(surface.triangles)
    quality = surface.quality
    assert np.all(faces == 2)
    assert len(surface.vertices_m) - len(edges) + len(surface.triangles) == 2
    assert (quality.boundary_loops, quality.components, quality.non_manifold_edges) == (0, 1, 0)
    assert quality.unused_points == 0
    assert quality.area_m2 == pytest.approx(4 * np.pi * RADIUS_M**2, rel=0.002)
    np.testing.assert_allclose(np.linalg.norm(surface.vertices_m, axis=1), RADIUS_M, rtol=0.005)
    assert surface.radii_m == ()


def test_triangles_are_counter_clockwise_from_outside(surface):
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    assert np.all(np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0)


def test_the_same_cloud_gives_the_same_bits(make, cloud, surface):
    again = make(cloud)
    np.testing.assert_array_equal(again.vertices_m, surface.vertices_m)
    np.testing.assert_array_equal(again.triangles, surface.triangles)


def test_vertices_have_the_columns_of_their_nearest_point(surface, cloud):
    rows = np.argmin(np.linalg.norm(surface.vertices_m[::97, None] - cloud.points_m, axis=2), axis=1)
    np.testing.assert_array_equal(surface.colors[::97], cloud.colors[rows])
    np.testing.assert_array_equal(surface.normals[::97], cloud.normals[rows])
    np.testing.assert_array_equal(surface.source[::97], cloud.source[rows])


def test_vertices_of_an_alpha_shape_are_input_points(cloud):
    surface = alpha_surface(cloud, 1.01 * RADIUS_M)
    known = {tuple(point) for point in cloud.points_m}
    assert {tuple(vertex) for vertex in surface.vertices_m} <= known


def test_an_alpha_shape_makes_a_thick_wall_a_slab_with_two_sides(cloud):
    noise = np.random.default_rng(0).normal(scale=0.007, size=(5000, 1))
    rough = replace(cloud, points_m=cloud.points_m + noise * cloud.normals)
    assert alpha_surface(rough, 0.08).quality.area_m2 == pytest.approx(8 * np.pi * RADIUS_M**2, rel=0.1)


def test_poisson_ends_where_the_points_end():
    """A half sphere would be closed by a wide balloon."""
    whole = sphere(5000, RADIUS_M)
    half = whole.select(whole.points_m[:, 2] > 0.0)
    spacing_m, _ = spacing(half.points_m)
    surface = poisson_surface(half, spacing_m)
    distances_m = np.linalg.norm(surface.vertices_m[:, None] - half.points_m[None], axis=2).min(axis=1)
    assert distances_m.max() <= TRIM_SPACINGS * spacing_m
    assert surface.quality.boundary_loops == 1
    assert surface.quality.area_m2 == pytest.approx(2 * np.pi * RADIUS_M**2, rel=0.1)


def test_the_finest_cell_is_about_the_spacing_and_the_depth_is_bounded():
    points_m = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.2]])
    for spacing_m in (0.1, 0.03, 0.01, 0.002):
        cell_m = 1.1 / 2 ** poisson_depth(points_m, spacing_m)
        assert 0.5 * spacing_m < cell_m <= spacing_m
    assert poisson_depth(points_m, 1e-6) == 10
    assert poisson_depth(points_m, 50.0) == 2


def test_a_flat_cloud_has_no_alpha_shape():
    flat = perforated_plane(0.5, 0.02, 0.1)
    with pytest.raises(ReconstructionError, match=r"No tetrahedron.*not lie in one plane"):
        alpha_surface(flat, 0.1)


def test_an_alpha_that_no_tetrahedron_fits_says_so(cloud):
    with pytest.raises(ReconstructionError, match=r"fits into a ball of 0\.01 m; try a larger alpha"):
        alpha_surface(cloud, 0.01)


def test_poisson_without_a_surface_near_the_points_says_so():
    with pytest.raises(ReconstructionError, match=r"Poisson makes no triangle within 1\.5 m of the points"):
        poisson_surface(PointCloud(np.eye(3), normals=np.eye(3)), 0.5)


@pytest.mark.parametrize("method", [poisson_surface, alpha_surface])
@pytest.mark.parametrize(
    ("bad", "length_m", "says"),
    [
        (sphere(2), 0.1, "at least 3 points, not 2"),
        (PointCloud(np.ones((9, 3)), normals=np.ones((9, 3))), 0.1, "All 9 points lie in one place"),
        (PointCloud(np.eye(3)), 0.1, "needs normals"),
        (sphere(50), 0.0, "is 0.0 m"),
        (sphere(50), -1.0, "is -1.0 m"),
        (sphere(50), float("nan"), "is nan m"),
        (sphere(50), float("inf"), "is inf m"),
    ],
)
def test_bad_input_gets_its_sentence(method, bad, length_m, says):
    with pytest.raises(InputError, match=says):
        method(bad, length_m)

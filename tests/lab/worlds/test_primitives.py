"""Every solid is closed, faces outwards, and has the volume that geometry says."""

import inspect
from importlib import import_module
from math import cos, pi, sin
from pkgutil import iter_modules

import numpy as np
import pytest

from lab.worlds import furniture
from lab.worlds import primitives as p
from lab.worlds.furniture.placing import place
from pipeline.kernels import geometry

MODULES = [
    import_module(f"lab.worlds.furniture.{module.name}") for module in iter_modules(furniture.__path__)
]
PIECES = {
    name: piece
    for module in MODULES
    for name, piece in inspect.getmembers(module, inspect.isfunction)
    if list(inspect.signature(piece).parameters)[:2] == ["rng", "T_world"] and not name.startswith("_")
}
HAND_TOOLS = {"hammer", "saw", "spanner", "screwdriver", "pliers", "square", "tape_roll"}
WALL_PIECES = {"picture", "note", "wall_clock", "wall_shelf", "pendant_lamp", "window"}


def facet_share(segments: int) -> float:
    """Area of a regular polygon relative to its circle."""
    return segments * sin(2.0 * pi / segments) / (2.0 * pi)


def directed_edges(triangles: np.ndarray) -> np.ndarray:
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def assert_closed(mesh: p.Mesh) -> None:
    """Every directed edge occurs once, together with its opposite: two faces an edge, turned alike."""
    vertices, triangles = mesh
    edges = directed_edges(triangles)
    code = edges[:, 0] * len(vertices) + edges[:, 1]
    opposite = edges[:, 1] * len(vertices) + edges[:, 0]
    assert len(np.unique(code)) == len(code)
    np.testing.assert_array_equal(np.sort(code), np.sort(opposite))
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))


def euler(mesh: p.Mesh) -> int:
    edges = np.unique(np.sort(directed_edges(mesh[1]), axis=1), axis=0)
    return len(mesh[0]) - len(edges) + len(mesh[1])


def volume_m3(mesh: p.Mesh) -> float:
    a, b, c = (mesh[0][mesh[1][:, k]] - mesh[0].mean(axis=0) for k in range(3))
    return float(np.einsum("nk,nk->", a, np.cross(b, c)) / 6.0)


SOLIDS = {
    "box": (p.box((1.0, 2.0, 3.0)), 6.0),
    "cylinder": (p.cylinder(0.5, 2.0, 24), pi * 0.5 * facet_share(24)),
    "frustum": (p.frustum(0.6, 0.3, 1.0, 24), pi * (0.36 + 0.18 + 0.09) / 3.0 * facet_share(24)),
    "cone": (p.frustum(0.5, 0.0, 1.2, 48), pi * 0.25 * 0.4 * facet_share(48)),
    "extruded L": (p.extrude([(0, 0), (2, 0), (2, 1), (1, 1), (1, 3), (0, 3)], 0.5), 2.0),
    "extruded arrow": (p.extrude([(0, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)], 1.0), 2.5),
    "sheet": (p.sheet((1.0, 2.0), lambda x, y: 0.1 * np.sin(7.0 * x) * y, 0.01), 0.02),
    "straight tube": (
        p.tube([(0, 0, 0), (0, 0.3, 0.4), (0, 0.6, 0.8)], 0.1, 12),
        pi * 0.01 * facet_share(12),
    ),
    "moved, turned, merged": (
        p.merged([p.transformed(p.box((1, 1, 1)), place(4.0, 1.0, 0.7)), p.moved(p.box((1, 1, 2)), z_m=9.0)]),
        3.0,
    ),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solid_is_closed_and_has_its_analytic_volume(name: str) -> None:
    mesh, expected = SOLIDS[name]
    assert_closed(mesh)
    assert euler(mesh) == (4 if "merged" in name else 2)
    assert volume_m3(mesh) == pytest.approx(expected, rel=1e-9)


def test_sphere_approaches_the_analytic_volume() -> None:
    coarse, fine = (volume_m3(p.sphere(0.5, n)) for n in (16, 64))
    exact = pi / 6.0
    assert_closed(p.sphere(0.5, 16))
    assert euler(p.sphere(0.5, 16)) == 2
    assert coarse < fine < exact
    # The error of an inscribed polyhedron falls with the square of the facets' size.
    assert (exact - coarse) / (exact - fine) == pytest.approx(16.0, rel=0.05)
    assert np.linalg.norm(p.sphere(0.5, 16)[0], axis=1) == pytest.approx(0.5)


def test_ring_is_a_closed_torus_with_the_volume_of_its_section() -> None:
    ring = p.lathe([(1.0, 0.0), (1.2, 0.0), (1.2, 0.5), (1.0, 0.5), (1.0, 0.0)], 32)
    assert_closed(ring)
    assert euler(ring) == 0
    assert volume_m3(ring) == pytest.approx(pi * (1.44 - 1.0) * 0.5 * facet_share(32))


def test_bevel_only_cuts_corners() -> None:
    sharp, cut = p.cylinder(0.5, 1.0, 32), p.cylinder(0.5, 1.0, 32, bevel_m=0.01)
    assert_closed(cut)
    assert euler(cut) == 2
    # Pappus: each rim loses a triangle of legs 1 cm whose centroid turns at 0.5 - 0.01 / 3.
    lost = 2.0 * 0.5 * 0.01**2 * 2.0 * pi * (0.5 - 0.01 / 3.0) * facet_share(32)
    assert volume_m3(sharp) - volume_m3(cut) == pytest.approx(lost, rel=1e-6)
    np.testing.assert_allclose(np.ptp(cut[0], axis=0), np.ptp(sharp[0], axis=0))


@pytest.mark.parametrize("crown_m", [0.0, 0.06])
@pytest.mark.parametrize("radius_m", [0.02, 0.1, 0.4])
def test_rounded_box_fills_its_bounding_box_and_nothing_else(radius_m: float, crown_m: float) -> None:
    size = np.array([0.9, 0.6, 0.4])
    mesh = p.rounded_box(size, radius_m, crown_m)
    assert_closed(mesh)
    assert euler(mesh) == 2
    np.testing.assert_allclose(mesh[0].max(axis=0), size / 2.0, atol=1e-12)
    np.testing.assert_allclose(mesh[0].min(axis=0), -size / 2.0, atol=1e-12)
    assert 0.3 * size.prod() < volume_m3(mesh) < size.prod()


def test_rounded_box_volume_tends_to_the_analytic_one() -> None:
    x, y, z, r = 0.9, 0.6, 0.4, 0.1
    a, b, c = x - 2 * r, y - 2 * r, z - 2 * r
    exact = a * b * c + 2 * r * (a * b + b * c + c * a) + pi * r * r * (a + b + c) + 4.0 / 3.0 * pi * r**3
    assert volume_m3(p.rounded_box((x, y, z), r, steps=12)) == pytest.approx(exact, rel=1e-3)


def test_tube_follows_a_bend_with_round_sections() -> None:
    angle = np.linspace(0.0, pi, 60)
    path = np.stack([np.cos(angle), np.sin(angle), np.zeros(60)], axis=1)
    bend = p.tube(path, 0.1, 16)
    assert_closed(bend)
    assert euler(bend) == 2
    assert volume_m3(bend) == pytest.approx(pi * 0.01 * pi * facet_share(16), rel=2e-3)
    to_path = np.abs(np.hypot(bend[0][:, 0], bend[0][:, 1]) - 1.0)
    assert to_path.max() < 0.1 + 1e-3


def test_sheet_keeps_its_height_function_and_thickness() -> None:
    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return x * y + 0.2

    vertices, _ = p.sheet((2.0, 1.0), height, 0.05, (6, 4))
    top, under = np.split(vertices, 2)
    np.testing.assert_allclose(top[:, 2], height(top[:, 0], top[:, 1]))
    np.testing.assert_allclose(top - under, np.tile([0.0, 0.0, 0.05], (len(top), 1)), atol=1e-15)


@pytest.mark.parametrize("name", sorted(PIECES.keys() - HAND_TOOLS))
def test_furniture_is_closed_stands_on_its_floor_and_has_albedo(name: str) -> None:
    T = place(1.0, -2.0, 0.6, 0.3)
    parts = PIECES[name](np.random.default_rng(5), T)
    points = []
    for part in parts:
        assert_closed((part.vertices_m, part.triangles))
        assert volume_m3((part.vertices_m, part.triangles)) > 0.0
        corners = part.vertices_m[part.triangles[:50, 0]]
        albedo = part.material.texture(corners, np.tile([0.0, -1.0, 0.0], (len(corners), 1)))
        assert albedo.shape == corners.shape
        assert albedo.min() >= 0.0
        assert albedo.max() <= 1.0
        points.append(geometry.apply(geometry.inverse(T) @ part.T_world_part, part.vertices_m))
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    if name not in WALL_PIECES:
        assert low[2] >= -1e-3
    assert np.all(high - low < 3.0)


@pytest.mark.parametrize("name", ["sofa", "bookshelf", "potted_plant"])
def test_furniture_depends_on_the_seed_alone(name: str) -> None:
    first, again, other = (PIECES[name](np.random.default_rng(seed)) for seed in (3, 3, 4))
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.vertices_m, b.vertices_m)
        np.testing.assert_array_equal(a.T_world_part, b.T_world_part)
    assert len(first) != len(other) or any(
        a.T_world_part.tobytes() + a.vertices_m.tobytes() != b.T_world_part.tobytes() + b.vertices_m.tobytes()
        for a, b in zip(first, other, strict=True)
    )


def test_place_turns_the_front_towards_a_heading() -> None:
    front = geometry.apply(place(2.0, 3.0, pi / 2.0), np.array([[0.0, -1.0, 0.0]]))
    np.testing.assert_allclose(front, [[2.0 + sin(pi / 2.0), 3.0 - cos(pi / 2.0), 0.0]], atol=1e-12)

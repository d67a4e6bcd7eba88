"""Surfaces in colours, and quick looks at a radius, as the computing process makes them."""

from dataclasses import replace

import numpy as np
import pytest

from app.compute.state import Spec
from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET
from app.screens.surface.labels import COLORINGS, legend_html
from app.screens.surface.paint_job import paint_job, vertex_colors
from app.screens.surface.view import QUICK_POINTS, PaintRequest
from packetmesh.progress import drain as end
from pipeline.config import PipelineConfig
from pipeline.kernels.rays import triangle_areas_m2
from pipeline.sources import Demo
from pipeline.stages import cameras_of
from pipeline.surface.ball_pivoting import roll_or_nothing
from pipeline.surface.truth import distances_to_truth_m
from pipeline.types import PointSource
from tests.app.gltf import arrays

CONFIG = PipelineConfig()


def spec_of(points):
    surface = replace(CONFIG.surface, max_points=points)
    return Spec(Demo("box-on-table"), config=replace(CONFIG, surface=surface))


SPEC = spec_of(8_000)
SHIPPED = Spec(Demo("box-on-table"))


@pytest.fixture(scope="module")
def made(store):
    """Rig, cameras and the surface after fusion."""
    rig, placement = end(store.stage(SPEC, "rig")), end(store.stage(SPEC, "placement"))
    return rig, cameras_of(rig, placement), end(store.stage(SPEC, "after"))


def test_the_settings_own_surfaces_are_painted_whole_with_their_rims(store, made):
    view = end(paint_job(store, SPEC, PaintRequest(("after", "before"), "source")))
    assert set(view.meshes) == {"after", "before"}
    assert view.points == view.all_points
    assert view.meshes["after"].triangles == len(made[2].triangles)
    assert all(mesh.rims_glb for mesh in view.meshes.values())


def test_a_quick_look_rolls_one_ball_over_what_is_shown_alone(store):
    clouds = end(store.stage(SPEC, "clouds"))
    small, large = (
        end(paint_job(store, SPEC, PaintRequest(("before",), "color", factor * clouds.r_F_m)))
        for factor in (0.6, 2.0)
    )
    assert set(small.meshes) == {"before"}
    assert small.points == small.all_points == len(clouds.sensor)
    assert 0 < small.meshes["before"].triangles < 0.3 * large.meshes["before"].triangles
    assert not large.meshes["before"].rims_glb
    none = end(paint_job(store, SPEC, PaintRequest(("after",), "color", 1e-4)))
    assert (none.meshes["after"].glb, none.meshes["after"].triangles) == (b"", 0)


def test_a_quick_look_at_a_large_cloud_thins_it(store):
    spec = spec_of(60_000)
    view = end(paint_job(store, spec, PaintRequest(("after",), "color", 0.08)))
    assert view.all_points > 1.2 * QUICK_POINTS
    assert view.points == pytest.approx(QUICK_POINTS, rel=0.15)
    _, read = arrays(view.meshes["after"].glb)
    assert len(read["POSITION"]) <= view.points
    fewer = end(paint_job(store, spec, PaintRequest(("after",), "color", 0.08, QUICK_POINTS // 4)))
    assert fewer.points == pytest.approx(QUICK_POINTS // 4, rel=0.15)


@pytest.mark.parametrize("radius_m", [0.01, 0.015, 0.02, 0.03, 0.04, 0.06])
def test_a_quick_look_shows_no_hole_that_only_the_thinning_made(store, radius_m):
    view = end(
        paint_job(store, SHIPPED, PaintRequest(("after", "before"), "color", radius_m, QUICK_POINTS // 4))
    )
    clouds = end(store.stage(SHIPPED, "clouds"))
    for name, cloud in (("after", clouds.fused), ("before", clouds.sensor)):
        whole = roll_or_nothing(cloud, (radius_m,))
        _, read = arrays(view.meshes[name].glb)
        shown_m2 = triangle_areas_m2(read["POSITION"], read["indices"].reshape(-1, 3)).sum()
        assert shown_m2 > 0.9 * triangle_areas_m2(whole.vertices_m, whole.triangles).sum()


def test_colours_say_what_their_names_say(made):
    rig, cameras, surface = made
    assert vertex_colors(surface, "color", rig, cameras) is surface.colors
    guessed = surface.source == PointSource.INFERRED
    assert 0.0 < guessed.mean() < 1.0
    colors = vertex_colors(surface, "source", rig, cameras)
    assert np.all(colors[guessed] == INFERRED)
    assert np.all(colors[~guessed] == TARGET)
    colors = vertex_colors(surface, "normal", rig, cameras)
    assert np.allclose(colors / 127.5 - 1.0, surface.normals, atol=0.005)
    colors = vertex_colors(surface, "distance", rig, cameras)
    distance_m = distances_to_truth_m(surface.vertices_m, rig.truth, cameras)
    brightest = np.all(colors == DISTANCE_STOPS[-1], axis=1)
    assert brightest.any()
    assert np.all(brightest[distance_m >= MOST_DISTANCE_M])
    assert not np.any(brightest[distance_m < 0.99 * MOST_DISTANCE_M])
    assert np.all(colors[distance_m < 1e-4] == DISTANCE_STOPS[0])


def test_what_is_not_known_is_grey(made):
    rig, cameras, surface = made
    bare = replace(surface, source=None, normals=None)
    for coloring in ("source", "normal"):
        assert np.all(vertex_colors(bare, coloring, rig, cameras) == NEUTRAL)
    assert np.all(vertex_colors(surface, "distance", replace(rig, truth=None), cameras) == NEUTRAL)


def test_every_colouring_but_the_cameras_has_a_legend():
    for coloring in COLORINGS.values():
        assert "Points that the ball left out" in legend_html(coloring, True)
        closed = "Holes whose rim is at most 15 cm long are closed" in legend_html(coloring, True)
        assert closed == (coloring in ("photo", "violet"))
        assert (legend_html(coloring, True) == legend_html("color", True)) == (coloring == "color")
    assert "10 cm or more" in legend_html("distance", True)
    assert "not known" in legend_html("distance", False)

"""Baselines as the computing process makes them."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.compute.state import Spec
from app.screens.surface.baselines_job import baseline_job
from packetmesh.errors import InputError
from packetmesh.progress import drain as end
from packetmesh.settings import with_settings
from pipeline.sources import Demo
from pipeline.surface.radii import radii
from tests.app.gltf import arrays

SPEC = Spec(Demo("box-on-table"))


@pytest.fixture(scope="module")
def views(store):
    return {name: end(baseline_job(store, SPEC, name)) for name in ("poisson", "alpha")}


@pytest.fixture(scope="module")
def clouds(store):
    return end(store.stage(SPEC, "clouds"))


@pytest.mark.parametrize("name", ["poisson", "alpha"])
def test_a_baseline_is_measured_as_the_ball_is(views, name):
    view = views[name]
    assert view.name == name
    assert view.elapsed_s > 0.0
    assert 0.0 < view.mesh.quality.no_hit_ray_share < 1.0
    assert 0.5 < view.mesh.truth["f_score_5cm"] < 1.0
    _, drawn = arrays(view.mesh.glb)
    assert (len(drawn["POSITION"]), len(drawn["indices"])) == (view.mesh.vertices, view.mesh.triangles)
    assert len(np.unique(drawn["COLOR_0"], axis=0)) > 1000


def test_the_notes_are_one_sentence_with_the_parameters(views, clouds):
    largest_m = radii(SPEC.config.surface, clouds.r_F_m, clouds.sigma_D_m)[-1]
    assert f"alpha {100 * largest_m:.3g} cm, the radius of the largest ball" in views["alpha"].note
    assert f"for a point spacing of {100 * clouds.r_F_m:.3g} cm" in views["poisson"].note
    for view in views.values():
        assert view.note.endswith(".")
        assert ". " not in view.note


def test_vertices_of_the_alpha_shape_are_points_of_the_fused_cloud(views, clouds):
    _, drawn = arrays(views["alpha"].mesh.glb)
    off_m = cKDTree(clouds.fused.points_m).query(drawn["POSITION"])[0]
    assert off_m.max() <= np.sqrt(3.0) * 1e-4  # as far as the browser's mesh rounds


def test_they_are_remembered_and_only_the_alpha_shape_depends_on_the_ball(store, views):
    for name, view in views.items():
        again = end(baseline_job(store, SPEC, name))
        assert (again.elapsed_s, again.mesh.glb) == (view.elapsed_s, view.mesh.glb)
    config = with_settings(SPEC.config, ("surface.radius_rule=thesis",))
    other = Spec(SPEC.source, SPEC.preset, config)
    assert end(baseline_job(store, other, "poisson")).elapsed_s == views["poisson"].elapsed_s
    smaller = end(baseline_job(store, other, "alpha"))
    assert smaller.note != views["alpha"].note
    assert smaller.mesh.triangles < views["alpha"].mesh.triangles


def test_another_name_is_refused(store):
    with pytest.raises(InputError, match="no baseline 'delaunay'; try one of poisson, alpha"):
        end(baseline_job(store, SPEC, "delaunay"))


def test_poisson_leaves_fewer_rays_without_a_surface_than_the_tetrahedra(views):
    missed = {name: view.mesh.quality.no_hit_ray_share for name, view in views.items()}
    assert missed["poisson"] < missed["alpha"]

"""The holes of a surface as the computing process tells of them."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from app.compute.state import Spec
from app.screens.surface.holes_job import explain_job, fill_job, hole_views, parts_of, views_of
from packetmesh.errors import InputError
from packetmesh.progress import drain as end
from pipeline.config import PipelineConfig
from pipeline.sources import Demo
from pipeline.stages import cameras_of
from pipeline.surface.boundary import boundary_loops
from pipeline.surface.hole_diagnosis import explain_hole
from pipeline.surface.holes import find_holes
from tests.app.gltf import arrays, srgb

CONFIG = PipelineConfig()
SPEC = Spec(Demo("box-on-table"), config=replace(CONFIG, surface=replace(CONFIG.surface, max_points=8_000)))
LONGEST_CM = 60.0


@pytest.fixture(scope="module")
def rig(store):
    return end(store.stage(SPEC, "rig"))


@pytest.fixture(scope="module")
def balls(store):
    return {which: end(store.stage(SPEC, which)) for which in ("after", "before")}


@pytest.fixture(scope="module")
def holes(balls):
    return {which: hole_views(surface) for which, surface in balls.items()}


@pytest.fixture(scope="module")
def filled(store):
    return end(fill_job(store, SPEC, LONGEST_CM))


def polygon_length_m(loop_m):
    return np.linalg.norm(loop_m - np.roll(loop_m, -1, axis=0), axis=1).sum()


@pytest.mark.parametrize("which", ["after", "before"])
def test_every_boundary_loop_is_a_hole_or_a_rim(balls, holes, which):
    surface, views = balls[which], holes[which]
    loops = boundary_loops(surface.triangles)
    assert len(views) == len(loops) > 3
    assert sum(len(view.loop_m) for view in views) == sum(map(len, loops))
    for view in views:
        assert view.loop_m.dtype == np.float32
        assert view.length_m == pytest.approx(polygon_length_m(view.loop_m), rel=1e-4)
        assert np.all(view.center_m >= view.loop_m.min(axis=0) - 1e-5)
        assert np.all(view.center_m <= view.loop_m.max(axis=0) + 1e-5)
    areas_m2 = [view.area_m2 for view in views if not view.rim]
    assert areas_m2 == sorted(areas_m2, reverse=True)
    assert sum(areas_m2) == pytest.approx(surface.quality.hole_area_m2)
    rims = [view.rim for view in views]
    assert rims == sorted(rims)
    assert rims[-1]


def test_views_say_what_each_registered_camera_knows(store, rig):
    nodes, placement = end(store.stages(SPEC, "nodes", "placement"))
    views = end(views_of(store, SPEC))
    assert len(views) == len(rig.frames)
    for view, camera, frame, node in zip(views, cameras_of(rig, placement), rig.frames, nodes, strict=True):
        np.testing.assert_array_equal(view.camera.T_world_camera, camera.T_world_camera)
        np.testing.assert_array_equal(view.sensor_valid, np.isfinite(frame.depth.z_m))
        np.testing.assert_array_equal(view.inferred_valid, np.isfinite(node.alignment.depth.z_m))


@pytest.mark.parametrize("which", ["after", "before"])
def test_the_parts_of_all_rays_add_up_and_agree_with_the_no_hit_share(store, balls, which):
    surface = balls[which]
    parts = end(parts_of(store, SPEC, surface))
    missed = parts.missed_measured + parts.missed_inferred + parts.missed_unknown
    assert missed == pytest.approx(surface.quality.no_hit_ray_share, abs=1e-9)
    assert parts.on_sensor + parts.on_inferred + missed == pytest.approx(1.0)
    assert (parts.on_inferred == 0.0) == (which == "before")


@pytest.mark.parametrize(("which", "index"), [("after", 0), ("after", 3), ("before", 0), ("before", -1)])
def test_a_hole_is_explained_by_its_own_surface_cloud_and_cameras(store, balls, which, index):
    surface = balls[which]
    holes = find_holes(surface.vertices_m, surface.triangles)
    index %= len(holes)
    clouds = end(store.stage(SPEC, "clouds"))
    cloud = {"after": clouds.fused, "before": clouds.sensor}[which]
    expected = explain_hole(holes[index], surface, cloud, end(views_of(store, SPEC)))
    answer = end(explain_job(store, SPEC, which, index))
    assert (answer.which, answer.index) == (which, index)
    np.testing.assert_equal(asdict(answer.found), asdict(expected))


def test_an_explanation_is_remembered(store, monkeypatch):
    first = end(explain_job(store, SPEC, "after", 1))
    monkeypatch.setattr("app.screens.surface.holes_job.explain_hole", None)
    assert end(explain_job(store, SPEC, "after", 1)) == first


@pytest.mark.parametrize("index", [-1, 100_000])
def test_a_hole_that_is_not_there_is_one_sentence(store, index):
    with pytest.raises(InputError, match=f"There is no hole {index + 1} on the surface before fusion"):
        end(explain_job(store, SPEC, "before", index))


def test_filling_closes_the_small_holes_and_leaves_the_rims(balls, holes, filled):
    small = [hole for hole in holes["after"] if not hole.rim and hole.length_m <= LONGEST_CM / 100.0]
    assert 0 < filled.holes <= len(small)
    assert filled.mesh.triangles > len(balls["after"].triangles)
    assert filled.mesh.vertices == len(balls["after"].vertices_m)
    before, after = balls["after"].quality, filled.mesh.quality
    assert after.area_m2 == pytest.approx(before.area_m2 + filled.area_m2)
    assert after.hole_area_m2 < before.hole_area_m2
    assert after.no_hit_ray_share < before.no_hit_ray_share
    assert after.unused_points == before.unused_points
    assert len(filled.mesh.rims_glb) < 24 * sum(len(hole.loop_m) for hole in holes["after"])
    assert filled.mesh.truth is not None


def test_what_is_invented_is_drawn_in_its_own_colour_and_nothing_else(filled):
    _, read = arrays(filled.mesh.glb)
    assert len(read["indices"]) == filled.mesh.triangles
    rgb = srgb(read["COLOR_0"][:, :3])
    magenta = (rgb[:, 1] < 1e-6) & np.isclose(rgb[:, 0], rgb[:, 2]) & (rgb[:, 0] > 0.7)
    marked = magenta[read["indices"]]
    np.testing.assert_array_equal(marked.any(axis=1), marked.all(axis=1))
    a, b, c = read["POSITION"].astype(float)[read["indices"][marked.all(axis=1)]].swapaxes(0, 1)
    areas_m2 = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert areas_m2.sum() == pytest.approx(filled.area_m2, rel=1e-3)


def test_filling_nothing_changes_nothing(store, balls):
    view = end(fill_job(store, SPEC, 0.1))
    assert (view.holes, view.area_m2) == (0, 0.0)
    assert view.mesh.triangles == len(balls["after"].triangles)
    assert view.mesh.quality == balls["after"].quality

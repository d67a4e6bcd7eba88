from itertools import combinations

import numpy as np
import pytest

from lab.training import dataset
from lab.training.furniture import Catalogue
from lab.training.varied_rooms import plan_room, varied_room
from lab.worlds.render import Renderer
from lab.worlds.viewpoints import NEAREST_M, varied_views
from tests.lab.training.test_furniture import write_catalogue

SEEDS = range(6)


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    file = write_catalogue(tmp_path_factory.mktemp("furniture") / "Tiny.sh3f")
    return Catalogue.open(file, tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="module")
def plans(catalogue):
    return [plan_room(seed, catalogue) for seed in SEEDS]


def test_things_stay_inside_the_room_and_out_of_each_other(plans):
    for plan in plans:
        half = 0.5 * plan.size_m[:2] + 1e-5
        for thing in plan.placed:
            assert np.all(thing.low_m[:2] >= -half)
            assert np.all(thing.high_m[:2] <= half)
            assert thing.high_m[2] <= plan.size_m[2] + 1e-5
        for a, b in combinations(plan.placed, 2):
            apart = np.any((a.low_m >= b.high_m - 1e-5) | (b.low_m >= a.high_m - 1e-5))
            assert apart or a.support is b or b.support is a


def test_furniture_stands_on_the_floor_or_on_its_support(plans):
    roles = set()
    for thing in (t for plan in plans for t in plan.placed if t.entry is not None):
        roles.add(thing.entry.role)
        if thing.entry.role in ("table", "chair", "against", "free"):
            assert thing.low_m[2] == pytest.approx(0.0, abs=1e-9)
        elif thing.support is not None:
            assert thing.low_m[2] == pytest.approx(thing.support.high_m[2], abs=1e-5)  # the tops are flat
        elif thing.entry.role == "small":
            assert thing.low_m[2] == pytest.approx(0.0, abs=1e-9)
    assert roles == {"table", "chair", "against", "wall", "opening", "small"}
    assert any(thing.support is not None for plan in plans for thing in plan.placed)


def test_what_hangs_is_at_its_elevation_and_touches_a_wall(plans):
    hung = [
        (p, t) for p in plans for t in p.placed if t.entry is not None and t.entry.role in ("wall", "opening")
    ]
    assert hung
    for plan, thing in hung:
        assert thing.low_m[2] == pytest.approx(thing.entry.elevation_m)
        gap = 0.5 * plan.size_m[:2] - np.maximum(-thing.low_m[:2], thing.high_m[:2])
        assert gap.min() == pytest.approx(0.0, abs=1e-9)


def test_a_seed_makes_one_room_and_another_seed_another(catalogue):
    first, again, other = (varied_room(seed, catalogue) for seed in (3, 3, 4))
    assert len(first.parts) == len(again.parts)
    for a, b in zip(first.parts, again.parts, strict=True):
        np.testing.assert_array_equal(a.T_world_part, b.T_world_part)
        np.testing.assert_array_equal(a.vertices_m, b.vertices_m)
    assert not np.array_equal(first.parts[0].vertices_m, other.parts[0].vertices_m)
    assert 1 <= len(first.lights) <= 3


def test_rooms_hold_mirrors_and_dark_things_that_a_depth_sensor_loses(catalogue):
    materials = [part.material for seed in SEEDS for part in varied_room(seed, catalogue).parts]
    assert any(material.gloss > 0.9 and material.infrared < 0.05 for material in materials)
    assert any(material.gloss < 0.5 and material.infrared <= 0.05 for material in materials)
    assert any(material.emission > 0.5 for material in materials)


def test_cameras_keep_their_heights_angles_and_distances(catalogue):
    heights, fields = [], []
    for seed in SEEDS:
        scene = varied_room(seed, catalogue)
        renderer = Renderer(scene, threads=1)
        for T_world_camera, intrinsics in varied_views(seed, scene, 5, renderer):
            depth_m = renderer.depth(intrinsics, T_world_camera)
            assert np.isfinite(depth_m).all()
            assert depth_m.min() > NEAREST_M
            heights.append(T_world_camera[2, 3])
            fields.append(2.0 * np.degrees(np.arctan(0.5 * intrinsics.width_px / intrinsics.fx_px)))
            if heights[-1] >= 2.2:
                assert T_world_camera[2, 2] < -np.sin(np.radians(15.0))  # looks down
    assert len(heights) == 5 * len(SEEDS)
    assert all(1.0 <= h <= 1.8 or 2.2 <= h <= 3.0 for h in heights)
    assert 1 <= sum(h >= 2.2 for h in heights) < len(heights) / 2
    assert 45.0 <= min(fields) < 55.0 < 65.0 < max(fields) <= 75.0


def test_shards_of_catalogue_rooms_have_the_size_of_others_and_the_trained_focal_length(
    catalogue, monkeypatch, tmp_path
):
    monkeypatch.setattr(dataset, "ROOMS_PER_SHARD", 1)
    monkeypatch.setattr(dataset, "VIEWS_PER_ROOM", 2)
    list(dataset.render_shards(tmp_path, "train", 0, 1, catalogue))
    shards = dataset.Shards(tmp_path, "train")
    scene = varied_room(0, catalogue)
    renderer = Renderer(scene, threads=1)
    for (rgb, depth_m), (T_world_camera, camera) in zip(
        [shards[0], shards[1]], varied_views(0, scene, 2, renderer), strict=True
    ):
        assert rgb.shape == (240, 320, 3)
        assert rgb.std() > 3.0
        true_m = renderer.depth(camera, T_world_camera)
        np.testing.assert_allclose(depth_m, true_m * 262.5 / camera.fx_px, rtol=1e-3)

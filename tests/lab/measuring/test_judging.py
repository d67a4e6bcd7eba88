"""Measures of a rendered room beside the truth, and their summary."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from lab.benchmarks import measuring
from lab.measuring.clicks import away_from_edges, clicks, flat_normal
from lab.measuring.judging import RoomTask, judged_room, summaries
from lab.measuring.rooms import FOCAL_SD, HELD_OUT, TUNING, Room, TrueView, measured_room
from lab.measuring.things import true_boxes, true_holes
from lab.places.pairs import FIRST_ROOM
from lab.results.measuring import measuring as measuring_table
from lab.training.dataset import FIRST_SEED
from lab.walks.held_out import FIRST_ROOM as FIRST_WALK
from lab.worlds.furniture.placing import board
from lab.worlds.pieces.stock import SEEDS_OF_A_SPLIT
from lab.worlds.raycast import world_mesh
from lab.worlds.scene import Material, Scene
from packetmesh.errors import InputError
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.kernels import geometry
from pipeline.kernels.geometry import look_at
from pipeline.kernels.rays import hit_depth
from pipeline.types import CameraIntrinsics, RgbdFrame
from tests.pipeline.measuring.scenes import BOX_M, TABLE_M, box_on_table, measured, sheet, table_in_room

CAMERA = CameraIntrinsics.pinhole(130.0, 130.0, 79.5, 59.5, 160, 120)
FINE = CameraIntrinsics.pinhole(520.0, 520.0, 319.5, 239.5, 640, 480)


@pytest.fixture(scope="module")
def room():
    return measured_room(TUNING + 41)


def test_clicks_hit_what_the_same_pixel_truly_shows(room):
    found = list(islice(clicks(room, np.random.default_rng(0)), 400))
    measured = [click for click in found if not click.mark.guessed]
    off_m = np.array([np.linalg.norm(click.mark.point_m - click.true_m) for click in measured])
    raw_m = np.array(
        [np.linalg.norm(click.raw_m - click.true_m) for click in measured if click.raw_m is not None]
    )
    assert np.median(off_m) < np.median(raw_m) < 0.05
    assert {click.mark.node for click in found} >= {0, 1}
    assert room.surface.scale_sd == FOCAL_SD


def test_errors_are_those_of_the_calibration_and_differ_by_camera(room):
    ratios = [
        frame.intrinsics.fx_px / view.camera.fx_px for frame, view in zip(room.frames, room.true, strict=True)
    ]
    assert ratios[0] != ratios[1]
    assert np.abs(np.array(ratios) - 1.0).max() < 5 * FOCAL_SD


def test_no_click_is_at_a_depth_edge_and_flat_is_flat():
    z_m = np.full((120, 160), 2.0)
    z_m[:, 80:] = 1.0
    normals = np.tile([0.0, 0.0, -1.0], (120, 160, 1))
    view = TrueView(CAMERA, np.eye(4), z_m, normals)
    away = away_from_edges(view)
    assert away[60, 20]
    assert away[60, 140]
    assert not away[60, 76:84].any()
    points_m = view.points_m()
    assert flat_normal(points_m, np.zeros(3), 42, 60) == pytest.approx([0.0, 0.0, -1.0])
    assert flat_normal(points_m, np.zeros(3), 75, 60) is None
    assert flat_normal(points_m, np.zeros(3), 5, 60) is None


def test_all_kinds_are_judged_by_the_truth(room, monkeypatch):
    monkeypatch.setattr("lab.measuring.judging.measured_room", lambda seed: room)
    rows = judged_room(RoomTask(room.seed))
    assert {row["kind"] for row in rows} >= {"distance", "point-plane", "angle", "corner"}
    for kind, off in (("distance", 0.01), ("angle", 0.5), ("corner", 0.5)):
        some = [row for row in rows if row["kind"] == kind and not row["guessed"]]
        assert np.median([abs(row["value"] - row["true"]) for row in some]) < off


def box_room():
    """A camera above a box on a table, both as parts of a scene after six of the shell."""
    grey = Material(lambda points_m, normals: np.full(points_m.shape, 0.5))
    table = board((3.0, 3.0, 0.1), grey, np.eye(4), (0.0, 0.0, -0.05))
    box = board(BOX_M, grey, np.eye(4), [0.5 * side_m for side_m in BOX_M])
    scene = Scene("box", (*[table] * 6, box), (), np.ones(3), (), FINE)
    T = look_at((0.5, 0.8, 1.2), (0.15, 0.1, 0.1))
    depth = hit_depth(*world_mesh(scene), FINE, T)
    up = np.broadcast_to([0.0, 0.0, 1.0], (*depth.z_m.shape, 3))
    frame = RgbdFrame("node", np.zeros((*depth.z_m.shape, 3), np.uint8), depth, FINE, T)
    true = TrueView(FINE, T, depth.z_m.astype(float), up)
    return Room(0, (frame,), (T,), measured(box_on_table()), (true,), scene)


def test_the_true_sides_of_a_box_are_those_of_its_top_and_its_stand():
    ((measure, sides_m, _),) = true_boxes(box_room())
    assert sides_m == pytest.approx(BOX_M, abs=1e-6)
    assert [value.name for value in measure.values] == ["width", "depth", "height"]
    for value, true_m in zip(measure.values, sides_m, strict=True):
        assert value.ci95[0] <= true_m <= value.ci95[1]


def test_the_true_height_of_a_table_is_that_over_the_floor_whatever_was_measured(monkeypatch):
    """A chair's seat next to the table, on which a measure once stood it, is no truth."""
    grey = Material(lambda points_m, normals: np.full(points_m.shape, 0.5))
    floor = board((6.0, 6.0, 0.1), grey, np.eye(4), (0.0, 0.0, -0.05))
    top = board((1.5, 0.9, 0.04), grey, np.eye(4), (0.75, 0.45, 0.72))
    seat = board((0.45, 0.45, 0.04), grey, np.eye(4), (1.73, 0.45, 0.43))
    scene = Scene("table", (*[floor] * 6, top, seat), (), np.ones(3), (), FINE)
    T = look_at((0.75, 2.2, 2.6), (0.75, 0.45, 0.7))
    depth = hit_depth(*world_mesh(scene), FINE, T)
    up = np.broadcast_to([0.0, 0.0, 1.0], (*depth.z_m.shape, 3))
    frame = RgbdFrame("node", np.zeros((*depth.z_m.shape, 3), np.uint8), depth, FINE, T)
    surface = measured(table_in_room(((1.505, 0.225, 0.45), (0.45, 0.45))))
    room = Room(0, (frame,), (T,), surface, (TrueView(FINE, T, depth.z_m.astype(float), up),), scene)
    (measure, sides_m, _), *_ = true_boxes(room)
    assert sides_m == pytest.approx(TABLE_M, abs=1e-6)
    height = measure.values[2]
    assert height.value == pytest.approx(TABLE_M[2], abs=0.01)
    wrong = replace(height, value=0.29, ci95=(0.28, 0.3))
    seated = replace(measure, values=(*measure.values[:2], wrong))
    monkeypatch.setattr("lab.measuring.things.box_of_part", lambda surface, place_m: seated)
    (_, again_m, _), *_ = true_boxes(room)
    assert again_m == sides_m


def test_a_box_that_is_partly_hidden_is_not_judged():
    room = box_room()
    (view,) = room.true
    z_m = view.z_m.copy()
    z_m[:, : z_m.shape[1] // 2] = 0.4
    assert not list(true_boxes(replace(room, true=(replace(view, z_m=z_m),))))


def test_the_true_area_of_a_hole_is_that_between_the_true_points_of_its_rim():
    vertices_m, triangles, normals = sheet(12, 12, 0.05)
    middle = np.all(np.abs(vertices_m[triangles].mean(axis=1)[:, :2] - 0.3) < 0.1, axis=1)
    room = box_room()
    surface = measured((vertices_m, triangles[~middle], normals))
    T = look_at((0.3, 0.31, 1.5), (0.3, 0.3, 0.0))
    rays = geometry.pixel_rays(FINE) @ T[:3, :3].T
    flat_m = -(T[2, 3] - 0.01) / rays[..., 2]
    view = TrueView(FINE, T, flat_m, room.true[0].normals)
    ((measure, (area_m2,), _),) = true_holes(
        replace(room, surface=surface, true=(view,), T_world_camera=(T,))
    )
    assert measure.values[0].value == pytest.approx(0.04)
    assert area_m2 == pytest.approx(0.04 * ((1.5 - 0.01) / 1.5) ** 2, rel=0.06)


def row(room, covered, value=1.01, guessed=False, raw=0.02):
    low, high = (0.9, 1.1) if covered else (1.005, 1.1)
    return {
        "room": room, "kind": "distance", "guessed": guessed, "value": value, "true": 1.0, "low": low,
        "high": high, "covered": covered, "elapsed_s": 0.01, "raw_error": raw,
    }  # fmt: skip


def test_a_summary_counts_what_holds_and_resamples_rooms():
    rows = [row(0, True)] * 10 + [row(1, True)] * 9 + [row(1, False)] + [row(2, True, guessed=True, raw=None)]
    measured, guessed = summaries(rows)
    assert (measured["measures"], measured["rooms"], measured["guessed"]) == (20, 2, False)
    assert measured["coverage"] == pytest.approx(0.95)
    assert measured["coverage_ci95"] == pytest.approx((0.9, 1.0))
    assert measured["error_over_raw"] == pytest.approx(0.5)
    assert measured["median_half_width"] == pytest.approx(0.1)
    assert guessed["guessed"]
    assert guessed["error_over_raw"] is None


def test_a_room_too_full_for_a_camera_is_left_out(monkeypatch):
    def full(seed):
        raise InputError("too full")

    monkeypatch.setattr("lab.measuring.rooms.random_room", full)
    assert measured_room(1) is None


def test_rooms_that_choose_constants_share_no_furniture_with_rooms_that_judge():
    firsts = (*FIRST_SEED.values(), *FIRST_ROOM.values(), FIRST_WALK, HELD_OUT)
    assert TUNING // SEEDS_OF_A_SPLIT not in {first // SEEDS_OF_A_SPLIT for first in firsts}


def test_a_room_without_two_views_gives_no_row(monkeypatch):
    monkeypatch.setattr("lab.measuring.judging.measured_room", lambda seed: None)
    assert judged_room(RoomTask(1)) is None


def test_the_benchmark_goes_on_until_it_has_its_rooms(monkeypatch, tmp_path):
    def room_of(task):
        return None if task.seed % 2 else [row(task.seed, True)]

    monkeypatch.setattr(measuring, "FOLDER", tmp_path)
    given = set()

    def trials(name, work, tasks, folder, processes, data):
        given.update(data)
        return iter_done(work, tasks)

    monkeypatch.setattr(measuring, "iterate_trials", trials)
    monkeypatch.setattr(measuring, "judged_room", room_of)
    record = measuring.benchmark(rooms=5).record()
    assert given == {SHIPPED_MODEL, SHIPPED_COMPLETION}  # a room is reconstructed by both networks
    assert record["runs"][0]["rooms"] == 5
    assert record["peak_memory_bytes"] is None
    assert record["ours_s"] == 0.01
    text = measuring_table({"measuring": record})
    assert "| length | measured | 5 | 100.0 % [100.0 %, 100.0 %] | 10.00 mm | 0.5 | 100.00 mm | 10 |" in text


def iter_done(work, tasks):
    """As ``iterate_trials``, without files and processes."""
    return [work(task) for task in tasks]
    yield

"""C12 to C14 measure what they say on depths with known errors, and judge by their own rules."""

import json
import os
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.reports.reproduction import write_reproduction_report
from lab.claims.claim import Claim
from lab.claims.depth import claims
from lab.claims.depth.errors import (
    ALIGNMENTS,
    CHAIN,
    EDGES_M,
    JUDGED,
    SENSOR,
    STRIP_HEIGHT_PX,
    by_distance,
    distance_curve,
    frame_errors,
    from_trial,
    picture_strip,
    scene_errors,
    site_trial,
    within,
)
from lab.claims.depth.scenes import (
    HELD_OUT,
    VIEWS_PER_ROOM,
    Site,
    held_out_scenes,
    real_folders,
    set_paths,
    sites,
    user_sets,
)
from lab.training.dataset import FIRST_SEED
from lab.training.evaluate import Example
from packetmesh.errors import InputError
from packetmesh.files import finite
from packetmesh.progress import Progress, drain
from pipeline.depth import DepthNetwork
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 60, 80


class Answering:
    """Stands for a network whose errors are known: it answers with given depths, one after the other."""

    def __init__(self, *depths_m):
        self._depths_m = iter(depths_m)

    def infer(self, rgb):
        return DepthMap(next(self._depths_m), kind="relative")


def slope_m(near_m=1.0, far_m=5.0):
    """(H, W) a floor that recedes, with every depth between."""
    return np.broadcast_to(np.linspace(far_m, near_m, HEIGHT_PX)[:, None], (HEIGHT_PX, WIDTH_PX)).astype(
        np.float32
    )


def site(examples, truth=True, name="Scene 1", group=HELD_OUT, cap_m=10.0):
    return Site(name, group, lambda: iter(examples), truth, cap_m)


def example(truth_m, sensor_factor=1.002):
    sensor_m = (sensor_factor * truth_m).astype(np.float32)
    sensor_m[:, :8] = np.nan
    return Example(np.full((*truth_m.shape, 3), 90, np.uint8), DepthMap(sensor_m), truth_m)


def measured(inferred_m, truth_m=None, frames=VIEWS_PER_ROOM, **named):
    """A site whose every image has the same truth and the same answer."""
    truth_m = slope_m() if truth_m is None else truth_m
    return scene_errors(site([example(truth_m)] * frames, **named), Answering(*[inferred_m] * frames))


# errors


def test_a_wrong_scale_is_an_error_only_raw():
    scene = measured(1.3 * slope_m())
    assert scene.mean("raw", "abs_rel") == pytest.approx(0.3, abs=1e-5)
    assert scene.mean("raw", "rmse_log") == pytest.approx(np.log(1.3), abs=1e-5)
    assert scene.mean("raw", "delta_1") == 0.0
    assert scene.mean("raw", "delta_2") == 1.0
    for alignment in ("median-scaled", "affine-aligned"):
        assert scene.mean(alignment, "abs_rel") < 1e-5
        assert scene.mean(alignment, "delta_1") == 1.0


def test_an_offset_is_no_error_only_to_the_affine_alignment():
    scene = measured(slope_m() + 0.5)
    assert scene.mean("affine-aligned", "abs_rel") < 1e-5
    assert scene.mean("median-scaled", "abs_rel") > 0.03


def test_only_depths_below_the_cap_judge_and_align():
    truth_m = slope_m(far_m=20.0)
    inferred_m = np.where(truth_m < 10.0, truth_m, 3.0 * truth_m)
    assert measured(inferred_m, truth_m).mean(JUDGED, "abs_rel") < 1e-6
    assert measured(inferred_m, truth_m, cap_m=80.0).mean(JUDGED, "abs_rel") > 0.3
    assert np.nanmax(within(truth_m, 10.0)) < 10.0


def test_the_bins_of_distance_add_up_to_the_pooled_error():
    rng = np.random.default_rng(0)
    judging_m = within(rng.uniform(0.2, 9.9, (HEIGHT_PX, WIDTH_PX)), 10.0)
    z_m = judging_m * rng.uniform(0.5, 1.5, judging_m.shape)
    z_m[:5] = np.nan
    total, pixels = by_distance(z_m, judging_m)
    assert len(total) == len(pixels) == len(EDGES_M) - 1
    assert pixels.sum() == (HEIGHT_PX - 5) * WIDTH_PX
    np.testing.assert_allclose(
        total.sum() / pixels.sum(), np.nanmean(np.abs(z_m - judging_m) / judging_m), rtol=1e-12
    )


def test_the_pooled_error_counts_pixels_and_the_mean_counts_images():
    full_m, half_m = slope_m(), slope_m().copy()
    half_m[:, WIDTH_PX // 2 :] = np.nan
    answers = Answering(1.1 * full_m, 1.4 * slope_m())
    scene = scene_errors(site([example(full_m), example(half_m)]), answers)
    assert scene.mean("raw", "abs_rel") == pytest.approx(0.25, abs=1e-5)
    assert scene.pooled_abs_rel("raw") == pytest.approx((2 * 0.1 + 0.4) / 3, abs=1e-5)


def test_the_curve_over_distance_finds_where_the_error_is():
    truth_m = slope_m(1.0, 9.0)
    inferred_m = np.where(truth_m > 6.0, 1.5 * truth_m, truth_m)
    scene = measured(inferred_m, truth_m)
    middles_m, values = distance_curve(scene.frames, "raw")
    assert all(len(column) == VIEWS_PER_ROOM for column in values)
    for middle_m, column in zip(middles_m, values, strict=True):
        np.testing.assert_allclose(column, 0.5 if middle_m > 6.0 else 0.0, atol=1e-5)


def test_the_sensor_is_judged_where_it_sees_and_the_network_beside_it_there():
    truth_m = slope_m()
    inferred_m = truth_m.copy()
    inferred_m[:, :8] *= 5.0  # wrong only where the sensor has nothing
    given = example(truth_m, sensor_factor=1.02)
    judging_m = within(truth_m, 10.0)
    frame = frame_errors(given, DepthMap(inferred_m), judging_m, {"raw": inferred_m}, site([]))
    assert frame.beside_sensor[SENSOR] == pytest.approx(0.02, abs=1e-5)
    assert frame.beside_sensor["raw"] < 1e-6
    assert frame.aligned["raw"].abs_rel == pytest.approx(0.4, abs=1e-5)
    assert frame.beside_sensor[CHAIN] == pytest.approx(0.02, abs=1e-3)  # pulled onto the sensor


def test_a_site_without_truth_says_nothing_of_the_sensor():
    assert not measured(slope_m(), truth=False).frames[0].beside_sensor


def test_the_strip_shows_equal_depths_alike_and_unknown_ones_black():
    truth_m = slope_m().copy()
    truth_m[:10] = np.nan
    rgb = np.full((*truth_m.shape, 3), 200, np.uint8)
    strip = picture_strip(rgb, truth_m, slope_m())
    shown_px = round(STRIP_HEIGHT_PX * WIDTH_PX / HEIGHT_PX)
    assert strip.shape == (STRIP_HEIGHT_PX, 4 * shown_px, 3)
    color, true, inferred, error = np.split(strip, 4, axis=1)
    assert (color == 200).all()
    top, rest = np.s_[: STRIP_HEIGHT_PX // 8], np.s_[STRIP_HEIGHT_PX // 4 :]
    assert (true[top] == 0).all()
    assert (error[top] == 0).all()
    np.testing.assert_array_equal(true[rest], inferred[rest])
    assert error[rest].max() < 10


# claims


def three_scenes(factors, sensor_factor=1.002):
    """Scene 1 to 3, whose depth is off by a factor in the lower half."""
    for number, factor in enumerate(factors, 1):
        truth_m = slope_m()
        inferred_m = truth_m.copy()
        inferred_m[HEIGHT_PX // 2 :] *= factor
        examples = [example(truth_m, sensor_factor)] * VIEWS_PER_ROOM
        yield scene_errors(site(examples, name=f"Scene {number}"), Answering(*[inferred_m] * VIEWS_PER_ROOM))


def test_c12_is_reproduced_only_if_every_scene_meets_the_target():
    good = claims.judge_errors(tuple(three_scenes((1.1, 1.2, 1.3))))
    assert good.reproduced
    assert "KITTI" in good.why
    bad = claims.judge_errors(tuple(three_scenes((1.1, 1.2, 2.5))))
    assert not bad.reproduced
    assert bad.ours[f"abs_rel_{JUDGED}_Scene 3"] > claims.TARGET_ABS_REL
    assert {f"abs_rel_{JUDGED}_Scene {n}" for n in (1, 2, 3)} == set(bad.ci95)


def test_c12_shows_the_thesis_s_table_beside_ours_for_every_alignment():
    outcome = claims.judge_errors(tuple(three_scenes((1.1, 1.2, 1.3))))
    tables = claims.error_tables(tuple(three_scenes((1.1, 1.2, 1.3))))
    assert [alignment in table.title for table, alignment in zip(tables, ALIGNMENTS, strict=True)] == [
        True
    ] * 3
    for table in tables:
        assert all(len(row) == len(table.header) for row in table.rows)
        assert [row[3:6] for row in table.rows[:3]] == list(claims.TABLE_4_3)
        assert [row[0] for row in table.rows[3:]] == ["Scene 1", "Scene 2", "Scene 3"]
    kinds = [type(exhibit).__name__ for exhibit in outcome.exhibits]
    assert kinds == ["Table"] * 3 + ["Chart"] + ["Picture"] * 3


def test_indoor_and_outdoor_errors_have_charts_of_their_own():
    indoors = tuple(three_scenes((1.1, 1.2, 1.3)))
    far_m = slope_m(5.0, 60.0)
    street = measured(1.2 * far_m, far_m, name="kitti=/x", group="set kitti", cap_m=80.0, truth=False)
    charts = claims.distance_charts((*indoors, street))
    assert [[curve.label for curve in chart.curves] for chart in charts] == [[HELD_OUT], ["set kitti"]]
    assert charts[1].curves[0].x[-1] > 10.0 > charts[0].curves[0].x[-1]


def test_c13_the_printed_averages_are_population_values():
    outcome = claims.arithmetic()
    assert outcome.reproduced
    assert round(outcome.ours["rmse_mean_m"], 3) == 6.640
    assert round(outcome.ours["rmse_sd_m"], 3) == 0.963
    assert round(outcome.ours["abs_rel_mean"], 3) == 0.243
    assert round(outcome.ours["abs_rel_sd"], 3) == 0.086
    assert outcome.ours["rmse_sample_sd_m"] == pytest.approx(outcome.ours["rmse_sd_m"] * np.sqrt(1.5))


def test_c13_is_not_reproduced_by_another_table(monkeypatch):
    monkeypatch.setattr(claims, "TABLE_4_3", (*claims.TABLE_4_3[:2], (5.657, 0.236, 0.161)))
    outcome = claims.arithmetic()
    assert not outcome.reproduced
    assert "off" in outcome.why


def test_c14_needs_the_network_to_be_worse_on_every_scene():
    worse = claims.judge_against_sensor(tuple(three_scenes((1.3, 1.4, 1.5))))
    assert worse.reproduced
    rows = worse.exhibits[0].rows
    assert [row[0] for row in rows] == ["Scene 1", "Scene 2", "Scene 3"]
    assert all(min(row[2:]) > row[1] for row in rows)
    better = claims.judge_against_sensor(tuple(three_scenes((1.3, 1.0, 1.5), sensor_factor=1.05)))
    assert not better.reproduced


def test_c14_leaves_out_what_nobody_knows_and_says_so():
    real = measured(slope_m(), truth=False, name="kinect", group="real frames")
    outcome = claims.judge_against_sensor((*three_scenes((1.3, 1.4, 1.5)), real))
    assert not any("kinect" in name for name in outcome.ours)
    assert "the sensor's error on kinect is unknown" in outcome.why


def test_the_report_and_the_record_hold_everything(tmp_path):
    scenes = tuple(three_scenes((1.1, 1.2, 1.3)))
    verdicts = [
        Claim("C12", "c", "t", "tol", lambda: claims.judge_errors(scenes)).judge(),
        claims.C13.judge(),
        Claim("C14", "c", "t", "tol", lambda: claims.judge_against_sensor(scenes)).judge(),
    ]
    path = tmp_path / "reproduce.html"
    write_reproduction_report(verdicts, path)
    page = path.read_text("utf-8")
    assert page.count("<img") == 3
    assert "thesis, scene 2" in page
    json.dumps(finite([verdict.record() for verdict in verdicts]), allow_nan=False)


# scenes


def test_the_held_out_rooms_are_of_the_test_split_and_overlap_nowhere():
    rooms = [site.examples.args[0] for site in held_out_scenes()]
    assert [site.name for site in held_out_scenes()] == ["Scene 1", "Scene 2", "Scene 3"]
    seeds = [seed for room in rooms for seed in room]
    assert min(seeds) == FIRST_SEED["test"] > FIRST_SEED["validation"] > FIRST_SEED["train"]
    assert len(set(seeds)) == len(seeds) == 150


def test_the_shipped_network_errs_less_than_half_of_a_flat_wall_and_of_its_own_depth_mirrored():
    """A network that did not look at the image would do no better than these two."""
    network = DepthNetwork()
    room = held_out_scenes(rooms=1, views=1)[1]
    (image,) = room.examples()
    inferred = network.infer(image.rgb)
    seen, flat, mirrored = (
        scene_errors(site([image]), Answering(z_m))
        for z_m in (inferred.z_m, np.ones_like(inferred.z_m), inferred.z_m[:, ::-1])
    )
    for alignment in ("median-scaled", "affine-aligned"):
        error = seen.mean(alignment, "abs_rel")
        assert error < 0.5 * flat.mean(alignment, "abs_rel")
        assert error < 0.5 * mirrored.mean(alignment, "abs_rel")
    assert seen.beside_sensor(SENSOR) < 0.02 < seen.beside_sensor(JUDGED)
    np.testing.assert_array_equal(
        scene_errors(room, network).frames[0].binned["raw"], seen.frames[0].binned["raw"]
    )


def test_a_stored_site_is_the_measured_one():
    room = held_out_scenes(rooms=1, views=1)[0]
    measured = scene_errors(room, DepthNetwork())
    again = from_trial(room, json.loads(json.dumps(finite(site_trial(room)))))
    np.testing.assert_array_equal(again.strip, measured.strip)
    for before, after in zip(measured.frames, again.frames, strict=True):
        assert (after.aligned, after.beside_sensor) == (before.aligned, before.beside_sensor)
        for name in ALIGNMENTS:
            np.testing.assert_array_equal(after.binned[name], before.binned[name])


def test_real_folders_are_found_where_the_variable_says(tmp_path, monkeypatch):
    folder = tmp_path / "desk"
    folder.mkdir()
    rgb, z_mm = np.full((48, 64, 3), 128, np.uint8), np.full((48, 64), 1500, np.uint16)
    cv2.imwrite(str(folder / "color.png"), rgb)
    cv2.imwrite(str(folder / "depth.png"), z_mm)
    camera = {"fx": 60.0, "fy": 60.0, "cx": 31.5, "cy": 23.5, "width": 64, "height": 48}
    (folder / "intrinsics.json").write_text(json.dumps(camera))
    monkeypatch.setenv("PACKETMESH_SHARED_DATA", str(tmp_path))
    assert real_folders() == (folder,)
    (desk,) = (site for site in sites() if site.group == "real frames")
    assert (desk.name, desk.truth) == ("desk", False)
    (only,) = desk.examples()
    np.testing.assert_allclose(only.truth_m, 1.5)


def test_no_real_frames_are_no_error(tmp_path, monkeypatch):
    monkeypatch.setenv("PACKETMESH_SHARED_DATA", str(tmp_path / "nothing"))
    assert real_folders() == ()


def test_a_user_s_sets_are_named_by_a_variable(monkeypatch):
    monkeypatch.setenv("PACKETMESH_DEPTH_SETS", os.pathsep.join(("kitti=/a", "nyu=/b")))
    kitti, nyu = user_sets()
    assert (kitti.group, kitti.cap_m, kitti.truth) == ("set kitti", 80.0, False)
    assert (nyu.group, nyu.cap_m) == ("set nyu", 10.0)
    assert isinstance(nyu.examples, partial)
    assert nyu.examples.args == ("nyu=/b",)


@pytest.mark.parametrize("text", ["nyu", "nyu= ", "=/b"])
def test_a_set_without_kind_or_path_is_refused(monkeypatch, text):
    monkeypatch.setenv("PACKETMESH_DEPTH_SETS", os.pathsep.join(("kitti=/a", text)))
    with pytest.raises(InputError, match=f"PACKETMESH_DEPTH_SETS names the set '{text}' without"):
        set_paths()


def test_the_trials_depend_on_the_files_of_the_user_s_sets(tmp_path, monkeypatch):
    given = []

    def trials(stage, function, tasks, folder, scheduler, data):
        given.extend(data)
        yield Progress(stage, 1.0)
        return []

    monkeypatch.setattr(claims, "iterate_trials", trials)
    monkeypatch.setattr(claims, "sites", tuple)
    monkeypatch.setenv("PACKETMESH_DEPTH_SETS", os.pathsep.join(("folder= ~/a", f"nyu={tmp_path}/b.mat")))
    assert drain(claims.infer_all(tmp_path, None)) == ()
    assert given[-2:] == [Path.home() / "a", tmp_path / "b.mat"]


def test_a_folder_of_pairs_is_measured_like_any_other_site(tmp_path, monkeypatch):
    rgb = np.random.default_rng(3).integers(0, 255, (96, 128, 3), np.uint8)
    z_mm = np.tile(np.linspace(1000, 4000, 128).astype(np.uint16), (96, 1))
    cv2.imwrite(str(tmp_path / "color.png"), rgb[..., ::-1])
    cv2.imwrite(str(tmp_path / "depth.png"), z_mm)
    monkeypatch.setenv("PACKETMESH_DEPTH_SETS", f"folder={tmp_path}")
    (site,) = user_sets()
    result = scene_errors(site, DepthNetwork())
    assert sum(result.frames[0].binned["raw"][1]) == 96 * 128
    inferred_m, true_m = DepthNetwork().infer(rgb).z_m, z_mm / 1000.0
    scaled_m = inferred_m * np.median(true_m) / np.median(inferred_m)
    for alignment, z_m in (("raw", inferred_m), (JUDGED, scaled_m)):
        expected = np.mean(np.abs(z_m - true_m) / true_m)
        assert result.mean(alignment, "abs_rel") == pytest.approx(expected, rel=1e-3)

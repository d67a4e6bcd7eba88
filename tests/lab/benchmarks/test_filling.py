"""The depth benchmark judges every program by the same pixels, and knows the network's time and size."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from lab.benchmarks import CASES, Benchmark
from lab.benchmarks.depth import error_lines, network_speed
from lab.benchmarks.filling import (
    FLAT,
    HIDDEN_SHARE,
    NETWORK,
    OURS,
    PIXELS,
    RADII_PX,
    REAL_DRAWS,
    HoleCase,
    compare_fillings,
    disc_cases,
    discs,
    hidden_case,
    hidden_cases,
    mean_ci95,
    programs,
)
from lab.claims.depth.scenes import HELD_OUT, REAL, Site, held_out_scenes
from lab.training.evaluate import Example
from packetmesh.files import finite
from pipeline.depth import DepthNetwork
from pipeline.depth.fillers import PEERS
from pipeline.io.demos import load_demo
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 40, 50


def case(place="a", group="g"):
    """A wall 2 m away, of which the sensor misses 100 pixels."""
    truth_m = np.full((HEIGHT_PX, WIDTH_PX), 2.0, np.float32)
    hole = np.zeros(truth_m.shape, bool)
    hole[10:20, 10:20] = True
    sensor = DepthMap(np.where(hole, np.float32(np.nan), truth_m))
    return HoleCase(place, group, np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8), sensor, hole, truth_m)


def constant(z_m):
    return lambda sensor, rgb: DepthMap(np.full(sensor.z_m.shape, z_m, np.float32))


def half(sensor, rgb):
    """Exact in the hole's upper half, silent in the lower."""
    z_m = np.full(sensor.z_m.shape, 2.0, np.float32)
    z_m[15:] = np.nan
    return DepthMap(z_m)


def test_every_measure_has_its_known_answer():
    programs = {"exact": constant(2.0), "near": constant(2.08), "far": constant(2.4), "half": half}
    runs = {run.program: run for run in compare_fillings(iter([case(), case("b")]), programs)}
    assert list(runs) == list(programs)
    assert {run.images for run in runs.values()} == {2}
    assert runs["exact"].abs_rel == 0.0
    assert runs["near"].abs_rel == pytest.approx(0.04, abs=1e-6)
    assert runs["far"].abs_rel == pytest.approx(0.2, abs=1e-6)
    assert runs["far"].abs_rel_ci95 == pytest.approx((0.2, 0.2), abs=1e-6)
    assert runs["far"].median_error_m == pytest.approx(0.4, abs=1e-6)
    assert runs["exact"].excess_ci95 == (0.0, 0.0)
    assert runs["far"].excess_ci95 == pytest.approx((0.2, 0.2), abs=1e-6)
    assert [runs[name].close_share for name in programs] == [1.0, 1.0, 0.0, 0.5]
    assert [runs[name].filled_share for name in programs] == [1.0, 1.0, 1.0, 0.5]


def test_silence_costs_what_the_nearest_depth_costs():
    """Around the hole the sensor says 3 m: half of the pixels are off by half, those filled not at all."""
    around = case()
    around = replace(around, sensor=DepthMap(np.where(around.hole, np.float32(np.nan), np.float32(3.0))))
    (run,) = compare_fillings(iter([around]), {"half": half})
    assert (run.abs_rel, run.abs_rel_filled) == (pytest.approx(0.25), 0.0)
    assert (run.close_share, run.filled_share) == (0.5, 0.5)
    (silent,) = compare_fillings(iter([around]), {"silent": constant(np.nan)})
    assert silent.abs_rel == pytest.approx(0.5)
    assert np.isnan(silent.abs_rel_filled)


def test_an_interval_resamples_places_not_pixels():
    """Two places of unlike errors may each be drawn twice; many pixels of one place say no more than one."""
    values = np.repeat([0.0, 1.0], 100)
    assert mean_ci95(values, np.repeat([0, 1], 100)) == (0.0, 1.0)
    low, high = mean_ci95(values, np.arange(200))
    assert 0.4 < low < 0.5 < high < 0.6
    assert mean_ci95(np.array([0.0, 1.0, 1.0, 1.0]), np.zeros(4, int)) == (0.75, 0.75)


def test_a_line_ranks_everyone_over_all_pixels():
    everyone = {"far": constant(2.4), "exact": constant(2.0)}
    runs = compare_fillings(iter([case(group="g"), case(group="h")]), everyone)
    assert list(error_lines(runs)) == [f"{group}: exact 0.0000, far 0.2000" for group in "gh"]


def test_an_excess_is_of_the_same_pixels():
    """Two places, one far harder: the errors' intervals overlap, but not that of their difference."""
    easy, hard = case("a"), case("b")
    hard = replace(hard, truth_m=np.full_like(hard.truth_m, 4.0))
    better, worse = compare_fillings(iter([easy, hard]), {"a": constant(2.0), "b": constant(1.96)})
    assert better.abs_rel_ci95 == pytest.approx((0.0, 0.5), abs=1e-6)
    assert worse.abs_rel_ci95[0] < better.abs_rel_ci95[1]
    assert worse.excess_ci95 == pytest.approx((0.01, 0.02), abs=1e-6)


def test_groups_are_kept_apart_and_programs_see_no_hidden_depth():
    seen = []

    def watching(sensor, rgb):
        seen.append(sensor.valid)
        return constant(2.0)(sensor, rgb)

    runs = compare_fillings(iter([case(group="g"), case(group="h")]), {"watching": watching})
    assert [run.group for run in runs] == ["g", "h"]
    assert all(not valid[case().hole].any() and valid[~case().hole].all() for valid in seen)


def test_a_hidden_case_hides_depth_and_nothing_else():
    frame = load_demo("box-on-table").frames[0]
    hidden = hidden_case("x", "g", frame.rgb, frame.depth, np.random.default_rng(1))
    assert frame.depth.valid[hidden.hole].all()
    assert hidden.hole.sum() == pytest.approx(HIDDEN_SHARE * frame.depth.valid.sum(), rel=0.2)
    np.testing.assert_array_equal(hidden.sensor.valid, frame.depth.valid & ~hidden.hole)
    kept = hidden.sensor.valid
    np.testing.assert_array_equal(hidden.sensor.z_m[kept], frame.depth.z_m[kept])


def test_rooms_come_with_hidden_depth_and_with_their_own_holes():
    cases = hidden_cases(held_out_scenes(1, 1)[0])
    hidden, own = next(cases), next(cases)
    assert hidden.place == own.place
    assert not own.sensor.valid[own.hole].any()
    assert np.isfinite(own.truth_m[own.hole]).all()
    assert own.hole.any()
    assert not np.array_equal(hidden.hole, own.hole)


def test_ours_and_every_peer_fill_a_demo_frame():
    frame = load_demo("box-on-table").frames[1]
    hidden = hidden_case("x", "g", frame.rgb, frame.depth, np.random.default_rng(1))
    median = constant(np.nanmedian(frame.depth.z_m))
    everyone = {**programs(DepthNetwork()), "median": median}
    runs = {run.program: run for run in compare_fillings(iter([hidden]), everyone)}
    assert set(runs) == {OURS, NETWORK, FLAT, PIXELS, *PEERS, "median"}
    assert all(runs[name].filled_share == 1.0 for name in PEERS)
    assert runs[OURS].filled_share > 0.9
    assert all(runs[name].abs_rel < 0.3 * runs["median"].abs_rel for name in (OURS, NETWORK, FLAT, *PEERS))
    assert runs[OURS].abs_rel < min(0.9 * runs["nearest"].abs_rel, runs[PIXELS].abs_rel)


def test_a_disc_hides_measured_depth_in_a_circle_of_its_size():
    frame = load_demo("box-on-table").frames[0]
    cases = list(discs("x", "g", frame.rgb, frame.depth, np.random.default_rng(0)))
    assert [case.group for case in cases] == [f"g, disc of {radius_px} px" for radius_px in RADII_PX]
    for case, radius_px in zip(cases, RADII_PX, strict=True):
        assert frame.depth.valid[case.hole].all()
        assert 0.8 * np.pi * radius_px**2 <= case.hole.sum() <= 1.1 * np.pi * radius_px**2
        rows, columns = np.nonzero(case.hole)
        assert np.ptp(rows) <= 2 * radius_px >= np.ptp(columns)
        np.testing.assert_array_equal(case.sensor.valid, frame.depth.valid & ~case.hole)


def test_a_disc_that_finds_no_place_is_left_out():
    thin = DepthMap(np.full((40, 640), 2.0, np.float32))
    rgb = np.zeros((40, 640, 3), np.uint8)
    found = list(discs("x", "g", rgb, thin, np.random.default_rng(0)))
    assert [case.group for case in found] == ["g, disc of 10 px"]
    empty = DepthMap(np.full((40, 640), np.nan, np.float32))
    assert list(discs("x", "g", rgb, empty, np.random.default_rng(0))) == []


@pytest.mark.parametrize(
    ("group", "truth", "places"),
    [
        (HELD_OUT, True, ["s/0", "s/0", "s/0", "s/1"]),
        ("demo scenes", True, ["s"] * 4),
        (REAL, False, [f"s/{draw}" for _ in range(4) for draw in range(REAL_DRAWS)]),
    ],
)
def test_views_of_a_room_are_one_place_and_real_frames_are_drawn_again(group, truth, places):
    """Real frames have no truth, and so no own holes that could be judged."""
    example = Example(case().rgb, DepthMap(case().truth_m), case().truth_m)
    site = Site("s", group, lambda: iter([example] * 4), truth)
    cases = list(hidden_cases(site))
    hidden = [one for one in cases if one.group == f"{group}, hidden"]
    assert [one.place for one in hidden] == places
    assert len(cases) == len(hidden) * (2 if truth else 1)
    assert len({one.hole.tobytes() for one in hidden}) > 1


def test_discs_are_scaled_with_the_image():
    first = next(disc_cases(held_out_scenes(1, 1)[0]))
    width_px = first.rgb.shape[1]
    assert width_px < 640
    assert first.hole.sum() == pytest.approx(np.pi * (RADII_PX[0] * width_px / 640) ** 2, rel=0.25)


class Described:
    """Stands for a network of a known file that takes a known time by a clock of the test's own."""

    provider = "test"

    def __init__(self, path, file_bytes, infer_s, monkeypatch, **description):
        with path.open("wb") as file:
            file.truncate(file_bytes)
        self.model_path, self.description = path, description
        self._now_s, self._infer_s = 0.0, infer_s
        monkeypatch.setattr("time.perf_counter", lambda: self._now_s)

    def infer(self, rgb):
        self._now_s += self._infer_s


@pytest.mark.parametrize(
    ("description", "cost"),
    [({"abs_rel": "0.105", "float_abs_rel": "0.1"}, pytest.approx(0.005)), ({"abs_rel": "0.1"}, None)],
)
def test_a_network_s_speed_has_its_time_its_size_and_its_cost(tmp_path, monkeypatch, description, cost):
    network = Described(tmp_path / "a.onnx", 39 * 10**6, 0.049, monkeypatch, **description)
    speed = network_speed(network, np.zeros((4, 4, 3), np.uint8), rounds=3)
    assert (speed.elapsed_s, speed.slowest_s) == (pytest.approx(0.049), pytest.approx(0.049))
    assert speed.file_bytes == 39 * 10**6
    assert speed.quantisation_cost == cost


def test_the_shipped_network_is_small_and_says_what_its_8_bits_cost():
    speed = network_speed(DepthNetwork(), load_demo("box-on-table").frames[0].rgb, rounds=1)
    assert speed.file_bytes <= 40e6
    assert abs(speed.quantisation_cost) < 0.01 < speed.abs_rel < 0.25


def test_the_benchmark_is_registered_and_its_record_is_plain():
    assert "depth" in CASES
    (run,) = compare_fillings(iter([case()]), {"exact": constant(2.0)})
    record = Benchmark(0.1, {"exact": 0.2}, 1, errors_m={"exact": 0.0}, runs=(asdict(run),)).record()
    json.dumps(finite(record), allow_nan=False)

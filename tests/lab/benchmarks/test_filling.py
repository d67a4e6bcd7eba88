"""The depth benchmark judges every program by the same pixels, and knows the network's time and size."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from lab.benchmarks import CASES, Benchmark
from lab.benchmarks.depth import network_speed
from lab.benchmarks.filling import (
    HIDDEN_SHARE,
    OURS,
    HoleCase,
    compare_fillings,
    hidden_case,
    hidden_cases,
    our_filling,
)
from packetmesh.files import finite
from pipeline.depth import DepthNetwork
from pipeline.depth.fillers import PEERS
from pipeline.io.demos import load_demo
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 40, 50


def case(name="a", group="g"):
    """A wall 2 m away, of which the sensor misses 100 pixels."""
    truth_m = np.full((HEIGHT_PX, WIDTH_PX), 2.0, np.float32)
    hole = np.zeros(truth_m.shape, bool)
    hole[10:20, 10:20] = True
    sensor = DepthMap(np.where(hole, np.float32(np.nan), truth_m))
    return HoleCase(name, group, np.zeros((HEIGHT_PX, WIDTH_PX, 3), np.uint8), sensor, hole, truth_m)


def constant(z_m):
    return lambda sensor, rgb: DepthMap(np.full(sensor.z_m.shape, z_m, np.float32))


def flat(sensor, rgb):
    """The sensor's median everywhere."""
    return DepthMap(np.full(sensor.z_m.shape, np.nanmedian(sensor.z_m), np.float32))


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
    assert runs["far"].abs_rel_shared == pytest.approx(0.2, abs=1e-6)
    assert runs["far"].median_error_m == pytest.approx(0.4, abs=1e-6)
    assert [runs[name].close_share for name in programs] == [1.0, 1.0, 0.0, 0.5]
    assert [runs[name].filled_share for name in programs] == [1.0, 1.0, 1.0, 0.5]


def test_silence_is_no_error_but_no_success_either():
    (run,) = compare_fillings(iter([case()]), {"half": half})
    assert (run.abs_rel, run.close_share) == (0.0, 0.5)


def test_what_all_filled_is_judged_apart():
    def wrong_below(sensor, rgb):
        z_m = np.full(sensor.z_m.shape, 2.0, np.float32)
        z_m[15:] = 4.0
        return DepthMap(z_m)

    runs = {
        run.program: run for run in compare_fillings(iter([case()]), {"wrong": wrong_below, "half": half})
    }
    assert runs["wrong"].abs_rel == pytest.approx(0.5)
    assert runs["wrong"].abs_rel_shared == 0.0


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
    hidden = hidden_case("x", "g", frame.rgb, frame.depth, 1)
    assert frame.depth.valid[hidden.hole].all()
    assert hidden.hole.sum() == pytest.approx(HIDDEN_SHARE * frame.depth.valid.sum(), rel=0.2)
    np.testing.assert_array_equal(hidden.sensor.valid, frame.depth.valid & ~hidden.hole)
    kept = hidden.sensor.valid
    np.testing.assert_array_equal(hidden.sensor.z_m[kept], frame.depth.z_m[kept])


def test_rooms_come_with_hidden_depth_and_with_their_own_holes():
    cases = hidden_cases()
    hidden, own = next(cases), next(cases)
    assert hidden.name == own.name
    assert not own.sensor.valid[own.hole].any()
    assert np.isfinite(own.truth_m[own.hole]).all()
    assert own.hole.any()
    assert not np.array_equal(hidden.hole, own.hole)


def test_ours_and_every_peer_fill_a_demo_frame():
    frame = load_demo("box-on-table").frames[1]
    hidden = hidden_case("x", "g", frame.rgb, frame.depth, 1)
    programs = {OURS: our_filling(DepthNetwork()), **PEERS, "flat": flat}
    runs = {run.program: run for run in compare_fillings(iter([hidden]), programs)}
    assert set(runs) == set(programs)
    assert all(runs[name].filled_share == 1.0 for name in PEERS)
    assert runs[OURS].filled_share > 0.9
    assert all(runs[name].abs_rel < 0.25 * runs["flat"].abs_rel for name in (OURS, *PEERS))
    assert runs[OURS].abs_rel_shared < 0.8 * runs["nearest"].abs_rel_shared


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
    assert abs(speed.quantisation_cost) < 0.01 < speed.abs_rel < 0.2


def test_the_benchmark_is_registered_and_its_record_is_plain():
    assert "depth" in CASES
    (run,) = compare_fillings(iter([case()]), {"exact": constant(2.0)})
    record = Benchmark(0.1, {"exact": 0.2}, 1, errors_m={"exact": 0.0}, runs=(asdict(run),)).record()
    json.dumps(finite(record), allow_nan=False)

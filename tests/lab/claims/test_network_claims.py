"""The network's claims: known answers of the fits, small studies, and runs that are kept."""

import json
import os

import numpy as np
import pytest

from lab.benchmarks.network import SATURATED, benchmark
from lab.claims import registry
from lab.claims.network import link, radio, selection, street, study
from lab.claims.network.intervals import interval
from lab.claims.network.tasks import STREET_METRICS, saturated, transfer
from network_sim.fixed.selection import all_cameras
from network_sim.presets import PRESETS
from packetmesh.errors import InputError
from packetmesh.progress import Progress, drain
from packetmesh.settings import with_settings

TINY = with_settings(PRESETS["thesis-link"], ["nodes.image_bytes=2000", "run.horizon_s=10"])


def fake(found_by_case):
    """A study in which every run of a case is alike."""
    return {case: [metrics] * study.RUNS for case, metrics in found_by_case.items()}


def of_case(images, coverage=0.9, requests=0.0, summaries=1000.0):
    return dict.fromkeys(STREET_METRICS, 0.5) | {
        "images_per_minute": images,
        "coverage": coverage,
        "request_bytes": requests,
        "summary_bytes": summaries,
    }


def as_claimed():
    """What the thesis says of the schemes, GREEDY's wider coverage included."""
    cases = {}
    for n in study.OBJECTS:
        cases[study.Case("baseline", n)] = of_case(30.0 * n, 0.85)
        cases[study.Case("pdc", n)] = of_case(20.0 * n, 0.8)
        cases[study.Case("greedy", n)] = of_case(10.0 * n, 0.9, 800.0)
    for k, images in ((3, 80.0), (5, 130.0), (10, 250.0), (20, 317.0)):
        cases[study.Case("greedy", study.CAPPED_OBJECTS, k)] = of_case(images, 0.5, 2.0 * images)
    return cases


def test_what_needs_no_run_is_judged_at_once():
    events = registry.run_claims(["C26", "C27", "C29", "C31"])
    verdicts = {event.id: event for event in events if not isinstance(event, Progress)}
    assert {name: v.verdict for name, v in verdicts.items()} == {
        "C26": "true by definition",
        "C27": "true by definition",
        "C29": "not reproduced",
        "C31": "true by definition",
    }
    assert verdicts["C26"].ours["ppm_bytes"] == 921_615
    assert verdicts["C29"].ours["wrong_rows"] == 3
    json.dumps([verdict.record() for verdict in verdicts.values()], allow_nan=False)


def test_the_fits_to_table_4_6_are_those_of_the_specification():
    n = np.array(link.IMAGES, float)
    assert link.line_through_origin() == pytest.approx(159.85, abs=0.01)
    assert link.mape(link.line_through_origin() * n) == pytest.approx(0.061, abs=0.0006)
    assert link.mape(link.line_through_origin(link.mape) * n) == pytest.approx(0.059, abs=0.0006)
    assert link.mape(164.3 * n) == pytest.approx(0.062, abs=0.0006)
    low, high = link.slope_interval()
    assert low < 159.85 < high
    slopes = np.linspace(100.0, 220.0, 2001)
    best = link.line_through_origin(link.mape)
    assert min(link.mape(slope * n) for slope in slopes) >= link.mape(best * n) - 1e-12


def test_the_fitted_lines_are_the_least_squares_ones():
    runs = link.LinkRuns(np.full((5, 3), 160.0), np.full(5, 160.0))
    models = link.fits(runs)
    assert models["affine line"] == pytest.approx(163.1 * np.arange(1, 6) - 11.9, abs=0.1)
    assert set(models) > {"A: 802.15.4, simulated", "B: serial line, simulated", "C: fitted goodput"}


@pytest.mark.parametrize(("slope_s", "reproduced"), [(164.3, True), (190.0, False)])
def test_c28_follows_its_runs(slope_s, reproduced):
    times_s = slope_s * np.arange(1.0, 6.0)
    outcome = link.CLAIMS[2].experiment(link.LinkRuns(np.tile(times_s[:, None], 3), 160.0 * np.arange(1, 6)))
    assert outcome.reproduced is reproduced
    assert ("cannot decide" in outcome.why) is reproduced
    assert outcome.ours["mape_A"] == pytest.approx(link.mape(times_s))


def test_a_transfer_over_serial_lines_takes_ten_bits_a_byte():
    config = with_settings(link.model_b(1), ["nodes.image_bytes=11600"])
    assert transfer(config)["transfer_s"] == pytest.approx(11_600 * 10 / 57_600, abs=0.011)


def test_an_unfinished_transfer_has_no_time():
    assert transfer(with_settings(TINY, ["run.horizon_s=0.01"])) == {"transfer_s": None}


def test_one_saturated_station_gets_what_bianchi_says():
    throughput_bps = saturated(radio.crowd(1, seed=0, wait_after_loss=True, duration_s=3.0))["throughput_bps"]
    assert throughput_bps == pytest.approx(8000 / (1275.818182e-6 + 310e-6), rel=0.01)


def test_c32_states_the_data_rate_and_fails_with_another(monkeypatch):
    bps = (1e6,) * len(radio.STATIONS)
    runs = radio.Throughputs(tuple((value,) * radio.RUNS for value in bps), bps)
    (claim,) = radio.CLAIMS
    assert claim.experiment((runs, runs)).reproduced
    assert ("data rate, Mbit/s", 11.0, 11.0) in claim.experiment((runs, runs)).exhibits[0].rows
    monkeypatch.setattr(radio, "STREET", with_settings(radio.STREET, ["mac.rate_bps=2e6"]))
    assert not claim.experiment((runs, runs)).reproduced


def test_an_interrupted_claim_resumes_and_gives_the_same_verdict(tmp_path, monkeypatch):
    monkeypatch.setattr(link, "LINK", with_settings(link.LINK, ["nodes.image_bytes=2000"]))
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    whole = list(registry.run_claims(["C28"], tmp_path / "whole"))
    run = registry.run_claims(["C28"], tmp_path / "cut")
    before = [next(run) for _ in range(8)]
    run.close()
    after = list(registry.run_claims(["C28"], tmp_path / "cut"))
    assert [event.fraction for event in whole[:-1]] == [k / 20 for k in range(21)]
    assert all(event.stage.startswith("C28") for event in whole[:-1])
    assert after[0].fraction == before[-1].fraction == 7 / 20
    assert len(after) == 15
    assert after[-1].record() == whole[-1].record()


def test_the_scheduler_reaches_the_trials(tmp_path):
    for name in ("C12", "C16", "C22", "C23", "C28", "C30", "C32", "C33"):
        with pytest.raises(InputError, match="no Dask scheduler at nowhere://1"):
            list(registry.run_claims([name], tmp_path, "nowhere://1"))


def test_the_study_has_every_case_once_and_shares_seeds():
    cases = study.standard_cases()
    assert len(cases) == len(set(cases)) == len(study.OBJECTS) * len(study.SCHEMES) + len(study.CAPS) - 1
    config = study.Case("greedy", 40, 5).config()
    assert (config.scheme.name, config.street.vehicles, config.scheme.k) == ("greedy", 40, 5)
    assert (config.run.horizon_s, config.run.warmup_s) == (18_000.0, 1800.0)


def test_small_runs_of_the_street_come_back_by_case(tmp_path):
    cases = (study.Case("greedy", 4, 3), study.Case("baseline", 6))
    found = drain(study.run_cases("small", cases, tmp_path, horizon_s=2100.0, runs=2))
    assert set(found) == set(cases)
    assert all(len(runs) == 2 for runs in found.values())
    assert study.mean(found, cases[1], "images_per_minute") > study.mean(found, cases[0], "images_per_minute")
    assert study.mean(found, cases[0], "request_bytes") > 0.0 == study.mean(found, cases[1], "request_bytes")


def test_the_street_s_claims_follow_its_numbers():
    found = fake(as_claimed())
    by_id = {claim.id: claim for claim in street.CLAIMS}
    for name in ("C33", "C34", "C35"):
        outcome = by_id[name].experiment(found)
        assert outcome.reproduced, outcome.why
        assert outcome.exhibits
    fewer = found | fake({study.Case("baseline", 120): of_case(1.0)})
    assert not by_id["C34"].experiment(fewer).reproduced
    narrower = found | fake({study.Case("greedy", 120): of_case(1200.0, 0.84, 800.0)})
    outcome = by_id["C34"].experiment(narrower)
    assert not outcome.reproduced
    assert "GREEDY covers more than BASELINE with 4 of 5 numbers of vehicles" in outcome.why
    louder = found | fake({study.Case("pdc", 40): of_case(800.0, summaries=1030.0)})
    assert not by_id["C35"].experiment(louder).reproduced
    short = found | {study.Case("pdc", 40): found[study.Case("pdc", 40)][:4]}
    assert not by_id["C33"].experiment(short).reproduced


def test_no_jpeg_of_800_by_600_is_as_small_as_the_thesis_says():
    sizes = (street.STREET.scheme.image_bytes, street.LARGE_BYTES)
    cases = {
        study.Case(scheme, street.LARGE_OBJECTS, None, size): of_case(100.0)
        for size in sizes
        for scheme in study.SCHEMES
    }
    outcome = {claim.id: claim for claim in street.CLAIMS}["C30"].experiment(fake(cases))
    assert not outcome.reproduced
    assert outcome.ours["least_jpeg_bytes"] > 1000.0
    assert outcome.ours["bit_per_px"] == pytest.approx(8000 / 480_000)
    assert "as a baseline colour JPEG" in outcome.why


def test_a_camera_behind_a_sphere_sees_nothing_of_what_is_behind():
    view = selection.make_view(0)
    assert view.q.shape == (selection.CAMERAS, selection.SPHERES * selection.VOXELS_EACH)
    assert 0.0 <= view.q.min() < view.q.max() <= 1.0
    one_m = np.array([1.0])
    blocked = selection.behind_a_sphere(
        np.zeros((1, 3)), np.array([[[0.0, 0.0, 1.0]]]), 5.0 * one_m[None], np.array([[0.0, 0.0, 2.0]]), one_m
    )
    assert blocked.all()
    assert not selection.behind_a_sphere(
        np.zeros((1, 3)), np.array([[[0.0, 0.0, 1.0]]]), one_m[None], np.array([[0.0, 0.0, 3.0]]), one_m
    ).any()


def test_all_cameras_are_worth_everything_and_greedy_never_falls():
    rows = selection.shares(selection.make_view(3), 3)
    assert rows[[0, 2, 3], -1] == pytest.approx([1.0, 1.0, 1.0])
    assert (np.diff(rows[0]) >= 0.0).all()
    assert (rows <= 1.0 + 1e-12).all()
    assert all_cameras(selection.make_view(3).q).value > 0.0


def test_an_interval_lies_around_its_mean():
    assert interval([1.0, 3.0]) == (2.0, pytest.approx(2.0 - 12.7062047), pytest.approx(2.0 + 12.7062047))
    assert interval([2.0]) == (2.0, 2.0, 2.0)


def test_the_benchmark_counts_simulated_time_and_events():
    result = benchmark(objects=4, horizon_s=1860.0, runs=1, saturated_s=dict.fromkeys(SATURATED, 1.0))
    total, *runs = (run for run in result.runs if "scheme" in run)
    assert [run["scheme"] for run in runs] == list(study.SCHEMES)
    assert total["simulated_s_per_s"] == pytest.approx(3 * 1860.0 / result.ours_s)
    assert total["events_per_s"] == pytest.approx(sum(run["events"] for run in runs) / result.ours_s)
    assert result.record()["ratio"] is None

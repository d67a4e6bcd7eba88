"""Intervals with known answers, seeds, sweeps, and the same runs on a Dask cluster."""

import math

import numpy as np
import pytest

from network_sim.metrics.metrics import Metric
from network_sim.presets import PRESETS
from network_sim.replicate import (
    estimates_of,
    iterate_runs,
    iterate_sweep,
    measured,
    replications,
    t_interval,
)
from packetmesh.errors import InputError
from packetmesh.progress import Progress, drain
from packetmesh.settings import with_settings

TINY = with_settings(PRESETS["thesis-link"], ["nodes.image_bytes=2000", "run.horizon_s=10"])


def answer(steps):
    """What a generator returns, and its reports."""
    reports = []
    return drain(steps, reports.append), reports


def test_the_interval_of_five_values_is_the_one_of_the_tables():
    mean, half = t_interval([1.0, 2.0, 3.0, 4.0, 5.0])
    assert mean == 3.0
    assert half == pytest.approx(2.7764451 * math.sqrt(2.5 / 5.0), rel=1e-7)  # t with 4 degrees of freedom


def test_a_single_value_has_no_interval_and_equal_ones_have_one_without_width():
    assert t_interval([4.0]) == (4.0, None)
    assert t_interval([4.0, 4.0, 4.0]) == (4.0, 0.0)


def test_the_interval_covers_the_mean_95_times_of_100():
    rng = np.random.default_rng(1)
    runs = rng.normal(3.0, 2.0, (2000, 5))
    covered = [abs(mean - 3.0) <= half for mean, half in map(t_interval, runs)]
    assert 0.94 <= np.mean(covered) <= 0.96


def test_replications_differ_in_their_seed_alone():
    runs = replications(with_settings(TINY, ["run.seed=7"]), 3)
    assert [run.run.seed for run in runs] == [7, 8, 9]
    assert {with_settings(run, ["run.seed=0"]) for run in runs} == {TINY}
    with pytest.raises(InputError, match="replications is 0"):
        replications(TINY, 0)


def test_seeds_differ_and_repeat():
    first, second = replications(TINY, 2)
    assert measured(first) == measured(first)
    assert measured(first)["image_delay_mean"] != measured(second)["image_delay_mean"]


def test_a_metric_that_some_runs_lack_is_averaged_over_the_others():
    runs = [{"a": Metric(1.0, "s", "A"), "b": Metric(5.0, "1", "B")}, {"a": Metric(3.0, "s", "A")}]
    estimates = estimates_of(runs)
    assert (estimates["a"].mean, estimates["a"].values, estimates["a"].unit) == (2.0, (1.0, 3.0), "s")
    assert (estimates["b"].mean, estimates["b"].ci95, estimates["b"].values) == (5.0, None, (5.0,))


def test_runs_in_processes_come_back_in_their_order_with_progress():
    configs = replications(TINY, 3)
    runs, reports = answer(iterate_runs(configs))
    assert runs == [measured(config) for config in configs]
    assert [step.fraction for step in reports] == pytest.approx([1 / 3, 2 / 3, 1.0])
    assert all(isinstance(step, Progress) for step in reports)


def test_a_sweep_replicates_every_value_with_the_same_seeds():
    found, reports = answer(iterate_sweep(TINY, "nodes.count", ["1", "2"], 2))
    assert list(found) == ["1", "2"]
    assert len(reports) == 4
    direct, _ = answer(iterate_runs(replications(with_settings(TINY, ["nodes.count=2"]), 2)))
    assert found["2"] == estimates_of(direct)
    assert found["1"]["image_delay_mean"].mean < found["2"]["image_delay_mean"].mean


def test_a_sweep_over_an_unknown_setting_offers_the_nearest():
    with pytest.raises(InputError, match=r"nodes\.count"):
        answer(iterate_sweep(TINY, "nodes.cuont", ["1"], 1))


def test_a_cluster_of_two_workers_gives_the_same_answers():
    distributed = pytest.importorskip("distributed", reason="needs the package distributed")
    configs = replications(TINY, 3)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        runs, reports = answer(iterate_runs(configs, cluster.scheduler_address))
    assert runs == [measured(config) for config in configs]
    assert len(reports) == 3

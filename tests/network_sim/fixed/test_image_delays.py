"""Delays of single images, beside what the counters sum up on another way."""

import numpy as np
import pytest

from network_sim.metrics.metrics import image_delays_s
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

RUNS = {
    "all arrive": ("office", "run.horizon_s=25"),
    "some on their way": ("office", "run.horizon_s=20.3", "nodes.count=6"),
    "warm-up": ("office", "run.horizon_s=40", "run.warmup_s=15", "nodes.depth_bytes=0"),
    "images only": ("street-grid", "run.horizon_s=300", "run.warmup_s=100", "street.vehicles=10"),
}


@pytest.mark.parametrize("run", RUNS)
def test_they_are_the_counted_images_and_sum_up_to_the_counted_time(run):
    preset, *changes = RUNS[run]
    trace = simulate(with_settings(PRESETS[preset], changes))
    delays_s, counted = image_delays_s(trace), trace.counters.images
    assert len(delays_s) == counted.arrived > 0
    assert (delays_s > 0.0).all()
    assert delays_s.sum() == pytest.approx(counted.delays.total_s, rel=1e-9)
    assert np.square(delays_s).sum() == pytest.approx(counted.delays.squares_s2, rel=1e-9)


def test_a_run_without_arrivals_has_none():
    trace = simulate(with_settings(PRESETS["office"], ["run.horizon_s=0.01"]))
    assert image_delays_s(trace).shape == (0,)


def test_a_run_that_kept_no_events_is_one_sentence():
    trace = simulate(with_settings(PRESETS["office"], ["run.horizon_s=1", "run.keep=counters"]))
    with pytest.raises(InputError, match=r"run\.keep=images"):
        image_delays_s(trace)

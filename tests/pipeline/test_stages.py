"""The order in which stages are computed, with stages that compute nothing."""

from __future__ import annotations

import threading

import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline import stages
from pipeline.sources import Demo
from pipeline.spec import CHAIN, NEEDS, SIDE_BY_SIDE, Spec, whole_s
from pipeline.stages import RunCache, compute, run

SPEC = Spec(Demo("box-on-table"))
PATIENCE_S = 30.0


@pytest.fixture
def computed(monkeypatch):
    """The stages in the order in which they began; those of a pair wait until both have."""
    order, meetings = [], {name: threading.Barrier(2) for name in SIDE_BY_SIDE}

    def stage(name):
        def work(*arguments):
            order.append(name)
            for pair in SIDE_BY_SIDE:
                if name in pair:
                    meetings[pair].wait(PATIENCE_S)
            return name
            yield

        return work

    for name in CHAIN:
        monkeypatch.setitem(stages.STAGES, name, stage(name))
    return order


def test_each_stage_is_computed_once_after_what_it_needs_and_pairs_at_the_same_time(computed):
    results = drain(run(SPEC))
    assert tuple(results) == CHAIN
    assert {name: done.value for name, done in results.items()} == {name: name for name in CHAIN}
    assert sorted(computed) == sorted(CHAIN)
    for name in CHAIN:
        assert {computed.index(earlier) for earlier in NEEDS[name].after} <= set(range(computed.index(name)))


def test_stages_of_a_pair_that_share_what_is_not_there_yet_are_computed_in_turn(computed, monkeypatch):
    for name in ("after", "before"):
        monkeypatch.setitem(stages.STAGES, name, _alone(name, computed))
    drain(run(SPEC, stages=("after", "before")))
    assert sorted(computed) == sorted(set(CHAIN) - {"truth"})


def test_what_is_there_is_not_computed_again(computed):
    cache = RunCache()
    drain(run(SPEC, cache))
    count = len(computed)
    drain(run(SPEC, cache))
    assert drain(compute(SPEC, "after", cache)).value == "after"
    assert len(computed) == count


@pytest.mark.parametrize("name", ["after", "before"])
def test_a_stage_of_a_pair_that_fails_ends_the_run_with_its_sentence(computed, monkeypatch, name):
    other = {"after": "before", "before": "after"}[name]
    monkeypatch.setitem(stages.STAGES, other, _alone(other, computed))
    monkeypatch.setitem(stages.STAGES, name, _broken)
    with pytest.raises(InputError, match="nothing to roll over"):
        drain(run(SPEC))


def test_of_two_stages_at_the_same_time_the_longer_one_counts():
    assert whole_s({"rig": 1.0, "after": 4.0, "before": 3.0, "truth": 0.5}) == 5.5
    assert whole_s({"rig": 1.0, "after": 4.0}) == 5.0


def _alone(name, order):
    def work(*arguments):
        order.append(name)
        return name
        yield

    return work


def _broken(*arguments):
    raise InputError("There is nothing to roll over")
    yield

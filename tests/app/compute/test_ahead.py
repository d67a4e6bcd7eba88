"""What the first browser wants is there, or on its way, when it comes."""

from dataclasses import dataclass, field, replace

import pytest

from app.compute.ahead import compute_ahead
from app.compute.pool import Outcome
from app.compute.shared import SharedViews
from app.compute.state import CHAIN
from app.compute.store import Store
from pipeline.sources import Demo
from tests.app.fakes import START, end


@dataclass
class Pool:
    """Runs every job at once."""

    steps: list = field(default_factory=list)

    def submit(self, owner, function, step, store, spec, *, on_progress, on_end, key):
        assert key == spec.key(step)
        self.steps.append(step)
        try:
            outcome = Outcome("result", end(function(step, store, spec)))
        except Exception as error:
            outcome = Outcome("error", str(error))
        on_end(outcome)


@pytest.fixture
def shared(tmp_path):
    """Views of sessions that have none yet, whatever other tests have computed."""
    return SharedViews(Store(str(tmp_path)))


def test_every_view_of_the_chain_is_there(store, shared):
    pool = Pool()
    compute_ahead(pool, store, shared, START, "the server")
    assert pool.steps == list(CHAIN)
    views = [shared.get(START.key(step)) for step in CHAIN]
    assert [type(view).__name__ for view in views] == ["SceneView", "DepthView", "FuseView", "SurfaceView"]


def test_what_fails_is_left_to_those_who_come(store, shared):
    pool = Pool()
    wrong = replace(START, source=Demo("no-such-scene"))
    compute_ahead(pool, store, shared, wrong, "the server")
    assert pool.steps == ["scene"]
    assert shared.get(wrong.key("scene")) is None


def test_a_pool_that_is_closed_is_no_error(store, shared):
    class Closed:
        def submit(self, *_, **__):
            raise RuntimeError("the pool is closed")

    compute_ahead(Closed(), store, shared, START, "the server")


def test_what_is_there_already_is_not_computed_again(store, shared):
    pool, seen = Pool(), []
    shared.on_surface = lambda spec, view: seen.append(spec)
    for step in CHAIN:
        shared.put(START.key(step), f"the {step}'s view")
    compute_ahead(pool, store, shared, START, "the server")
    assert pool.steps == []
    assert seen == [START]

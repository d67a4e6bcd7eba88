"""Verdicts and depth pictures count only for the calibration that they are about; failures are repeated."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.records import Picture
from app.compute.state import BoardViews, Results, Spec
from app.screens.calibrate.answers import Answers
from app.screens.calibrate.view import DepthErrorView, TrustRequest
from pipeline.sources import Demo

REQUEST = TrustRequest("node_00", 2.0, 0.005)
CAMERA, OTHER_CAMERA = SimpleNamespace(name="node_00"), SimpleNamespace(name="node_01")
MAP = Picture(np.zeros((360, 640, 3), np.uint8), "map")
TRUST = SimpleNamespace(request=REQUEST, pictures={"uncertainty": MAP})
OFF = DepthErrorView("node_00", "1", {"off-before": MAP})
SMALL, WIDE = BoardViews("photographs"), BoardViews("photographs", edition=1)


class Session:
    """Keeps the ends of the jobs that were requested, and shows calibrations."""

    def __init__(self):
        self.spec, self.results, self.ends = Spec(Demo("office"), views=SMALL), Results(), []
        self.answers = Answers(self, lambda _: self.ask(), self.ask)
        self.show(SMALL)

    def quick_job(self, job, *_, on_end):
        self.ends.append(on_end)

    def want(self, views):
        self.spec = replace(self.spec, views=views)

    def show(self, views):
        """The calibration of these photographs has come."""
        self.want(views)
        self.results.put("calibrate", self.spec.key("calibrate"), None)

    def ask(self):
        """As the screen does whenever it shows a view of the camera."""
        self.answers.ask(REQUEST, "1", depth=True)

    def end(self, view):
        self.ends.pop(0)(view)


@pytest.fixture
def session():
    """The verdict on a camera and the depth error of its first view are there."""
    session = Session()
    session.ask()
    session.end(TRUST)
    session.end(OFF)
    assert session.ends == []
    return session


def test_maps_belong_to_the_photographs_and_the_camera_that_are_shown(session):
    answers = session.answers
    assert answers.trust_in(CAMERA) is TRUST
    assert answers.trust_in(OTHER_CAMERA) is None
    assert answers.pictures_of(CAMERA, "1").keys() == {"uncertainty", "off-before"}
    assert answers.pictures_of(CAMERA, "2").keys() == {"uncertainty"}
    session.show(WIDE)
    assert answers.trust_in(CAMERA) is None
    assert answers.pictures_of(CAMERA, "1") == {}
    session.show(SMALL)
    assert answers.trust_in(CAMERA) is TRUST
    assert answers.pictures_of(CAMERA, "1").keys() == {"uncertainty", "off-before"}


def test_an_answer_that_comes_after_the_photographs_have_changed_is_not_shown(session):
    session.show(WIDE)
    session.ask()
    session.show(SMALL)
    session.end(TRUST)
    assert session.answers.trust_in(CAMERA) is None


def test_nothing_is_asked_about_a_calibration_that_is_not_there_yet(session):
    """The jobs would use the new photographs, whose lens may be undetermined."""
    session.want(WIDE)
    session.ask()
    assert session.ends == []
    session.show(WIDE)
    session.ask()
    assert len(session.ends) == 1


@pytest.mark.parametrize("before", [(), (TRUST,)], ids=["verdict", "depth"])
def test_what_failed_or_was_cancelled_is_not_repeated_at_once_but_at_the_next_occasion(before):
    session = Session()
    session.ask()
    for view in (*before, None):
        session.end(view)
    assert session.ends == []
    session.ask()
    assert len(session.ends) == 1

"""What a session asks the pool for, and what it makes of the answers; nothing is computed."""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from app.compute.pool import Outcome
from app.compute.shared import SharedViews
from app.compute.store import Store
from app.landing import SHIPPED
from app.lesson.files import LESSONS, screen_of
from app.lesson.reading import head_of
from app.screens.scene.panel import ScenePanel
from app.server import PANELS
from app.session.session import CANCELLED, Session
from app.web.uploads import Uploads
from tests.app.fakes import START

LONG_S = 30.0
OTHER = replace(START, source=replace(START.source, name="office"))


@dataclass
class Pool:
    """Begins every job and ends none."""

    begun: list[Any] = field(default_factory=list)
    """What is to be told the end of each."""
    keys: list[Any] = field(default_factory=list)

    def submit(self, owner, function, *arguments, on_progress, on_end, key, urgent):
        self.begun.append(on_end)
        self.keys.append(key)
        return on_end

    def stop(self, ticket, patience_s=None):
        """It will stop at its next report."""


@pytest.fixture
def pool():
    return Pool()


@pytest.fixture
def session(server, store, pool, tmp_path):
    shared = SharedViews(Store(str(tmp_path)))
    session = Session(server, pool, store, Uploads(tmp_path), shared, START, [ScenePanel])
    with contextlib.closing(session):
        settle(session)
        yield session


def settle(session):
    """Wait until the session has done all that was posted, also what waits for its turn to draw."""
    done = threading.Event()
    session._post_in_turn(done.set)
    assert done.wait(LONG_S)


def test_the_end_of_what_was_stopped_is_not_that_of_the_same_asked_for_again(session, pool):
    for spec in (OTHER, START):
        session.post(session.want, spec)
    settle(session)
    assert len(pool.begun) == 1  # it is still asked to stop
    pool.begun[0](Outcome("stopped"))
    settle(session)
    assert len(pool.begun) == 2
    assert session.results.failure("scene", START) is None
    assert session._tracks[0].running == "scene"


class Curious(ScenePanel):
    """Asks for a job beside the chain as soon as its step is there."""

    def on_view(self, step, view):
        self.session.side_job("curious", on_end=print)


def test_a_job_beside_the_chain_waits_for_the_step_that_follows(server, store, pool, tmp_path):
    shared = SharedViews(Store(str(tmp_path)))
    session = Session(server, pool, store, Uploads(tmp_path), shared, START, [Curious])
    with contextlib.closing(session):
        settle(session)
        pool.begun[0](Outcome("result", "a view"))
        settle(session)
        assert pool.keys == [START.key("scene"), START.key("depth"), ("curious", START, ())]


@pytest.mark.parametrize("asked", [[], [OTHER, START]], ids=["running", "waiting"])
def test_what_a_person_cancels_has_failed_until_it_is_asked_for_again(session, pool, asked):
    for spec in asked:
        session.post(session.want, spec)
    session.post(session._act, "Cancel")
    settle(session)
    pool.begun[0](Outcome("stopped"))
    settle(session)
    assert session.results.failure("scene", START) == CANCELLED
    assert session._tracks[0].running is None
    session.post(session._act, "Retry")
    settle(session)
    assert len(pool.begun) == 2


def test_the_start_page_names_each_lesson_by_the_key_that_its_screen_gives_it(server, store, pool, tmp_path):
    shared = SharedViews(Store(str(tmp_path)))
    session = Session(server, pool, store, Uploads(tmp_path), shared, START, PANELS)
    with contextlib.closing(session):
        settle(session)
        parts = {panel.title.lower(): panel.in_address for panel in session.panels}
        for name, key in SHIPPED.items():
            head, _ = head_of((LESSONS / f"{name}.md").read_text(encoding="utf-8"))
            assert parts[screen_of(head["screen"][1])][key].lesson.name == name


def commands(server):
    """Descriptions and handles of the palette's entries, by label; of several the last."""
    handles = server.gui._command_handle_from_uuid.values()
    return {one.label: one for one in handles}


def test_a_scene_is_opened_and_left_again_by_the_palette(session, server):
    found = commands(server)
    for label in ("Office", "Undo", "Redo"):
        for action in found[label]._impl.trigger_cb:
            action(None)
        settle(session)
        assert session.spec.source.name == {"Undo": START.source.name}.get(label, "office")


def test_what_a_link_opens_is_the_first_state_and_cannot_be_undone(session):
    session.post(session.places._go_to, replace(session.places._now(), spec=OTHER), [])
    settle(session)
    assert session.spec.source == OTHER.source
    session.post(session.places._go_to, replace(session.places._now(), spec=START), [])
    settle(session)
    assert [session.palettes._history.undo() for _ in range(2)] == [
        "Undone: scene.",
        "There is nothing to undo.",
    ]
    assert session.spec.source == OTHER.source


def test_controls_can_be_found_where_they_are(session, server):
    session.palettes._refresh()
    found = commands(server)
    assert found["Preset"].description == "Setting on Scene"
    assert found["Measure"].description == "Part of Scene"
    assert "Stop" not in found

"""Quick looks: one at a time, always the newest, none faster than the browser answers."""

import threading
import time
from types import SimpleNamespace

import pytest

from app.screens.surface import quick
from app.screens.surface.quick import FEWEST_POINTS, LOOKS, SLOW_S, Detail, QuickLook
from app.screens.surface.view import QUICK_POINTS, PaintedView, PaintRequest
from app.window.debounce import Debounce
from tests.app.fakes import START, page_calls, ui_of


class Browser:
    """Stands for session and browser: keeps what is asked of both, and answers when asked to."""

    def __init__(self):
        self.ui, self.jobs = ui_of(), []
        self.spec = START
        self.results = SimpleNamespace(fresh=lambda step, spec: True)

    def quick_job(self, job, request, on_end, key):
        assert key == request.key(self.spec)
        self.jobs.append((request, on_end))

    @property
    def call(self):
        """What the page was asked to call last, and with what."""
        (call,) = page_calls(self.ui.gui.handles[0].content)
        return call

    def answer(self):
        self.ui.gui.press("Say that all is drawn")

    def finish(self, points=1):
        request, on_end = self.jobs[-1]
        on_end(PaintedView(request, {}, points, points, 0.0))


def request(radius_m):
    return PaintRequest(("after",), "color", radius_m)


@pytest.fixture
def scene(monkeypatch):
    monkeypatch.setattr(quick, "QUIET_S", 30.0)
    browser, seen = Browser(), []

    def draw(view):
        seen.append(view.request.radius_m)
        look.sent()

    look = QuickLook(browser, draw, lambda: seen.append("drawn"), lambda: seen.append("rest"))
    look._acknowledgement.held = True
    yield browser, look, seen
    browser.ui.close()


def test_while_one_rolls_the_newest_of_many_waits(scene):
    browser, look, seen = scene
    for radius_m in (0.01, 0.02, 0.03):
        look.want(request(radius_m))
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01]
    browser.finish()
    assert seen == [0.01]
    assert len(browser.jobs) == 1
    browser.answer()
    assert seen == [0.01, "drawn"]
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01, 0.03]


def test_nothing_is_rolled_while_the_browser_draws(scene):
    browser, look, _ = scene
    look.want(request(0.01))
    browser.finish()
    look.want(request(0.02))
    assert len(browser.jobs) == 1
    browser.answer()
    assert len(browser.jobs) == 2


def test_a_browser_that_does_not_answer_is_not_waited_for_for_ever(scene):
    browser, look, seen = scene
    look.want(request(0.01))
    browser.finish()
    look.want(request(0.02))
    for _ in range(40):
        time.sleep(0.1)
        if "drawn" in seen:
            break
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01, 0.02]
    browser.answer()
    assert seen.count("drawn") == 1


def test_a_job_that_fails_does_not_stop_the_next(scene):
    browser, look, seen = scene
    look.want(request(0.01))
    look.want(request(0.02))
    browser.jobs[0][1](None)
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01, 0.02]
    assert seen == []


def test_the_radius_rests_once_the_surface_of_its_last_value_is_drawn(scene):
    browser, look, seen = scene
    look.want(request(0.01))
    look.want(request(0.02))
    look._quiet()  # the slider stops while the first surface is computed
    browser.finish()
    browser.answer()
    assert seen == [0.01, "drawn"]
    browser.finish()
    assert look.moving
    browser.answer()
    assert seen == [0.01, "drawn", 0.02, "drawn", "rest"]
    assert not look.moving


def test_a_radius_that_moves_again_does_not_rest(scene):
    browser, look, seen = scene
    look.want(request(0.01))
    look._quiet()
    look.want(request(0.02))
    for _ in range(2):
        browser.finish()
        browser.answer()
    assert "rest" not in seen
    assert look.moving


def test_the_radius_rests_though_a_surface_never_comes(monkeypatch):
    monkeypatch.setattr(quick, "TIMEOUT_S", 0.1)
    browser, rested = Browser(), threading.Event()
    look = QuickLook(browser, lambda view: None, lambda: None, rested.set)
    look._acknowledgement.held = True
    look.want(request(0.01))
    assert rested.wait(10.0)
    assert not look.moving
    look.want(request(0.02))
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01, 0.02]
    browser.ui.close()


def test_before_the_nodes_are_placed_nothing_is_rolled(scene):
    browser, look, _ = scene
    browser.results = SimpleNamespace(fresh=lambda step, spec: False)
    look.want(request(0.01))
    assert browser.jobs == []
    assert look.moving


def test_a_debounced_action_comes_once_after_the_last_restart_and_not_when_cancelled():
    came = []
    debounce = Debounce(0.15, lambda: came.append(time.monotonic()))
    for _ in range(3):
        last = time.monotonic()
        debounce.restart()
        time.sleep(0.05)
        assert debounce.pending
    time.sleep(0.4)
    assert len(came) == 1
    assert came[0] - last >= 0.15
    assert not debounce.pending
    debounce.restart()
    debounce.cancel()
    time.sleep(0.3)
    assert len(came) == 1


def test_looks_get_coarser_for_a_slow_browser_and_finer_again_for_a_fast_one():
    detail = Detail()
    for seconds in (0.2, 0.9, 0.9, 0.2):
        detail.took(seconds)
    assert detail.points == QUICK_POINTS
    for _ in range(4 * LOOKS):
        detail.took(1.0)
    assert detail.points == FEWEST_POINTS
    for _ in range(4 * LOOKS):
        detail.took(0.03)
    assert detail.points == QUICK_POINTS


@pytest.mark.parametrize("seconds_per_point", [1e-6, 1e-5, 1.6e-5, 3e-5])
def test_the_detail_settles_whatever_the_speed(seconds_per_point):
    detail, seen = Detail(), []
    for _ in range(20 * LOOKS):
        detail.took(detail.points * seconds_per_point)
        seen.append(detail.points)
    assert len(set(seen[-10 * LOOKS :])) == 1
    assert seen[-1] * seconds_per_point <= SLOW_S


def test_what_is_asked_for_follows_the_browsers_answers(scene, monkeypatch):
    browser, look, _ = scene
    now_s = 0.0
    monkeypatch.setattr(quick, "time", SimpleNamespace(monotonic=lambda: now_s))
    for _ in range(2 * LOOKS):
        look.want(request(0.01))
        now_s += 0.5
        browser.finish()
        browser.answer()
    for _ in range(LOOKS):
        look.sent()
        browser.answer()
    look.want(request(0.02))
    asked = [asked.most_points for asked, _ in browser.jobs]
    assert asked == [QUICK_POINTS] * LOOKS + [QUICK_POINTS // 2] * LOOKS + [QUICK_POINTS // 4]


def test_a_look_that_needed_more_points_does_not_make_the_next_ones_coarser(scene, monkeypatch):
    """Its ball is small; the time would not be shorter with fewer points asked for."""
    browser, look, _ = scene
    now_s = 0.0
    monkeypatch.setattr(quick, "time", SimpleNamespace(monotonic=lambda: now_s))
    for _ in range(4 * LOOKS):
        look.want(request(0.01))
        now_s += 2.0 * SLOW_S
        browser.finish(2 * QUICK_POINTS)
        browser.answer()
    assert {asked.most_points for asked, _ in browser.jobs} == {QUICK_POINTS}


def test_the_view_is_held_before_the_first_surface_is_computed_and_until_the_radius_rests(scene):
    browser, look, _ = scene
    look._acknowledgement.held = False
    look.want(request(0.01))
    assert browser.call == ("hold", [])
    assert browser.jobs == []
    browser.answer()
    look.want(request(0.02))
    assert [asked.radius_m for asked, _ in browser.jobs] == [0.01]
    look.sent([4, 5])
    assert browser.call == ("ask", [[4, 5], True])
    look._rest()
    browser.answer()
    look.sent([6])
    assert browser.call == ("ask", [[6], False])
    browser.answer()
    look.want(request(0.03))
    assert browser.call == ("hold", [])


def test_a_second_question_is_for_the_meshes_of_both(scene):
    browser, look, _ = scene
    look.sent([4])
    look.sent([])
    look.sent([5])
    assert browser.call == ("ask", [[4, 5], False])
    browser.answer()
    look.sent([6])
    assert browser.call == ("ask", [[6], False])

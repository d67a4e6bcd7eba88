"""The load of many browsers: its figures, and turns in drawing."""

import math
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from app.cli.bench import _browsers
from app.compute.turns import Turns
from app.load.connection import OLD, QUESTIONS, Connection
from app.load.load import Load
from app.load.serving import Look
from app.load.visitor import RADIUS_MM, Diary, Visitor
from app.screens.surface.settings import STEP_MM
from app.window.page import page_call, stale_html
from app.window.stepper import _style


def look(strays=(), server=100, files=3):
    return Look(2, 10, files, 1000, strays, True, server, 200)


def test_the_figures_of_a_load():
    diaries = (
        Diary(opened_s=1.0, answers_s=[0.1, 0.3], meshes_s=[2.0]),
        Diary(answers_s=[0.2], lost="ConnectionError: the server ended the connection"),
    )
    looks = ((0.0, look()), (1.0, look((7,))), (2.0, look((7, 8), server=150)), (9.0, look((7,), files=4)))
    load = Load(diaries, looks, look(), look(), prepared_s=100.0)
    record = load.record()
    assert record["clicks"] == 3
    assert record["answers_s"] == pytest.approx({"count": 3, "median": 0.2, "p95": 0.29, "max": 0.3})
    assert record["late"] == 0
    assert record["opened_s"]["count"] == 1
    assert len(record["lost"]) == 1
    assert record["longest_stray_s"] == 8.0
    assert record["strays_beyond_patience"] == 1
    assert (record["server_peak_bytes"], record["workers_peak_bytes"]) == (150, 200)
    assert [quarter["files"] for quarter in record["quarters"] if quarter] == [3, 4]
    first = record["quarters"][0]
    assert (first["server_least_bytes"], first["server_bytes"]) == (100, 150)
    assert "100 s of computing ahead" in load.notes()[0]
    assert any("lost: 1 of 2" in note for note in load.notes())


def test_a_load_test_without_any_answer_is_reported(monkeypatch):
    lost = Diary(lost="TimeoutError: what was awaited did not come within 240 s")
    load = Load((lost,), ((0.0, look()),), look(), look())
    monkeypatch.setattr("app.load.load.soak", lambda seconds: load)
    measured = _browsers("soak", 1.0)
    assert math.isnan(measured.ours_s)
    assert measured.runs[0]["lost"] == [lost.lost]
    assert any("lost: 1 of 1" in note for note in measured.notes)


def test_a_browser_that_is_lost_keeps_its_notices(monkeypatch):
    page = SimpleNamespace(notices=[], lost=True, close=lambda: None, uuids={"Radius (mm)": ["1"]}, steps="?")
    monkeypatch.setattr("app.load.visitor.Connection", lambda url: page)
    monkeypatch.setattr("app.load.visitor.THINKING_S", 1e-3)
    page.notices.append("Surface failed: out of memory")
    visitor = Visitor("http://nowhere", 0)
    visitor._thread.join(10.0)
    assert visitor.diary.lost == "ConnectionError: the server ended the connection"
    assert visitor.diary.notices == ["Surface failed: out of memory"]


def test_one_draws_after_the_other_and_who_waits_goes_on_with_other_things():
    turns, order, first_may_end = Turns(), [], threading.Event()
    with ThreadPoolExecutor(1) as slow, ThreadPoolExecutor(1) as quick:
        turns.give(lambda: slow.submit(lambda: (first_may_end.wait(10.0), order.append("drawn"))))
        turns.give(lambda: quick.submit(order.append, "drawn second"))
        turns.give(lambda: None)  # a session that has gone
        quick.submit(order.append, "clicked").result(10.0)
        first_may_end.set()
        with turns.taken():
            pass
        done = threading.Event()
        turns.give(lambda: quick.submit(done.set))
        assert done.wait(10.0)
    assert order == ["clicked", "drawn", "drawn second"]


def test_a_simulated_page_knows_the_html_that_a_page_knows():
    calls = page_call("ask", [3], True), page_call("hold")
    assert all(question in call for question, call in zip(QUESTIONS, calls, strict=True))
    assert OLD in stale_html(numbers=True, picture=False)
    assert OLD in stale_html(numbers=False, picture=True)
    assert OLD not in stale_html(numbers=False, picture=False)


def test_a_surface_counts_once_nothing_shown_is_dimmed():
    page = object.__new__(Connection)  # no server
    page.steps, page.shown_s, page._marks, page._dimmed = ("Scene", "Surface"), {}, {}, set()
    page._take_html("dimming", stale_html(numbers=True, picture=False))
    page._take_html("stepper", _style(1, ["fresh", "fresh"]))
    assert page.current == "Surface"
    assert "surface" not in page.shown_s
    page._take_html("dimming", stale_html(numbers=False, picture=False))
    assert "surface" in page.shown_s


def test_simulated_hands_drag_between_steps_of_the_slider():
    assert all(radius_mm % STEP_MM == 0.0 for radius_mm in RADIUS_MM)

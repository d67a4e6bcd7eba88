"""Lessons led through by keys alone, and what of them is in view."""

from __future__ import annotations

import contextlib
import re

import pytest
from playwright.sync_api import TimeoutError, expect

from tests.browser.hands import PATIENCE_MS, afresh, go, press, unfold

LESSONS = {
    "How good is my calibration?": ("Calibrate", 7),
    "Can a picture measure?": ("Depth", 7),
    "ICP against CEICP": ("Fuse", 13),
    "Which ball radius?": ("Surface", 10),
    "How images cross a sensor network": ("Network", 10),
    "What one lost packet costs": ("Network", 8),
    "Where should the camera stand?": ("Network", 6),
}
NEXT_MS = 20_000
"""For the next stop on a busy machine."""
WAITS, FIRST, RIGHT = "Take a guess", "Guess before you go on", "Right."


@pytest.fixture
def page(few, tab):
    """A session of its own: a lesson goes on where somebody left it."""
    size = tab.viewport_size
    afresh(tab)
    yield tab
    tab.set_viewport_size(size)


def seen(page, text):
    return page.get_by_text(text).locator("visible=true").first


def press_until(page, key, text, wait_ms=3_000):
    """A stop's text may stand there a moment before the page has given its lesson the keys."""
    for _ in range(20):
        page.keyboard.press(key)
        with contextlib.suppress(TimeoutError):
            return seen(page, text).wait_for(timeout=wait_ms)
    raise AssertionError(f"{key} does not bring '{text}'")


def begin(page, lesson, stops, place="", begins="Choose a stop, or press"):
    """Open the lesson at its first stop; what moves under the hand may miss a click, and gets another."""
    unfold(page, f"Lesson: {lesson}")
    for _ in range(10):
        page.get_by_role("button", name="Next", exact=True).first.click()  # the pictures may have one, too
        with contextlib.suppress(TimeoutError):
            return seen(page, place or f"(1 of {stops})").wait_for(timeout=10_000)
        if not page.get_by_text(begins).locator("visible=true").count():
            unfold(page, f"Lesson: {lesson}")
    raise AssertionError(f"'{lesson}' does not begin")


@pytest.mark.parametrize("lesson", LESSONS)
def test_five_stops_are_led_through_by_keys_alone(page, lesson):
    step, stops = LESSONS[lesson]
    go(page, step)
    if step == "Calibrate":  # its lesson needs photographs of a board
        press(page, "Uncalibrated nodes")
    begin(page, lesson, stops)
    for stop in range(1, 6):
        seen(page, f"({stop} of {stops})").wait_for()
        seen(page, WAITS).wait_for()
        press_until(page, "ArrowRight", FIRST)
        page.keyboard.press("s" if stop == 5 else str(1 + stop % 3))
        expect(page.get_by_text(FIRST).locator("visible=true")).to_have_count(0)
        expect(page.get_by_text("✓").locator("visible=true").first).to_be_visible(timeout=PATIENCE_MS)
        press_until(page, "ArrowRight" if stop % 2 else "Space", f"({stop + 1} of {stops})", NEXT_MS)
    press_until(page, "ArrowLeft", f"(5 of {stops})", NEXT_MS)
    assert page.get_by_text(WAITS).locator("visible=true").count() == 0
    unfold(page, f"Lesson: {lesson}")


def test_the_dock_has_the_keys_after_a_click_on_it_until_escape(page):
    go(page, "Fuse")
    begin(page, "ICP against CEICP", 13)
    page.locator(".packetmesh-dock-time").click()
    seen(page, "The keys control the dock now").wait_for()
    seen(page, "Up to date").wait_for()
    page.keyboard.press("Home")
    expect(page.locator(".packetmesh-dock-time")).to_have_text(re.compile("^iteration 0 of"))
    page.keyboard.press("ArrowRight")
    expect(page.locator(".packetmesh-dock-time")).to_have_text(re.compile("^iteration 1 of"))
    assert page.get_by_text(FIRST).locator("visible=true").count() == 0
    page.keyboard.press("Escape")
    seen(page, "the keys control the dock.").wait_for()
    page.keyboard.press("ArrowRight")
    seen(page, FIRST).wait_for()
    unfold(page, "Lesson: ICP against CEICP")


@pytest.mark.parametrize("size", [(1280, 720), (390, 844)])
def test_a_lesson_is_read_and_answered_without_scrolling_and_covers_nothing(page, size):
    page.set_viewport_size({"width": size[0], "height": size[1]})
    go(page, "Fuse")
    begin(page, "ICP against CEICP", 13)
    card, picture = page.locator(".packetmesh-lesson-card"), page.locator("canvas[data-engine]")
    for name in ("Skip", "Back", "Next"):
        expect(card.get_by_role("button", name=name, exact=True)).to_be_in_viewport(ratio=1)
    steps = page.get_by_role("button", name=re.compile("^(Scene|Export)"))
    for _ in range(50):  # after a resize the page may still move
        row = steps.first.bounding_box()["y"] == steps.last.bounding_box()["y"]
        upper, lower = card.bounding_box(), picture.bounding_box()
        above = upper["y"] + upper["height"] <= lower["y"] + 1
        if row and above:
            break
        page.wait_for_timeout(200)
    assert row
    assert above
    card.locator(".choice").first.click()
    expect(card).to_contain_text(RIGHT)
    page.mouse.move(size[0] - 60, steps.first.bounding_box()["y"] + 60)
    page.mouse.wheel(0, 4000)
    page.wait_for_timeout(400)
    expect(steps.last).to_be_in_viewport(ratio=1)


def test_large_text_has_no_more_than_a_room_needs_and_what_it_speaks_of_is_in_view(page):
    go(page, "Surface")
    begin(page, "Which ball radius?", 10)
    page.get_by_label("Large", exact=True).locator("visible=true").check()
    card = page.locator(".packetmesh-lesson-card")
    expect(card).to_contain_text("(1 of 10)")
    page.keyboard.press("3")
    expect(card).to_contain_text(RIGHT)
    expect(card).not_to_contain_text("(1 of 10)")
    ball = page.locator(".packetmesh-here")
    expect(ball).to_have_count(1)
    expect(ball).to_contain_text("Watch the ball roll")
    expect(ball).to_be_in_viewport()
    assert float(card.evaluate("one => parseFloat(getComputedStyle(one).fontSize)")) >= 17.0
    go(page, "Scene")
    expect(card).to_have_count(0)

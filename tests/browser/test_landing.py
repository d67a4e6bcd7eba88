"""The landing screen as a new browser meets it."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.hands import PATIENCE_MS


@pytest.fixture(scope="module")
def page(browser):
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    yield page
    context.close()


@pytest.fixture
def landing(page, app):
    """The bare address, which keeps nothing of before, as soon as anything is there."""
    page.goto("about:blank")
    page.goto(app.url, wait_until="commit")
    page.get_by_role("dialog", name="Welcome").wait_for()
    return page


def on_top(page):
    """What lies over the middle of the page."""
    return page.evaluate("document.elementFromPoint(640, 360).closest('#packetmesh-landing') !== null")


def test_it_covers_the_page_while_the_scene_loads_and_escape_leaves_to_it(landing):
    assert on_top(landing)
    landing.get_by_text("Up to date").wait_for()
    assert on_top(landing)
    landing.keyboard.press("Escape")
    expect(landing.get_by_role("dialog", name="Welcome")).to_have_count(0)
    assert not on_top(landing)
    landing.get_by_text("Each camera node delivers").wait_for()


def test_a_click_on_explore_is_nothing_that_could_be_reset(landing):
    landing.get_by_role("button", name="Explore").click()
    landing.get_by_text("Up to date").wait_for()
    expect(landing.get_by_role("button", name="Reset", exact=True)).to_be_disabled()


def test_a_lesson_opens_at_its_first_stop(landing):
    landing.get_by_role("button", name="What one lost packet costs").click()
    landing.get_by_text("(1 of 8)").locator("visible=true").first.wait_for()
    expect(landing.get_by_role("dialog", name="Welcome")).to_have_count(0)
    landing.keyboard.press("s")
    landing.get_by_text("They were sent again.").locator("visible=true").first.wait_for()


def test_a_scene_opens(landing):
    landing.get_by_role("button", name="Office").click()
    expect(landing.get_by_label("Scene", exact=True).first).to_have_value("Office")
    expect(landing.get_by_role("dialog", name="Welcome")).to_have_count(0)


def test_ones_own_images_are_asked_for_in_the_open_folder(landing):
    landing.get_by_role("button", name="Open your own").click()
    landing.get_by_role("button", name="Recording …").locator("visible=true").wait_for()
    expect(landing.get_by_label("It becomes").locator("visible=true")).to_have_value(
        "some of its frames, as nodes"
    )
    expect(landing.get_by_role("dialog", name="Welcome")).to_have_count(0)
    expect(landing.get_by_label("Scene", exact=True).first).to_have_value("Box on a table")


def test_a_lesson_opens_in_the_scene_that_it_speaks_of(landing):
    """That of calibration needs photographs of a board, which only one scene has."""
    landing.get_by_role("button", name="How good is my calibration?").click()
    landing.get_by_text("(1 of 7)").locator("visible=true").first.wait_for()
    landing.wait_for_url("**scene=uncalibrated**")
    landing.get_by_text("Up to date").wait_for()
    expect(landing.get_by_text("without photographs of a board").locator("visible=true")).to_have_count(0)

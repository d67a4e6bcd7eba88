"""The Calibrate screen as somebody uses it who doubts the cameras, in a real browser."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from app.screens.calibrate.labels import AROUND, HALVES
from tests.browser.conftest import dismiss_notifications
from tests.browser.hands import canvas, changed_from, go, press, slider, unfold

LONG_MS = 240_000
"""For the cameras and their depth on a busy machine."""
BARS = ".packetmesh-views button"


@pytest.fixture(scope="module")
def calibrated(browser, app):
    """The step with the scene whose cameras need calibration, opened as the screen proposes."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.set_default_timeout(LONG_MS)
    page.goto(f"{app.url}?fixedDpr=1")
    go(page, "Calibrate")
    page.get_by_text("without photographs of a board").wait_for()
    press(page, "Uncalibrated nodes")
    page.get_by_text("PASS").wait_for()
    page.get_by_text("Up to date").wait_for()
    dismiss_notifications(page)
    yield page
    context.close()


def visible(page, label):
    """The input of that label on the step that is shown."""
    return page.get_by_label(label, exact=True).locator("visible=true").first


def pick(page, label, option):
    visible(page, label).click()
    page.get_by_role("option", name=option, exact=True).locator("visible=true").click()


def f_scores(page):
    """Of the surface as before and calibrated, in %."""
    row = page.get_by_role("row", name="F-score 5 cm").locator("visible=true").first
    return [float(text) for text in re.findall(r"[\d.]+(?= %)", row.inner_text())]


def test_a_click_on_a_bar_shows_its_photograph(calibrated):
    bars = calibrated.locator(BARS)
    expect(bars).to_have_count(14)
    bars.nth(3).click()
    calibrated.get_by_text(re.compile(r"View 3, \d+ points found")).wait_for()
    expect(bars.nth(3)).to_have_attribute("aria-pressed", "true")


def test_a_dropped_view_is_left_out_and_comes_back(calibrated):
    row = calibrated.get_by_role("row", name="Views used").locator("visible=true")
    before = row.inner_text()
    calibrated.locator(BARS).nth(1).click()
    press(calibrated, "Drop")
    calibrated.get_by_text("all views", exact=True).wait_for()
    expect(row).to_have_text(re.compile("10 of 14.*11 of 14"))
    press(calibrated, "All")
    expect(row).to_have_text(before.replace("\t", ""), timeout=LONG_MS)
    calibrated.get_by_text("Up to date").wait_for()


def test_the_pictures_and_the_stage_follow_the_lists(calibrated):
    pick(calibrated, "Compare", HALVES)
    calibrated.get_by_text("Two halves of the views put a point").wait_for()
    for around in list(AROUND)[1:]:
        begin = canvas(calibrated)
        pick(calibrated, "In space", around)
        assert changed_from(calibrated, begin)


def test_the_noise_slider_replays_the_experiment(calibrated):
    unfold(calibrated, "What if the points were noisier?")
    handle = slider(calibrated, "Noise (px)")
    handle.focus()
    handle.press("ArrowRight")
    calibrated.get_by_text(re.compile(r"\d+ of 200 trials")).wait_for()
    handle.press("ArrowRight")
    calibrated.get_by_text("All trials").wait_for()
    expect(calibrated.locator(".js-plotly-plot").locator("visible=true").first).to_be_visible()
    unfold(calibrated, "What if the points were noisier?")


def test_the_mesh_is_another_with_the_calibration_and_the_same_again_without(calibrated):
    go(calibrated, "Surface")
    calibrated.get_by_text("Up to date").wait_for()
    before = canvas(calibrated)
    go(calibrated, "Calibrate")
    press(calibrated, "Use this calibration")
    calibrated.get_by_text("In use").wait_for()
    calibrated.get_by_text("Up to date").wait_for()
    row = calibrated.get_by_role("row", name="F-score 5 cm").locator("visible=true").first
    expect(row).to_have_text(re.compile(r"\d %.*\d %"), timeout=LONG_MS)
    came, calibrated_share = f_scores(calibrated)
    assert calibrated_share > came + 10.0
    go(calibrated, "Surface")
    assert changed_from(calibrated, before)
    go(calibrated, "Export")
    calibrated.get_by_text(re.compile("--calibration .*calibration_01")).first.wait_for()
    go(calibrated, "Calibrate")
    press(calibrated, "As before")
    expect(calibrated.get_by_text("In use")).to_have_count(0)

"""The Calibrate screen as somebody uses it who doubts the cameras, in a real browser."""

from __future__ import annotations

import re
from functools import partial
from itertools import pairwise

import pytest
from playwright.sync_api import expect

from app.screens.calibrate import panel
from app.screens.calibrate.labels import AROUND, HALVES
from app.screens.calibrate.noise_view import TRIALS, NoiseRequest
from tests.browser.hands import (
    PATIENCE_MS,
    canvas,
    changed_from,
    dismiss_notifications,
    go,
    pick,
    press,
    slider,
    unfold,
)

BARS = ".packetmesh-views [data-packetmesh-pick]"
DOCK = ".packetmesh-dock-row"
FEW = 24
"""Trials of the experiment with noise, whose number is nothing to the page."""


@pytest.fixture(scope="module")
def few_trials():
    """Few trials, so that they are soon there."""
    assert TRIALS == 200  # the thesis's
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(panel, "NoiseRequest", partial(NoiseRequest, trials=FEW))
        yield


@pytest.fixture(scope="module")
def calibrated(browser, app, few_trials):
    """The step with the scene whose cameras need calibration, opened as the screen proposes."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{app.url}?fixedDpr=1")
    go(page, "Calibrate")
    page.get_by_text("without photographs of a board").wait_for()
    folders = page.locator("svg[class*=tabler-icon-chevron-]").locator("visible=true").locator("xpath=..")
    expect(folders).to_have_text(["Use your own photographs"])  # the only one that can be used
    press(page, "Uncalibrated nodes")
    page.get_by_text("PASS").wait_for()
    page.get_by_text("Up to date").wait_for()
    dismiss_notifications(page)
    yield page
    context.close()


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
    expect(row).to_have_text(re.compile("11 of 14.*12 of 14"))
    press(calibrated, "All")
    expect(row).to_have_text(before.replace("\t", ""))
    calibrated.get_by_text("Up to date").wait_for()


def test_the_pictures_and_the_stage_follow_the_lists(calibrated):
    pick(calibrated, "Compare", HALVES)
    calibrated.get_by_text("Difference of the two halves for a point").wait_for()
    for around in list(AROUND)[1:]:
        begin = canvas(calibrated)
        pick(calibrated, "In space", around)
        assert changed_from(calibrated, begin)


def test_the_noise_slider_replays_the_experiment(calibrated):
    unfold(calibrated, "What if the points were noisier?")
    handle = slider(calibrated, "Noise (px)")
    handle.focus()
    handle.press("ArrowRight")
    calibrated.locator(f"{DOCK} b").get_by_text(re.compile(rf"\d+ of {FEW} trials")).wait_for()
    handle.press("ArrowRight")
    calibrated.get_by_text("All trials").wait_for()
    unfold(calibrated, "What if the points were noisier?")


def test_the_dock_shows_every_trial_with_labels_and_units_until_the_screen_is_left(calibrated):
    dock = calibrated.locator(DOCK)
    expect(dock.locator("b").first).to_have_text(re.compile(f"0.60 px of noise.*{FEW} of {FEW} trials"))
    plots = dock.locator(".plot")
    expect(plots).to_have_count(3)
    for index, (x, y) in enumerate((("fx (px)", "fy (px)"), ("cx (px)", "cy (px)"), ("k1 (", "k2 ("))):
        plot = plots.nth(index)
        expect(plot.locator(".xtitle")).to_contain_text(x)
        expect(plot.locator(".ytitle")).to_contain_text(y)
        assert plot.locator(".scatterlayer .point").count() == FEW + 2
    box, window = dock.bounding_box(), calibrated.viewport_size
    assert (box["x"], box["width"]) == (0, window["width"])
    assert box["y"] + box["height"] == window["height"]
    go(calibrated, "Surface")
    expect(dock).to_have_count(0)
    go(calibrated, "Calibrate")
    expect(dock).to_be_visible()
    dock.get_by_role("button", name="✕").click()
    expect(dock).to_have_count(0)


def test_a_stop_of_the_lesson_unfolds_what_it_speaks_of(calibrated):
    unfold(calibrated, "Lesson: How good is my calibration?")
    sliders = calibrated.get_by_text("Range (m)", exact=True).locator("visible=true")
    expect(sliders).to_have_count(0)
    pick(calibrated, "Stop", "4. Sure of what, and where?")
    expect(sliders).to_have_count(1)
    pick(calibrated, "Stop", "3. Test on views left out")
    calibrated.get_by_text("(3 of 7)").locator("visible=true").first.wait_for()
    pick(calibrated, "Stop", "4. Sure of what, and where?")
    calibrated.wait_for_timeout(600)
    expect(sliders).to_have_count(1)
    pick(calibrated, "Stop", "not now")
    unfold(calibrated, "Good enough for what?")
    unfold(calibrated, "Lesson: How good is my calibration?")


def test_on_a_phone_nothing_covers_anything(browser, app):
    context = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{app.url}?fixedDpr=1")
    go(page, "Network")
    page.locator(DOCK).wait_for()
    page.wait_for_timeout(1000)
    places = [
        page.locator(one).first.bounding_box()
        for one in ("canvas", ".mantine-Paper-root:has(.packetmesh-steps)", DOCK)
    ]
    for above, below in pairwise(places):
        assert above["y"] + above["height"] <= below["y"] + 1
    assert all((one["x"], one["width"]) == (0, 390) for one in places)
    assert places[0]["height"] > 150
    assert places[2]["y"] + places[2]["height"] == pytest.approx(844, abs=1)
    assert page.get_by_label("Dock", exact=True).locator("visible=true").count() == 0
    context.close()


def test_the_mesh_is_another_with_the_calibration_and_the_same_again_without(calibrated):
    go(calibrated, "Surface")
    calibrated.get_by_text("Up to date").wait_for()
    before = canvas(calibrated)
    go(calibrated, "Calibrate")
    press(calibrated, "Use this calibration")
    calibrated.get_by_text("In use").wait_for()
    calibrated.get_by_text("Up to date").wait_for()
    row = calibrated.get_by_role("row", name="F-score 5 cm").locator("visible=true").first
    expect(row).to_have_text(re.compile(r"\d %.*\d %"))
    came, calibrated_share = f_scores(calibrated)
    assert calibrated_share > came + 10.0
    go(calibrated, "Surface")
    assert changed_from(calibrated, before)
    go(calibrated, "Export")
    calibrated.get_by_text(re.compile("--calibration .*calibration_01")).first.wait_for()
    go(calibrated, "Calibrate")
    press(calibrated, "As before")
    expect(calibrated.get_by_text("In use")).to_have_count(0)

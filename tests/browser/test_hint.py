"""What names mean: of numbers and of controls, by a click on them."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import SIZE_PX
from tests.browser.hands import STEPS, go


@pytest.fixture
def note(page):
    return page.locator(".packetmesh-hint")


def named(page, label):
    return page.locator("label", has_text=label).locator("visible=true").first


def test_a_number_is_explained_by_a_click_on_its_name(page, note):
    go(page, "Surface")
    page.get_by_text("Up to date").wait_for()
    page.get_by_role("button", name="Area of holes").click()
    expect(note).to_contain_text("holes that the cameras see")
    page.keyboard.press("Escape")
    expect(note).to_have_count(0)


def test_a_control_is_explained_by_a_click_on_its_label_which_ticks_a_box_as_everywhere(page, note):
    go(page, "Surface")
    page.get_by_text("Up to date").wait_for()
    rims = page.get_by_label("Hole rims", exact=True)
    drawn = rims.is_checked()
    for label, meaning in (("Radius (mm)", "Radius of the ball"), ("Hole rims", "one triangle only")):
        expect(named(page, label)).to_have_css("border-bottom-style", "dotted")
        named(page, label).click()
        expect(note).to_contain_text(meaning)
        page.wait_for_timeout(300)  # a click on the label of a checkbox is one on the box, too
        expect(note).to_contain_text(meaning)
    assert rims.is_checked() != drawn
    named(page, "Hole rims").click()
    expect(note).to_have_count(0)
    assert rims.is_checked() == drawn


def test_an_explanation_covers_no_row_of_the_panel(page, note):
    go(page, "Surface")
    page.get_by_text("Up to date").wait_for()
    panel = page.locator(".mantine-ScrollArea-viewport", has=page.locator(".packetmesh-steps")).first
    for size in (SIZE_PX, {"width": 390, "height": 780}):
        page.set_viewport_size(size)
        page.wait_for_timeout(500)
        page.get_by_role("button", name="Area of holes").click()
        over, under = note.bounding_box(), panel.bounding_box()
        assert over["x"] >= 0
        assert over["y"] >= 0
        beside = over["x"] + over["width"] <= under["x"]
        assert beside or over["y"] + over["height"] <= under["y"]
        page.keyboard.press("Escape")
    page.set_viewport_size(SIZE_PX)
    page.get_by_label("Radii", exact=True).first.hover()
    hint = page.get_by_role("tooltip").first
    hint.wait_for()
    over, under = hint.bounding_box(), panel.bounding_box()
    assert 0 <= over["x"] <= under["x"] - over["width"]


def test_every_control_that_is_seen_has_a_meaning(page):
    for step in STEPS:
        go(page, step)
        page.wait_for_timeout(500)
        labels = page.locator("label[data-plain]").locator("visible=true").all_inner_texts()
        assert labels == [], step

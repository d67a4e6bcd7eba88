"""The Depth screen as somebody uses it who wants to know how far to believe a picture, in a real browser."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from app.screens.depth.labels import COLORINGS, EVERYWHERE, FILLS, PICTURES
from tests.browser.hands import (
    ALIKE,
    afresh,
    canvas,
    changed_from,
    differing,
    go,
    pick,
    press,
    slider,
    unfold,
    visible,
)

BY_CONFIDENCE = next(name for name, coloring in COLORINGS.items() if coloring == "confidence")


@pytest.fixture
def depth(tab):
    """The Depth step with everything computed, as a fresh session has it."""
    afresh(tab)
    go(tab, "Depth")
    tab.get_by_role("row", name="Network ran on").wait_for()
    tab.get_by_text("Up to date").wait_for()
    return tab


def picture(page):
    """The split picture, as it is drawn."""
    return page.locator("img").locator("visible=true").first.get_attribute("src")


def becomes_another(page, before):
    for _ in range(40):
        if picture(page) != before:
            return True
        page.wait_for_timeout(100)
    return False


def test_the_split_slider_and_the_lists_change_the_picture_and_its_captions(depth):
    begin, view = picture(depth), canvas(depth, still=4)
    handle = slider(depth, "Split (%)")
    handle.focus()
    for _ in range(20):
        handle.press("ArrowRight")
    assert becomes_another(depth, begin)
    assert differing(canvas(depth), view) < ALIKE  # the arrows moved the slider, not the view
    whole = picture(depth)
    pick(depth, "Left", PICTURES["difference"])
    depth.get_by_text("+30 cm").wait_for()
    assert becomes_another(depth, whole)
    pick(depth, "Right", PICTURES["confidence"])
    depth.get_by_text("100 %", exact=True).first.wait_for()


def test_the_points_can_have_the_colours_of_their_confidence(depth):
    unfold(depth, "Advanced")
    begin = canvas(depth)
    pick(depth, "Inferred points", EVERYWHERE)
    assert changed_from(depth, begin)
    violet = canvas(depth)
    pick(depth, "Colours", BY_CONFIDENCE)
    assert changed_from(depth, violet)


def test_the_residuals_say_what_was_fitted(depth):
    unfold(depth, "Residuals of the alignment")
    depth.get_by_role("row", name="Fitted line").get_by_text("exp C").wait_for()
    depth.locator(".js-plotly-plot").locator("visible=true").first.wait_for()


def test_a_shorter_reach_lets_in_less(depth):
    unfold(depth, "Confidence of inferred depth")
    row = depth.get_by_role("row", name="Out of reach")
    row.wait_for()
    handle = slider(depth, "Reach (% of the diagonal)")
    handle.focus()
    handle.press("Home")
    expect(row).to_have_text(re.compile(r"[1-9]\d\.\d %"))
    depth.get_by_text("Up to date").wait_for()


def test_a_hidden_disc_is_filled_in_every_way(depth):
    unfold(depth, "Hide a region and see it filled")
    press(depth, "Hide and fill")
    depth.get_by_text(re.compile(r"[\d,]+ measured pixels of node_00 hidden")).wait_for()
    for way in FILLS.keys() - {"measured", "hidden", "shipped"}:
        depth.get_by_role("row", name=FILLS[way]).wait_for()


def test_a_click_with_the_brush_paints_points(depth):
    depth.mouse.move(1, 1)
    begin = canvas(depth)
    unfold(depth, "Hide a region and see it filled")
    visible(depth, "Brush").check()
    picture = depth.locator("canvas").first.bounding_box()
    spots = [(0.5, 0.5), (0.4, 0.45), (0.5, 0.4), (0.6, 0.5), (0.45, 0.6)]
    for x, y in spots:
        depth.mouse.click(picture["x"] + x * picture["width"], picture["y"] + y * picture["height"])
        depth.wait_for_timeout(300)
    depth.get_by_text("painted in magenta").wait_for()
    assert changed_from(depth, begin)
    press(depth, "Hide and fill")
    depth.get_by_text(re.compile(r"[\d,]+ measured pixels of node_00 hidden")).wait_for()
    press(depth, "Clear")
    expect(depth.get_by_text("painted in magenta")).to_have_count(0)
    assert differing(canvas(depth), begin) <= ALIKE


def test_a_file_that_is_no_network_is_a_sentence_and_changes_nothing(depth):
    begin = canvas(depth)
    unfold(depth, "Neural network")
    depth.locator("input[type=file]").last.set_input_files(
        {"name": "mine.onnx", "mimeType": "application/octet-stream", "buffer": b"not a network"}
    )
    depth.get_by_text("is not a readable ONNX network").wait_for()
    depth.get_by_text("The previous network stays in use.").wait_for()
    expect(visible(depth, "Network file")).to_have_value("mine.onnx")
    depth.get_by_text("Up to date").wait_for()
    assert differing(canvas(depth), begin) <= ALIKE


def test_the_lesson_sets_the_controls(depth):
    unfold(depth, "Lesson: Can a picture measure?")
    for stop in range(1, 8):
        depth.get_by_role("button", name="Next", exact=True).locator("visible=true").first.click()
        depth.get_by_text(f"({stop} of 7)").locator("visible=true").first.wait_for()
        press(depth, "Skip")
        expect(depth.get_by_text("Take a guess").locator("visible=true")).to_have_count(0)
        if stop == 3:
            expect(visible(depth, "Alignment")).to_have_value("one scale")
        if stop == 5:
            expect(visible(depth, "Right")).to_have_value(PICTURES["confidence"])
    depth.get_by_text(re.compile(r"[\d,]+ measured pixels of node_00 hidden")).wait_for()
    depth.get_by_text("Up to date").wait_for()

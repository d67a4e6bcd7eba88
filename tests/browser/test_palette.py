"""The command palette and the keys: find a setting, undo it, and show the stage alone."""

from __future__ import annotations

import cv2
import numpy as np
from playwright.sync_api import expect

from tests.browser.hands import drawn, go

FIELD = "input.mantine-Spotlight-search"


def find(page, text):
    """Choose the first entry of the palette that typing finds."""
    page.get_by_role("button", name="Find …").click()
    page.locator(FIELD).fill(text)
    entry = page.locator(".mantine-Spotlight-action").first
    expect(entry).to_contain_text(text)
    entry.click()
    expect(page.locator(FIELD)).to_have_count(0)


def row_of(page, label):
    """A visible slider's row."""
    return page.locator("label", has_text=label).locator("visible=true").locator("xpath=../../..")


def test_a_setting_that_is_found_is_shown_in_its_folder_and_its_change_is_undone(page):
    page.wait_for_timeout(1000)  # entries follow what is computed
    find(page, "Smoothing passes")
    framed = page.locator(".packetmesh-pointed")
    expect(framed).to_contain_text("Smoothing passes")
    row = row_of(page, "Smoothing passes")
    expect(row).to_be_in_viewport()
    row.get_by_role("slider").press("ArrowRight")
    expect(row.locator("input[type=text]")).to_have_value("3")
    expect(page.locator(".packetmesh-tools [data-packetmesh-key='mod+z']")).to_be_enabled()
    page.keyboard.press("Control+z")  # the slider still has the keyboard
    page.get_by_text("Undone: smoothing passes.").wait_for()
    expect(row.locator("input[type=text]")).to_have_value("2")
    page.keyboard.press("Control+y")
    expect(row.locator("input[type=text]")).to_have_value("3")


def test_keys_turn_the_view_and_a_field_keeps_its_letters(page):
    go(page, "Scene")
    page.keyboard.press("t")
    page.wait_for_url("**cam=**")
    view = page.url
    page.get_by_role("button", name="Find …").click()
    page.locator(FIELD).press_sequentially("front")
    expect(page.locator(FIELD)).to_have_value("front")
    page.keyboard.press("Escape")
    page.wait_for_timeout(800)
    assert page.url == view


def test_the_stage_stands_alone_and_its_picture_is_twice_as_large(page, tmp_path):
    stage = page.locator("canvas[data-engine]")
    beside = stage.bounding_box()["width"]
    page.keyboard.press("m")
    expect(page.get_by_role("button", name="Scene")).to_be_hidden()
    wait_for_width(page, stage, page.evaluate("innerWidth"))
    box = stage.bounding_box()
    with drawn(page), page.expect_download() as download:
        page.keyboard.press("p")
    download.value.save_as(tmp_path / "view.png")
    picture = cv2.imread(str(tmp_path / "view.png"), cv2.IMREAD_UNCHANGED)
    assert picture.shape == (2 * box["height"], 2 * box["width"], 3)
    assert np.unique(picture.reshape(-1, 3), axis=0).shape[0] > 1000
    page.keyboard.press("Escape")
    expect(page.get_by_role("button", name="Scene")).to_be_visible()
    wait_for_width(page, stage, beside)


def wait_for_width(page, stage, width_px):
    for _ in range(100):
        if stage.bounding_box()["width"] == width_px:
            return
        page.wait_for_timeout(200)
    assert stage.bounding_box()["width"] == width_px

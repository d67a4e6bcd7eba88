"""The hand-out in a real Chromium that has no network: it plays, seeks and zooms."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from app.reports.delivery import delivery_page
from tests.app.hand_outs import END_S, frames, hand_out
from tests.browser.hands import PATIENCE_MS


@pytest.fixture(scope="module")
def opened(browser, tmp_path_factory):
    """The page of a made-up delivery, with what it asked for and what went wrong."""
    path = tmp_path_factory.mktemp("hand-out") / "delivery.html"
    path.write_text(delivery_page(hand_out(on_air=frames(4000))), encoding="utf-8")
    context = browser.new_context(viewport={"width": 1000, "height": 700}, offline=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    asked, wrong = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.add_init_script("window.draws = true")
    page.goto(path.as_uri())
    page.locator("html[data-moment='3']").wait_for()
    yield page, asked, wrong
    context.close()


@pytest.fixture
def page(opened):
    """The page at its start, over the whole time."""
    page, _, _ = opened
    page.get_by_role("button", name="Whole time").click()
    page.keyboard.press("Home")
    shown(page, -1)
    return page


def shown(page, moment):
    page.locator(f"html[data-moment='{moment}']").wait_for()
    page.wait_for_timeout(300)  # one more frame


def number(page, name):
    """The big number of that name, without its unit."""
    text = page.locator("#numbers div", has_text=name).locator("dd").first.inner_text()
    return float(re.match(r"[\d.,]+", text)[0].replace(",", "")) if text != "–" else None


def red_pixels(page):
    """How much of the stage has the colour of the wall and of its pictures."""
    picture = page.locator("#stage canvas").screenshot(style="#names, #stage p { visibility: hidden }")
    blue, green, red = np.moveaxis(
        cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).astype(int), 2, 0
    )
    return int((red - np.maximum(green, blue) > 60).sum())


def test_stepping_shows_more_of_the_wall_and_larger_numbers(page):
    seen = [red_pixels(page)]
    assert seen == [0]
    for moment in range(4):
        page.keyboard.press("ArrowRight")
        shown(page, moment)
        seen.append(red_pixels(page))
    assert seen[1] > 20  # a picture on a frustum, without a surface yet
    assert np.all(np.diff(seen) > 50)
    assert number(page, "Network time") == END_S
    assert number(page, "Bytes delivered") == 1.5
    assert number(page, "Frames lost") == 30
    assert number(page, "F-score") == 90
    assert page.locator("#about").inner_text().endswith("288 triangles")
    page.keyboard.press("ArrowLeft")
    shown(page, 2)
    assert number(page, "Frames lost") == 20


def test_playing_moves_the_clock_until_it_is_paused(page):
    page.get_by_label("Speed").select_option(label="1×")
    page.keyboard.press(" ")
    page.locator("#play", has_text="Pause").wait_for()
    # On a busy machine one picture may pass over a whole moment, so "reached" is asked, not "is".
    page.wait_for_function("() => Number(document.documentElement.dataset.moment) >= 1")
    page.keyboard.press(" ")
    page.locator("#play", has_text="Play").wait_for()
    stopped = number(page, "Network time")
    assert stopped >= 0.5 * END_S
    assert number(page, "Frames lost") in (10, 20, 30)
    page.wait_for_timeout(500)
    assert number(page, "Network time") == stopped


def test_a_click_on_the_timeline_seeks_and_the_wheel_zooms_around_it(page):
    box = page.locator("#timeline").bounding_box()
    x = box["x"] + 168 + 0.5 * (box["width"] - 168 - 64)
    page.mouse.click(x, box["y"] + 20)
    shown(page, 1)
    assert number(page, "Network time") == pytest.approx(0.5 * END_S, abs=0.05 * END_S)
    assert "full row" in page.locator("#scale").inner_text()
    before = page.locator("#timeline").screenshot()
    for _ in range(16):
        page.mouse.wheel(0, -300)
    page.get_by_text("one box per frame").wait_for()
    assert page.locator("#timeline").screenshot() != before
    page.mouse.click(x + 100, box["y"] + 20)
    page.wait_for_timeout(300)
    assert number(page, "Network time") == pytest.approx(0.5 * END_S, abs=0.05 * END_S)


def test_pointing_at_a_row_says_what_was_sent(page):
    box = page.locator("#timeline").bounding_box()
    page.mouse.move(box["x"] + 500, box["y"] + 15)
    page.locator("#readout", has_text=re.compile("^left around .* frames?, ")).wait_for()


def test_dragging_turns_the_room(page):
    page.keyboard.press("End")
    shown(page, 3)
    before = page.locator("#stage canvas").screenshot()
    box = page.locator("#stage canvas").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 320, box["y"] + 120, steps=4)
    page.mouse.up()
    page.wait_for_timeout(500)
    assert page.locator("#stage canvas").screenshot() != before


def test_of_names_that_would_cover_each_other_one_is_shown(page):
    names = page.locator("#names span:not([hidden])")
    expect(names.locator("visible=true")).to_have_count(2)
    large = page.add_style_tag(content="#names span { padding: 300px }")
    box = page.locator("#stage canvas").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 100)
    page.mouse.wheel(0, 10)  # draws anew
    expect(names.locator("visible=true")).to_have_count(1)
    large.evaluate("style => style.remove()")


def test_on_a_phone_nothing_is_cut_off(opened):
    page, _, _ = opened
    size = page.viewport_size
    page.set_viewport_size({"width": 360, "height": 800})
    page.wait_for_timeout(500)
    wide = page.evaluate("() => document.documentElement.scrollWidth")
    boxes = [
        box.bounding_box() for box in page.locator("#numbers dd, #controls button, #stage, #timeline").all()
    ]
    page.set_viewport_size(size)
    assert wide == 360
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= 360 for box in boxes)


def test_nothing_is_asked_of_a_network_and_nothing_goes_wrong(opened):
    _, asked, wrong = opened
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []
    assert wrong == []

"""Every screen comes back with what it adds to the address: by a reload, by Back, in a second tab."""

from __future__ import annotations

import re
from urllib.parse import parse_qs, urlencode, urlsplit

import pytest
from playwright.sync_api import expect

from pipeline.io.demos import SCENES
from tests.browser.hands import PATIENCE_MS, TEXTS, go, press, unfold

ADDED = {
    "scene": {"set": "depth.reach=0.125"},
    "calibrate": {"scene": "uncalibrated", "stop": "2", "pictures": "photo,coverage,30"},
    "depth": {"stop": "2", "color": "confidence", "pictures": "inferred,difference,25"},
    "fuse": {"stop": "2", "race": "seed=3", "t": "4"},
    "surface": {"surface": "before", "color": "normal", "cam": "0.500,2.000,2.500,2.600,2.600,0.800"},
    "network": {"net": "lose=10;burst=4", "t": "0.25"},
    "export": {"surface": "poisson"},
}
"""By screen, what a link sets that is not as at the start."""
SEEN = {"calibrate": "(2 of ", "depth": "(2 of ", "fuse": "(2 of "}
"""What a person sees of it before anything is computed."""
FILES = {
    "color.png": "Colour image …",
    "depth.png": "Depth image …",
    "intrinsics.json": "Intrinsics …",
}
STEP_MS = 400


@pytest.fixture(scope="module")
def page(few, browser, app):
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    yield page
    context.close()


def said(page):
    """What the address says, by its keys."""
    return {key: values[0] for key, values in parse_qs(urlsplit(page.url).query).items()}


def wait_for_address(page, wanted):
    """Wait until the screen is there and the address says so, and goes on to say so."""
    page.get_by_text(TEXTS[wanted["screen"].capitalize()]).wait_for()
    right = 0
    for _ in range(PATIENCE_MS // STEP_MS):
        page.wait_for_timeout(STEP_MS)
        right = right + 1 if said(page) | wanted == said(page) else 0
        if right == 3:
            return
    assert said(page) | wanted == said(page)


def link(app, wanted):
    return f"{app.url}?{urlencode({'fixedDpr': 1, 'scene': 'box-on-table', **wanted})}"


@pytest.mark.parametrize("screen", ADDED)
def test_a_reload_and_back_give_back_screen_setting_and_what_the_screen_adds(page, app, screen):
    wanted = {"screen": screen, "preset": "packetmesh", **ADDED[screen]}
    page.goto(link(app, wanted))
    for way in (page.reload, page.go_back):
        wait_for_address(page, wanted)
        page.get_by_text(SEEN.get(screen, TEXTS[screen.capitalize()])).locator(
            "visible=true"
        ).first.wait_for()
        expect(page.get_by_text("Part of the address")).to_have_count(0)
        if way == page.go_back:
            other = "Depth" if screen == "scene" else "Scene"
            go(page, other)
            wait_for_address(page, {"screen": other.lower()})
        way()
    wait_for_address(page, wanted)


def test_what_is_broken_in_a_link_is_one_sentence_and_the_rest_is_followed(page, app):
    page.goto(link(app, {"screen": "surface", "color": "normal", "cam": "1,2", "stop": "99"}))
    page.get_by_text("this lesson has 1 to 10 (and 1 more).").wait_for()
    wait_for_address(page, {"screen": "surface", "color": "normal", "preset": "packetmesh"})
    assert not said(page).keys() & {"cam", "stop"}


def test_an_upload_opens_in_a_second_tab_with_the_first_one_closed(page, app):
    page.goto(link(app, {"screen": "scene"}))
    page.get_by_text(TEXTS["Scene"]).wait_for()
    unfold(page, "Use your own images")
    for name, label in FILES.items():
        with page.expect_file_chooser() as chooser:
            page.get_by_role("button", name=label).last.click()
        chooser.value.set_files(SCENES / "box-on-table" / "node_00" / name)
        page.wait_for_timeout(STEP_MS)
    page.get_by_text("All three are there").wait_for()
    press(page, "Reconstruct this pair")
    page.wait_for_url(re.compile("scene=upload-"))
    upload = {"scene": said(page)["scene"]}
    go(page, "Export")
    wait_for_address(page, {"screen": "export", **upload})
    command = page.get_by_text("packetmesh reconstruct --color color.png --depth depth.png --intrinsics")
    command.wait_for()
    second = page.context.new_page()
    second.goto(page.url)
    page.close()
    wait_for_address(second, {"screen": "export", **upload})
    second.get_by_text("packetmesh reconstruct --color color.png --depth depth.png").wait_for()

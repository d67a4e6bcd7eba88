"""The walk of a recording on the Fuse screen, in a real browser."""

from __future__ import annotations

import re
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from tests.browser.hands import afresh, canvas, changed_from, pick

SEEN = "camera by tracking alone"
"""Part of the legend."""


@pytest.fixture(scope="module")
def walk(tab):
    """The Fuse step with the demo recording, once its pictures have been read."""
    afresh(tab, "fixedDpr=1&scene=living-room-walk&screen=fuse")
    tab.get_by_text(SEEN).wait_for()
    tab.get_by_text("Up to date").wait_for()
    return tab


def field(page):
    return page.locator(".packetmesh-dock-field").bounding_box()


def in_address(page, key):
    """What the address has for a key, once it has anything."""
    page.wait_for_function("key => new URLSearchParams(location.search).has(key)", arg=key)
    return parse_qs(urlsplit(page.url).query)[key][0]


def test_the_map_grows_while_the_camera_walks(walk):
    names = walk.locator(".packetmesh-dock-row .names")
    expect(names).to_contain_text("frame 199")
    end = canvas(walk)
    walk.locator(".packetmesh-dock-row").focus()
    walk.keyboard.press("Home")
    expect(names).to_contain_text("frame 0: keyframe")
    assert changed_from(walk, end)
    assert in_address(walk, "frame") == "0"
    walk.keyboard.press("Space")
    expect(names).to_contain_text(re.compile(r"frame \d\d+:"))
    walk.keyboard.press("Space")


def test_a_click_on_a_loop_shows_what_closed_it_and_a_reload_keeps_it(walk):
    walk.get_by_label("Loop", exact=True).first.click()
    option = walk.get_by_role("option", name=re.compile("^frames ")).first
    name = option.inner_text()
    option.click()
    first, last = re.findall(r"\d+", name)
    assert in_address(walk, "loop") == f"{first}-{last}"
    expect(walk.get_by_role("row", name="Moved")).to_contain_text(re.compile(r"[\d.]+ cm, [\d.]+°"))
    expect(walk.get_by_role("row", name="Counts")).to_contain_text("yes")
    pick(walk, "Loop", "none")
    expect(walk.get_by_role("row", name="Counts")).to_have_count(0)
    box = field(walk)
    walk.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 8)  # the longest loops are on top
    expect(walk.get_by_role("row", name="Counts")).to_be_visible()
    shown = walk.locator(".packetmesh-dock-row .names").inner_text()
    frame = re.search(r"frame (\d+)", shown)[1]
    loop = "-".join(re.findall(r"\d+", walk.get_by_label("Loop", exact=True).first.input_value()))
    for key, value in (("frame", frame), ("loop", loop)):
        walk.wait_for_function(
            "([key, value]) => new URLSearchParams(location.search).get(key) === value", arg=[key, value]
        )
    walk.reload()
    walk.get_by_text(SEEN).wait_for()
    expect(walk.locator(".packetmesh-dock-row .names")).to_contain_text(f"frame {frame}:")
    assert in_address(walk, "loop") == loop
    expect(walk.get_by_role("row", name="Moved")).to_be_visible()

"""Reload, Back and a link that was sent do what people expect."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from tests.browser.hands import PATIENCE_MS, go


@pytest.fixture(scope="module")
def page(browser, app):
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    yield page
    context.close()


def shown(page, screen):
    """Wait for the address of a screen and for the screen itself."""
    page.wait_for_url(re.compile(f"screen={screen.lower()}$"))
    expect(page.get_by_role("button", name=re.compile(f"^{screen}"))).to_be_visible()


def preset(page):
    return page.get_by_label("Preset", exact=True).first


def test_a_link_shows_its_scene_settings_and_screen_and_survives_a_reload(page, app):
    page.goto(f"{app.url}?scene=box-on-table&preset=thesis&set=depth.reach%3D0.125&screen=surface")
    shown(page, "Surface")
    page.get_by_text("Up to date").wait_for()
    page.reload()
    shown(page, "Surface")
    page.get_by_text("Up to date").wait_for()
    assert "preset=thesis" in page.url
    assert "depth.reach" in page.url
    page.get_by_role("button", name="Copy as command").click()
    text = page.locator("pre").first.inner_text()
    assert "--preset thesis --set depth.reach=0.125" in text


def test_back_and_forward_go_through_the_screens(page, app):
    page.goto(f"{app.url}?explore")
    shown(page, "Scene")
    page.get_by_text("Up to date").wait_for()
    go(page, "Fuse")
    shown(page, "Fuse")
    go(page, "Surface")
    shown(page, "Surface")
    page.go_back()
    shown(page, "Fuse")
    page.get_by_text("The race").first.wait_for()
    page.go_back()
    shown(page, "Scene")
    expect(preset(page)).to_be_visible()
    page.go_forward()
    shown(page, "Fuse")


def test_an_address_that_cannot_be_followed_is_a_sentence_and_mended(page, app):
    page.goto(f"{app.url}?scene=attic")
    page.get_by_text("scene=attic; try one of").wait_for()
    shown(page, "Scene")
    assert "attic" not in page.url

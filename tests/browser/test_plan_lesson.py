"""The lesson on the plan in a real browser: a pupil moves the ghost by keys, and meets the number again."""

from __future__ import annotations

import re

from playwright.sync_api import expect

from tests.browser.hands import go
from tests.browser.test_lesson import begin, page, press_until  # noqa: F401

LESSON = "Where should the camera stand?"
POINTS = r"\d+\.\d \(\d+\.\d to \d+\.\d\)"
FOCUS = """index => {
  const label = [...document.querySelectorAll("label")].find(one => one.textContent.includes("Place (m)"));
  let around = label;
  while (around.querySelectorAll("input").length < 3) around = around.parentElement;
  around.querySelectorAll("input")[index].focus();
}"""


def table_promise(page):  # noqa: F811
    """The promise in the folder's table."""
    return page.get_by_role("row", name="Promise, points").inner_text().split("\t")[-1].strip()


def test_a_pupil_places_a_ghost_by_keys_and_sees_its_promise_beside_the_plans(page):  # noqa: F811
    go(page, "Network")
    begin(page, LESSON, 6)
    card = page.locator(".packetmesh-lesson-card")
    expect(card).to_contain_text(re.compile(r"\d+\.\d % of the rays meet no measured surface"))
    page.keyboard.press("s")
    press_until(page, "ArrowRight", "(2 of 6)", 20_000)
    expect(card).to_contain_text(re.compile(f"Your ghost promises {POINTS} points"))
    first = table_promise(page)
    expect(card).to_contain_text(first)
    page.evaluate(FOCUS, 2)
    for _ in range(8):
        page.keyboard.press("ArrowUp")
    expect(page.get_by_role("row", name="Promise, points")).not_to_contain_text(first)
    page.evaluate("document.activeElement.blur()")
    expect(page.get_by_text("What it would see").locator("visible=true")).to_have_count(1)
    own = table_promise(page)
    expect(card).to_contain_text(own)
    page.keyboard.press("s")
    press_until(page, "ArrowRight", "(3 of 6)", 20_000)
    expect(card).to_contain_text(f"Your ghost promised {own}")
    expect(card).to_contain_text(re.compile(f"It promises {POINTS} points"))
    card.get_by_role("button", name="End the lesson").click()
    expect(page.get_by_text("No plan yet").locator("visible=true")).to_have_count(1)

"""The Surface screen as somebody who tunes a ball radius uses it, in a real browser."""

from __future__ import annotations

import itertools
import re
import time

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from app.screens.surface.labels import BOTH, COLORINGS, POISSON
from app.window import acknowledgement
from tests.browser.hands import (
    ALIKE,
    DRAG_S,
    PATIENCE_MS,
    afresh,
    canvas,
    changed_from,
    differing,
    go,
    pick,
    press,
    slider,
    unfold,
)

SOURCE = next(name for name, coloring in COLORINGS.items() if coloring == "source")


@pytest.fixture
def surface(tab):
    """The Surface step with everything computed, as a fresh session has it."""
    afresh(tab)
    go(tab, "Surface")
    tab.get_by_role("row", name="Rays without a surface").wait_for(timeout=180_000)
    tab.get_by_text("Up to date").wait_for()
    return tab


def numbers(page, row):
    text = page.get_by_role("row", name=row).inner_text().replace(",", "")
    return [float(value) for value in re.findall(r"\d+(?:\.\d+)?", text)]


def watch(page, row, shown):
    """Have the page keep the text of a row as it is when another text is first shown, however shortly."""
    page.evaluate(
        """([row, shown]) => {
          window.beside = null;
          const watching = setInterval(() => {
            if (!new RegExp(shown).test(document.body.innerText)) return;
            const rows = [...document.querySelectorAll("tr")].map((one) => one.innerText);
            window.beside = rows.find((text) => text.includes(row));
            if (window.beside) clearInterval(watching);
          }, 20);
        }""",
        [row, shown],
    )


def watched(page):
    """The text of the row that ``watch`` was given, once the other text was shown."""
    return page.wait_for_function("() => window.beside").json_value()


def invented_px(png):
    """How many pixels show magenta, the colour of what was filled."""
    blue, green, red = cv2.split(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR).astype(int))
    return int(((red > 150) & (blue > 150) & (green < 60)).sum())


def test_a_dragged_radius_is_shown_at_once_and_measured_when_it_rests(surface):
    before = canvas(surface)
    watch(surface, "Triangles", "Up to date")
    triangles = watched(surface)
    handle = slider(surface, "Radius (mm)")
    handle.focus()
    quick = r"triangles over [\d,]+ points"
    watch(surface, "Triangles", quick)
    for _ in range(40):
        handle.press("ArrowLeft")
    assert watched(surface) == triangles
    expect(surface.get_by_text(re.compile(quick))).to_have_count(0)
    row = surface.get_by_role("row", name="Triangles")
    expect(row).not_to_have_text(triangles, use_inner_text=True)
    surface.get_by_text("Up to date").wait_for()
    assert changed_from(surface, before)


def measured_px(png):
    """How many pixels show blue, the colour of measured points that the ball left out."""
    blue, green, red = cv2.split(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR).astype(int))
    return int(((red < 40) & (blue > 140) & (abs(green - 114) < 30)).sum())


def test_where_the_ball_falls_through_the_points_stay_and_old_numbers_are_dimmed(surface):
    meshed = measured_px(canvas(surface))
    table = surface.locator(
        ".packetmesh-numbers", has=surface.get_by_role("row", name="Rays without a surface")
    )
    old = surface.locator(".packetmesh-old-numbers")
    expect(table).to_have_css("opacity", "1")
    handle = slider(surface, "Radius (mm)")
    handle.focus()
    handle.press("Home")
    old.wait_for(state="attached")
    expect(table).to_have_css("opacity", "0.3")
    expect(old).to_have_count(0)
    surface.get_by_text("Up to date").wait_for()
    expect(table).to_have_css("opacity", "1")
    assert min(numbers(surface, "Rays without a surface")) > 90.0
    assert measured_px(canvas(surface)) > 10 * (meshed + 100)


def test_side_by_side_and_colours_by_source_tell_what_was_guessed(surface):
    alone = canvas(surface)
    pick(surface, "Show", BOTH)
    assert changed_from(surface, alone)
    both = canvas(surface)
    pick(surface, "Colours", SOURCE)
    surface.get_by_text("measured by a sensor").wait_for()
    assert changed_from(surface, both)


def test_poisson_is_a_baseline_in_the_same_table(surface):
    ball = canvas(surface)
    assert len(numbers(surface, "Rays without a surface")) == 2
    pick(surface, "Show", POISSON)
    surface.get_by_text("Screened Poisson reconstruction").wait_for()
    before, after, poisson = numbers(surface, "Rays without a surface")
    assert poisson < after < before
    assert differing(canvas(surface), ball) > ALIKE


def test_a_hole_is_chosen_from_the_list_and_explained(surface):
    unfold(surface, "Holes")
    surface.get_by_text(re.compile("All pixel rays")).wait_for()
    press(surface, "Next")
    surface.get_by_text("What to try:").wait_for()
    assert surface.get_by_text(re.compile(r"^(Gap|Normals|No points|Outside view)\.")).count()


@pytest.mark.timeout(900)
def test_no_answer_is_lost_beside_a_fast_hand(tab, monkeypatch):
    monkeypatch.setattr(acknowledgement, "TIMEOUT_S", 600.0)
    asked, ask = [], acknowledgement.DrawAcknowledgement.ask
    monkeypatch.setattr(
        acknowledgement.DrawAcknowledgement,
        "ask",
        lambda self, *of, **how: (asked.append(self), ask(self, *of, **how)),
    )
    afresh(tab)
    go(tab, "Surface")
    tab.get_by_text("Up to date").wait_for()
    handle = slider(tab, "Radius (mm)").bounding_box()
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    tab.mouse.move(x, y)
    tab.mouse.down()
    begun_s = time.monotonic()
    for step in itertools.count():
        tab.mouse.move(x + 40.0 * np.sin(0.06 * step), y)
        if (step >= 100 and len(asked) > 10) or time.monotonic() - begun_s > DRAG_S:
            break
    tab.mouse.up()
    assert len(asked) > 10
    assert all_answered(tab, asked)


def all_answered(page, asked):
    """Whether the questions cease within a minute, and the last was answered."""
    for _ in range(60):
        count = len(asked)
        page.wait_for_timeout(1000)
        if len(asked) == count and not asked[-1].waiting:
            return True
    return False


def test_a_clicked_hole_says_why_it_is_there(surface):
    picture = surface.locator("canvas").first.bounding_box()
    notice = surface.locator(".mantine-Notification-root")
    answer = notice.filter(has_text=re.compile("mm|cm|camera|view"))
    for row in range(3, 9):
        for column in range(3, 9):
            spot = (picture["width"] * column / 12, picture["height"] * row / 12)
            surface.mouse.click(picture["x"] + spot[0], picture["y"] + spot[1])
            surface.wait_for_timeout(150)
            if notice.filter(has_text=re.compile("mm|cm|camera|view")).count():
                return
    answer.first.wait_for()  # of one of them; a busy machine answers late


def test_small_holes_are_filled_on_demand_and_given_back(surface):
    unfold(surface, "Holes")
    open_ = canvas(surface)
    handle = slider(surface, "Fill small holes")
    handle.focus()
    handle.press("End")
    surface.get_by_text(re.compile(r"holes? filled")).wait_for()
    assert invented_px(canvas(surface, still=4)) > 100 > invented_px(open_)
    handle.press("Home")
    surface.get_by_text("Filling is off").wait_for()
    assert invented_px(canvas(surface, still=4)) < 100


def test_the_ball_rolls_steps_back_and_leaves(surface):
    meshed = canvas(surface)
    unfold(surface, "Watch the ball roll")
    press(surface, "Roll")
    line = surface.get_by_text(re.compile(r"Step \d+ of \d+"))
    surface.get_by_text(re.compile(r"Step ([3-9]|\d\d+) of")).wait_for()
    press(surface, "Play")
    surface.wait_for_timeout(500)
    press(surface, "Next step")
    surface.wait_for_timeout(1500)
    step = int(re.search(r"Step (\d+)", line.inner_text())[1])
    assert step >= 3
    assert differing(canvas(surface), meshed) > ALIKE
    press(surface, "One step back")
    surface.get_by_text(re.compile(rf"Step {step - 1} of")).wait_for()
    press(surface, "Close")
    expect(line).to_have_count(0)
    assert differing(canvas(surface, still=6), meshed) <= ALIKE


def test_the_points_suggest_radii_and_one_can_be_taken(surface):
    unfold(surface, "Which radius?")
    radius_mm = numbers(surface, "even")[0]
    press(surface, "even")
    expect(surface.get_by_label("Radii").first).to_have_value("one radius (slider)")
    surface.get_by_text(f"Ball radii: {radius_mm:.1f} mm").wait_for()


def test_the_sweep_plots_every_radius_and_says_what_it_means(surface):
    unfold(surface, "Which radius?")
    press(surface, "Sweep the radius")
    surface.get_by_text(re.compile(r"[1-9]\d* of \d+ balls have rolled")).wait_for()
    surface.get_by_text(re.compile(r"larger balls close|the widest")).wait_for(timeout=PATIENCE_MS)


def test_the_lesson_sets_the_controls(surface):
    unfold(surface, "Lesson: Which ball radius?")
    press(surface, "Next")
    surface.get_by_text("(1 of 10)").locator("visible=true").first.wait_for()
    expect(surface.get_by_label("Radii").first).to_have_value("one radius (slider)")
    for stop in range(2, 9):
        press(surface, "Skip")
        expect(surface.get_by_text("Take a guess").locator("visible=true")).to_have_count(0)
        press(surface, "Next")
        surface.get_by_text(f"({stop} of 10)").locator("visible=true").first.wait_for()
    expect(surface.get_by_label("Show", exact=True).first).to_have_value(BOTH)
    surface.get_by_text("Up to date").wait_for()

"""What a person does with the app, in a real browser."""

from __future__ import annotations

import os
import re
import time
from itertools import combinations
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import SIZE_PX
from tests.browser.hands import ALIKE, PATIENCE_MS, STEPS, canvas, changed_from, differing, go, pick, slider


def test_all_of_a_file_run_on_one_worker(request):
    if "PYTEST_XDIST_WORKER" not in os.environ:
        pytest.skip("there are no workers: pytest runs without -n")
    assert request.node.nodeid.endswith("@browser 1")  # pytest-xdist sends a group by this


def test_every_step_shows_its_own_picture_and_no_error(page):
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    pictures = {}
    for step in STEPS:
        go(page, step)
        pictures[step] = canvas(page)
    drawn = ("Scene", "Depth", "Fuse", "Surface")  # this scene has no boards
    assert all(differing(pictures[a], pictures[b]) > ALIKE for a, b in combinations(drawn, 2))
    assert differing(pictures["Export"], pictures["Surface"]) < ALIKE
    assert not errors


def test_the_radius_slider_changes_the_surface(page):
    go(page, "Surface")
    before, numbers = canvas(page), page.get_by_role("row", name="Triangles").inner_text()
    slider(page, "Radius").press("Home")
    page.wait_for_function(
        "old => [...document.querySelectorAll('tr')].some(r => r.innerText.startsWith('Triangles')"
        " && r.innerText !== old && !r.innerText.includes('…'))",
        arg=numbers,
    )
    page.get_by_text("Up to date").wait_for()
    assert changed_from(page, before)
    assert page.get_by_label("Radii").first.input_value() == "one radius (slider)"


def test_the_dock_steps_through_the_race(page):
    """The server is asked for its iteration before the eye looks: a busy one answers late."""
    go(page, "Fuse")
    clock = page.locator(".packetmesh-dock-time")

    def press(name, expected):
        page.get_by_role("button", name=name, exact=True).click()
        expect(clock).to_have_text(re.compile(f"^iteration {expected} of"))
        return canvas(page, still=8)

    expect(clock).to_have_text(re.compile("^iteration 0 of"))
    start = canvas(page, still=8)
    first = press("Next iteration", 1)
    assert differing(first, start) > ALIKE
    second = press("Next iteration", 2)
    assert differing(second, first) > ALIKE
    back = press("One iteration back", 1)
    assert differing(back, first) < ALIKE < differing(back, second)
    page.keyboard.press("End")
    assert changed_from(page, back)


def test_changing_an_early_step_recomputes_the_later_ones(page):
    go(page, "Depth")
    row = page.get_by_role("row", name="Alignment")
    page.get_by_label("Alignment").first.click()
    page.get_by_role("option", name="one scale").click()
    row.get_by_text("one scale", exact=True).wait_for()
    page.get_by_text("Up to date").wait_for()
    go(page, "Export")
    assert "depth.alignment=median" in page.locator("pre").first.inner_text()


def test_a_surface_can_be_downloaded(page):
    go(page, "Export")
    with page.expect_download() as download:
        page.get_by_role("button", name="PLY", exact=True).click()
    content = Path(download.value.path()).read_bytes()
    assert content.startswith(b"ply\n")
    assert b"element face" in content[:1000]


def test_the_command_is_shown(page):
    page.get_by_role("button", name="Copy as command").click()
    text = page.locator("pre").first.inner_text()
    page.get_by_role("button", name="Close").click()
    assert text.startswith("packetmesh reconstruct --scene box-on-table --preset packetmesh")


def test_buttons_with_nothing_to_do_are_dead(page):
    cancel, retry, reset = (
        page.get_by_role("button", name=name, exact=True) for name in ("Cancel", "Retry", "Reset")
    )
    for button in (cancel, retry, reset):
        expect(button).to_be_disabled()
    page.get_by_role("button", name="Copy as command").click()
    page.get_by_role("button", name="Close").click()
    expect(page.get_by_role("button", name="Close")).to_have_count(0)
    expect(reset).to_be_disabled()
    go(page, "Depth")
    pick(page, "Colours", "photo")
    expect(reset).to_be_enabled()
    reset.click()
    for button in (cancel, retry, reset):
        expect(button).to_be_disabled()


def test_that_the_picture_is_drawn_in_software_is_one_line_which_goes(browser, app):
    context = browser.new_context(viewport=SIZE_PX)
    other = context.new_page()
    other.goto(f"{app.url}?fixedDpr=1")
    line = other.locator(".packetmesh-notice")
    line.wait_for()
    assert line.bounding_box()["height"] < 30
    expect(other.get_by_text("Software WebGL rendering detected").locator("visible=true")).to_have_count(0)
    line.wait_for(state="detached")
    context.close()


def test_a_wrong_upload_is_a_sentence_and_the_session_goes_on(page):
    page.get_by_text("Use your own images").click()
    files = page.locator("input[type=file]")
    for index, (name, content) in enumerate(
        [("color.png", b"not a picture"), ("depth.png", b"nor this"), ("k.json", b"{}")]
    ):
        files.nth(index).set_input_files({"name": name, "mimeType": "image/png", "buffer": content})
    page.get_by_text("All three are there: press the button.").wait_for()
    page.get_by_role("button", name="Reconstruct this pair").click()
    page.get_by_text("Scene failed").wait_for()
    page.get_by_text("Stopped").wait_for()
    page.get_by_role("button", name="Reset", exact=True).click()
    page.get_by_text("Up to date").wait_for()


def test_a_browser_answers_while_another_one_meshes(page, browser, app):
    go(page, "Surface")
    context = browser.new_context(viewport={"width": 620, "height": 240})
    other = context.new_page()
    other.set_default_timeout(PATIENCE_MS)
    other.goto(f"{app.url}?explore")
    other.get_by_text("Up to date").wait_for()
    handle = slider(page, "Radius")
    handle.focus()
    before_the_mesh = []
    for key in ("End", *["ArrowLeft"] * 3):  # a new radius every time, so that nothing is remembered
        handle.press(key)
        page.get_by_text("Computing").first.wait_for()
        other.get_by_role("button", name="Copy as command").click()
        other.get_by_text("The same from the command line").wait_for()
        before_the_mesh.append(page.get_by_text("Computing").count() > 0)
        other.get_by_role("button", name="Close").click()
        other.get_by_text("The same from the command line").wait_for(state="detached")
        page.get_by_text("Up to date").wait_for()
    context.close()
    assert sum(before_the_mesh) >= 2


def test_a_closed_browser_leaves_no_session(page, browser, app):
    known = set(app.sessions)
    context = browser.new_context()
    context.new_page().goto(f"{app.url}?explore")
    deadline = time.monotonic() + 30
    while set(app.sessions) == known and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    assert len(app.sessions) == len(known) + 1
    context.close()
    while set(app.sessions) != known and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    assert set(app.sessions) == known

"""The Fuse screen as a class uses it, in a real browser."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest

from tests.browser.hands import canvas, changed_from, go, pick, slider, unfold


@pytest.fixture
def fuse(tab):
    """The Fuse step with its race done, as a fresh session has it."""
    tab.reload()
    tab.get_by_text("Up to date").wait_for()
    go(tab, "Fuse")
    tab.get_by_role("row", name="End error").wait_for()
    return tab


def numbers(page, row):
    """The numbers in a row of the result table, one for each lane."""
    text = page.get_by_role("row", name=row).inner_text()
    return [float(value) for value in re.findall(r"\d+(?:\.\d+)?", text)]


def await_change(page, row, before):
    """The numbers of a row once they are other ones."""
    for _ in range(100):
        now = numbers(page, row)
        if now and now != before:
            return now
        page.wait_for_timeout(200)
    raise AssertionError(f"{row} stayed {before}")


def test_two_methods_race_by_default_and_ceicp_arrives(fuse):
    icp_cm, ceicp_cm = numbers(fuse, "End error")
    assert ceicp_cm < 2.0 < icp_cm
    assert len(set(numbers(fuse, "Start error"))) == 1
    fuse.get_by_text(re.compile("ends .* cm from the truth")).wait_for()


def test_a_third_method_gets_a_lane_a_column_and_room(fuse):
    before, picture = numbers(fuse, "End error"), canvas(fuse)
    unfold(fuse, "Methods, nodes and pairs")
    pick(fuse, "Method ③", "FICP, plane")
    assert len(await_change(fuse, "End error", before)) == 3
    fuse.get_by_text("③ FICP plane").first.wait_for()
    assert changed_from(fuse, picture)


def test_far_off_starts_farther_away_and_aligned_at_the_truth(fuse):
    before = numbers(fuse, "Start error")
    pick(fuse, "Start", "far off (20°, 40 cm)")
    assert await_change(fuse, "Start error", before)[0] > before[0] + 20
    pick(fuse, "Start", "aligned")
    for _ in range(50):
        if numbers(fuse, "Start error") == [0.0, 0.0]:
            return
        fuse.wait_for_timeout(200)
    raise AssertionError("aligned is not the truth")


def test_noise_changes_the_end_and_not_the_start(fuse):
    start, before = numbers(fuse, "Start error"), numbers(fuse, "End error")
    unfold(fuse, "Make the moving cloud worse")
    handle = slider(fuse, "Noise (cm)")
    handle.focus()
    handle.press("End")
    await_change(fuse, "End error", before)
    assert numbers(fuse, "Start error") == start


def test_the_player_counts_milliseconds(fuse):
    unfold(fuse, "Axis, speed and loop")
    pick(fuse, "Axis", "milliseconds")
    fuse.get_by_text("Time (ms)").wait_for()
    handle = slider(fuse, "Time (ms)")
    assert int(handle.get_attribute("aria-valuemax")) >= max(numbers(fuse, "Time")) - 1
    picture = canvas(fuse)
    handle.focus()
    handle.press("End")
    assert changed_from(fuse, picture)


def test_the_histogram_moves_with_the_player(fuse):
    fuse.get_by_role("tab", name="Pairs").click()
    pick(fuse, "Lane", "② CEICP-A point")
    sigma = fuse.get_by_text(re.compile("kernel f, σ = "))
    first = sigma.inner_text()
    fuse.get_by_role("button", name="Step", exact=True).click()
    fuse.get_by_role("button", name="Step", exact=True).click()
    fuse.wait_for_function(
        "old => ![...document.querySelectorAll('div')].some(d => d.innerText === old)", arg=first
    )
    assert "w = −p log p" in sigma.inner_text()


def test_the_lesson_walks_ten_stops_and_sets_the_controls(fuse):
    unfold(fuse, "Lesson: ICP against CEICP")
    starts, lanes = set(), set()
    for stop in range(1, 11):
        fuse.get_by_role("button", name="Next", exact=True).click()
        fuse.get_by_text(f"({stop} of 10)").wait_for()
        starts.add(fuse.get_by_label("Start", exact=True).first.input_value())
        fuse.wait_for_timeout(300)
        fuse.get_by_text("Up to date").wait_for()
        lanes.add(len(numbers(fuse, "Start error")))
    assert starts == {"aligned", "slightly off (3°, 6 cm)", "far off (20°, 40 cm)"}
    assert lanes == {2, 3, 4}
    assert fuse.get_by_label("Show", exact=True).first.input_value() == "race: inferred on sensor"
    fuse.get_by_text("Time (ms)").wait_for()
    fuse.get_by_role("button", name="Back", exact=True).click()
    fuse.get_by_text("(9 of 10)").wait_for()


def test_the_capture_map_is_computed_and_a_cell_starts_a_race(fuse):
    before = numbers(fuse, "Start error")
    unfold(fuse, "Capture range")
    fuse.get_by_role("button", name="Compute the map").click()
    fuse.get_by_text(re.compile("Of 25 starts")).wait_for()
    cells = fuse.locator("button[data-cell]")
    assert cells.count() == 25
    marks = [cells.nth(index).inner_text()[0] for index in range(25)]
    assert set(marks) <= {"✓", "✗"}
    assert "✓" in marks
    fuse.locator("button[data-cell='20° 30 cm']").click()
    assert await_change(fuse, "Start error", before)[0] > 25
    assert fuse.get_by_label("Start", exact=True).first.input_value() == "by hand"
    assert cells.count() == 25


def test_the_map_can_be_stopped(fuse):
    unfold(fuse, "Methods, nodes and pairs")
    pick(fuse, "Method ③", "CEICP-A, point")
    fuse.get_by_text("③ CEICP-A point").first.wait_for()
    unfold(fuse, "Capture range")
    fuse.get_by_role("button", name="Compute the map").click()
    fuse.get_by_text("Computing; the bar").wait_for()
    fuse.get_by_role("button", name="Stop the map").click()
    fuse.get_by_text("Stopped.").wait_for()
    assert fuse.locator("button[data-cell]").count() == 0


def test_inferred_on_sensor_is_another_race(fuse):
    before = numbers(fuse, "Start error")
    pick(fuse, "Show", "race: inferred on sensor")
    await_change(fuse, "Start error", before)
    picture = canvas(fuse)
    pick(fuse, "Show", "result")
    assert changed_from(fuse, picture)


def test_dragging_the_arrows_moves_the_start_and_races_from_there(fuse):
    error_cm = numbers(fuse, "Start error")
    assert len(red_pixels(canvas(fuse))) < 5
    unfold(fuse, "Start by hand")
    fuse.get_by_label("Drag", exact=True).first.check()
    arrow = next(spots for _ in range(25) if len(spots := red_pixels(canvas(fuse, still=4))) > 40)
    y, x = arrow[np.argmin(np.sum((arrow - np.median(arrow, axis=0)) ** 2, axis=1))]
    x, y = int(x), int(y)
    fuse.mouse.move(x, y)
    fuse.mouse.down()
    fuse.mouse.move(x + 20, y + 30, steps=6)
    fuse.mouse.up()
    assert await_change(fuse, "Start error", error_cm)
    assert fuse.get_by_label("Start", exact=True).first.input_value() == "by hand"


def red_pixels(png):
    """(K, 2) rows and columns in the colour of the gizmo's first axis, which nothing else has."""
    blue, green, red = cv2.split(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR))
    return np.argwhere((red > 180) & (green < 100) & (blue < 110))

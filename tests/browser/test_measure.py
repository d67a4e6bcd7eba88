"""A length on the demo's box, by two clicks of a mouse, in a real browser."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from lab.worlds.box_on_table import BOX_M, BOX_YAW_RAD, TABLE_M
from tests.browser.hands import afresh, go, pick, unfold, visible

STAND_M, LOOK_AT_M = np.array([2.0, 1.65, 1.65]), np.array([2.45, 2.5, 0.8])
FOV_RAD = np.radians(75.0)
"""Vertical, of viser's camera."""
INWARD_M = 0.01
"""Distance of a click from a face's edges: at the very edge a mesh is ragged."""


def corner(along, across):
    """A corner of the box's upper face, a little inside, world frame; each argument is -1 or 1."""
    x_m, y_m = (0.5 * BOX_M[0] - INWARD_M) * along, (0.5 * BOX_M[1] - INWARD_M) * across
    turn = np.array([[np.cos(BOX_YAW_RAD), -np.sin(BOX_YAW_RAD)], [np.sin(BOX_YAW_RAD), np.cos(BOX_YAW_RAD)]])
    middle_m = np.array([TABLE_M[0] - 0.02, TABLE_M[1] - 0.02])
    return np.append(middle_m + turn @ [x_m, y_m], TABLE_M[2] + BOX_M[2])


def pixel(page, point_m):
    """Where a point of the scene is on the page."""
    box = page.locator("canvas").first.bounding_box()
    forward = (LOOK_AT_M - STAND_M) / np.linalg.norm(LOOK_AT_M - STAND_M)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    from_m = np.asarray(point_m) - STAND_M
    px = 0.5 * box["height"] / np.tan(0.5 * FOV_RAD) / (from_m @ forward)
    x_px, y_px = px * (from_m @ right), px * (from_m @ np.cross(right, forward))
    return box["x"] + 0.5 * box["width"] + x_px, box["y"] + 0.5 * box["height"] - y_px


def numbers(page, name):
    """Value and half interval of a measure in the list, centimetres."""
    row = page.get_by_role("row", name=re.compile(rf"^{name}\s.*± [\d.]+ cm")).locator("visible=true").first
    row.wait_for()
    value_cm, half_cm = re.search(r"([\d.]+) ± ([\d.]+) cm", row.inner_text()).groups()
    return float(value_cm), float(half_cm)


@pytest.fixture
def measuring(tab):
    """The Surface step with the box in the middle, and clicks that measure."""
    view = ",".join(f"{value:g}" for value in (*STAND_M, *LOOK_AT_M))
    afresh(tab, f"fixedDpr=1&cam={view}&screen=surface")
    go(tab, "Surface")
    tab.get_by_text("Up to date").wait_for(timeout=180_000)
    unfold(tab, "Measure")
    visible(tab, "Clicks measure").click()
    return tab


def test_two_clicks_measure_the_box_and_the_link_shows_it_again(measuring):
    prompt = measuring.get_by_text(re.compile("Click the (first|second) end."))
    expect(prompt.locator("visible=true").first).to_have_text(re.compile("first"))
    measuring.mouse.click(*pixel(measuring, corner(-1, -1)))
    expect(prompt.locator("visible=true").first).to_have_text(re.compile("second"))
    measuring.mouse.click(*pixel(measuring, corner(1, -1)))
    value_cm, half_cm = numbers(measuring, "1")
    assert abs(value_cm - 100.0 * (BOX_M[0] - 2.0 * INWARD_M)) < half_cm
    assert half_cm < 5.0
    pick(measuring, "What", "Plane to plane")
    measuring.mouse.click(*pixel(measuring, corner(0, 0)))
    measuring.get_by_text("Click the second plane.").locator("visible=true").wait_for()
    measuring.mouse.click(*pixel(measuring, (2.3, 2.2, TABLE_M[2])))
    height_cm, half_cm = numbers(measuring, "2")
    assert abs(height_cm - 100.0 * BOX_M[2]) < half_cm < 1.0
    measuring.wait_for_function("() => location.search.includes('~~plane-plane~')")
    query = measuring.evaluate("() => location.search.slice(1)")
    afresh(measuring, query)
    unfold(measuring, "Measure")
    assert numbers(measuring, "1")[0] == value_cm
    assert numbers(measuring, "2") == (height_cm, half_cm)

"""The next cameras of a room in a real browser: suggested, dragged, saved, and one of them taken."""

from __future__ import annotations

import re

import numpy as np
import pytest
from playwright.sync_api import expect
from viser.transforms import SO3

from pipeline.kernels.geometry import apply, inverse, rigid
from tests.browser.hands import PATIENCE_MS, dismiss_notifications, go, press, unfold

NETWORK = "Network"


@pytest.fixture(scope="module")
def planned(few, tab, app):
    """The Network step with a plan of one camera, and its session."""
    tab.set_default_timeout(PATIENCE_MS)
    go(tab, NETWORK)
    tab.get_by_text("nodes sent").first.wait_for()
    tab.get_by_text("Up to date").wait_for()
    dismiss_notifications(tab)
    unfold(tab, "Plan")
    press(tab, "Suggest")
    tab.get_by_text("The new camera promises").wait_for()
    tab.get_by_text("What it would see").wait_for()
    (session,) = (one for one in app.sessions.values() if one.current.title == NETWORK)
    return tab, session


def node(session, name):
    return session.scene.get_handle_by_name(f"/network/plan/{name}")


def pose_of(handle):
    return rigid(SO3(np.asarray(handle.wxyz)).as_matrix(), np.asarray(handle.position))


def on_page(page, session, place_m):
    """Where a (3,) place is on the page, px."""
    (client,) = session.clients()
    x, y, z = apply(inverse(pose_of(client.camera)), np.asarray(place_m)[None])[0]
    box = page.locator("canvas").first.bounding_box()
    px = 0.5 * box["height"] / np.tan(0.5 * client.camera.fov) / z
    return np.array([box["x"] + 0.5 * box["width"] + px * x, box["y"] + 0.5 * box["height"] + px * y])


def promise(page):
    """The promise of the first ghost as the table says it."""
    return page.get_by_role("row", name="Promise, points").inner_text().split("\t")[-1].strip()


def test_a_suggested_camera_stands_in_the_room_and_says_what_it_adds(planned):
    page, session = planned
    assert re.fullmatch(r"\d+\.\d \(\d+\.\d to \d+\.\d\)", promise(page))
    assert np.allclose(node(session, "1").position, node(session, "handle-1").position)
    for name in ("Height", "99 % there after", "Energy of the image"):
        assert re.search(r"[\d.]+ (m|s|J)", page.get_by_role("row", name=name).inner_text())
    assert (node(session, "seen").points[:, 2] > -100.0).any()


def test_a_hand_drags_the_ghost_and_its_promise_follows_and_then_its_picture(planned):
    page, session = planned
    before, pose = promise(page), pose_of(node(session, "handle-1"))
    start = on_page(page, session, pose[:3, 3])
    tip = on_page(page, session, pose[:3, 3] + 0.85 * node(session, "handle-1").scale * pose[:3, 0])
    page.mouse.move(*tip)
    page.wait_for_timeout(300)
    page.mouse.down()
    for step in range(1, 13):
        page.mouse.move(*(tip + 0.4 * step * (tip - start)))
        page.wait_for_timeout(50)
    page.get_by_text("still those of the place before").wait_for()
    expect(page.get_by_role("row", name="Stands on")).to_contain_text("by hand")
    expect(page.get_by_role("row", name="Promise, points")).not_to_contain_text(before)
    page.mouse.up()
    page.get_by_text("What it would see").wait_for()
    moved = pose_of(node(session, "1"))
    away_m = moved[:3, 3] - pose[:3, 3]
    assert np.linalg.norm(away_m) > 0.1
    assert np.allclose(away_m / np.linalg.norm(away_m), pose[:3, 0], atol=0.05), "along the arrow"
    assert np.allclose(moved[:3, :3], pose[:3, :3], atol=1e-3)


def test_the_floor_plan_is_saved(planned, tmp_path):
    page, _ = planned
    with page.expect_download() as given:
        press(page, "SVG")
    given.value.save_as(tmp_path / "plan.svg")
    assert "by hand" in (tmp_path / "plan.svg").read_text()


def test_a_camera_that_is_taken_is_a_node_and_its_gain_is_beside_its_promise(planned):
    page, session = planned
    place_m = node(session, "1").position
    press(page, "Take it")
    said = page.get_by_text(re.compile(r"Promised [\d.]+ \(.*\) points(?:, .* depth)?, really -?[\d.]+"))
    said.first.wait_for()
    page.get_by_text("4 nodes sent").first.wait_for()
    page.get_by_text("Up to date").wait_for()
    nodes = session.results.view("network").nodes
    assert np.allclose(nodes[3].T_world_camera[:3, 3], place_m, atol=1e-6)
    assert node(session, "1") is None

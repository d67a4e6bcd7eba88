"""The page of two surfaces in a real Chromium that has no network: the line between them moves."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from app.drawing.glb import mesh_glb
from app.drawing.legend import Legend
from app.reports.hand_out import viewpoint_of
from app.reports.surface_page import Side, SurfacePage, surface_page
from tests.app.hand_outs import wall
from tests.browser.hands import PATIENCE_MS

RED, GREEN = (220, 40, 40), (40, 160, 60)


def side(name, color):
    surface = wall(12)
    colors = np.tile(np.array(color, np.uint8), (len(surface.vertices_m), 1))
    facing = surface.triangles[:, ::-1]
    glb = mesh_glb(surface.vertices_m, np.vstack([surface.triangles, facing]), colors)
    return Side(name, "half of it", glb)


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("surface") / "scene.html"
    view = viewpoint_of([np.eye(4)], wall(12).vertices_m)
    legend = Legend(swatches=(("a wall", RED),))
    told = SurfacePage("room <1>", "Two walls.", side("Before", RED), side("After", GREEN), view, legend)
    path.write_text(surface_page(told), encoding="utf-8")
    context = browser.new_context(viewport={"width": 390, "height": 844}, offline=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.wrong = []
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.add_init_script("window.draws = true")
    page.goto(path.as_uri())
    page.locator("html[data-ready]").wait_for()
    yield page
    context.close()


def shares(page):
    """How many pixels are red, and how many green."""
    page.wait_for_timeout(400)
    picture = page.locator("#stage canvas").screenshot(style="#line, #stage p { visibility: hidden }")
    pixels = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).astype(int)
    red, green = pixels[..., 2], pixels[..., 1]
    return int((red - green > 60).sum()), int((green - red > 60).sum())


def test_title_legend_and_sides_are_there_on_a_phone(page):
    assert page.title() == "room <1> · PacketMesh"
    assert page.locator("#legend").inner_text() == "a wall"
    assert "Before" in page.locator("#left").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    boxes = [page.locator(f"#{one}").bounding_box() for one in ("left", "right", "split", "legend", "hint")]
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= 390 for box in boxes)
    assert max(box["y"] + box["height"] for box in boxes) <= 844


def test_the_line_decides_how_much_of_each_is_seen(page):
    half = shares(page)
    assert min(half) > 1000
    page.locator("#split").fill("100")
    whole = shares(page)
    assert whole[0] > 1.5 * half[0]
    assert whole[1] == 0
    grip = page.locator("#line b").bounding_box()
    page.mouse.move(grip["x"] + 5, grip["y"] + 20)
    page.mouse.down()
    page.mouse.move(2, grip["y"] + 20, steps=3)
    page.mouse.up()
    none = shares(page)
    assert none[1] > 1.5 * half[1]
    assert none[0] < 0.1 * half[0]
    assert page.wrong == []

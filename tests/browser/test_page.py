"""What the app's script does to viser's page, in a real browser."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest

from tests.browser.hands import DRAG_S, PATIENCE_MS, go, slider

WATCH = """
(() => {
  window.draws = true;
  const HELD_MS = 3000; // six seconds after a question, and of these a surface is awaited three at most
  const watched = window.watched = {surfaces: 0, drawn: 0, drawnWhileHeld: 0, answers: 0, covered: []};
  let heldUntil = 0;
  const {bufferData, drawElements} = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.bufferData = function (target, data, ...rest) {
    if (target === this.ELEMENT_ARRAY_BUFFER && data.length > 3000) {
      watched.surfaces += 1;
      heldUntil = performance.now() + HELD_MS;
    }
    return bufferData.call(this, target, data, ...rest);
  };
  WebGL2RenderingContext.prototype.drawElements = function (mode, count, ...rest) {
    if (mode === this.TRIANGLES && count > 3000) {
      watched.drawn += 1;
      watched.drawnWhileHeld += performance.now() < heldUntil;
    }
    return drawElements.call(this, mode, count, ...rest);
  };
  addEventListener("keydown", event => { watched.answers += event.key === "Insert"; }, true);
  const small = document.createElement("canvas");
  small.width = small.height = 32;
  const pen = small.getContext("2d", {willReadFrequently: true});
  window.look = () => {
    pen.clearRect(0, 0, 32, 32);
    pen.drawImage(document.querySelector("canvas[data-engine]"), 0, 0, 32, 32);
    const pixels = pen.getImageData(0, 0, 32, 32).data;
    let covered = 0;
    for (let alpha = 3; alpha < pixels.length; alpha += 4) covered += pixels[alpha] > 0;
    watched.covered.push(covered);
    return covered;
  };
})();
"""


@pytest.fixture(scope="module")
def counting(browser, app):
    """The Surface step in a tab of its own, which counts what is drawn."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.add_init_script(WATCH)
    page.goto(f"{app.url}?fixedDpr=1")
    go(page, "Surface")
    page.get_by_text("Up to date").wait_for(timeout=PATIENCE_MS)
    page.wait_for_timeout(2000)
    yield page
    context.close()


@pytest.fixture
def page(counting):
    """The same once it draws: no view is held, and no mesh is awaited."""
    counting.set_viewport_size({"width": 900, "height": 640})
    counting.get_by_text("Up to date").wait_for(timeout=PATIENCE_MS)
    begin_to_count(counting)
    counting.wait_for_function("() => watched.drawn > 0")
    counting.wait_for_timeout(500)
    return counting


def begin_to_count(page):
    page.evaluate(
        "Object.assign(watched, {surfaces: 0, drawn: 0, drawnWhileHeld: 0, answers: 0, covered: []})"
    )


@pytest.mark.timeout(900)
def test_while_the_radius_is_dragged_only_new_surfaces_are_drawn_and_none_blinks(page):
    handle = slider(page, "Radius (mm)").bounding_box()
    x, y = handle["x"] + handle["width"] / 2, handle["y"] + handle["height"] / 2
    before = page.evaluate("look()")
    page.mouse.move(x, y)
    page.mouse.down()
    begun_s = time.monotonic()
    for step in itertools.count():
        page.mouse.move(x + 20.0 * (1.0 - np.cos(0.15 * step)), y)  # the balls grow: holes would be no blink
        page.evaluate("look()")
        if step == 10:
            begin_to_count(page)
        if step >= 100 and page.evaluate("watched.surfaces") > 5:
            break
        if time.monotonic() - begun_s > DRAG_S:
            break
    watched = page.evaluate("watched")
    page.mouse.up()
    surfaces = watched["surfaces"]
    assert surfaces > 5
    assert watched["drawnWhileHeld"] < 3 * surfaces
    while (
        page.evaluate("[look(), watched.surfaces][1]") == surfaces
        or not page.get_by_text("Up to date").count()
    ):
        assert time.monotonic() - begun_s < 2 * DRAG_S  # no surface of the radius at rest
    for _ in range(100):
        page.evaluate("look()")
    watched = page.evaluate("watched")
    assert min(watched["covered"]) > before / 2


def test_a_view_that_is_held_is_drawn_when_it_is_turned(page):
    canvas = page.locator("canvas[data-engine]").bounding_box()
    x, y = canvas["x"] + canvas["width"] / 2, canvas["y"] + canvas["height"] / 2
    page.mouse.move(x, y)
    page.evaluate("packetmesh.hold()")
    begin_to_count(page)
    page.mouse.down()
    for step in range(10):
        page.mouse.move(x + 4 * step, y)
    page.mouse.up()
    assert page.evaluate("watched.drawn") > 0


def test_a_view_that_is_held_is_drawn_when_its_size_changes(page):
    page.evaluate("packetmesh.hold()")
    begin_to_count(page)
    page.set_viewport_size({"width": 860, "height": 600})
    page.wait_for_function("() => watched.drawn > 0")
    assert page.evaluate("look()") > 0


def test_a_view_that_is_held_is_drawn_when_a_surface_is_gone(page):
    page.evaluate("packetmesh.hold()")
    begin_to_count(page)
    page.evaluate("packetmesh.ask([], true)")
    page.wait_for_function("() => watched.answers === 1 && watched.drawn > 0")


def test_a_question_is_answered_even_if_its_mesh_never_comes(page):
    begin_to_count(page)
    page.evaluate("packetmesh.ask([123456789], true)")
    assert page.evaluate("watched.answers") == 0
    page.wait_for_function("() => watched.answers === 1")
    page.evaluate("packetmesh.ask([], false)")
    page.wait_for_function("() => watched.answers === 2")


def test_of_two_questions_only_the_last_is_answered(page):
    begin_to_count(page)
    page.evaluate("packetmesh.ask([123456789], true); packetmesh.ask([], false)")
    page.wait_for_function("() => watched.answers === 1")
    page.wait_for_timeout(1500)
    assert page.evaluate("watched.answers") == 1


def test_a_view_is_drawn_while_a_mesh_is_awaited_whose_place_is_not_empty(page):
    begin_to_count(page)
    page.evaluate("packetmesh.ask([123456789], false)")
    page.set_viewport_size({"width": 860, "height": 600})
    page.wait_for_function("() => watched.drawn > 0")
    assert page.evaluate("watched.answers") == 0
    page.wait_for_function("() => watched.answers === 1")


def test_a_mesh_that_is_awaited_still_keeps_the_view_until_it_comes(page):
    begin_to_count(page)
    page.evaluate("packetmesh.ask([123456789], true); packetmesh.ask([], false)")
    page.wait_for_timeout(500)
    assert page.evaluate("[watched.answers, watched.drawn]") == [0, 0]
    page.wait_for_function("() => watched.answers === 1")

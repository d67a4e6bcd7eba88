"""A cut through the demo's surface and a scale bar, in a real browser."""

import re

import cv2
import pytest
from playwright.sync_api import expect

from tests.browser.hands import afresh, drawn, go, pick, press, unfold, visible

PLANE = """() => {
  let found = null;
  window.__viserMutable.nodeRefFromName["/surface/after"]?.traverse(({isMesh, material}) => {
    const [plane] = isMesh && material.isMeshBasicMaterial && material.clippingPlanes || [];
    if (plane) found = [...plane.normal.toArray(), plane.constant];
  });
  return found;
}"""
SHOWN_LABELS = """() => {
  const {scene} = window.__viserMutable;
  const shown = new Set();
  scene.traverse(({material}) => {
    const data = material?.uniforms?.uLabelData?.value.image.data ?? [];
    for (let at = 0; at < data.length; at += 4)
      if (data[at + 3] > 0) shown.add(data.slice(at, at + 3).join());
  });
  return shown.size;
}"""
METRES = """() => {
  const {camera, cameraControl} = window.__viserMutable;
  const away = camera.position.distanceTo(cameraControl.getTarget(camera.position.clone()));
  const bar = document.querySelector(".packetmesh-scale i").getBoundingClientRect().width;
  const height = document.querySelector("canvas[data-engine]").clientHeight;
  return 2 * away * Math.tan(camera.fov * Math.PI / 360) * bar / height;
}"""
"""Length that the scale bar spans at the point about which the view turns, metres."""
UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1.0}


@pytest.fixture
def looking(tab):
    """The Surface step, seen from the side."""
    afresh(tab, "fixedDpr=1&cam=1,0.8,2,2.6,2.6,0.8&screen=surface")
    go(tab, "Surface")
    tab.get_by_text("Up to date").wait_for(timeout=180_000)
    unfold(tab, "Look")
    return tab


def plane(page):
    """The plane that cuts the drawn surface: its normal and constant in three.js's world, metres."""
    return page.wait_for_function(PLANE).json_value()


def test_a_plane_cuts_the_surface_and_the_link_shows_it_again(looking):
    pick(looking, "Cut away", "Behind a plane")
    first = plane(looking)
    press(looking, "Flip")
    looking.wait_for_function(
        f"sum => {{ const found = ({PLANE})(); return found?.[3] * sum < 0; }}", arg=first[3]
    )
    assert plane(looking) == pytest.approx([-number for number in first], abs=1e-3)
    looking.wait_for_function("() => location.search.includes('look=plane_')")
    looking.wait_for_timeout(1000)
    query = looking.evaluate("() => location.search.slice(1)")
    afresh(looking, query)
    looking.get_by_text("Up to date").wait_for(timeout=180_000)
    assert plane(looking) == pytest.approx([-number for number in first], abs=0.003)


def test_two_surfaces_side_by_side_keep_their_names_above_a_cut(looking):
    pick(looking, "Show", "side by side")
    looking.wait_for_function(f"() => ({SHOWN_LABELS})() === 2")
    pick(looking, "Cut away", "Around a box")
    plane(looking)
    looking.wait_for_timeout(1000)
    assert looking.evaluate(SHOWN_LABELS) == 2


HANDLES = "() => window.__viserMutable.nodeRefFromName['/surface/look']?.visible === {}"
SHADOWS = """() => [...document.querySelectorAll("[data-dock-root] div")]
  .filter(one => one.offsetParent !== null && getComputedStyle(one).boxShadow !== "none").length"""


def test_full_screen_shows_the_handles_of_a_cut_again_and_no_edge_of_the_panel(looking):
    pick(looking, "Cut away", "Around a box")
    looking.evaluate("() => document.activeElement.blur()")  # a list that is open would take the key
    with drawn(looking):
        for key in ("m", "Escape"):
            looking.wait_for_function(HANDLES.format("false"))
            looking.keyboard.press(key)
            looking.wait_for_function(HANDLES.format("true"))
            assert (looking.evaluate(SHADOWS) == 0) == (key == "m")


def test_a_picture_of_the_view_has_the_scale_bar(looking, tmp_path):
    pictures = []
    for name in ("without", "with"):
        with looking.expect_download() as got:
            looking.keyboard.press("p")
        got.value.save_as(tmp_path / name)
        pictures.append(cv2.imread(str(tmp_path / name)))
        visible(looking, "Scale bar and axes").click()
        with drawn(looking):
            looking.wait_for_timeout(500)
    bare, ruled = (picture[-200:, 20:220].astype(float) for picture in pictures)
    assert ruled.mean() > bare.mean() + 10.0  # white under the bar


def test_the_scale_bar_is_a_round_length_where_the_view_turns(looking):
    visible(looking, "Scale bar and axes").click()
    bar = looking.locator(".packetmesh-scale")
    for _ in range(2):
        expect(bar).to_contain_text(re.compile(r"\d+ (mm|cm|m)"))
        number, unit = re.match(r"([\d.]+) (mm|cm|m)", bar.locator("b").inner_text()).groups()
        assert number.rstrip("0") in ("1", "2", "5")
        assert looking.evaluate(METRES) == pytest.approx(float(number) * UNITS_M[unit], rel=0.02)
        box = looking.locator("canvas").first.bounding_box()
        looking.mouse.move(box["x"] + 200, box["y"] + 200)
        looking.mouse.wheel(0, -1500)
        looking.wait_for_timeout(1500)
    assert sorted(bar.locator("text").all_text_contents()) == ["x", "y", "z"]
    visible(looking, "Scale bar and axes").click()
    expect(bar).to_have_count(0)

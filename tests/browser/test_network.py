"""The Network screen as a class uses it, in a real browser."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect

from tests.browser.hands import canvas, changed_from, differing, go, pick, press, slider, unfold


@pytest.fixture(scope="module")
def network(tab):
    """The Network step with the first run done."""
    tab.get_by_text("Up to date").wait_for()
    go(tab, "Network")
    tab.get_by_text("simulated in").wait_for()
    return tab


def now_s(page):
    """What the slider of the player says."""
    return float(slider(page, "Time (s)").get_attribute("aria-valuenow"))


def test_frames_are_stepped_played_and_scrubbed(network):
    expect(slider(network, "Time (s)")).to_have_attribute("aria-valuenow", "0")
    press(network, "Frames")
    start = canvas(network, still=4)
    for _ in range(20):  # until a frame is on its way
        press(network, "Next event")
        network.wait_for_timeout(300)
        if differing(canvas(network), start) > 0.0:  # it is a single small point
            break
    else:
        raise AssertionError("no frame was seen")
    stepped_s = now_s(network)
    assert 0.0 < stepped_s < 1.0
    press(network, "Play")
    network.wait_for_timeout(1500)
    press(network, "Pause")
    assert now_s(network) > stepped_s
    time = slider(network, "Time (s)")
    time.focus()
    time.press("End")
    network.wait_for_timeout(1000)
    assert now_s(network) == pytest.approx(float(time.get_attribute("aria-valuemax")), abs=0.1)


def test_the_timeline_tells_causes_and_zooms(network):
    press(network, "All")
    network.get_by_text(re.compile(r"Span \(\d+ s\)")).wait_for()
    expect(network.get_by_alt_text("timeline")).to_have_count(1)
    expect(network.locator("svg rect title", has_text="collision")).not_to_have_count(0)
    press(network, "Frames")  # the last ones, as the player stands at the end
    network.get_by_text(re.compile(r"Span \(\d+ ms\)")).wait_for()
    assert network.locator(".packetmesh-now").count() == 1


def test_the_command_is_that_of_the_simulation(network):
    press(network, "Copy as command")
    text = network.locator("pre").first.inner_text()
    press(network, "Close")
    assert text.startswith("packetmesh simulate --preset thesis-link --set run.horizon_s=600.0")


def test_a_wrong_setting_is_a_sentence_with_the_nearest_name(network):
    unfold(network, "Advanced")
    label = network.locator("label", has_text="Setting key=value")
    label.locator("xpath=following::input[1]").fill("nodes.image=2")
    press(network, "Use these settings")
    network.get_by_text(re.compile("There is no setting 'nodes.image'; try .*nodes.images")).wait_for()


def test_two_schemes_stand_beside_each_other(network):
    before = canvas(network)
    pick(network, "Preset", "Street grid: vehicles and access points")
    network.get_by_text("arXiv 1311.6013").wait_for()
    network.get_by_text("600.0 s of the network").wait_for()
    pick(network, "Beside", "PDC: by chance, as offered")
    network.get_by_role("columnheader", name="PDC: by chance").wait_for()
    expect(network.get_by_alt_text("timeline")).to_have_count(2)
    rates = network.get_by_role("row", name="Images per minute").inner_text()
    baseline, pdc = (float(value.replace(",", "")) for value in re.findall(r"([\d,.]+) 1/min", rates))
    assert baseline > pdc > 0
    assert changed_from(network, before)


def test_leaving_turns_the_view_back_to_the_scene(network):
    go(network, "Scene")
    scene = canvas(network)
    go(network, "Network")
    assert changed_from(network, scene)
    go(network, "Scene")
    assert differing(canvas(network), scene) < 0.02

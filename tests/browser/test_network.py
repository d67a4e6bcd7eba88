"""The Network screen as a class uses it, in a real browser."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest
from playwright.sync_api import expect

from pipeline.delivery.sending import DeliverySpec, received_at, send
from pipeline.sources import Demo
from pipeline.spec import Spec
from tests.browser.hands import (
    ALIKE,
    PATIENCE_MS,
    arrow,
    canvas,
    changed_from,
    differing,
    dismiss_notifications,
    go,
    pick,
    press,
)

ALL = re.compile(r"^\d nodes sent [\d.]+ MB in [\d,]+ packets; simulated in [\d.]+ s\.$")


@pytest.fixture(scope="module")
def network(few, tab):
    """The Network step with the first delivery done."""
    tab.set_default_timeout(PATIENCE_MS)
    tab.get_by_text("Up to date").wait_for()
    go(tab, "Network")
    tab.get_by_text(ALL).wait_for()
    tab.get_by_text("Up to date").wait_for()
    dismiss_notifications(tab)
    return tab


def seek(page, share):
    """Click into the rows of the timeline, at a share of the whole time."""
    field = page.locator(".packetmesh-dock-field").bounding_box()
    page.mouse.click(field["x"] + share * field["width"], field["y"] + 8)


def delivered_mb(page):
    """What the table says of the clock's moment; 0 before the first."""
    text = page.get_by_role("row", name="Bytes at the sink").inner_text()
    first = re.split(r"\s{2,}|\t|\n", text.strip())[1]
    return 0.0 if first == "–" else float(first.split()[0])


def drawn_clouds(session, page):
    """The nodes that have a cloud in the session's scene a moment from now."""
    page.wait_for_timeout(100)
    names = list(session.scene._handle_from_node_name)
    return {name.split("/cloud-")[1].rsplit("-", 1)[0] for name in names if "/cloud-" in name}


def test_the_room_fills_in_as_its_bytes_arrive(network):
    seen, last = [], None
    for share in (0.01, 0.5, 0.8, 0.995):
        seek(network, share)
        network.wait_for_timeout(1500)
        picture = canvas(network)
        assert last is None or differing(picture, last) > 0.0
        seen.append(delivered_mb(network))
        last = picture
    assert seen[0] == 0.0
    assert seen == sorted(set(seen))


def test_play_moves_the_clock_and_the_mesh_follows(network):
    seek(network, 0.01)
    before = canvas(network)
    network.locator(".packetmesh-dock-row button").nth(1).click()
    assert changed_from(network, before)
    network.locator(".packetmesh-dock-row button").nth(1).click()


def test_a_frame_is_told_in_words(network):
    seek(network, 0.6)
    network.get_by_text(re.compile("node_00 → sink")).first.wait_for()
    network.get_by_text(re.compile(r"Attempt \d+ of \d+")).wait_for()


def test_the_command_is_that_of_the_delivery(network):
    press(network, "Copy as command")
    text = network.locator("pre").first.inner_text()
    press(network, "Close")
    assert text.startswith(
        "packetmesh deliver --scene box-on-table --preset office --coding exact --moments 4"
    )


def test_another_coding_is_compared_with_the_one_before(network):
    pick(network, "Coding", "RVL depth, JPEG colour")
    network.get_by_text("coding jpeg instead of exact").wait_for()
    expect(network.get_by_text(re.compile("the last byte came after"))).to_be_visible()


def test_clouds_appear_in_the_order_in_which_their_images_were_delivered(network, app):
    """The sink's own account of the same sending says which nodes have depth at each moment."""
    (session,) = (one for one in app.sessions.values() if one.spec.sent and one.spec.sent.coding == "jpeg")
    sent = session.spec.sent
    source = Demo("box-on-table")
    sending = send(DeliverySpec(Spec(source), sent.network, sent.coding, sent.moments), source.load())
    network.get_by_text("Up to date").wait_for()
    pictures, orders = [], []
    for t_ns in sending.times_ns.tolist():
        seek(network, (t_ns + 2_000_000) / sending.trace.horizon_ns)
        with_depth = [bool((got.depth > 0).any()) for got in received_at(sending, t_ns)]
        wanted = {frame.name for frame, there in zip(sending.rig.frames, with_depth, strict=True) if there}
        assert any(drawn_clouds(session, network) == wanted for _ in range(50))
        if not orders or wanted != orders[-1]:
            pictures.append(canvas(network))
            orders.append(wanted)
    assert len(orders) >= 3
    assert all(one < other for one, other in pairwise(orders))
    assert all(differing(one, other) > ALIKE for one, other in pairwise(pictures))


def test_a_delivery_rests_while_nobody_looks_and_goes_on_from_there(network):
    pick(network, "Coding", "Tiles that stand alone")
    network.get_by_text(re.compile("moment 3 of")).wait_for()
    go(network, "Scene")
    network.get_by_text("Up to date").wait_for()
    go(network, "Network")
    network.get_by_text(re.compile("moment [234] of")).first.wait_for()
    network.get_by_text("Up to date").wait_for()


def test_a_hand_drags_a_radio_by_its_arrow_and_it_is_sent_again(network):
    pick(network, "Move radio of", "node_01")
    x, y = arrow(network)
    network.mouse.move(x, y)
    network.wait_for_timeout(300)
    network.mouse.down()
    for step in range(1, 9):
        network.mouse.move(x + 5 * step, y - 4 * step)
        network.wait_for_timeout(50)
    network.mouse.up()
    network.get_by_text(re.compile("radios moved")).first.wait_for()
    network.get_by_text("Up to date").wait_for()
    press(network, "Copy as command")
    assert "nodes.places_m=" in network.locator("pre").first.inner_text()
    press(network, "Close")
    pick(network, "Move radio of", "none")
    network.get_by_text("Up to date").wait_for()


def test_the_dock_is_there_on_this_screen_only(network):
    go(network, "Scene")
    expect(network.locator(".packetmesh-dock-row")).to_be_hidden()
    go(network, "Network")
    expect(network.locator(".packetmesh-dock-row")).to_be_visible()

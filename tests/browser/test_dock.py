"""The dock alone in a real browser: what a hand does there reaches the clock."""

from __future__ import annotations

import io
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import viser
from PIL import Image
from playwright.sync_api import expect

from app.dock.dock import Dock
from app.drawing.colors import LOSS, TARGET
from app.drawing.levels import levels_of
from app.drawing.timeline import Curve, CurvesLane, FramesLane
from app.landing import app_page
from app.window.gui import Gui
from app.window.ui import Ui
from tests.browser.hands import PATIENCE_MS

END_NS = 10_000_000_000


class Stage:
    """Two rows of frames and a curve, and what the dock reported."""

    def __init__(self, client):
        self.thread = ThreadPoolExecutor(1)
        ui = Ui(Gui(client.gui), client.scene, self.post, client.atomic, client.flush)
        self.ui, self.moves, self.picks = ui, [], []
        self.folder = client.gui.add_folder(None)
        with self.folder:
            self.dock = Dock(ui, self.moves.append, lambda *what: self.picks.append(what))
        self.post(self.fill)

    def post(self, function, *arguments):
        self.thread.submit(function, *arguments)

    def fill(self):
        starts_ns = np.arange(100) * 100_000_000
        ends_ns = starts_ns + 40_000_000
        row, lost = np.arange(100) % 2, np.arange(100) % 10 == 3
        frames = FramesLane(
            levels_of(starts_ns, ends_ns, row, lost, 2),
            ("porch", "window"),
            "frame {}".format,
            ("", "collision"),
        )
        t_ns = np.linspace(0, END_NS, 11).astype(np.int64)
        curve = Curve("F-score", "", (0, 158, 115), t_ns, np.linspace(0.0, 1.0, 11))
        self.dock.load(0, END_NS, starts_ns, [frames, CurvesLane("Quality", [curve])])
        self.dock.show(True)

    def close(self):
        self.ui.close()
        self.thread.shutdown()


@pytest.fixture(scope="module")
def docks(chromium):
    """A server whose visitors see nothing but a dock."""
    with app_page(lecture=True).served():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    stages = []
    server.on_client_connect(lambda client: stages.append(Stage(client)))
    yield server, stages
    for stage in stages:
        stage.close()
    server.stop()


@pytest.fixture(scope="module")
def opened(browser, docks):
    """A tab with a dock, and its stage."""
    server, stages = docks
    context = browser.new_context(viewport={"width": 1000, "height": 600})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.errors = []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.goto(f"http://127.0.0.1:{server.get_port()}?fixedDpr=1")
    page.locator(".packetmesh-dock-field").wait_for()
    yield page, stages[-1]
    assert page.errors == []
    context.close()


@pytest.fixture
def page(opened):
    """The tab with the whole run, at its start and paused."""
    page, stage = opened
    stage.dock.pause()
    page.get_by_role("button", name="All", exact=True).click()
    press(page, "Home")
    until(page, lambda: stage.dock.now_ns == 0 and window_ns(page) == (0, END_NS))
    stage.moves.clear()
    stage.picks.clear()
    return page


@pytest.fixture
def stage(opened):
    return opened[1]


def until(page, condition):
    """Wait for something on the server."""
    for _ in range(200):
        if condition():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it did not happen within ten seconds")


def press(page, *keys):
    """Press keys in the dock."""
    page.locator(".packetmesh-dock-row").focus()
    for key in keys:
        page.keyboard.press(key)


def window_ns(page):
    """Of the pictures that are shown."""
    return tuple(map(int, page.locator(".packetmesh-dock-row").get_attribute("data-window").split()))


def field(page):
    """Left end, top and width of the pictures."""
    box = page.locator(".packetmesh-dock-field").bounding_box()
    return box["x"], box["y"], box["width"]


def x_of(page, t_ns):
    """Where on the screen a time is."""
    left, _, width = field(page)
    start, end = window_ns(page)
    return left + (t_ns - start) / (end - start) * width


def cursor_x(page):
    box = page.locator(".packetmesh-dock-cursor").bounding_box()
    return box["x"] + box["width"] / 2


def rested(page):
    """Wait until the pictures are those of the window that a hand left."""
    page.wait_for_timeout(200)
    before = None
    while before != window_ns(page):
        before = window_ns(page)
        page.wait_for_timeout(300)
    return before


def test_a_click_goes_to_the_time_below_it_within_a_pixel(page, stage):
    left, top, width = field(page)
    for share in (0.213, 0.777, 0.4):
        x = round(left + share * width)
        page.mouse.click(x, top + 5)
        wanted_ns = (x - left) / width * END_NS
        until(page, lambda wanted_ns=wanted_ns: abs(stage.dock.now_ns - wanted_ns) < END_NS / width)
        page.wait_for_function(
            "x => { const box = document.querySelector('.packetmesh-dock-cursor').getBoundingClientRect();"
            " return Math.abs(box.left + box.width / 2 - x) <= 1; }",
            arg=x,
        )


def test_a_click_on_a_frame_picks_it(page, stage):
    _, top, _ = field(page)
    row_px = 24
    for item in (4, 13, 70):
        page.mouse.click(x_of(page, item * 100_000_000 + 20_000_000), top + (item % 2 + 0.5) * row_px)
        until(page, lambda item=item: stage.picks and stage.picks[-1] == (0, item))
    page.mouse.click(x_of(page, 120_000_000), top + 5)
    until(page, lambda: stage.picks[-1] == (0, -1))


def test_the_wheel_zooms_about_the_pointer(page, stage):
    left, top, width = field(page)
    x = round(left + 0.3 * width)  # the wheel's events have whole pixels
    t_ns = (x - left) / width * END_NS
    page.mouse.move(x, top + 10)
    for _ in range(5):
        page.mouse.wheel(0, -200)
    start, end = rested(page)
    assert (end - start) < END_NS / 5
    assert abs(x_of(page, t_ns) - x) <= 1.0
    page.mouse.wheel(0, 100)
    again = rested(page)
    assert (end - start) * 1.1 < again[1] - again[0] < END_NS
    assert abs(x_of(page, t_ns) - x) <= 1.0
    for _ in range(20):
        page.mouse.wheel(0, 300)
    assert rested(page) == (0, END_NS)
    assert not stage.moves


def test_a_drag_takes_the_time_below_the_pointer_along(page, stage):
    left, top, width = field(page)
    page.mouse.move(left + 0.5 * width, top + 10)
    for _ in range(4):
        page.mouse.wheel(0, -200)
    start, end = rested(page)
    x = left + 0.5 * width
    t_ns = (start + end) / 2
    page.mouse.down()
    page.mouse.move(x + 60, top + 12, steps=5)
    page.mouse.move(x + 130, top + 12, steps=5)
    page.mouse.up()
    moved = rested(page)
    assert moved[1] - moved[0] == pytest.approx(end - start, abs=2)
    assert abs(x_of(page, t_ns) - (x + 130)) <= 1.0
    assert not stage.moves
    assert not stage.picks


def test_a_drag_below_the_lanes_takes_the_clock_along(page, stage):
    left, top, width = field(page)
    height = page.locator(".packetmesh-dock-field").bounding_box()["height"]
    page.mouse.move(left + 0.2 * width, top + height - 6)
    page.mouse.down()
    for share in np.linspace(0.2, 0.8, 25):
        page.mouse.move(left + share * width, top + height - 6)
        assert abs(cursor_x(page) - (left + share * width)) <= 1.0
        page.wait_for_timeout(20)
    page.mouse.up()
    until(page, lambda: abs(stage.dock.now_ns - 0.8 * END_NS) < END_NS / width)
    assert stage.moves == sorted(stage.moves)
    assert len(stage.moves) >= 5
    assert rested(page) == (0, END_NS)


def test_keys_play_step_and_go_to_the_ends(page, stage):
    press(page, "End")
    until(page, lambda: stage.dock.now_ns == END_NS)
    press(page, "ArrowLeft")
    until(page, lambda: stage.dock.now_ns == 9_900_000_000)
    press(page, "Home")
    until(page, lambda: stage.dock.now_ns == 0)
    press(page, "Space")
    until(page, lambda: stage.dock.playing and stage.dock.now_ns > 0)
    press(page, "Space")
    until(page, lambda: not stage.dock.playing)
    stood = stage.dock.now_ns
    page.wait_for_timeout(300)
    assert stage.dock.now_ns == stood


def test_no_key_is_lost_however_quickly_they_follow(page, stage):
    press(page, *["ArrowRight"] * 25)
    until(page, lambda: stage.dock.now_ns == 25 * 100_000_000)
    page.wait_for_timeout(500)
    assert stage.dock.now_ns == 25 * 100_000_000


def test_keys_go_on_after_a_button_was_clicked(page, stage):
    page.get_by_role("button", name="Next event").click()
    until(page, lambda: stage.dock.now_ns == 100_000_000)
    page.keyboard.press("ArrowRight")
    until(page, lambda: stage.dock.now_ns == 200_000_000)
    page.keyboard.press("Space")
    until(page, lambda: stage.dock.playing)


def test_pointing_at_a_frame_says_what_it_is(page, stage):
    _, top, _ = field(page)
    page.mouse.move(x_of(page, 13 * 100_000_000 + 20_000_000), top + 36)
    tip = page.locator(".packetmesh-dock-tip")
    expect(tip).to_be_visible()
    expect(tip).to_have_text("frame 13")
    page.mouse.move(x_of(page, 5_500_000_000), top + 80)
    expect(tip).to_have_text("F-score 0.5")
    page.mouse.move(x_of(page, 5_500_000_000), top - 100)
    expect(tip).to_be_hidden()


def test_the_pictures_show_lost_frames_where_they_are_and_curves_up_to_the_clock(page, stage):
    press(page, "Home")
    _, top, _ = field(page)
    page.mouse.click(x_of(page, 5_000_000_000), top + 5)
    until(page, lambda: stage.dock.now_ns > 4_900_000_000)
    page.mouse.move(5, 5)
    page.wait_for_timeout(400)
    shot = np.array(Image.open(io.BytesIO(page.screenshot())).convert("RGB")).astype(int)

    def colors(t_ns, first, last):
        x = round(x_of(page, t_ns))
        return shot[round(top) + first : round(top) + last, x]

    assert (np.abs(colors(1_320_000_000, 28, 44) - LOSS) < 12).all()
    assert (np.abs(colors(1_120_000_000, 28, 44) - TARGET) < 12).all()
    curve = (0, 158, 115)
    for t_ns, full in ((2_500_000_000, True), (4_500_000_000, True), (6_500_000_000, False)):
        strongest = np.abs(colors(t_ns, 54, 110) - curve).max(axis=1).min()
        assert (strongest < 12) == full, t_ns


def test_it_follows_the_width_of_the_window(page, stage):
    _, _, before = field(page)
    page.set_viewport_size({"width": 1200, "height": 600})
    until(page, lambda: field(page)[2] == before + 200)
    wide = "[...document.querySelectorAll('.packetmesh-dock-field img')].map(image => image.naturalWidth)"
    page.wait_for_function(f"() => {wide}.every(width => width === {round(before + 200)})")
    page.set_viewport_size({"width": 1000, "height": 600})
    page.wait_for_function(f"() => {wide}.every(width => width === {round(before)})")


def test_it_stays_when_the_control_panel_is_closed_and_goes_when_it_is_hidden(page, stage):
    page.get_by_label("Minimize panel").first.click()
    page.wait_for_timeout(500)
    press(page, "End")
    until(page, lambda: stage.dock.now_ns == END_NS)
    stage.post(stage.dock.show, False)
    expect(page.locator(".packetmesh-dock-row")).to_have_count(0)
    stage.post(stage.dock.show, True)
    expect(page.locator(".packetmesh-dock-row")).to_be_visible()


def test_two_browsers_have_clocks_of_their_own(browser, docks, page, stage):
    server, stages = docks
    context = browser.new_context(viewport={"width": 800, "height": 500})
    other = context.new_page()
    other.set_default_timeout(PATIENCE_MS)
    other.goto(f"http://127.0.0.1:{server.get_port()}?fixedDpr=1")
    other.locator(".packetmesh-dock-field").wait_for()
    until(other, lambda: stages[-1] is not stage)
    press(other, "End")
    until(other, lambda: stages[-1].dock.now_ns == END_NS)
    assert stage.dock.now_ns == 0
    context.close()

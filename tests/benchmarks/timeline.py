"""How many pictures of a timeline with 60 nodes and a million frames the server paints, and how it scrubs.

``python tests/benchmarks/timeline.py`` paints windows from the whole run down to a millisecond, then opens
the dock alone in Chromium: a hand drags the clock, turns the wheel and drags the pictures. Prints medians and
95th percentiles: of a picture with its PNG on the server, by the clock and by the time that the processor
worked, from the hand to ``on_move`` on the server, and from a turn of the wheel to the new pictures on the
screen.
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import viser
from playwright.sync_api import sync_playwright

from app.dock.dock import Dock
from app.drawing.levels import levels_of
from app.drawing.timeline import Curve, CurvesLane, FramesLane
from app.window.ui import Ui

sys.path.insert(0, str(Path(__file__).parents[1] / "browser"))

from conftest import ARGUMENTS, chromium_path

NODES, FRAMES, END_NS = 60, 1_000_000, 600_000_000_000
WIDTH_PX = 1200


def columns() -> tuple[np.ndarray, ...]:
    """Start, end, row and cause of frames in bursts, a fifth of them lost."""
    rng = np.random.default_rng(0)
    burst_ns = rng.integers(0, 60, FRAMES) * 10_000_000_000
    start_ns = burst_ns + rng.integers(0, 7_000_000_000, FRAMES)
    cause = np.where(rng.random(FRAMES) < 0.2, rng.integers(1, 4, FRAMES), 0)
    return start_ns, start_ns + 900_000, rng.integers(0, NODES, FRAMES), cause


def say(what: str, times_s: list[float]) -> None:
    """Print the median and the 95th percentile."""
    median, p95 = 1000.0 * np.percentile(times_s, (50, 95))
    print(f"{what:<60} {median:7.1f} ms {p95:7.1f} ms  (median, 95 %)", flush=True)


def on_server(lane: FramesLane) -> None:
    """Paint windows of every width."""
    rng = np.random.default_rng(1)
    for span_ns in (END_NS, END_NS // 10, END_NS // 1000, 50_000_000, 1_000_000):
        times_s, worked_s, sizes = [], [], []
        for _ in range(30):
            start_ns = int(rng.integers(0, END_NS - span_ns + 1))
            picture = np.empty((lane.height_px, WIDTH_PX, 3), np.uint8)
            began, work_began = time.perf_counter(), time.thread_time()
            lane.draw(picture, start_ns, start_ns + span_ns)
            encoded = cv2.imencode(".png", picture, (cv2.IMWRITE_PNG_COMPRESSION, 1))[1]
            times_s.append(time.perf_counter() - began)
            worked_s.append(time.thread_time() - work_began)
            sizes.append(len(encoded))
        say(f"a picture of {span_ns / 1e9:g} s, {np.median(sizes) / 1000.0:.0f} kB: by the clock", times_s)
        say("    by the processor", worked_s)


class Stage:
    """A dock in a browser, and when its clock moved."""

    def __init__(self, client: viser.ClientHandle, lanes: list) -> None:
        self.thread, self.moved = ThreadPoolExecutor(1), []
        ui = Ui(client.gui, client.scene, self.thread.submit, client.atomic, client.flush)
        self.dock = Dock(ui, lambda now_ns: self.moved.append((now_ns, time.time())), lambda *_: None)
        self.thread.submit(self.dock.load, 0, END_NS, np.arange(0, END_NS, 10**9), lanes)
        self.thread.submit(self.dock.show, True)


def scrub(page, stage: Stage, box: dict) -> None:
    """Drag the clock along the axis."""
    x, y = box["x"], box["y"] + box["height"] - 5
    page.mouse.move(x + 5, y)
    page.mouse.down()
    times_s = []
    for step in range(100):
        stage.moved.clear()
        began = time.time()
        page.mouse.move(x + 10 + 8 * step, y)
        while not stage.moved and time.time() - began < 2.0:
            time.sleep(0.001)
        times_s.append(stage.moved[0][1] - began)
        page.wait_for_timeout(100)
    page.mouse.up()
    say("the clock dragged: from the hand to on_move", times_s)


SHOWN = """
() => new Promise(resolve => {
  const row = document.querySelector(".packetmesh-dock-row");
  const began = performance.now();
  new MutationObserver((_, watcher) => {
    watcher.disconnect();
    requestAnimationFrame(() => resolve(performance.now() - began));
  }).observe(row, {attributeFilter: ["data-window"]});
  const field = document.querySelector(".packetmesh-dock-field").getBoundingClientRect();
  document.querySelector(".packetmesh-dock-field").dispatchEvent(new WheelEvent("wheel", {
    deltaY: DELTA, clientX: field.left + field.width * 0.4, bubbles: true, cancelable: true}));
})
"""


def zoom(page) -> None:
    """Turn the wheel to and fro, each turn after the pictures of the one before are there."""
    turns = [-200] * 20 + [200] * 20
    say(
        "the wheel turned: from the hand to new pictures",
        [page.evaluate(SHOWN.replace("DELTA", str(turn))) / 1000.0 for turn in turns],
    )


def pan(page, box: dict) -> None:
    """How many new pictures a second come while a hand drags on and on."""
    page.evaluate(
        "window.seen = 0; new MutationObserver(() => { seen++; }).observe("
        "document.querySelector('.packetmesh-dock-row'), {attributeFilter: ['data-window']})"
    )
    for _ in range(10):
        page.evaluate(SHOWN.replace("DELTA", "-200"))
    x, y = box["x"] + box["width"] / 2, box["y"] + 20
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate("seen = 0")
    began = time.time()
    while time.time() - began < 5.0:
        page.mouse.move(x + 200.0 * np.sin(3.0 * (time.time() - began)), y)
        page.wait_for_timeout(8)
    print(f"pictures dragged: {page.evaluate('seen') / (time.time() - began):.1f} new ones a second")
    page.mouse.up()


def main() -> None:
    """Measure."""
    data = columns()
    began = time.perf_counter()
    levels = levels_of(*data, NODES)
    print(f"{FRAMES:,} frames of {NODES} nodes sorted and summed up in {time.perf_counter() - began:.2f} s")
    names = [f"camera {index + 1}" for index in range(NODES)]
    lane = FramesLane(levels, names, "frame {}".format, ("", "collision", "bit errors", "too late"))
    on_server(lane)
    t_ns = np.linspace(0, END_NS, 40).astype(np.int64)
    curve = Curve("F-score", "%", (0, 158, 115), t_ns, np.linspace(40.0, 95.0, 40), 0.0, 100.0)
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    stages: list[Stage] = []
    server.on_client_connect(lambda client: stages.append(Stage(client, [lane, CurvesLane("Mesh", [curve])])))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_context(viewport={"width": WIDTH_PX + 170, "height": 760}).new_page()
        page.goto(f"http://127.0.0.1:{server.get_port()}?fixedDpr=1")
        page.locator(".packetmesh-dock-field").wait_for(timeout=60_000)
        page.wait_for_timeout(2000)
        box = page.locator(".packetmesh-dock-field").bounding_box()
        scrub(page, stages[0], box)
        zoom(page)
        pan(page, box)
        browser.close()
    server.stop()
    for stage in stages:
        stage.thread.shutdown()


if __name__ == "__main__":
    main()

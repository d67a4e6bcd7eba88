"""How long after the radius slider moves its surface stands on the screen.

``python tests/benchmarks/slider_latency.py`` opens the app in Chromium, lets a hand drag the radius to and
fro, and times each radius from the message that carries it to the first frame that draws a mesh which was
not there before. Prints the median and the 95th percentile.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "browser"))

from conftest import ARGUMENTS, chromium_path
from hands import go, slider

WATCH = """
(() => {
  const log = window.surfaceLog = {moved: [], drawn: []};
  let hand = 0;
  addEventListener("pointermove", event => { hand = performance.now(); }, true);
  new MutationObserver(changes => {
    for (const change of changes)
      log.moved.push({at: hand, mm: parseFloat(change.target.getAttribute("aria-valuenow"))});
  }).observe(document, {subtree: true, attributes: true, attributeFilter: ["aria-valuenow"]});
  let last = 0;
  const draw = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (mode, count, type, offset) {
    draw.call(this, mode, count, type, offset);
    if (mode === 4 && count > 3000) {
      const indices = count;
      requestAnimationFrame(() => log.drawn.push({at: performance.now(), indices}));
    }
  };
})();
"""


def drag(page, stops: int, pause_ms: int) -> dict:
    """Drag the radius to and fro over most of its track; what the page has seen."""
    handle = slider(page, "Radius (mm)")
    track = handle.locator("xpath=..").bounding_box()
    middle = track["y"] + track["height"] / 2
    places = track["x"] + track["width"] * (0.5 + 0.35 * np.sin(np.linspace(0.0, 4.0 * np.pi, stops)))
    box = handle.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.evaluate("surfaceLog.moved.length = surfaceLog.drawn.length = 0")
    for place in places:
        page.mouse.move(float(place), middle)
        page.wait_for_timeout(pause_ms)
    page.wait_for_timeout(300)
    log = page.evaluate("surfaceLog")
    page.mouse.up()
    return log


def latencies_s(log: dict, shown: list[tuple[float, int]]) -> list[float]:
    """Seconds from the hand's move to a radius to the first frame with its mesh, in order.

    ``shown`` are the radii (mm) and triangles that the server sent. Frames are gone through in order, so a
    mesh counts from when it first appears after the one before it.
    """
    waits, frame = [], 0
    for radius_mm, triangles in shown:
        frames = [i for i in range(frame, len(log["drawn"])) if log["drawn"][i]["indices"] == 3 * triangles]
        if not frames:
            continue
        frame = frames[0]
        at = log["drawn"][frame]["at"]
        moves = [move["at"] for move in log["moved"] if move["mm"] == radius_mm and move["at"] < at]
        if moves:
            waits.append((at - moves[-1]) / 1000.0)
    return waits


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="living-room")
    parser.add_argument("--stops", type=int, default=80)
    parser.add_argument("--pause-ms", type=int, default=60)
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    from app.jobs.records import PaintedView
    from app.panels.surface import SurfacePanel
    from app.server import build_server

    shown: list[tuple[float, int]] = []
    rolls_s: list[float] = []
    painted = SurfacePanel._painted

    def noted(panel: SurfacePanel, view: PaintedView) -> None:
        shown.append((1000.0 * (view.wish.radius_m or 0.0), view.meshes["after"].triangles))
        rolls_s.append(view.roll_s)
        painted(panel, view)

    SurfacePanel._painted = noted
    app = build_server(options.scene, port=0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.add_init_script(WATCH)
        page.goto(app.url)
        go(page, "Surface")
        page.get_by_text("Up to date").wait_for(timeout=120_000)
        page.wait_for_timeout(3000)
        log = drag(page, options.stops, options.pause_ms)
        waits = latencies_s(log, [(round(mm, 3), n) for mm, n in shown])
        times = [drawn["at"] / 1000.0 for drawn in log["drawn"]]
        browser.close()
    app.stop()
    first = {}
    for drawn in log["drawn"]:
        first.setdefault(drawn["indices"], drawn["at"] / 1000.0)
    gaps = np.diff(sorted(first.values()))
    moves = len({move["at"] for move in log["moved"]})
    print(f"{moves} moves, {len(shown)} meshes sent, {len(waits)} seen on the screen, {len(times)} frames")
    print(f"of it the ball alone: median {np.median(rolls_s):.3f} s")
    print(f"move to mesh: median {np.median(waits):.3f} s, 95th percentile {np.percentile(waits, 95):.3f} s")
    print(
        f"mesh to next mesh: median {np.median(gaps):.3f} s, 95th percentile {np.percentile(gaps, 95):.3f} s"
    )


if __name__ == "__main__":
    main()

"""How long after the radius slider moves its surface stands on the screen.

``python tests/benchmarks/slider_latency.py`` opens the app in Chromium, lets a hand drag the radius to and
fro, and times each radius from the hand's move to when OpenGL has drawn the first frame with its mesh.
Prints the median and the 95th percentile, for the machine's OpenGL driver (Mesa's software one where there
is no graphics card) and for SwiftShader, Chromium's own without a driver.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import groupby
from operator import itemgetter
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from app.screens.surface.panel import SurfacePanel
from app.screens.surface.view import PaintedView
from app.server import build_server

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
  const draw = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (mode, count, type, offset) {
    draw.call(this, mode, count, type, offset);
    if (mode !== 4 || count < 3000) return;
    const drawn = this.fenceSync(this.SYNC_GPU_COMMANDS_COMPLETE, 0), frame = document.timeline.currentTime;
    const look = () => this.getSyncParameter(drawn, this.SYNC_STATUS) === this.SIGNALED
      ? log.drawn.push({at: performance.now(), frame, indices: count}) : setTimeout(look, 2);
    setTimeout(look, 2);
  };
})();
"""


RENDERER = """
(() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  return gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info").UNMASKED_RENDERER_WEBGL);
})()
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
        time.sleep(pause_ms / 1000.0)
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


def between_meshes_s(log: dict) -> np.ndarray:
    """Seconds from one mesh to the next on the screen."""
    drawn = [list(group) for _, group in groupby(log["drawn"], itemgetter("frame"))]
    frames = [{one["indices"] for one in group} for group in drawn]
    times = [max(one["at"] for one in group) for group in drawn]
    new = [at for at, before, now in zip(times[1:], frames, frames[1:], strict=False) if now - before]
    return np.diff(new) / 1000.0


class Watched:
    """The app, with every surface that it sends while the radius is dragged written down."""

    def __init__(self, scene: str) -> None:
        self.shown: list[tuple[float, int]] = []
        self.rolls_s: list[float] = []
        self.points: list[int] = []
        painted = SurfacePanel._painted

        def noted(panel: SurfacePanel, view: PaintedView) -> None:
            self.shown.append(
                (round(1000.0 * (view.request.radius_m or 0.0), 3), view.meshes["after"].triangles)
            )
            self.rolls_s.append(view.roll_s)
            self.points.append(view.points)
            painted(panel, view)

        SurfacePanel._painted = noted
        self.app = build_server(scene, port=0)


def measure(playwright, watched: Watched, angle: str, stops: int, pause_ms: int) -> None:
    """Drag in one Chromium and print what came of it."""
    arguments = [f"--use-angle={angle}" if "use-angle" in one else one for one in ARGUMENTS]
    browser = playwright.chromium.launch(
        executable_path=chromium_path(), args=[*arguments, "--ignore-gpu-blocklist"]
    )
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.add_init_script(WATCH)
    page.goto(f"{watched.app.url}?explore")
    go(page, "Surface")
    page.get_by_text("Up to date").wait_for(timeout=120_000)
    page.wait_for_timeout(3000)
    watched.shown.clear()
    watched.rolls_s.clear()
    watched.points.clear()
    log = drag(page, stops, pause_ms)
    renderer = page.evaluate(RENDERER)
    browser.close()
    waits, gaps = latencies_s(log, watched.shown), between_meshes_s(log)
    moves = len({move["at"] for move in log["moved"]})
    print(f"{angle}: {renderer}")
    print(f"  {moves} moves, {len(watched.shown)} meshes sent, {len(waits)} seen, {len(log['drawn'])} frames")
    changes = [f"{count:,} x {len(list(looks))}" for count, looks in groupby(watched.points)]
    print(f"  points: {', '.join(changes)}")
    print(f"  the ball alone: median {np.median(watched.rolls_s):.3f} s")
    for name, times_s in (("move to mesh", waits), ("mesh to next mesh", gaps)):
        print(
            f"  {name}: median {np.median(times_s):.3f} s, 95th percentile {np.percentile(times_s, 95):.3f} s"
        )


def main() -> None:
    """Measure with each renderer and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="living-room")
    parser.add_argument("--stops", type=int, default=300)
    parser.add_argument("--pause-ms", type=int, default=10)
    parser.add_argument(
        "--angle", nargs="+", default=["gl-egl", "swiftshader"], help="what Chromium draws with (--use-angle)"
    )
    options = parser.parse_args()
    watched = Watched(options.scene)
    with sync_playwright() as playwright:
        for angle in options.angle:
            measure(playwright, watched, angle, options.stops, options.pause_ms)
    watched.app.stop()


if __name__ == "__main__":
    main()

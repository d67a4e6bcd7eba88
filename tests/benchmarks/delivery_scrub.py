"""How long after a hand rests on the Network screen's timeline the mesh of that moment stands on the screen.

``python tests/benchmarks/delivery_scrub.py`` opens the app in Chromium, delivers the living room over the
preset ``office``, and has a hand click the timeline here and there and look for a second. Prints the median
and the 95th percentile from the hand's rest to the start of the first frame with the moment's mesh, which is
the program's part, and to when OpenGL has drawn that frame, for the machine's OpenGL driver (Mesa's software
one where there is no graphics card) and for SwiftShader.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright
from slider_latency import RENDERER, WATCH

from app.screens.network import setup
from app.server import build_server

sys.path.insert(0, str(Path(__file__).parents[1] / "browser"))

from conftest import ARGUMENTS, chromium_path
from hands import go

REST = """
addEventListener("pointerup", () => { window.handRested = performance.now(); }, true);
"""
LONGEST_S = 5.0
LOOK_MS = 1000


def waits_s(page, triangles: int) -> tuple[float, float] | None:
    """Seconds from the hand's rest to the first frame with a mesh and to its end; None without one."""
    until = time.monotonic() + LONGEST_S
    while time.monotonic() < until:
        drawn = page.evaluate(
            "surfaceLog.drawn.map(one => [one.frame - handRested, one.at - handRested, one.indices])"
        )
        frames = [(begun, done) for begun, done, indices in drawn if indices == 3 * triangles and done > 0.0]
        if frames:
            begun_ms, done_ms = min(frames)
            return begun_ms / 1000.0, done_ms / 1000.0
        page.wait_for_timeout(50)
    return None


def measure(playwright, app, angle: str, clicks: int) -> None:
    """Click in one Chromium and print what came of it."""
    arguments = [f"--use-angle={angle}" if "use-angle" in one else one for one in ARGUMENTS]
    browser = playwright.chromium.launch(
        executable_path=chromium_path(), args=[*arguments, "--ignore-gpu-blocklist"]
    )
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.add_init_script(WATCH + REST)
    page.goto(f"{app.url}?explore")
    page.set_default_timeout(240_000)
    go(page, "Network")
    page.get_by_text("Up to date").wait_for()
    page.wait_for_timeout(3000)
    (session,) = app.sessions.values()
    view = session._current._delivery
    meshes = {moment.t_ns: moment.triangles for moment in view.moments if moment.triangles}
    field, rng = page.locator(".packetmesh-dock-field").bounding_box(), np.random.default_rng(0)
    waits, before = [], 0
    for t_ns in rng.choice(list(meshes), clicks).tolist():
        if t_ns == before:
            continue
        before = t_ns
        page.evaluate("surfaceLog.drawn.length = 0")
        share = (t_ns + 1_000_000) / view.run.end_ns
        page.mouse.click(field["x"] + min(share, 0.999) * field["width"], field["y"] + 8)
        waits.append(waits_s(page, meshes[t_ns]))
        page.wait_for_timeout(LOOK_MS)
    renderer = page.evaluate(RENDERER)
    browser.close()
    seen = [one for one in waits if one is not None]
    print(f"{angle}: {renderer}")
    print(
        f"  {len(waits)} clicks, {len(seen)} meshes of {min(meshes.values()):,} to {max(meshes.values()):,}"
    )
    for name, times_s in zip(("begins", "is drawn"), zip(*seen, strict=True), strict=True):
        median, p95 = np.percentile(times_s, (50, 95))
        text = f"median {median:.3f} s, 95th percentile {p95:.3f} s"
        print(f"  hand's rest until the frame with the mesh {name}: {text}", flush=True)


def main() -> None:
    """Measure with each renderer and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="living-room")
    parser.add_argument("--moments", type=int, default=setup.MOMENTS)
    parser.add_argument("--clicks", type=int, default=40)
    parser.add_argument(
        "--angle", nargs="+", default=["gl-egl", "swiftshader"], help="what Chromium draws with (--use-angle)"
    )
    options = parser.parse_args()
    setup.MOMENTS = options.moments
    app = build_server(options.scene, port=0)
    with sync_playwright() as playwright:
        for angle in options.angle:
            measure(playwright, app, angle, options.clicks)
    app.stop()


if __name__ == "__main__":
    main()

"""How long after the second click of a length its number stands in the browser.

``python -m tests.benchmarks.click_to_number`` opens the demo's box in Chromium, measures an edge several
times and prints the time from the mouse button to the row of the list. ``--undrawn`` draws no 3-D picture, as
if a graphics card did.
"""

from __future__ import annotations

import argparse
import statistics

from playwright.sync_api import sync_playwright

from app.server import build_server
from tests.browser.conftest import ARGUMENTS, RESTING, UNDRAWN, chromium_path
from tests.browser.hands import TRIES, go, unfold, visible
from tests.browser.test_measure import LOOK_AT_M, STAND_M, corner, pixel

WATCH = """rows => {
  const has = row => / ± [\\d.]+ cm/.test(row.innerText);
  const count = () => [...document.querySelectorAll("tr")].filter(has).length;
  let pressed_ms = 0;
  addEventListener("pointerup", () => { pressed_ms = performance.now(); }, true);
  window.answered = new Promise(done => {
    new MutationObserver(() => count() >= rows && done(performance.now() - pressed_ms)).observe(
      document.body, {subtree: true, childList: true, characterData: true, attributes: true});
  });
}"""


def main() -> None:
    """Print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--undrawn", action="store_true", help="do not draw the 3-D picture")
    undrawn = parser.parse_args().undrawn
    app = build_server("box-on-table", port=0)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
        if undrawn:
            page.add_init_script(UNDRAWN)
            page.add_init_script(RESTING)
        view = ",".join(f"{value:g}" for value in (*STAND_M, *LOOK_AT_M))
        page.goto(f"{app.url}?fixedDpr=1&cam={view}&screen=surface")
        go(page, "Surface")
        page.get_by_text("Up to date").wait_for(timeout=180_000)
        unfold(page, "Measure")
        visible(page, "Clicks measure").click()
        page.wait_for_timeout(5000)  # the surface is made ready before the first click
        times_ms = []
        for row in range(1, TRIES):
            page.mouse.click(*pixel(page, corner(-1, -1)))
            page.get_by_text("Click the second end.").locator("visible=true").first.wait_for()
            page.wait_for_timeout(500)
            page.evaluate(WATCH, row)
            page.mouse.click(*pixel(page, corner(1, -1)))
            times_ms.append(page.evaluate("() => window.answered"))
        browser.close()
    app.stop()
    print(f"{statistics.median(times_ms):.0f} ms   {' '.join(f'{one:.0f}' for one in times_ms)}")


if __name__ == "__main__":
    main()

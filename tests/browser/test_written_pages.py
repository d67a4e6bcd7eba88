"""Written pages in a real Chromium: they work under the policy that they bring, and no text in them runs."""

from __future__ import annotations

import pytest

from tests.app.written_pages import PAGES
from tests.browser.hands import PATIENCE_MS

WATCH = """
window.forbidden = [];
addEventListener("securitypolicyviolation", event => {
  window.forbidden.push(`${event.effectiveDirective} ${event.blockedURI} ${event.sourceFile}`);
});
"""
READY = {
    "calibration": "() => document.querySelectorAll('.plotly-graph-div .main-svg').length >= 16",
    "delivery": "() => document.documentElement.dataset.moment === '3'",
    "race": "() => document.documentElement.dataset.ready",
    "surface": "() => document.documentElement.dataset.ready",
}
FORBIDDEN = """() => {
  const image = document.body.appendChild(document.createElement("div"));
  image.innerHTML = "<img src='data:,' onerror='window.pwned = 1'>";
  image.appendChild(document.createElement("script")).textContent = "window.pwned = 1";
}"""


@pytest.mark.parametrize("name", PAGES)
def test_a_page_works_under_its_policy_and_runs_nothing_else(browser, tmp_path, name):
    path = tmp_path / "written.html"
    path.write_text(PAGES[name](tmp_path), encoding="utf-8")
    context = browser.new_context(viewport={"width": 900, "height": 640}, offline=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    wrong = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    page.add_init_script(WATCH)
    page.goto(path.as_uri())
    page.wait_for_function(READY.get(name, "() => document.readyState === 'complete'"))
    page.wait_for_timeout(500)
    assert page.evaluate("window.forbidden") == []
    assert wrong == []
    page.evaluate(FORBIDDEN)
    page.wait_for_timeout(300)
    assert page.evaluate("window.pwned") is None
    assert len(page.evaluate("window.forbidden")) == 2
    context.close()

"""A real Chromium and a running app; skipped where there is no browser."""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

import pytest
from playwright.sync_api import Error

from tests.browser.hands import PATIENCE_MS, afresh, dismiss_notifications

HERE = Path(__file__).parent
ARGUMENTS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
"""Of Chromium where there is no graphics card."""
ROUGH = [
    "--webgl-antialiasing-mode=none",  # half the time of a frame, and tests look at no single pixel
    "--disable-gpu-compositing",  # only the 3-D picture needs a GPU
    "--disable-gpu-rasterization",
    "--js-flags=--no-enable-lazy-source-positions",  # Playwright's stack traces parse the page's script again
]
"""Pictures are drawn in half the time, but their edges are not smooth; pages load in five sixths."""


UNDRAWN = """
for (const name of ["drawElements", "drawArrays", "drawElementsInstanced", "drawArraysInstanced"]) {
  const draw = WebGL2RenderingContext.prototype[name];
  WebGL2RenderingContext.prototype[name] = function (...given) {
    if (window.draws) draw.apply(this, given);
    window.drew ||= window.draws;
  };
}
"""
"""Pages draw nothing into their 3-D picture before ``window.draws`` is true: without a graphics card that
takes most of the time, and few tests look at the picture."""
RESTING = """
{
  const ask = window.requestAnimationFrame.bind(window);
  const waiting = [];
  window.requestAnimationFrame = call => (window.rests ? waiting.push(call) : ask(call));
  window.goOn = () => {
    window.rests = false;
    waiting.splice(0).forEach(ask);
  };
}
"""
"""Pages begin no frame while ``window.rests`` is true."""
CONNECTION = """
window.Worker = class extends Worker {
  constructor(...given) {
    super(...given);
    window.connection = this;
  }
};
"""
"""Pages keep the worker that holds their connection to the server, the only one that viser starts."""
SIZE_PX = {"width": 900, "height": 640}
"""Of the tab, small so that drawing in software is quick."""
HALF = "test_lesson"
"""The first file of the second half. A browser mostly waits: each half runs on one worker, in one Chromium,
while others compute. Landing needs the cameras that Calibrate has calibrated before it.
"""


def chromium_path() -> str | None:
    """The browser that the environment names, or the first that is installed."""
    named = os.environ.get("PACKETMESH_CHROMIUM")
    candidates = [named] if named else ["/usr/bin/chromium", "chromium", "chromium-browser", "google-chrome"]
    return next((shutil.which(name) for name in candidates if shutil.which(name)), None)


@pytest.hookimpl(tryfirst=True)  # pytest-xdist looks at the groups, and where a path is named it came first
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test here, and keep those of a half on one worker: they share a page."""
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.browser)
            half = 1 + (item.path.stem >= HALF)
            item.add_marker(pytest.mark.xdist_group(f"browser {half}"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item):
    """Say in the report of a failed test what its page said."""
    report = yield
    if report.when == "call" and report.failed:
        for name, page in item.funcargs.items():
            if hasattr(page, "inner_text"):
                with contextlib.suppress(Error):  # of a page that is closed
                    report.sections.append((f"text of {name}", page.inner_text("body", timeout=5000)))
    return report


@pytest.fixture(scope="session")
def chromium():
    """Where Chromium is."""
    path = chromium_path()
    if path is None:
        pytest.skip(
            "no Chromium found: install the package 'chromium' or set PACKETMESH_CHROMIUM to its path"
        )
    return path


@pytest.fixture(scope="package")
def browser(chromium):
    """Chromium, closed before other tests: what drives it keeps an event loop that they must not meet."""
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*ARGUMENTS, *ROUGH])
        new_context = browser.new_context

        def undrawn(**options):
            context = new_context(**options)
            context.add_init_script(UNDRAWN)
            context.add_init_script(RESTING)
            context.add_init_script(CONNECTION)
            return context

        browser.new_context = undrawn
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def app(chromium):
    """The app with the smallest demo scene, on a port of its own; every tab has a session of its own."""
    from app.server import build_server

    app = build_server("box-on-table", port=0)
    yield app
    app.stop()


@pytest.fixture(scope="package")
def loaded(browser, app):
    """A tab that loads the app once: a page takes as long to load as a short test."""
    context = browser.new_context(viewport=SIZE_PX, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{app.url}?fixedDpr=1")
    page.get_by_text("Up to date").wait_for()
    yield page
    context.close()


@pytest.fixture(scope="module")
def tab(loaded):
    """The tab with a new session."""
    loaded.set_viewport_size(SIZE_PX)
    afresh(loaded)
    return loaded


@pytest.fixture
def page(tab):
    """The tab with the settings of the start, on its first step."""
    reset = tab.get_by_role("button", name="Reset", exact=True)
    tab.evaluate("() => new Promise(done => setTimeout(done, 50))")  # the last click has had its effect
    reset.evaluate("button => button.click()")  # nothing if it is disabled, or is by now
    tab.get_by_role("button", name="Scene").click()
    tab.get_by_text("Each camera node delivers").wait_for()
    tab.get_by_text("Up to date").wait_for()
    dismiss_notifications(tab)
    return tab


@pytest.fixture(scope="module")
def few():
    """Deliveries of few moments, so that they are soon there, in sessions that begin after this."""
    from app.screens.network import setup

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(setup, "MOMENTS", 4)
        yield

"""What browsers are told to forbid, the app itself never tries."""

import pytest

from tests.browser.hands import PATIENCE_MS, go

WATCH = """
window.forbidden = [];
addEventListener("securitypolicyviolation", event => {
  window.forbidden.push(`${event.effectiveDirective} ${event.blockedURI} ${event.sample}`);
});
"""
SEND = "fetch('https://example.org/').then(() => 'sent', () => 'not sent')"


@pytest.fixture
def page(browser, app):
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(WATCH)
    page.goto(f"{app.url}?fixedDpr=1")
    yield page
    context.close()


def test_every_screen_works_under_the_policy_and_nothing_is_sent_elsewhere(page):
    page.get_by_text("Each camera node delivers").wait_for()
    for step in ("Depth", "Fuse", "Surface", "Network", "Export"):
        go(page, step)
        page.wait_for_timeout(1000)
    assert page.evaluate("window.forbidden") == []
    assert page.evaluate(SEND) == "not sent"
    assert page.evaluate("window.forbidden.length") == 1

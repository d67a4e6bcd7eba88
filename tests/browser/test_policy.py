"""What browsers are told to forbid, the app itself never tries."""

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from tests.browser.hands import PATIENCE_MS, STEPS, afresh, go

WATCH = """
window.forbidden = [];
addEventListener("securitypolicyviolation", event => {
  window.forbidden.push(`${event.effectiveDirective} ${event.blockedURI} ${event.sample}`);
});
"""
HOSTILE = """
<img src=x onerror=window.pwned=1><script>window.pwned=1</script><svg onload=window.pwned=1></svg>
<details open ontoggle=window.pwned=1>x</details><iframe srcdoc="<script>parent.pwned=1</script>"></iframe>
<iframe src="javascript:parent.pwned=1"></iframe><object data="javascript:parent.pwned=1"></object>
<embed src="data:text/html,<script>parent.pwned=1</script>">
<a class=bait href="javascript:window.pwned=1">a</a>
<base href="{there}"><img src="{there}/image"><img srcset="{there}/images 1x">
<iframe src="{there}/frame"></iframe><video src="{there}/video" autoplay></video>
<object data="{there}/object"></object><embed src="{there}/embed">
<link rel=stylesheet href="{there}/sheet"><link rel=prefetch href="{there}/early">
<style>@import "{there}/more"; .bait {{ background: url("{there}/picture") }}</style>
<form action="{there}/form"><button class=bait>b</button></form>
"""
"""What would run, fetch or send, were it not forbidden; ``there`` is another place."""
SEND = "fetch('https://example.org/').then(() => 'sent', () => 'not sent')"


@pytest.fixture(scope="module")
def watched(browser, app):
    """A tab that notes what is forbidden, from before any script runs."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.add_init_script(WATCH)
    page.goto(f"{app.url}?fixedDpr=1")
    yield page
    context.close()


@pytest.fixture
def page(watched):
    """The same with a session of its own, and nothing noted."""
    afresh(watched)
    watched.evaluate("window.forbidden = []")
    return watched


def test_every_screen_works_under_the_policy_and_nothing_is_sent_elsewhere(watched):
    """From the first byte of the page on."""
    page = watched
    page.get_by_text("Each camera node delivers").wait_for()
    for step in STEPS[1:]:
        go(page, step)
        page.wait_for_timeout(1000)
    assert page.evaluate("window.forbidden") == []
    assert page.evaluate(SEND) == "not sent"
    assert page.evaluate("window.forbidden.length") == 1


@pytest.fixture
def elsewhere():
    """Another place, and the paths that it was asked for."""
    asked = []

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append(self.path)
            self.send_error(404)

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answer) as there:
        threading.Thread(target=there.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{there.server_port}", asked
        there.shutdown()


@pytest.mark.parametrize("kind", ["add_html", "add_markdown"])
def test_markup_past_all_escaping_runs_fetches_and_sends_nothing(page, app, elsewhere, kind):
    page.get_by_text("Each camera node delivers").wait_for()
    there, asked = elsewhere
    (session,) = [one for one in app.sessions.values() if not one._closed][-1:]
    getattr(session.target.gui, kind)(HOSTILE.format(there=there))
    page.locator(".bait").first.wait_for(state="attached")
    page.evaluate("document.querySelectorAll('.bait').forEach(one => one.click())")
    page.wait_for_timeout(2000)
    assert page.evaluate("window.pwned") is None
    assert asked == []
    assert page.url.startswith(app.url)
    assert page.evaluate("window.forbidden.length") >= 4


CALLS = """() => {
  const call = (name, given) => `<i hidden data-packetmesh-call="${name}" data-arguments='${given}'></i>`;
  window.called = [];
  packetmesh.calls.note = (element, ...given) => called.push(given.join());
  window.pieces = document.createElement("div");
  document.body.append(pieces);
  const unknown = ["constructor", "__proto__", "toString", "nothing"].map(name => call(name, "[]"));
  pieces.innerHTML = [...unknown, call("note", "not JSON"), call("note", '[1, "a"]')].join("");
}"""


def test_only_functions_that_are_there_are_called_each_time_and_one_that_fails_stops_no_other(page):
    errors = []
    page.on("pageerror", lambda error: errors.append(error.name))
    page.get_by_text("Each camera node delivers").wait_for()
    page.evaluate(CALLS)
    page.wait_for_timeout(300)
    assert page.evaluate("called") == ["1,a"]
    page.evaluate("pieces.remove()")
    page.evaluate("document.body.append(pieces)")
    page.wait_for_timeout(300)
    assert page.evaluate("called") == ["1,a", "1,a"]
    assert errors == ["SyntaxError", "SyntaxError"]

"""A server behind a proxy: the allowed name gets the page and its websocket, every other name neither."""

from __future__ import annotations

import http.client
import socket
from contextlib import closing
from urllib.parse import quote

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.web.headers import strict_headers
from app.web.names import allowed_names
from app.web.origin import NOT_PASSED_ON, WHY, is_own, only_own_page, refusal

ALLOWED = allowed_names(["lab.example.org", "büro.example"])


def serve(allowed):
    with strict_headers(allowed=allowed), only_own_page(allowed):
        return viser.ViserServer(host="127.0.0.1", port=0, verbose=False)


@pytest.fixture(scope="module")
def allowing():
    server = serve(ALLOWED)
    yield server.get_port()
    server.stop()


@pytest.fixture(scope="module")
def plain():
    server = serve(frozenset())
    yield server.get_port()
    server.stop()


def get(port, path="/", host="127.0.0.1"):
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=10)) as connection:
        connection.request("GET", path, headers={"Host": host})
        response = connection.getresponse()
        response.text = response.read().decode()
        return response


def websocket(port, origin, host):
    """Open a websocket as a proxy passes it on."""
    protocols = [f"viser-v{viser.__version__}"]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as sock:
        connect(f"ws://{host}", origin=origin, subprotocols=protocols, proxy=None, sock=sock).close()


KEPT, REWRITTEN = "lab.example.org:9003", "127.0.0.1:8123"


@pytest.mark.parametrize("host", [KEPT, REWRITTEN, "LAB.example.ORG", "lab.example.org.:1", "localhost:8123"])
@pytest.mark.parametrize(
    "origin",
    ["http://lab.example.org:9003", "https://lab.example.org", "https://xn--bro-hoa.example:8443", None],
)
def test_the_allowed_name_works_whether_or_not_the_proxy_keeps_the_host(allowing, host, origin):
    assert get(allowing, host=host).status == 200
    websocket(allowing, origin, host)


@pytest.mark.parametrize("host", [KEPT, REWRITTEN])
@pytest.mark.parametrize(
    "origin",
    [
        *(
            "http://evil.example",
            "https://lab.example.org.evil.example",
            "http://evil-lab.example.org",
            "null",
        ),
        *("http://example.org", "http://sub.lab.example.org", "http://lab.example.org@evil.example", ""),
        *("ftp://lab.example.org", "lab.example.org", "http://evil@lab.example.org", "file://", "http://["),
    ],
)
def test_another_site_gets_no_websocket(allowing, host, origin):
    assert not is_own({"Host": host, "Origin": origin}, ALLOWED)
    with pytest.raises(InvalidStatus, match=r"40[03]"):
        websocket(allowing, origin, host)


@pytest.mark.parametrize(
    "host", ["evil.example", "sub.lab.example.org", "example.org", "lab.example.org.evil.example"]
)
def test_a_name_that_is_made_to_point_here_gets_nothing(allowing, host):
    """DNS rebinding: the page's own Origin is no help, and neither is the name of an allowed page."""
    assert get(allowing, host=host).status == 403
    assert get(allowing, f"{WHY}?origin=http://{host}", host=host).status == 403
    for origin in (f"http://{host}", "http://lab.example.org"):
        assert not is_own({"Host": host, "Origin": origin}, ALLOWED)


def test_without_the_option_the_name_gets_nothing(plain):
    assert get(plain, host=KEPT).status == 403
    for host in (KEPT, REWRITTEN):
        with pytest.raises(InvalidStatus, match="403"):
            websocket(plain, "http://lab.example.org:9003", host)


def test_the_refusal_names_the_address_and_the_option(plain):
    text = get(plain, host=KEPT).text
    assert "does not answer pages of lab.example.org:9003:" in text
    assert text.endswith("packetmesh serve --allow-host lab.example.org\n")
    assert text.count("\n") == 1


@pytest.mark.parametrize(
    "host", ["<script>alert(1)</script>", "a b", "$(reboot)", "lab.example.org;reboot", "`id`"]
)
def test_a_refusal_repeats_nothing_that_is_no_name(plain, host):
    text = get(plain, host=host).text
    assert "--allow-host" not in text
    assert not set("<>$;`()").intersection(text)
    text = get(plain, f"{WHY}?origin={quote('http://' + host)}").text
    assert not set("<>$;`()").intersection(text)


def test_a_page_learns_why_its_websocket_is_refused(plain, allowing):
    asked = f"{WHY}?origin={quote('http://lab.example.org:9002')}"
    answer = get(plain, asked)
    assert answer.status == 200
    assert answer.headers["Content-Type"].startswith("text/plain")
    assert answer.text.endswith("packetmesh serve --allow-host lab.example.org\n")
    assert get(allowing, asked).text == ""
    assert get(plain, f"{WHY}?origin=http://127.0.0.1:{plain}", host=f"127.0.0.1:{plain}").text == ""
    assert "127.0.0.1:1:" in get(plain, f"{WHY}?origin=http://127.0.0.1:1", host=f"127.0.0.1:{plain}").text


@pytest.mark.parametrize(
    "query", ["", "?origin=", "?origin=%5B", "?origin=%00", "?origin=null", "?origin=a&origin=b"]
)
def test_a_strange_question_gets_the_usual_sentence(plain, query):
    answer = get(plain, f"{WHY}{query}")
    assert answer.status == 200
    assert answer.text.startswith("PacketMesh answers only its own page")


def test_the_policy_names_the_websocket_of_the_allowed_names_only(plain, allowing):
    policies = [get(port, host=REWRITTEN).headers["Content-Security-Policy"] for port in (plain, allowing)]
    assert "ws://lab.example.org:* wss://lab.example.org:*" in policies[1]
    assert "example" not in policies[0]
    assert " * " not in policies[1]


def asked(port, origin, waited="", host=REWRITTEN):
    return get(port, f"{WHY}?origin={quote(origin)}{waited}", host=host).text


@pytest.mark.parametrize(
    ("host", "origin", "options"),
    [
        ("packetmesh:8080", "https://lab.example.org", "also with: --allow-host packetmesh"),
        (
            "packetmesh:8080",
            "https://x.example",
            "also with: --allow-host x.example --allow-host packetmesh",
        ),
        (REWRITTEN, "https://x.example", "also with: --allow-host x.example"),
    ],
)
def test_the_options_of_a_refusal_are_those_that_are_missing_and_they_help(host, origin, options):
    """A proxy in Docker sends the container's name as Host."""
    headers = {"Host": host, "Origin": origin}
    text = refusal(headers, ALLOWED)
    assert text.endswith(f"start the server {options}\n")
    named = allowed_names(options.partition("with: ")[2].replace("--allow-host ", "").split())
    assert is_own(headers, ALLOWED | named)
    assert not any(is_own(headers, ALLOWED | (named - {one})) for one in named)


def test_a_page_whose_websocket_a_proxy_drops_learns_that_after_a_while():
    server = serve(ALLOWED)
    try:
        port, origin = server.get_port(), "https://lab.example.org:9001"
        assert asked(port, origin) == ""
        assert asked(port, origin, "&waited=1") == NOT_PASSED_ON
        websocket(port, origin, REWRITTEN)
        assert asked(port, origin, "&waited=1") == ""
        assert asked(port, "https://lab.example.org:9002", "&waited=1") == NOT_PASSED_ON
        assert "--allow-host evil.example" in asked(port, "https://evil.example", "&waited=1")
    finally:
        server.stop()

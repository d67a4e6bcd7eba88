"""Who comes in where other machines reach the server, and what browsers are told to forbid."""

import contextlib
import hashlib
import http.client
import re
from base64 import b64encode
from contextlib import closing
from itertools import count
from types import SimpleNamespace
from urllib.parse import quote

import pytest
import viser
from viser import _messages as messages
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.cli import main
from app.landing import app_page
from app.load.connection import Connection, wait_for
from app.web.entrance import Entrance, Token, is_loopback
from app.web.gate import Gate
from app.web.headers import strict_headers
from app.web.origin import only_own_page
from app.web.upload_gate import (
    LEAST_PART_BYTES,
    MOST_A_MINUTE,
    MOST_BYTES,
    MOST_TOTAL_BYTES,
    REFUSED,
    UploadGate,
)
from packetmesh.errors import InputError

ENTRANCE = Entrance(Token("token"), Token("teacher"))


@pytest.fixture(scope="module")
def server():
    with strict_headers(), only_own_page(), ENTRANCE.guarded():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


def get(server, path="/", **headers):
    with closing(http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=10)) as connection:
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        response.text = response.read()
        return response


def cookie_of(server, token):
    return get(server, f"/{token.query}").headers["Set-Cookie"].partition(";")[0]


def open_socket(server, **headers):
    origin = headers.pop("Origin", None)
    protocols = [f"viser-v{viser.__version__}"]
    url = f"ws://127.0.0.1:{server.get_port()}"
    connect(url, origin=origin, subprotocols=protocols, additional_headers=headers, proxy=None).close()


@pytest.mark.parametrize("path", ["/", "/index.html", "/?scene=office", "/nothing"])
def test_without_the_link_there_is_one_sentence_and_no_page(server, path):
    response = get(server, path)
    assert (response.status, response.text.count(b".")) == (403, 1)
    assert b"<" not in response.text


@pytest.mark.parametrize("token", [ENTRANCE.visitor, ENTRANCE.teacher], ids=["token", "teacher"])
def test_a_link_gives_a_cookie_that_lets_in_and_keeps_the_rest_of_the_address(server, token):
    response = get(server, f"/{token.query}&scene=office&set=depth.reach%3D0.2")
    assert (response.status, response.headers["Location"]) == (303, "./?scene=office&set=depth.reach%3D0.2")
    assert token.text not in response.headers["Location"]
    assert "HttpOnly" in response.headers["Set-Cookie"]
    cookie = cookie_of(server, token)
    assert get(server, Cookie=cookie).status == 200
    open_socket(server, Cookie=cookie)


@pytest.mark.parametrize("key", ["token", "teacher"])
@pytest.mark.parametrize("text", ["", "x", "é", "{other}", "{own}x", "{own[0]}", "{own:.21}"])
def test_another_token_is_refused(server, key, text):
    own, other = ENTRANCE.visitor, ENTRANCE.teacher
    if key == "teacher":
        own, other = other, own
    wrong = quote(text.format(own=own.text, other=other.text))
    response = get(server, f"/?{key}={wrong}")
    assert response.status == 403
    assert "Set-Cookie" not in response.headers


def test_a_cookie_lets_in_with_the_whole_token_and_nothing_else():
    token = ENTRANCE.visitor
    for text in ("", token.text[:1], token.text[:-1], token.text[1:], f"{token.text}x", 2 * token.text):
        assert not ENTRANCE.lets_in(f"{token.cookie}={text}"), text
    assert ENTRANCE.lets_in(f"{token.cookie}={token.text}")


def test_a_websocket_needs_the_cookie_and_its_own_page(server):
    cookie, own = cookie_of(server, ENTRANCE.visitor), f"http://127.0.0.1:{server.get_port()}"
    open_socket(server, Cookie=cookie, Origin=own)
    wrong = {"Cookie": f"{ENTRANCE.visitor.cookie}=x"}, {"Cookie": cookie, "Origin": "http://evil.example"}
    for headers in ({}, *wrong):
        with pytest.raises(InvalidStatus, match="403"):
            open_socket(server, **headers)


@pytest.mark.parametrize(
    "path",
    [
        "/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%5c..%5cetc/passwd",
        "//etc/passwd",
        "/C:/boot.ini",
    ],
)
def test_no_file_outside_the_page_is_sent(server, path):
    response = get(server, path, Cookie=cookie_of(server, ENTRANCE.visitor))
    assert response.status == 404
    assert b"root" not in response.text


@pytest.mark.parametrize("lets_in", [True, False])
def test_every_answer_forbids_other_sites(server, lets_in):
    headers = {"Cookie": cookie_of(server, ENTRANCE.visitor)} if lets_in else {}
    response = get(server, **headers)
    policy = dict(part.split(" ", 1) for part in response.headers["Content-Security-Policy"].split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == "'none'"
    assert f"ws://127.0.0.1:{server.get_port()}" in policy["connect-src"]
    assert not any("http" in sources or "*" in sources for sources in policy.values())
    assert response.headers["X-Content-Type-Options"] == "nosniff"


def test_scripts_are_files_of_the_server_or_known_by_their_hashes():
    page = app_page(lecture=False)
    with strict_headers(page.script_hashes), page.served():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        for path in ("/", "/?scene", "/nothing"):
            response = get(server, path)
            policy = dict(
                part.split(" ", 1) for part in response.headers["Content-Security-Policy"].split("; ")
            )
            wanted = {"'self'", "'wasm-unsafe-eval'", *page.script_hashes}
            assert set(policy["script-src"].split()) == wanted
            assert policy["object-src"] == policy["frame-src"] == policy["form-action"] == "'none'"
        inline = re.findall(rb"<script(?! defer src=)[^>]*>(.*?)</script>", get(server).text, re.DOTALL)
        digests = [b64encode(hashlib.sha256(one).digest()).decode() for one in inline]
        assert [f"'sha256-{one}'" for one in digests] == [page.script_hashes[0]]
    finally:
        server.stop()


def test_the_policy_holds_no_header_of_a_stranger(server):
    response = get(server, Host="127.0.0.1; script-src *")
    assert "script-src *" not in response.headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    ("host", "alone"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True)]
    + [(host, False) for host in ("0.0.0.0", "::", "192.168.1.7", "example.org", "localhost.evil.example")],
)
def test_only_loopback_needs_no_token(host, alone):
    assert is_loopback(host) == alone


@pytest.mark.parametrize(
    ("words", "with_token", "names"),
    [
        ((), True, ()),
        (("--no-token",), False, ()),
        (("--allow-host", "a.example", "--allow-host", "b.example"), True, ("a.example", "b.example")),
    ],
)
def test_the_command_passes_on_who_may_come_in(monkeypatch, words, with_token, names):
    asked, pools = [], []

    def refuse(*arguments, ahead):
        *_, token, pool, allow_hosts, _ = arguments
        asked.append((token, allow_hosts))
        pools.append(pool)
        raise InputError("not now")

    monkeypatch.setattr("app.server.build_server", refuse)
    with pytest.raises(SystemExit):
        main(["serve", "--host", "192.0.2.1", *words])
    assert asked == [(with_token, names)]
    with pytest.raises(RuntimeError, match="the pool is closed"):
        pools[0].submit("a", print, on_progress=print, on_end=print)


def test_a_file_is_too_large_too_many_or_more_than_it_said():
    gate = UploadGate()
    assert not gate.begins(MOST_BYTES + 1, 1, "large")
    assert not gate.begins(-1, 1, "negative")
    assert not gate.begins(9, 10**9, "parts")
    assert gate.begins(10, 2, "a")
    assert not gate.begins(10, 2, "a")
    assert gate.goes_on("a", 6)
    assert not gate.goes_on("a", 5)
    assert not gate.goes_on("unknown", 1)
    whole = (MOST_TOTAL_BYTES - 10) // MOST_BYTES
    assert all(gate.begins(MOST_BYTES, 1, f"b{k}") for k in range(whole))
    assert not gate.begins(MOST_BYTES, 1, "total")
    quick = UploadGate()
    assert all(quick.begins(0, 0, str(k)) for k in range(MOST_A_MINUTE))
    assert not quick.begins(0, 0, "one more")


def test_parts_of_unknown_files_are_not_kept_and_empty_parts_are_bounded(monkeypatch):
    gate = UploadGate()
    assert not any(gate.goes_on(f"unknown {k}", 0) for k in range(1000))
    assert not gate._left
    monkeypatch.setattr("app.web.upload_gate.MOST_A_MINUTE", 10**6)
    assert sum(gate.begins(0, 0, f"empty {k}") for k in range(10)) == 10
    most = MOST_TOTAL_BYTES // LEAST_PART_BYTES - 10
    assert not gate.begins(most, most + 1, "parts")
    assert gate.begins(most, most, "parts")
    assert not gate.begins(0, 0, "one more")


def test_only_parts_of_accepted_files_are_awaited():
    gate = UploadGate()
    gate.begins(10, 2, "a")
    gate.goes_on("a", 6)
    assert [gate.awaits(transfer) for transfer in ("a", "b", ["a"], None)] == [True, False, False, False]
    gate.goes_on("a", 5)
    assert not gate.awaits("a")
    gate.begins(10, 3, "empty parts")
    assert [gate.goes_on("empty parts", size) for size in (0, 0, 10, 0)] == [True, True, True, False]
    assert not gate.awaits("empty parts")


def test_an_upload_makes_room_for_another_when_it_is_a_minute_old(monkeypatch):
    clock = SimpleNamespace(now_s=1000.0, monotonic=lambda: clock.now_s)
    monkeypatch.setattr("app.web.upload_gate.time", clock)
    gate, names = UploadGate(), map(str, count())
    for k in range(MOST_A_MINUTE):
        clock.now_s = 1000.0 + k / 8
        assert gate.begins(0, 0, next(names))
    for clock.now_s, may in ((1059.99, False), (1060.0, True), (1060.0, False), (1060.125, True)):
        assert gate.begins(0, 0, next(names)) == may
    clock.now_s = 1000.0 + (MOST_A_MINUTE - 1) / 8 + 60.0
    assert sum(gate.begins(0, 0, next(names)) for _ in range(MOST_A_MINUTE)) == MOST_A_MINUTE - 2


def test_what_is_too_much_is_not_kept():
    told, got = [], []
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    gate = Gate(server)
    gate.on_too_much = lambda _, sentence: told.append(sentence)
    try:

        @server.on_client_connect
        def _(client):
            client.gui.add_upload_button("File").on_upload(
                lambda event: got.append(event.target.value.content)
            )

        with contextlib.closing(Connection(f"http://127.0.0.1:{server.get_port()}")) as browser:
            wait_for(lambda: "File" in browser.uuids)
            button = browser.uuids["File"][0]

            def send(transfer, said, *parts):
                browser.send(
                    messages.FileTransferStartUpload(button, transfer, "../../x", "", len(parts), said)
                )
                for index, part in enumerate(parts):
                    browser.send(messages.FileTransferPart(button, transfer, index, part))

            send("large", MOST_BYTES + 1, b"x")
            send("more", 2, b"x", b"more")
            send("good", 2, b"o", b"k")
            wait_for(lambda: bool(got))
            assert got == [b"ok"]
            assert told == [REFUSED]
    finally:
        server.stop()

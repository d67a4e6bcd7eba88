"""Requests that are not well formed get 400 or 403, and the server goes on."""

import socket

import pytest

from app.server import build_server

pytestmark = pytest.mark.xdist_group("attack")
KEY = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\nConnection: Upgrade\r\n"


@pytest.fixture(scope="module")
def port():
    app = build_server("box-on-table", port=0)
    yield app.viser_server.get_port()
    app.stop()


def ask(port, head):
    """The first line of the answer to a request as it is written here; empty without one."""
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as one:
        one.sendall(head.replace("PORT", str(port)).encode("latin-1"))
        answer = b""
        while b"\r\n" not in answer and (part := one.recv(4096)):
            answer += part
    return answer.partition(b"\r\n")[0].decode("latin-1")


HOST = "Host: 127.0.0.1:PORT\r\n"
BAD = {
    "two hosts": f"GET / HTTP/1.1\r\n{HOST}{HOST}\r\n",
    "two hosts, one foreign": f"GET / HTTP/1.1\r\n{HOST}Host: evil.example\r\n\r\n",
    "two origins": f"GET / HTTP/1.1\r\n{HOST}Origin: http://a\r\nOrigin: http://b\r\n\r\n",
    "two upgrades": f"GET / HTTP/1.1\r\n{HOST}Upgrade: websocket\r\nUpgrade: h2c\r\n\r\n",
    "two cookies": f"GET / HTTP/1.1\r\n{HOST}Cookie: a=b\r\nCookie: c=d\r\n\r\n",
    "an open bracket": "GET / HTTP/1.1\r\nHost: [::1\r\n\r\n",
    "a bracket in the origin": f"GET / HTTP/1.1\r\n{HOST}Origin: http://[\r\n\r\n",
    "no host": "GET / HTTP/1.1\r\n\r\n",
    "an empty host": "GET / HTTP/1.1\r\nHost:\r\n\r\n",
    "a foreign host": "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n",
    "a host with a name": "GET / HTTP/1.1\r\nHost: user@127.0.0.1\r\nOrigin: http://evil\r\n\r\n",
    "a port that is none": "GET / HTTP/1.1\r\nHost: evil.example:x\r\n\r\n",
    "a bracket in the path": f"GET //[ HTTP/1.1\r\n{HOST}\r\n",
    "an upgrade of two hosts": f"GET / HTTP/1.1\r\n{HOST}{HOST}Upgrade: websocket\r\n{KEY}\r\n",
    "bytes in a header": f"GET / HTTP/1.1\r\n{HOST}Cookie: \xff\xfe\r\n\r\n",
}


@pytest.mark.parametrize("kind", BAD)
def test_a_request_that_is_not_well_formed_is_refused_and_the_next_is_answered(port, kind):
    status = ask(port, BAD[kind])
    assert "500" not in status
    assert status.split(" ")[1:2] in (["400"], ["403"], ["404"]) or kind == "bytes in a header"
    assert ask(port, f"GET / HTTP/1.1\r\n{HOST}\r\n").endswith("200 OK")


@pytest.mark.parametrize(
    "line",
    [
        "POST / HTTP/1.1",
        "HEAD / HTTP/1.1",
        "GET / HTTP/1.0",
        "GET /",
        "\x00\x01\x02",
        "GET / HTTP/9.9",
        "get / http/1.1",
    ],
)
def test_what_is_no_request_for_a_page_is_no_error_of_the_server(port, line):
    assert "500" not in ask(port, f"{line}\r\n{HOST}\r\n")
    assert ask(port, f"GET / HTTP/1.1\r\n{HOST}\r\n").endswith("200 OK")


@pytest.mark.parametrize(
    "path",
    [
        *("/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2fetc/passwd"),
        *("/..\\..\\etc\\passwd", "//etc/passwd", "/%00", "/assets/../../x"),
    ],
)
def test_no_path_leads_out_of_the_pages_folder(port, path):
    assert ask(port, f"GET {path} HTTP/1.1\r\n{HOST}\r\n").split(" ")[1] in ("400", "404")

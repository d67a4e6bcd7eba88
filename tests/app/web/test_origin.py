"""Pages of other sites get nothing from the server, its own page everything."""

import asyncio
import http.client

import pytest
import viser
import websockets

from app.web.origin import is_own, only_own_page


@pytest.fixture(scope="module")
def port():
    with only_own_page():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.get_port()
    server.stop()


def get(port, host):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", "/", headers={"Host": host})
    status = connection.getresponse().status
    connection.close()
    return status


def connect(port, origin):
    """Open a websocket as a page of that origin does."""

    async def attempt():
        protocol = f"viser-v{viser.__version__}"
        async with websockets.connect(
            f"ws://127.0.0.1:{port}", origin=origin, subprotocols=[protocol], proxy=None
        ) as connection:
            assert connection.subprotocol == protocol

    asyncio.run(attempt())


def test_a_page_of_this_server_connects(port):
    connect(port, f"http://127.0.0.1:{port}")


def test_a_program_that_is_no_page_connects(port):
    connect(port, None)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "https://127.0.0.1:1", "http://localhost.evil.example:{port}", "null"]
)
def test_a_page_of_another_site_is_refused(port, origin):
    with pytest.raises(websockets.InvalidStatus, match="403"):
        connect(port, origin.format(port=port))


def test_a_name_that_is_made_to_point_here_is_refused(port):
    assert get(port, f"evil.example:{port}") == 403
    assert get(port, f"127.0.0.1:{port}") == 200
    assert get(port, f"localhost:{port}") == 200


@pytest.mark.parametrize("host", ["192.168.1.7:8080", "[::1]:8080", "localhost", "LOCALHOST:9"])
def test_addresses_and_localhost_are_this_machine(host):
    assert is_own({"Host": host})
    assert is_own({"Host": host, "Origin": f"http://{host}"})
    assert not is_own({"Host": host, "Origin": "http://evil.example"})


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:8080", ""])
def test_other_names_are_not(host):
    assert not is_own({"Host": host})


def test_a_request_without_a_host_is_refused():
    assert not is_own({"Origin": "http://127.0.0.1:8080"})

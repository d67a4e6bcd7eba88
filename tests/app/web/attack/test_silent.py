"""Connections that send nothing are bounded in number and time, on a real server."""

import sys
from contextlib import ExitStack, closing
from pathlib import Path

import msgspec
import pytest
import viser
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed

sys.path.insert(0, str(Path(__file__).parent))
from attacker import receive, silent_connection

from app.load.connection import Connection, wait_for
from app.web import silent
from app.web.gate import Gate
from app.web.silent import limit_silent
from app.web.viser_private import TRY_AGAIN


@pytest.fixture
def server():
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.gate = Gate(server)
    limit_silent(server)
    server.url = f"http://127.0.0.1:{server.get_port()}"
    yield server
    server.stop()


def close_code(connection):
    """The code with which the server closes a connection."""
    with pytest.raises(ConnectionClosed) as closed:
        receive(connection)
    return closed.value.rcvd.code


def test_one_too_many_closes_the_longest_silent_and_no_page(server, monkeypatch):
    monkeypatch.setattr(silent, "MOST_SILENT", 3)
    with closing(Connection(server.url)) as page, ExitStack() as stack:
        wait_for(lambda: server.get_clients())
        first, *others = [stack.enter_context(silent_connection(server.url)) for _ in range(4)]
        assert close_code(first) == TRY_AGAIN
        wait_for(lambda: len(server._websock_server._live_connections) == 4)
        assert {one.state.name for one in others} == {"OPEN"}
        assert not page.lost


def test_a_connection_that_sends_no_view_is_closed_after_a_while_and_leaves_nothing(server, monkeypatch):
    upload = server.gui.add_upload_button("File")
    with closing(Connection(server.url)) as page:
        wait_for(lambda: server.get_clients())
        monkeypatch.setattr(silent, "SILENT_S", 0.3)
        with silent_connection(server.url) as other:
            for message in (
                messages.FileTransferStartUpload(upload._impl.uuid, "transfer", "name", "", 2, 2),
                messages.FileTransferPart(upload._impl.uuid, "transfer", 0, b"x"),
            ):
                other.send(msgspec.msgpack.encode(message.as_serializable_dict()))
            assert close_code(other) == TRY_AGAIN
        assert not page.lost
        wait_for(lambda: len(server.gate._guests) == 1)
    wait_for(lambda: not server.gate._guests)
    assert server.gui._current_file_upload_states == {}

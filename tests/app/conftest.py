"""What the tests of the app share."""

import pytest
import viser

from app.compute.store import Store


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """An empty store for the tests of one file."""
    return Store(str(tmp_path_factory.mktemp("store")))


@pytest.fixture(scope="module")
def server():
    """A server that nobody visits."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()

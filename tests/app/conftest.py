"""What the tests of the app share."""

import pytest
import viser

from app.compute.store import Store


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    """A store that all tests share, so that what one has computed is there for the others."""
    return Store(str(tmp_path_factory.mktemp("store")))


@pytest.fixture(scope="module")
def server():
    """A server that nobody visits."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()

"""What the tests of the app share."""

import pytest
import viser


@pytest.fixture(scope="module")
def server():
    """A server that nobody visits."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()

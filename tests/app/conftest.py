"""What the tests of the app share."""

import pytest

from app.store import Store


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """An empty store for the tests of one file."""
    return Store(str(tmp_path_factory.mktemp("store")))

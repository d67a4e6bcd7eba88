"""What every test may use."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # more only spin when tests run side by side

from pathlib import Path

import hypothesis
import pytest

from tests.paths import ROOT

hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")


LONGEST_ID = 60


def pytest_make_parametrize_id(val):
    """Long texts and files are called by their beginning: every worker is sent all names of tests, and one
    had 65 MB.
    """
    if isinstance(val, bytes | str) and len(val) > LONGEST_ID:
        return f"{val[:20]!a} and so on"
    return None


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder with real frames, which lies outside the repository."""
    folder = Path(os.environ.get("PACKETMESH_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real data at {folder}; set PACKETMESH_SHARED_DATA")
    return folder

"""What every test may use."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # more only spin when tests run side by side

from pathlib import Path

import hypothesis
import pytest

from tests.paths import ROOT

hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder with real frames, which lies outside the repository."""
    folder = Path(os.environ.get("PACKETMESH_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real data at {folder}; set PACKETMESH_SHARED_DATA")
    return folder

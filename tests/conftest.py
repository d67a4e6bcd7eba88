"""What every test may use."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # more only spin when tests run side by side

from fnmatch import fnmatch
from pathlib import Path

import hypothesis
import pytest

from tests.paths import ROOT

hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")


SLOW = (
    *("lab", "real", "bad_input", "app/cli", "app/lesson", "app/web/attack", "app/test_one_chain.py"),
    *("app/compute/test_ahead.py", "app/compute/test_faults.py", "app/screens/*/test_*panel.py"),
    *("app/screens/*/test_*jobs.py", "app/screens/*/test_lesson.py", "app/screens/surface/test_[bhsw]*.py"),
    *("app/screens/fuse/test_race*.py", "pipeline/calibration/test_[de]*.py", "pipeline/test_*.py"),
    *(
        "pipeline/calibration/test_rig*.py",
        "pipeline/depth/test_inference.py",
        "pipeline/placement/test_*.py",
    ),
    *(
        "pipeline/registration/test_[agpr]*.py",
        "pipeline/surface/test_baselines.py",
        "packetmesh/test_[ei]*.py",
    ),
)
"""Files below ``tests`` that ``make test-fast`` leaves out: several seconds each."""
LONGEST_ID = 60


def pytest_collection_modifyitems(items):
    """Mark slow tests."""
    for item in items:
        path = item.path.relative_to(ROOT / "tests").as_posix()
        if any(path.startswith(f"{one}/") or fnmatch(path, one) for one in SLOW):
            item.add_marker(pytest.mark.slow)


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

"""What every test may use."""

import gc
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # more only spin when tests run side by side

from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import hypothesis
import pytest

from tests.paths import ROOT

hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")


SLOW = (
    *("lab", "real", "bad_input", "app/cli", "app/lesson", "app/web/attack", "app/test_one_chain.py"),
    *("app/compute/test_ahead.py", "app/compute/test_faults.py", "app/screens/*/test_*panel.py"),
    *(
        "app/screens/*/test_*jobs.py",
        "app/screens/*/test_measures.py",
        "app/screens/*/test_lesson.py",
        "app/screens/surface/test_[bhsw]*.py",
    ),
    *("app/screens/fuse/test_race*.py", "pipeline/calibration/test_[de]*.py", "pipeline/test_*.py"),
    *(
        "pipeline/calibration/test_rig*.py",
        "pipeline/depth/test_inference.py",
        "pipeline/placement/test_*.py",
    ),
    *(
        "pipeline/pairs/test_found.py",
        "pipeline/registration/finding/test_search.py",
        "pipeline/registration/test_[agpr]*.py",
        "pipeline/surface/test_baselines.py",
        "packetmesh/test_[ei]*.py",
    ),
)
"""Files below ``tests`` that ``make test-fast`` leaves out: several seconds each."""
APART = ("test_table.py", "test_fuzz.py")
"""Slow files of many tests that share little."""
LONGEST_ID = 60


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for garbage neither while thousands of lasting tests are made, nor later among them."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)  # pytest-xdist looks at the groups afterwards
def pytest_collection_modifyitems(items):
    """Mark slow tests. Begin with the browser, beside which others compute, then with slow tests, so that no
    worker is left with one in the end. The tests of a file stay on one worker, which makes once what they
    share.
    """
    for item in items:
        if _slow(item.path):
            item.add_marker(pytest.mark.slow)
        if item.path.name not in APART and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(_below(item.path)))
    items.sort(key=lambda item: (not _below(item.path).startswith("browser/"), not _slow(item.path)))


@cache
def _slow(path):
    below = _below(path)
    return any(below.startswith(f"{one}/") or fnmatch(below, one) for one in SLOW)


@cache
def _below(path):
    return path.relative_to(ROOT / "tests").as_posix()


def pytest_make_parametrize_id(val):
    """Long texts and files are called by their beginning: every worker is sent all names of tests, and one
    had 65 MB.
    """
    if isinstance(val, bytes | str) and len(val) > LONGEST_ID:
        return f"{val[:20]!a} and so on"
    return None


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    """A store that all tests share, so that what one has computed is there for the others: of all workers,
    whose temporary folders lie beside each other.
    """
    from app.compute.store import Store

    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    (folder / "store").mkdir(exist_ok=True)
    return Store(str(folder / "store"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder with real frames, which lies outside the repository."""
    folder = Path(os.environ.get("PACKETMESH_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real data at {folder}; set PACKETMESH_SHARED_DATA")
    return folder

"""The store keeps results by what they depend on, within its limit, and survives damage."""

import os
import pickle
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from app.compute.store import Store
from packetmesh.progress import Progress, drain


def counted(store, key, value):
    """The result for a key, and how often it was computed for that."""
    calls = []

    def compute():
        calls.append(key)
        yield Progress("computing", 0.5)
        return value

    return drain(store.remember(key, compute)), len(calls)


def files(store):
    return sorted(path for path in Path(store.folder).iterdir() if path.is_file())


def size(store):
    return sum(path.stat().st_size for path in files(store))


def use_in_order(paths):
    """Make the first of the files the one that was unused for longest."""
    for age, path in enumerate(paths):
        os.utime(path, (1e9 + age, 1e9 + age))


def test_a_result_is_computed_once_and_others_beside_it(tmp_path):
    store = Store(str(tmp_path))
    assert counted(store, ("stage", 1), "one") == ("one", 1)
    assert counted(store, ("stage", 1), "one") == ("one", 0)
    assert counted(store, ("stage", 2), "two") == ("two", 1)
    assert counted(store, ("stage", 1), "one") == ("one", 0)  # no longer the newest of its stage
    assert counted(store, ("other", 1), "three") == ("three", 1)


def test_another_process_finds_it(tmp_path):
    counted(Store(str(tmp_path)), ("stage", "key"), [1, 2, 3])
    script = (
        "import sys; from app.compute.store import Store; from packetmesh.progress import drain\n"
        "def refuse():\n    raise SystemExit('computed again')\n    yield\n"
        "print(drain(Store(sys.argv[1]).remember(('stage', 'key'), refuse)))"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "[1, 2, 3]\n"


def test_reports_are_passed_on_and_an_abandoned_computation_leaves_nothing(tmp_path):
    store = Store(str(tmp_path))

    def compute():
        yield Progress("first", 0.1)
        yield Progress("second", 0.9)
        return "never"

    steps = store.remember(("stage", 0), compute)
    assert next(steps).stage == "first"
    steps.close()
    assert files(store) == []
    assert counted(store, ("stage", 0), "now") == ("now", 1)


def test_an_error_is_not_kept(tmp_path):
    store = Store(str(tmp_path))

    def fail():
        raise ValueError("no")
        yield

    with pytest.raises(ValueError, match="no"):
        drain(store.remember(("stage", 0), fail))
    assert counted(store, ("stage", 0), "now") == ("now", 1)


@pytest.mark.parametrize("folders", [0, 2])
def test_the_limit_holds_and_the_ones_unused_for_longest_go(tmp_path, folders):
    """Folders of uploads lie beside the results and are neither counted nor touched."""
    for index in range(folders):
        upload = tmp_path / f"upload-{index}"
        upload.mkdir()
        (upload / "color.png").write_bytes(bytes(5_000))
    store = Store(str(tmp_path), limit_bytes=3_500)
    for index in range(3):
        counted(store, (f"stage {index}", 0), bytes(1_000))
    oldest, middle, newest = sorted(files(store), key=lambda path: path.name)
    use_in_order([oldest, middle, newest])
    counted(store, ("stage 3", 0), bytes(1_000))
    assert size(store) <= 3_500
    assert not oldest.exists()
    assert middle.exists()
    assert newest.exists()
    for index in range(folders):
        assert (tmp_path / f"upload-{index}" / "color.png").stat().st_size == 5_000


def test_reading_counts_as_use(tmp_path):
    store = Store(str(tmp_path), limit_bytes=3_500)
    for key in range(3):
        counted(store, ("stage", key), bytes(1_000))
    use_in_order(sorted(files(store), key=lambda path: path.stat().st_mtime_ns))
    assert counted(store, ("stage", 0), None)[1] == 0  # the oldest, which is read again
    counted(store, ("stage", 3), bytes(1_000))
    assert counted(store, ("stage", 0), None)[1] == 0
    assert counted(store, ("stage", 1), bytes(1_000))[1] == 1


def test_a_result_larger_than_the_limit_is_given_all_the_same(tmp_path):
    store = Store(str(tmp_path), limit_bytes=100)
    assert counted(store, ("stage", 0), bytes(1_000)) == (bytes(1_000), 1)


@pytest.mark.parametrize(
    "damage",
    [b"", b"not a pickle", pickle.dumps(list(range(1000)))[:100], b"cno.such.module\nname\n."],
    ids=["empty", "noise", "cut off", "other code"],
)
def test_a_damaged_file_is_computed_again(tmp_path, damage):
    store = Store(str(tmp_path))
    counted(store, ("stage", 0), "good")
    counted(store, ("stage", 1), "newer")  # so that the first is not in memory any more
    for path in files(store):
        path.write_bytes(damage)
    assert counted(store, ("stage", 0), "good") == ("good", 1)


def test_damage_anywhere_is_noticed_and_the_result_is_never_a_wrong_one(tmp_path):
    """A flipped bit within an array would otherwise be read as another array."""
    rng = np.random.default_rng(0)
    value, store = rng.standard_normal(500), Store(str(tmp_path))
    counted(store, ("stage", 0), value)
    (path,) = files(store)
    whole = path.read_bytes()
    cut = [whole[:end] for end in np.linspace(0, len(whole) - 1, 20).astype(int)]
    flipped = [bytearray(whole) for _ in range(60)]
    for damaged, at in zip(flipped, rng.choice(len(whole), 60, replace=False), strict=True):
        damaged[at] ^= 1 << int(rng.integers(8))
    for damaged in (*cut, *flipped, whole + b"x", whole[4:], bytes(len(whole))):
        path.write_bytes(damaged)
        counted(store, ("stage", 1), "newer")  # so that the other is not in memory
        found, computed = counted(store, ("stage", 0), value)
        np.testing.assert_array_equal(found, value)
        assert computed == 1
    counted(store, ("stage", 1), "newer")
    assert counted(store, ("stage", 0), value)[1] == 0


def test_on_a_full_disk_results_are_given_and_no_part_of_a_file_is_kept(tmp_path):
    store = Store(str(tmp_path))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000, hard))
    try:
        assert counted(store, ("stage", 0), bytes(50_000)) == (bytes(50_000), 1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []


def test_with_the_clock_set_back_what_is_used_now_outlives_what_was_used_before(tmp_path):
    store = Store(str(tmp_path), limit_bytes=3_500)
    for key in range(3):
        counted(store, ("stage", key), bytes(1_000))
    for path in files(store):
        os.utime(path, (4e9, 4e9))
    for key in (3, 4, 5):
        counted(store, ("stage", key), bytes(1_000))
    assert [counted(store, ("stage", key), bytes(1_000))[1] for key in (3, 4, 5)] == [0, 0, 0]


def test_a_folder_that_cannot_be_written_costs_only_time(tmp_path):
    store = Store(str(tmp_path / "gone"))
    assert counted(store, ("stage", 0), "here") == ("here", 1)

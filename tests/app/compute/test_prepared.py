"""Results of the set-up: found by the program that made them, and by no other."""

import os
from pathlib import Path

import pytest

from app.compute import prepared
from app.compute.prepared import fingerprint, prepare, take_prepared
from app.compute.shared import kept
from app.compute.state import CHAIN, Spec
from app.compute.store import Store
from pipeline.sources import Demo

START = Spec(Demo("living-room"))


@pytest.fixture
def program(tmp_path, monkeypatch):
    """A program of one file and one picture, and the keys of the steps that were computed."""
    root, computed = tmp_path / "program", []
    for name, content in (("pipeline/stages.py", "radius = 1\n"), ("assets/color.png", "picture")):
        (root / name).parent.mkdir(parents=True)
        (root / name).write_text(content)

    def run_step(step, store, spec):
        computed.append(spec.key(step))
        store.put(kept(spec.key(step)), step)
        yield from ()

    monkeypatch.setattr(prepared, "ROOT", root)
    monkeypatch.setattr(prepared, "FOLDER", tmp_path / "prepared")
    monkeypatch.setattr(prepared.jobs, "run_step", run_step)
    return root, computed


def taken(folder):
    """The steps of the start settings that a new server finds in its store."""
    folder.mkdir()
    take_prepared(folder)
    return [Store(str(folder)).get(kept(START.key(step))) for step in CHAIN]


def test_what_the_set_up_computes_a_server_finds(program, tmp_path):
    prepare()
    assert program[1] == [START.key(step) for step in CHAIN]
    assert taken(tmp_path / "one") == list(CHAIN)
    prepare()
    assert len(program[1]) == len(CHAIN)
    assert [path.name for path in prepared.FOLDER.iterdir()] == [fingerprint()]


def test_what_a_server_deletes_the_next_one_still_finds(program, tmp_path):
    prepare()
    taken(tmp_path / "one")
    for path in (tmp_path / "one").iterdir():
        path.unlink()
    assert taken(tmp_path / "two") == list(CHAIN)


def test_results_on_another_disk_are_copied(program, tmp_path, monkeypatch):
    prepare()

    def refuse(*_):
        raise OSError(18, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", refuse)
    assert taken(tmp_path / "one") == list(CHAIN)


@pytest.mark.parametrize(
    "change",
    [
        lambda root: (root / "pipeline/stages.py").write_text("radius = 2\n"),
        lambda root: (root / "assets/color.png").write_text("Picture"),
        lambda root: (root / "assets/color.png").rename(root / "assets/depth.png"),
        lambda root: (root / "pipeline/new.py").touch(),
    ],
    ids=["code", "picture", "name", "one more file"],
)
def test_after_any_change_nothing_is_found_until_the_next_set_up(program, tmp_path, change):
    prepare()
    change(program[0])
    assert taken(tmp_path / "one") == [None] * len(CHAIN)
    prepare()
    assert taken(tmp_path / "two") == list(CHAIN)
    assert [path.name for path in prepared.FOLDER.iterdir()] == [fingerprint()]


def test_bytecode_is_no_change_but_a_package_of_another_version_is(program, tmp_path, monkeypatch):
    before = fingerprint()
    (program[0] / "pipeline/__pycache__").mkdir()
    (program[0] / "pipeline/__pycache__/stages.pyc").touch()
    assert fingerprint() == before
    packages = tmp_path / "packages"
    (packages / "numpy-2.4.0.dist-info").mkdir(parents=True)
    monkeypatch.setattr(prepared.sysconfig, "get_path", lambda name: str(packages))
    first = fingerprint()
    (packages / "numpy-2.4.0.dist-info").rename(packages / "numpy-2.4.1.dist-info")
    assert before != first != fingerprint()


def test_a_set_up_that_is_interrupted_leaves_nothing_to_find(program, tmp_path, monkeypatch):
    def fail(step, store, spec):
        store.put(kept(spec.key(step)), step)
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(prepared.jobs, "run_step", fail)
    with pytest.raises(KeyboardInterrupt):
        prepare()
    assert taken(tmp_path / "one") == [None] * len(CHAIN)
    assert Path(prepared.FOLDER).is_dir()


def test_without_a_set_up_a_server_finds_nothing(program, tmp_path):
    assert taken(tmp_path / "one") == [None] * len(CHAIN)


def test_a_damaged_result_counts_as_missing(program, tmp_path):
    prepare()
    for path in (prepared.FOLDER / fingerprint()).iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    assert taken(tmp_path / "one") == [None] * len(CHAIN)

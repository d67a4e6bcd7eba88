"""A disk that fills while a command writes, and run folders that a killed command left half written."""

import contextlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from app.cli.runs import RigTask, _inputs_of, reconstruct_one
from packetmesh.files import write_json
from packetmesh.settings import with_settings
from pipeline.config import PipelineConfig
from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.io.rigs import save_rig
from pipeline.types import PointCloud
from tests.app.commands import check_one_sentence, run
from tests.paths import ROOT
from tests.pipeline.delivery.small import small_rig

QUICK = ("--set", "surface.max_points=3000")
ROOM_BYTES = 10_000
FILES = {"config.json", "measuring.npz", "metrics.json", "poses.json", "report.html", "surface.glb"} | {
    f"{name}.ply" for name in ("sensor", "inferred", "fused", "surface_before", "surface_after")
}


@contextlib.contextmanager
def disk_with_room(size):
    """The system lets no file grow beyond a size; on a full disk a write fails alike.

    Python 3.11 would keep the truncated bytecode of modules that are imported meanwhile: none is written.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "dont_write_bytecode", True)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """One node."""
    folder = tmp_path_factory.mktemp("rig") / "office"
    save_rig(folder, replace(small_rig(nodes=1), truth=None))
    return folder


@pytest.fixture(scope="module")
def ellipsoid(tmp_path_factory):
    """Not a round one, whose pose would be anyone's guess."""
    path = tmp_path_factory.mktemp("cloud") / "ellipsoid.ply"
    points_m = np.random.default_rng(0).standard_normal((2000, 3))
    directions = points_m / np.linalg.norm(points_m, axis=1, keepdims=True)
    write_cloud(path, PointCloud(directions * (1.0, 0.6, 0.3)))
    return path


COMMANDS = {
    "reconstruct": lambda rig, cloud: ["--rig", rig, *QUICK, "--out"],
    "deliver": lambda rig, cloud: ["--rig", rig, "--moments", "1", *QUICK, "--out"],
    "plan": lambda rig, cloud: ["--rig", rig, "--where", "tripods", *QUICK, "--out"],
    "register": lambda rig, cloud: [cloud, cloud, "--method", "icp", "--out"],
    "mesh": lambda rig, cloud: [cloud, "--radii-m", "0.2", "--out"],
    "simulate": lambda rig, cloud: ["--preset", "thesis-link", "--out"],
    "infer-depth": lambda rig, cloud: [rig / "node_00" / "color.png", "--out"],
    "target": lambda rig, cloud: ["--out"],
}
"""The options of each command, the last of which names the output."""
AS_FILES = {"mesh": "mesh.ply", "target": "board.svg"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_disk_that_fills_is_one_sentence_and_leaves_nothing_half_written(
    capsys, rig, ellipsoid, tmp_path, command
):
    out = tmp_path / "out" / AS_FILES.get(command, "")
    options = COMMANDS[command](rig, ellipsoid)
    room = 1000 if command in AS_FILES else ROOM_BYTES
    with disk_with_room(room):
        got = run(capsys, command, *options, out)
    check_one_sentence((got[0], "", got[2]), 1, "delete something there")
    left = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert [path.name for path in left if path.name.startswith(".")] == []
    assert not {"metrics.json", "plan.json"} & {path.name for path in left}
    assert all(path.stat().st_size < room for path in left)
    if command == "reconstruct":
        assert not out.exists()


def killed_while_writing(rig, out):
    """``reconstruct``, killed as soon as the first of its files is there."""
    words = ["reconstruct", "--rig", str(rig), "--out", str(out), *QUICK]
    process = subprocess.Popen([sys.executable, "-m", "app.cli", *words], cwd=ROOT, stderr=subprocess.PIPE)
    end_s = time.monotonic() + 120.0
    while not (out / "config.json").exists() and process.poll() is None:
        assert time.monotonic() < end_s
        time.sleep(0.0005)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_killed_reconstruction_has_no_metrics_and_the_next_one_leaves_no_trace_of_it(capsys, rig, tmp_path):
    out = tmp_path / "out"
    assert killed_while_writing(rig, out) == -signal.SIGKILL
    assert not (out / "metrics.json").exists()
    (out / ".surface-0123abcd.glb").write_bytes(b"half")  # what it was writing, if it was
    assert run(capsys, "reconstruct", "--rig", rig, "--out", out, *QUICK)[0] == 0
    assert {path.name for path in out.iterdir()} == FILES
    assert len(read_cloud(out / "fused.ply")) > 1000


def test_a_run_over_an_older_one_leaves_none_of_its_surfaces(capsys, rig, tmp_path):
    out = tmp_path / "out"
    assert run(capsys, "reconstruct", "--rig", rig, "--out", out, *QUICK)[0] == 0
    too_small = ("surface.radius_rule=manual", "surface.radii_m=0.0001")
    run(capsys, "reconstruct", "--rig", rig, "--out", out, *QUICK, *too_small)
    meshes = {"surface_before.ply", "surface_after.ply", "surface.glb", "measuring.npz"}
    assert {path.name for path in out.iterdir()} == FILES - meshes


DAMAGE = {
    "no metrics": lambda out: (out / "metrics.json").unlink(),
    "half the metrics": lambda out: os.truncate(out / "metrics.json", 500),
    "other metrics": lambda out: (out / "metrics.json").write_text("[]"),
    "half a task": lambda out: os.truncate(out / "task.json", 20),
    "no rig": lambda out: (out / "task.json").write_text("null"),
}


@pytest.fixture(scope="module")
def task(rig, tmp_path_factory):
    """A rig of many, done once."""
    settings = with_settings(PipelineConfig(), QUICK[1:])
    task = RigTask("office", str(rig), str(tmp_path_factory.mktemp("many")), "packetmesh", settings, None)
    assert reconstruct_one(task).state == "done"
    assert reconstruct_one(task).state == "kept"
    return task


CHANGES = {
    "another image": lambda rig: os.utime(rig / "node_00" / "depth.png", ns=(1, 1)),
    "another node": lambda rig: shutil.copytree(rig / "node_00", rig / "node_01"),
}


class ComputedAgain(BaseException):
    """As it should be."""


def begun(*arguments):
    raise ComputedAgain


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_run_of_many_is_computed_again(task, tmp_path, monkeypatch, damage):
    out = tmp_path / "out"
    shutil.copytree(task.out, out)
    DAMAGE[damage](out)
    monkeypatch.setattr("app.cli.runs.iterate_run", begun)
    with pytest.raises(ComputedAgain):
        reconstruct_one(replace(task, out=str(out)))
    assert not (out / "task.json").exists()


@pytest.mark.parametrize("change", CHANGES)
def test_a_run_of_other_images_at_the_same_path_is_computed_again(task, tmp_path, monkeypatch, change):
    rig, out = tmp_path / "rig", tmp_path / "out"
    shutil.copytree(task.path, rig)
    shutil.copytree(task.out, out)
    moved = replace(task, path=str(rig), out=str(out))
    write_json(out / "task.json", _inputs_of(moved))
    assert reconstruct_one(moved).state == "kept"
    CHANGES[change](rig)
    monkeypatch.setattr("app.cli.runs.iterate_run", begun)
    with pytest.raises(ComputedAgain):
        reconstruct_one(moved)


def test_a_lack_of_memory_is_a_sentence_and_no_error_of_the_program(task, tmp_path, monkeypatch):
    def full(*arguments):
        raise MemoryError

    monkeypatch.setattr("app.cli.runs.iterate_run", full)
    outcome = reconstruct_one(replace(task, out=str(tmp_path / "out")))
    assert (outcome.state, outcome.sentence) == (
        "failed",
        "It was stopped, probably for lack of memory; try a smaller surface.max_points",
    )
    assert list(tmp_path.iterdir()) == []


def everything(folder):
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.mark.parametrize(
    "words",
    [
        ["reconstruct", "--recording", "scans/one", "--out", "scans/one"],
        ["reconstruct", "--rig", "scans/one", "--out", "scans/one/keyframes"],
        ["reconstruct", "--rigs", "scans", "--out", "scans"],
        ["deliver", "--rig", "scans/one", "--out", "scans/one"],
        ["deliver", "--scene", "office", "--out", "scans/one"],
        ["mesh", "cloud.ply", "--out", "cloud.ply"],
        ["register", "aligned.ply", "cloud.ply", "--out", "."],
        ["register", "cloud.ply", "cloud.ply", "--init", "transform.txt", "--out", "."],
        ["infer-depth", "room.png", "--sensor", "room_depth.png", "--out", "."],
    ],
)
def test_results_do_not_replace_what_they_are_made_from(capsys, ellipsoid, tmp_path, monkeypatch, words):
    """As Polycam's raw recordings, whose images are in keyframes/."""
    for name in ("images/1.jpg", "cameras/1.json", "depth/1.png"):
        (tmp_path / "scans/one/keyframes" / name).parent.mkdir(parents=True)
        (tmp_path / "scans/one/keyframes" / name).write_text(name)
    for name in ("cloud.ply", "aligned.ply"):
        shutil.copy(ellipsoid, tmp_path / name)
    np.savetxt(tmp_path / "transform.txt", np.eye(4))
    for name in ("room.png", "room_depth.png"):
        (tmp_path / name).write_text("an image")
    before = everything(tmp_path)
    monkeypatch.chdir(tmp_path)
    check_one_sentence(run(capsys, *words), 1, "would replace")
    assert everything(tmp_path) == before

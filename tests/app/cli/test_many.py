"""``reconstruct --rigs``: a folder of rigs and recordings, one bad, stopped and gone on with."""

import csv
import json
import shutil
from dataclasses import replace

import pytest

from app.cli.runs import RigTask, iterate_rigs, rigs_in
from packetmesh.errors import InputError, PacketMeshError
from packetmesh.progress import drain
from pipeline.config import PipelineConfig
from pipeline.io.demos import load_demo
from pipeline.io.rigs import is_rig, save_rig
from pipeline.types import Rig
from tests.app.commands import check_one_sentence, run
from tests.pipeline.delivery.small import small_frame, small_rig

QUICK = ("--set", "surface.max_points=3000")


@pytest.fixture(scope="module")
def rigs(tmp_path_factory):
    """A rig of one node, a recording of TUM's kind made from another node, and a rig without images."""
    folder = tmp_path_factory.mktemp("rigs")
    first, second = small_rig().frames
    save_rig(folder / "a-rig", Rig("a", (first,)))
    save_rig(folder / "made", Rig("b", (second,)))
    tum = folder / "b-recording"
    for kind, name in (("rgb", "color.png"), ("depth", "depth.png")):
        (tum / kind).mkdir(parents=True)
        shutil.copy(folder / "made" / "node_00" / name, tum / kind / "1.000000.png")
        (tum / f"{kind}.txt").write_text(f"# {kind}\n1.000000 {kind}/1.000000.png\n")
    shutil.copy(folder / "made" / "node_00" / "intrinsics.json", tum / "intrinsics.json")
    shutil.rmtree(folder / "made")
    (folder / "c-empty" / "node_00").mkdir(parents=True)
    (folder / "notes.txt").write_text("no rig")
    return folder


def run_here(do, tasks, *_, **__):
    """In place of ``run_batch`` where it is not the processes that matter."""
    return enumerate(map(do, tasks))


@pytest.fixture
def in_this_process(monkeypatch):
    monkeypatch.setattr("app.cli.runs.run_batch", run_here)


def table(out):
    return {row["name"]: row for row in csv.DictReader((out / "rigs.csv").read_text().splitlines())}


def test_every_good_one_is_done_and_a_bad_one_gets_a_sentence(capsys, rigs, tmp_path):
    out = tmp_path / "out"
    words = ["reconstruct", "--rigs", rigs, "--out", out, "--depth-scale", "1000", *QUICK]
    code, printed, err = run(capsys, *words)
    assert code == 1
    rows = table(out)
    assert [row["state"] for row in rows.values()] == ["done", "done", "failed"]
    assert "node_00" in rows["c-empty"]["sentence"]
    assert "Traceback" not in err
    assert err.splitlines()[-1] == f"2 of 3 rigs reconstructed; see {out / 'rigs.html'}"
    assert [line.split()[0] for line in printed.splitlines()] == ["rig", "a-rig", "b-recording", "c-empty"]
    for name in ("a-rig", "b-recording"):
        metrics = json.loads((out / name / "metrics.json").read_text())
        assert float(rows[name]["no_hit_after"]) == metrics["surface_after"]["no_hit_ray_share"]
        assert (out / name / "report.html").exists()
    assert is_rig(out / "b-recording" / "imported")
    page = (out / "rigs.html").read_text()
    assert page.count("data:image/jpeg;base64") == 2
    assert 'href="a-rig/report.html"' in page


def test_the_same_again_goes_on_and_other_settings_begin_anew(capsys, rigs, tmp_path, in_this_process):
    out = tmp_path / "out"
    words = ["reconstruct", "--rigs", rigs, "--out", out, "--depth-scale", "1000"]
    run(capsys, *words, *QUICK)
    (out / "b-recording" / "task.json").unlink()  # as if stopped in the middle of it
    written = (out / "a-rig" / "metrics.json").stat().st_mtime_ns
    code, printed, _ = run(capsys, *words, *QUICK, "--json")
    assert code == 1
    assert [row["state"] for row in json.loads(printed)] == ["kept", "done", "failed"]
    assert (out / "a-rig" / "metrics.json").stat().st_mtime_ns == written
    _, printed, _ = run(capsys, *words, "--set", "surface.max_points=2500", "--json")
    assert [row["state"] for row in json.loads(printed)] == ["done", "done", "failed"]


def test_a_cluster_of_two_workers_gives_the_same_surfaces(capsys, rigs, tmp_path, monkeypatch):
    """The workers stand in folders of their own; paths hold for all of them."""
    distributed = pytest.importorskip("distributed", reason="needs the package distributed")
    shutil.copytree(rigs, tmp_path / "rigs")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        monkeypatch.chdir(tmp_path)
        words = ["reconstruct", "--rigs", "rigs", "--depth-scale", "1000", *QUICK, "--json"]
        code, spread, _ = run(capsys, *words, "--out", "spread", "--scheduler", cluster.scheduler_address)
    assert code == 1
    monkeypatch.setattr("app.cli.runs.run_batch", run_here)
    _, local, _ = run(capsys, *words, "--out", "local")
    rows = json.loads(spread)
    assert [row["state"] for row in rows] == ["done", "done", "failed"]
    for row, own in zip(rows, json.loads(local), strict=True):
        assert row | {"elapsed_s": 0.0} == own | {"elapsed_s": 0.0}


def test_an_error_of_the_program_and_a_rig_that_failed_are_rows_and_the_table_is_written(
    capsys, rigs, tmp_path, monkeypatch, in_this_process
):
    """Two rooms are no rig; an exception that nobody foresaw leaves a log; both are not done twice."""
    rooms = (load_demo(scene).frames[0] for scene in ("office", "living-room"))
    two = (replace(small_frame(frame), pose_known=False) for frame in rooms)
    folder = tmp_path / "rigs"
    shutil.copytree(rigs / "a-rig", folder / "a-rig")
    save_rig(folder / "b-strangers", Rig("b", tuple(two)))
    out = tmp_path / "out"
    words = ["reconstruct", "--rigs", folder, "--out", out, *QUICK]
    with monkeypatch.context() as broken:
        broken.setattr("pipeline.stages.acquire", nothing)
        code, _, err = run(capsys, *words)
    assert code == 1
    assert "Traceback" not in err
    rows = table(out)
    assert {row["state"] for row in rows.values()} == {"failed"}
    assert "ZeroDivisionError" in rows["a-rig"]["sentence"]
    assert "ZeroDivisionError" in (out / "a-rig.log").read_text()
    run(capsys, *words)
    rows = table(out)
    assert [row["state"] for row in rows.values()] == ["done", "failed"]
    assert "No two nodes could be placed relative to each other" in rows["b-strangers"]["sentence"]
    assert not (out / "a-rig.log").exists()
    written = (out / "b-strangers" / "metrics.json").stat().st_mtime_ns
    _, printed, _ = run(capsys, *words, "--json")
    assert [row["state"] for row in json.loads(printed)] == ["kept", "failed"]
    assert (out / "b-strangers" / "metrics.json").stat().st_mtime_ns == written


def test_the_table_is_written_of_what_was_done_when_the_rest_cannot_be(rigs, tmp_path, monkeypatch):
    def lost(do, tasks, *_, **__):
        yield 0, do(tasks[0])
        raise PacketMeshError("The cluster was lost")

    monkeypatch.setattr("app.cli.runs.run_batch", lost)
    chain = "packetmesh", PipelineConfig(), None
    tasks = [RigTask(n, str(rigs / n), str(tmp_path / n), *chain) for n in ("c-empty", "a-rig")]
    with pytest.raises(PacketMeshError, match="lost"):
        drain(iterate_rigs(tasks, tmp_path, None))
    assert list(table(tmp_path)) == ["c-empty"]


def nothing(frame, config):
    return 1 / 0


def test_what_is_taken_for_a_rig(rigs, tmp_path):
    assert [path.name for path in rigs_in(rigs)] == ["a-rig", "b-recording", "c-empty"]
    with pytest.raises(InputError, match="is no folder"):
        rigs_in(tmp_path / "nowhere")
    with pytest.raises(InputError, match="holds no rig"):
        rigs_in(tmp_path)


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--rigs", "x", "--scene", "office"], 2, "--rigs takes no other images"),
        (["--scene", "office", "--scheduler", "tcp://localhost:1"], 2, "--scheduler is for many rigs"),
        (["--rigs", "nowhere"], 1, "is no folder"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_leaves_no_folder(capsys, tmp_path, words, code, says):
    check_one_sentence(run(capsys, "reconstruct", *words, "--out", tmp_path / "out"), code, says)
    assert not (tmp_path / "out").exists()

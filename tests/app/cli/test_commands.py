"""The command line as a user meets it: exit codes, one-sentence errors, JSON on stdout alone."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from lab import benchmarks
from lab.benchmarks.benchmark import Benchmark
from pipeline.io.clouds import read_cloud
from pipeline.io.demos import DEMOS
from pipeline.io.meshes import read_mesh
from tests.app.commands import check_one_sentence, run
from tests.paths import ASSETS

pytestmark = pytest.mark.xdist_group("cli")  # one worker makes the shared run once
PAIR = ASSETS / "scenes" / "box-on-table" / "node_00"


def pair(depth=PAIR / "depth.png"):
    """The options that name one RGB-D pair."""
    images = {"color": PAIR / "color.png", "depth": depth, "intrinsics": PAIR / "intrinsics.json"}
    return [word for name, path in images.items() for word in (f"--{name}", str(path))]


@pytest.fixture(scope="module")
def pair_run(tmp_path_factory):
    """One single-pair run, in its own process as a user would start it."""
    out = tmp_path_factory.mktemp("run")
    command = [sys.executable, "-m", "app.cli", "reconstruct", "--out", str(out), "--json", *pair()]
    finished = subprocess.run(
        [*command, "--set", "surface.max_points=8000"], capture_output=True, text=True, timeout=120
    )
    assert finished.returncode == 0, finished.stderr
    return out, json.loads(finished.stdout), finished.stderr


@pytest.mark.parametrize(
    ("command", "needs"),
    [
        (("calibrate", "--out", "cameras"), "needs images of a board"),
        (("calibrate", "--out", "cameras", "--rig"), "needs images of a board"),
        (("infer-depth", "--out", "depth"), "needs at least one photograph"),
        (("lesson", "check"), "needs a file"),
    ],
)
def test_a_command_without_its_files_names_them(capsys, tmp_path, monkeypatch, command, needs):
    monkeypatch.chdir(tmp_path)
    check_one_sentence(run(capsys, *command), 2, needs)
    assert not list(tmp_path.iterdir())


def test_json_is_the_only_thing_on_stdout_and_holds_what_is_promised(pair_run):
    _, metrics, stderr = pair_run
    assert {"scene", "preset", "nodes", "registration", "surface_before", "surface_after", "truth"} <= set(
        metrics
    )
    quality = {"radii_m", "vertices", "triangles", "no_hit_ray_share", "boundary_loops", "boundary_length_m"}
    quality |= {"hole_area_m2", "non_manifold_edges", "components", "area_m2"}
    assert quality <= set(metrics["surface_before"]) & set(metrics["surface_after"])
    assert metrics["truth"] is None
    assert metrics["registration"] == []
    assert metrics["nodes"][0]["alignment"]["mode"] == "local"
    assert metrics["surface_after"]["no_hit_ray_share"] < metrics["surface_before"]["no_hit_ray_share"]
    assert "after" in stderr


def test_every_promised_file_is_written_and_agrees_with_the_metrics(pair_run):
    out, metrics, _ = pair_run
    names = {"config.json", "measuring.npz", "metrics.json", "poses.json", "report.html", "surface.glb"}
    names |= {f"{name}.ply" for name in ("sensor", "inferred", "fused", "surface_before", "surface_after")}
    assert {path.name for path in out.iterdir()} == names
    assert json.loads((out / "metrics.json").read_text()) == metrics
    mesh = read_mesh(out / "surface_after.ply")
    assert (len(mesh.vertices_m), len(mesh.triangles)) == tuple(
        metrics["surface_after"][k] for k in ("vertices", "triangles")
    )
    fused, inferred = read_cloud(out / "fused.ply"), read_cloud(out / "inferred.ply")
    assert 0 < len(inferred) < len(fused)
    report = (out / "report.html").read_text()
    assert report.count("data:image/jpeg") == 9
    assert not re.search("https?:", report)


def test_a_written_config_repeats_the_run_bit_for_bit(pair_run, capsys, tmp_path):
    out, _, _ = pair_run
    again = tmp_path / "again"
    code, _, _ = run(capsys, "reconstruct", "--out", again, "--preset", out / "config.json", *pair())
    assert code == 0
    assert (again / "surface_after.ply").read_bytes() == (out / "surface_after.ply").read_bytes()
    assert (again / "fused.ply").read_bytes() == (out / "fused.ply").read_bytes()


def test_scenes_lists_every_demo(capsys):
    code, out, _ = run(capsys, "scenes", "--json")
    assert code == 0
    assert json.loads(out) == {name: scene.description for name, scene in DEMOS.items()}


def test_doctor_finds_this_machine_well(capsys):
    code, out, _ = run(capsys, "doctor", "--json")
    findings = json.loads(out)
    assert code == 0
    assert all(finding["ok"] for finding in findings.values())
    assert "Provider" in findings["depth network"]["detail"]


@pytest.mark.parametrize(
    ("argv", "code", "names"),
    [
        (["reconstruct", "--scene", "moon"], 1, "living-room"),
        (["reconstruct", "--scene", "office", "--preset", "these"], 1, "these"),
        (["reconstruct", "--scene", "office", "--set", "depth.x=1"], 1, "depth.x"),
        (["reconstruct"], 2, "--scene"),
        (["reconstruct", "--scene", "office", "--rig", "there"], 2, "--scene"),
        (["reconstruct", "--color", "a.png"], 2, "--intrinsics"),
        (["reconstruct", "--rig", "/no/such/rig"], 1, "/no/such/rig"),
        (["reproduce", "--only", "C99"], 1, "C99"),
        (["bench", "--only", "speed"], 1, "speed"),
    ],
)
def test_wrong_use_is_one_sentence_and_leaves_nothing_behind(capsys, tmp_path, argv, code, names):
    out_folder = tmp_path / "out"
    got = run(capsys, *argv, "--out", out_folder)
    check_one_sentence(got, code, names)
    assert got[2].count("\n") == 1
    assert not out_folder.exists() or not list(out_folder.iterdir())


def test_bench_tells_the_notes_of_a_case_below_its_times(capsys, monkeypatch, tmp_path):
    measured = Benchmark(1.5, {}, 10**7, notes=("one station", "no peer was found"))
    monkeypatch.setattr(benchmarks, "run_benchmarks", lambda only, cases: [("network", measured)])
    code, out, err = run(capsys, "bench", "--out", str(tmp_path), "--json")
    assert code == 0
    assert err == "network: 1.500 s (no peer), 10 MB at most\n  one station\n  no peer was found\n"
    assert json.loads(out)["network"]["notes"] == list(measured.notes)


def test_bench_leaves_memory_out_where_it_was_not_measured(capsys, monkeypatch, tmp_path):
    measured = Benchmark(1.5, {"peer": 2.0}, None)
    monkeypatch.setattr(benchmarks, "run_benchmarks", lambda only, cases: [("places", measured)])
    assert run(capsys, "bench", "--out", str(tmp_path))[2] == "places: 1.500 s (peer 2.000 s)\n"


def test_a_folder_that_cannot_be_written_is_named(capsys, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    code, _, err = run(capsys, "reconstruct", "--scene", "office", "--out", str(blocked / "out"))
    assert code == 1
    assert str(blocked) in err
    assert "Traceback" not in err


def test_depth_of_zeros_is_one_sentence(capsys, tmp_path):
    import cv2

    cv2.imwrite(str(tmp_path / "zeros.png"), np.zeros((480, 640), np.uint16))
    code, _, err = run(capsys, "reconstruct", "--out", tmp_path / "out", *pair(tmp_path / "zeros.png"))
    assert code == 1
    assert "zeros.png" in err
    assert err.count("\n") == 1


def test_help_needs_no_heavy_import():
    heavy = {"numpy", "open3d", "viser", "cv2", "scipy"}
    script = f"import sys, app.cli.commands; print({heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout == "set()\n"

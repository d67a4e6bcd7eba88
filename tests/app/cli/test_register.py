"""`packetmesh register` as a user meets it: any two clouds, any method, one sentence for what cannot be."""

import csv
import json

import numpy as np
import pytest

from app.cli.register import EXIT_CODES
from pipeline.io.clouds import read_cloud, write_cloud
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.kernels.open3d_runtime import o3d
from pipeline.registration import point_error_m
from pipeline.registration.methods import METHODS
from pipeline.registration.peers import available_peers
from pipeline.types import PointCloud
from tests.app import commands
from tests.pipeline.pairs.rooms import room

T_TRUE = rigid(rotation_exp(np.radians(4.0) * np.array([0.6, -0.48, 0.64])), [0.03, -0.02, 0.03])
KEYS = {"T_target_source", "iterations", "stop_reason", "rmse_m", "average_hausdorff_m", "elapsed_s"}
EVIDENCE = {"overlap_share", "on_surface_share", "seen_through_share", "height_over_noise", "stiffness"}


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "register", *argv)


def corner(seed: int, count: int = 1200) -> np.ndarray:
    """Three walls with a ball before them, in front of a camera at the origin."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0.0, 1.0, (2, count))
    zero = np.zeros_like(a)
    ball = rng.normal(size=(count // 3, 3))
    ball = 0.25 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0.6, 0.5, 0.55]
    faces = [np.stack(face, axis=1) for face in ((a, zero, b), (zero, a, b), (a, b, zero))]
    tilt = rotation_exp(np.array([0.6, -0.5, 0.3]))
    points_m = np.concatenate([*faces, ball]) @ tilt.T + [0.0, 0.2, 1.5]
    return points_m + rng.normal(scale=0.001, size=points_m.shape)


def painted(points_m: np.ndarray) -> np.ndarray:
    """Colours that change smoothly with the place."""
    return np.uint8(127.5 + 127.5 * np.sin(4.0 * points_m))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same place twice, 4 degrees and 5 cm apart, and the true pose."""
    folder = tmp_path_factory.mktemp("clouds")
    source_m, target_m = corner(1), corner(2)
    moved_m = apply(inverse(T_TRUE), source_m)
    write_cloud(folder / "source.ply", PointCloud(moved_m, painted(source_m)))
    write_cloud(folder / "target.ply", PointCloud(target_m, painted(target_m)))
    np.savetxt(folder / "truth.txt", T_TRUE)
    return folder


def test_a_run_leaves_its_pose_numbers_steps_and_cloud(capsys, tmp_path, files):
    source, target = files / "source.ply", files / "target.ply"
    code, out, _ = run(capsys, source, target, "--truth", files / "truth.txt", "--json", "--out", tmp_path)
    assert code == 0
    metrics = json.loads(out)
    assert metrics == json.loads((tmp_path / "metrics.json").read_text())
    assert set(metrics) == {"ceicp-a"}
    row = metrics["ceicp-a"]
    words = {"verdict", "verdict_reasons", "start"}
    assert set(row) == KEYS | EVIDENCE | words | {"point_error_m", "draws", "spread_m"}
    assert (row["verdict"], row["verdict_reasons"], row["start"]) == ("sure", [], "given")
    assert row["spread_m"] < 0.003
    assert row["on_surface_share"] > 0.95
    assert row["seen_through_share"] == 0.0
    assert row["point_error_m"] < 0.003
    T = np.loadtxt(tmp_path / "transform.txt")
    np.testing.assert_array_equal(T, row["T_target_source"])
    moved = read_cloud(tmp_path / "aligned.ply")
    np.testing.assert_allclose(moved.points_m, apply(T, read_cloud(source).points_m), atol=1e-6)
    np.testing.assert_array_equal(moved.colors, read_cloud(source).colors)
    with (tmp_path / "steps.csv").open() as file:
        steps = list(csv.DictReader(file))
    assert len(steps) == row["iterations"]
    np.testing.assert_array_equal(np.array(steps[-1]["T_target_source"].split(), float).reshape(4, 4), T)
    times_s = [float(step["elapsed_s"]) for step in steps]
    assert times_s == sorted(times_s)
    assert times_s[-1] == row["elapsed_s"]
    assert (
        json.loads((tmp_path / "config.json").read_text())["settings"]["node_registration.method"]
        == "ceicp-a"
    )


def test_all_methods_and_peers_are_set_side_by_side(capsys, tmp_path, files):
    clouds = (files / "source.ply", files / "target.ply")
    code, out, _ = run(capsys, *clouds, "--method", "all", "--truth", files / "truth.txt", "--out", tmp_path)
    assert code == 0
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert set(metrics) == {*METHODS, *available_peers()}
    assert [line.split()[0] for line in out.splitlines()] == ["method", *metrics]
    assert metrics["ceicp-a"]["point_error_m"] == min(
        metrics[name]["point_error_m"] for name in ("ceicp-a", "icp")
    )
    T = np.array(metrics["ceicp-a"]["T_target_source"])
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "transform.txt"), T)


def test_the_alias_and_other_formats_give_the_same_pose(capsys, tmp_path, files):
    source, target = (read_cloud(files / f"{name}.ply").points_m for name in ("source", "target"))
    np.savetxt(tmp_path / "source.csv", source, delimiter=",", header="x,y,z", comments="")
    np.savez(tmp_path / "target.npz", points=target)
    run(capsys, files / "source.ply", files / "target.ply", "--out", tmp_path / "ply")
    other = (tmp_path / "source.csv", tmp_path / "target.npz", "--method", "ceicp")
    assert run(capsys, *other, "--out", tmp_path / "other")[0] == 0
    first, second = (np.loadtxt(tmp_path / name / "transform.txt") for name in ("ply", "other"))
    np.testing.assert_array_equal(first, second)


def test_clouds_that_have_nothing_in_common_are_not_sure_in_words_json_and_exit_code(capsys, tmp_path):
    rng = np.random.default_rng(0)
    for name in ("one", "other"):
        np.savez(tmp_path / f"{name}.npz", points=rng.uniform(0.0, 1.0, (500, 3)))
    clouds = (tmp_path / "one.npz", tmp_path / "other.npz")
    code, out, err = run(capsys, *clouds, "--json", "--out", tmp_path / "out")
    row = json.loads(out)["ceicp-a"]
    assert code == EXIT_CODES[row["verdict"]]
    assert row["verdict"] in ("doubtful", "none")
    assert row["verdict_reasons"]
    assert err.splitlines()[-1] == f"The pose is {row['verdict']}: {'; '.join(row['verdict_reasons'])}"
    assert (tmp_path / "out" / "transform.txt").exists()


def test_a_cloud_far_away_is_found_by_its_features_and_the_way_is_said(capsys, tmp_path, files):
    """Fifty metres from a start pose that was given."""
    np.savez(tmp_path / "far.npz", points=read_cloud(files / "source.ply").points_m + 50.0)
    np.savetxt(tmp_path / "init.txt", np.eye(4))
    command = (tmp_path / "far.npz", files / "target.ply", "--init", tmp_path / "init.txt", "--json")
    code, out, err = run(capsys, *command, "--out", tmp_path / "out")
    assert code == 0
    row = json.loads(out)["ceicp-a"]
    assert row["start"] == "surfaces"
    T_true = T_TRUE @ rigid(np.eye(3), [-50.0, -50.0, -50.0])
    assert point_error_m(np.array(row["T_target_source"]), T_true, corner(1) + 50.0) < 0.005
    assert "The answer is 86" in err  # sqrt(3) x 50 m
    assert "from the start pose of --init" in err


def test_a_start_pose_a_voxel_and_a_gate_are_heeded(capsys, tmp_path, files):
    away = rigid(np.eye(3), [3.0, 0.0, 0.0])
    far = apply(inverse(away), read_cloud(files / "source.ply").points_m)
    np.savez(tmp_path / "far.npz", points=far)
    np.savetxt(tmp_path / "init.txt", away)
    command = (tmp_path / "far.npz", files / "target.ply", "--voxel-m", 0.03, "--gate-m", 0.2)
    code, _, _ = run(capsys, *command, "--init", tmp_path / "init.txt", "--out", tmp_path / "out")
    assert code == 0
    T = np.loadtxt(tmp_path / "out" / "transform.txt")
    assert point_error_m(T, T_TRUE @ away, far) < 0.005


def test_a_global_start_needs_no_start_pose(capsys, tmp_path, files):
    turn = rigid(rotation_exp(np.array([0.0, 1.2, 0.3])), [2.0, 1.0, -1.0])
    far = apply(inverse(turn), read_cloud(files / "source.ply").points_m)
    np.savez(tmp_path / "far.npz", points=far)
    command = (tmp_path / "far.npz", files / "target.ply", "--start", "global", "--out", tmp_path / "out")
    assert run(capsys, *command)[0] == 0
    assert point_error_m(np.loadtxt(tmp_path / "out" / "transform.txt"), T_TRUE @ turn, far) < 0.01


def test_a_scale_is_found(capsys, tmp_path, files):
    np.savez(tmp_path / "small.npz", points=read_cloud(files / "source.ply").points_m / 1.05)
    command = (tmp_path / "small.npz", files / "target.ply", "--scale", "--out", tmp_path / "out")
    assert run(capsys, *command, "--method", "icp")[0] == 0
    T = np.loadtxt(tmp_path / "out" / "transform.txt")
    assert np.cbrt(np.linalg.det(T[:3, :3])) == pytest.approx(1.05, abs=0.005)


def test_repeated_points_and_points_that_are_nan_or_astray_do_not_matter(capsys, tmp_path, files):
    points_m = read_cloud(files / "source.ply").points_m
    messy = np.concatenate([points_m, points_m[:2000], np.full((7, 3), np.nan), [[1e38, 0.0, 0.0]]])
    np.savez(tmp_path / "messy.npz", points=messy)
    for source, name in ((files / "source.ply", "clean"), (tmp_path / "messy.npz", "messy")):
        assert run(capsys, source, files / "target.ply", "--out", tmp_path / name)[0] == 0
    clean, messy = (np.loadtxt(tmp_path / name / "transform.txt") for name in ("clean", "messy"))
    np.testing.assert_array_equal(clean, messy)


def test_a_million_points_are_no_more_work_than_it_takes(capsys, tmp_path):
    np.savez(tmp_path / "source.npz", points=apply(inverse(T_TRUE), corner(1, 300_000)).astype(np.float32))
    np.savez(tmp_path / "target.npz", points=corner(2, 300_000).astype(np.float32))
    code, out, _ = run(
        capsys, tmp_path / "source.npz", tmp_path / "target.npz", "--json", "--out", tmp_path / "out"
    )
    assert code == 0
    T = np.array(json.loads(out)["ceicp-a"]["T_target_source"])
    assert point_error_m(T, T_TRUE, corner(1)) < 0.003


SQUARE = np.stack([*np.random.default_rng(0).uniform(0, 1, (2, 900)), np.full(900, 2.0)], axis=1)
BAD_SOURCES = {
    "three points": (corner(1)[:3], "3 distinct points; registration needs at least 6"),
    "one point often": (np.ones((500, 3)), "1 distinct points"),
    "all NaN": (np.full((500, 3), np.nan), "no point with finite"),
    "millimetres": (1000.0 * corner(1), "times as large as the other, as if it were in millimetres"),
    "microns": (1e6 * corner(1), "across, as if its numbers were millimetres"),
    "kilometres": (1e-5 * corner(1), "across, as if its numbers were kilometres"),
}


@pytest.mark.parametrize("case", BAD_SOURCES)
def test_a_cloud_that_cannot_be_registered_is_one_sentence(capsys, tmp_path, files, case):
    points_m, says = BAD_SOURCES[case]
    np.savez(tmp_path / "bad.npz", points=points_m)
    got = run(capsys, tmp_path / "bad.npz", files / "target.ply", "--out", tmp_path / "out")
    commands.check_one_sentence(got, 1, says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("method", ["ceicp-a", "icp", "open3d-point", "all"])
def test_planes_alone_are_refused_with_the_motion_they_leave_open(capsys, tmp_path, method):
    np.savez(tmp_path / "plane.npz", points=SQUARE)
    clouds = (tmp_path / "plane.npz", tmp_path / "plane.npz")
    got = run(capsys, *clouds, "--method", method, "--out", tmp_path / "out")
    commands.check_one_sentence(
        got, 1, "sliding in any direction perpendicular to z and turning about z changes nothing"
    )


def test_each_cloud_may_have_a_unit_of_its_own(capsys, tmp_path, files):
    moving = read_cloud(files / "source.ply")
    write_cloud(tmp_path / "mm.ply", PointCloud(1000.0 * moving.points_m))
    command = (tmp_path / "mm.ply", files / "target.ply", "--truth", files / "truth.txt", "--json")
    check = commands.check_one_sentence
    check(run(capsys, *command, "--out", tmp_path / "out"), 1, "try --metres-per-unit 0.001 1")
    code, out, _ = run(capsys, *command, "--metres-per-unit", 0.001, 1, "--out", tmp_path / "out")
    assert code == 0
    assert json.loads(out)["ceicp-a"]["point_error_m"] < 0.003


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["source.ply", "target.ply", "--metres-per-unit", "0", "1"], 1, "cannot be 0 metres in a unit"),
        (["source.ply", "missing.ply"], 1, "missing.ply does not exist"),
        (["source.ply", "cut.ply"], 1, "of its 4000 points"),
        (["source.ply", "target.ply", "--method", "magic"], 2, "ceicp-a, ceicp-r"),
        (["source.ply", "target.ply", "--init", "cut.ply"], 1, "pose file"),
        (["source.ply", "target.ply", "--scale", "--metric", "plane"], 1, "needs the point metric"),
        (["source.ply", "target.ply", "--gate-m", "-1"], 1, "gate_m"),
        (["source.ply", "target.ply", "--voxel-m", "0"], 1, "voxel size is 0"),
    ],
)
def test_wrong_use_is_one_sentence_and_leaves_nothing_behind(capsys, tmp_path, files, argv, code, says):
    (files / "cut.ply").write_bytes((files / "target.ply").read_bytes()[:20_000])
    argv = [files / word if word.endswith(".ply") else word for word in argv]
    commands.check_one_sentence(run(capsys, *argv, "--out", tmp_path / "out"), code, says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("value", [0.0, np.nan])
@pytest.mark.parametrize("count", [40, 4000])
@pytest.mark.parametrize("voxel", [(), ("--voxel-m", 0.02)])
def test_normals_that_are_unknown_are_estimated_with_a_sentence(
    capsys, caplog, tmp_path, files, value, count, voxel
):
    target = read_cloud(files / "target.ply").points_m
    normals = np.tile([0.6, 0.0, 0.8], (len(target), 1))
    normals[:count] = value
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(target))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    o3d.io.write_point_cloud(str(tmp_path / "bad.ply"), cloud)
    command = (files / "source.ply", tmp_path / "bad.ply", "--truth", files / "truth.txt", "--json", *voxel)
    code, out, _ = run(capsys, *command, "--out", tmp_path / "out")
    assert code == 0
    assert json.loads(out)["ceicp-a"]["point_error_m"] < 0.003
    assert f"normals of {count} of the {len(target)} points of the target cloud are zero" in caplog.text


def test_a_far_pair_keeps_its_place(capsys, tmp_path):
    away = rigid(np.eye(3), [5e5, 4.65e6, 300.0])
    source, target = apply(away @ inverse(T_TRUE), corner(1)), apply(away, corner(2))
    np.savetxt(tmp_path / "source.xyz", source, "%.6f")
    np.savetxt(tmp_path / "target.xyz", target, "%.6f")
    assert run(capsys, tmp_path / "source.xyz", tmp_path / "target.xyz", "--out", tmp_path / "out")[0] == 0
    T = np.loadtxt(tmp_path / "out" / "transform.txt")
    moved = o3d.io.read_point_cloud(str(tmp_path / "out" / "aligned.ply"))
    np.testing.assert_allclose(
        np.asarray(moved.points), apply(T, np.loadtxt(tmp_path / "source.xyz")), atol=1e-4
    )
    assert np.abs(np.asarray(moved.points) - apply(away, corner(1))).max() < 0.005


@pytest.mark.parametrize(("unit", "metres"), [("feet", 0.3048), ("inches", 0.0254), ("centimetres", 0.01)])
def test_units_are_named_and_the_remedy_works(capsys, tmp_path, files, unit, metres):
    np.savez(tmp_path / "other.npz", points=read_cloud(files / "source.ply").points_m / metres)
    command = (tmp_path / "other.npz", files / "target.ply", "--truth", files / "truth.txt", "--json")
    got = run(capsys, *command, "--out", tmp_path / "out")
    commands.check_one_sentence(
        got, 1, f"in {unit} and the other in metres; try --metres-per-unit {metres} 1"
    )
    code, out, _ = run(capsys, *command, "--metres-per-unit", metres, 1, "--out", tmp_path / "out")
    assert code == 0
    assert json.loads(out)["ceicp-a"]["point_error_m"] < 0.003


def test_a_mirrored_source_is_named(capsys, tmp_path):
    np.savez(tmp_path / "left.npz", points=room(1, 1500) * [-1.0, 1.0, 1.0])
    np.savez(tmp_path / "right.npz", points=room(2, 1500))
    code, _, err = run(capsys, tmp_path / "left.npz", tmp_path / "right.npz", "--out", tmp_path / "out")
    assert code == EXIT_CODES["doubtful"]
    assert "The pose is doubtful: " in err
    assert "one cloud is mirrored, since with x negated the source fits" in err


def test_columns_may_be_given_once_or_for_each_cloud(capsys, tmp_path, files):
    source, target = (read_cloud(files / f"{name}.ply").points_m for name in ("source", "target"))
    np.savetxt(tmp_path / "source.txt", np.hstack([np.arange(len(source))[:, None], source]))
    np.savetxt(tmp_path / "target.txt", target)
    moving = tmp_path / "source.txt"
    command = (moving, tmp_path / "target.txt", "--out", tmp_path / "out")
    commands.check_one_sentence(run(capsys, *command), 1, "--columns _,x,y,z")
    assert run(capsys, *command, "--columns", "_,x,y,z", "auto")[0] == 0
    assert (
        run(capsys, moving, files / "target.ply", "--columns", "_,x,y,z", "--out", tmp_path / "ply")[0] == 0
    )
    plain = (files / "source.ply", files / "target.ply", "--out", tmp_path / "out")
    commands.check_one_sentence(run(capsys, *plain, "--columns", "x,y,z"), 1, "try it without --columns")
    commands.check_one_sentence(
        run(capsys, *plain, "--columns", "x", "y", "z"), 1, "--columns is given 3 times"
    )

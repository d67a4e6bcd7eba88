"""`packetmesh mesh` as a user meets it: any cloud becomes a mesh, one sentence for what cannot be."""

import json
import logging
from dataclasses import replace

import numpy as np
import pytest

from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import read_mesh
from pipeline.types import PointCloud
from tests.app import commands
from tests.pipeline.surface.shapes import perforated_plane, sphere

KEYS = {
    "input", "out", "points", "width_m", "unit_doubt", "normals", "radii_m", "vertices", "triangles",
    "unused_points",
    "boundary_loops", "boundary_length_m", "hole_area_m2", "non_manifold_edges", "components", "area_m2",
    "euler", "genus", "elapsed_s",
}  # fmt: skip


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "mesh", *argv)


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A sphere with normals and colours as a file."""
    path = tmp_path_factory.mktemp("clouds") / "ball.ply"
    colors = np.random.default_rng(3).integers(0, 256, (1500, 3), dtype=np.uint8)
    write_cloud(path, replace(sphere(1500), colors=colors))
    return path


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb", ".stl"])
def test_a_cloud_becomes_a_mesh_file_and_a_report(capsys, tmp_path, ball, suffix):
    out = tmp_path / "new" / f"mesh{suffix}"
    code, text, err = run(capsys, ball, "--out", out, "--radii-m", "0.2", "0.1", "--json")
    assert code == 0
    report = json.loads(text)
    assert set(report) == KEYS
    assert (report["input"], report["out"], report["normals"]) == (str(ball), str(out), "given")
    assert report["radii_m"] == [0.1, 0.2]
    assert (report["points"], report["vertices"], report["triangles"]) == (1500, 1500, 2996)
    assert (report["euler"], report["genus"], report["components"], report["boundary_loops"]) == (2, 0, 1, 0)
    assert report["area_m2"] == pytest.approx(4 * np.pi, rel=0.01)
    mesh = read_mesh(out)
    assert (len(mesh.vertices_m), len(mesh.triangles)) == (1500, 2996)
    assert (mesh.colors is None) == (suffix == ".stl")
    assert "the normals are given" in err
    assert [path.name for path in out.parent.iterdir()] == [out.name]


@pytest.mark.parametrize("suffix", [".npz", ".xyz", ".csv", ".txt", ".asc"])
def test_points_alone_get_normals_and_radii(capsys, tmp_path, suffix):
    points_m = sphere(1500).points_m
    if suffix == ".npz":
        np.savez(tmp_path / "points.npz", points=points_m)
    else:
        np.savetxt(tmp_path / f"points{suffix}", points_m, delimiter="," if suffix == ".csv" else " ")
    code, text, err = run(capsys, tmp_path / f"points{suffix}", "--out", tmp_path / "mesh.ply", "--json")
    assert code == 0
    report = json.loads(text)
    assert report["genus"] == 0
    assert len(report["radii_m"]) == 4
    assert "the normals are estimated, consistent among neighbours and outwards" in err


def test_without_json_the_report_goes_to_stderr(capsys, tmp_path, ball):
    auto = (ball, "--out", tmp_path / "mesh.ply", "--radii-m", "auto", "--viewpoint", 0, 0, 0)
    code, text, err = run(capsys, *auto)
    assert (code, text) == (0, "")
    for words in (
        "given, turned to the viewpoint",
        "2996 triangles of 1500 points, closed, genus 0",
        " mm\n",
    ):
        assert words in err


def test_thinning_and_smoothing_are_heeded(capsys, tmp_path, ball):
    options = ("--max-points", 500, "--smoothing-passes", 1, "--json")
    code, text, _ = run(capsys, ball, "--out", tmp_path / "mesh.ply", *options)
    assert code == 0
    assert json.loads(text)["points"] == pytest.approx(500, rel=0.1)


def test_the_same_file_gives_the_same_bytes(capsys, tmp_path):
    np.savez(tmp_path / "points.npz", points=sphere(1500).points_m)
    for name in ("first", "second"):
        assert run(capsys, tmp_path / "points.npz", "--out", tmp_path / f"{name}.ply")[0] == 0
    assert (tmp_path / "first.ply").read_bytes() == (tmp_path / "second.ply").read_bytes()


def test_a_flat_cloud_gives_a_flat_mesh(capsys, tmp_path):
    np.savez(tmp_path / "flat.npz", points=perforated_plane(0.4, 0.02, 0.0).points_m)
    code, text, _ = run(capsys, tmp_path / "flat.npz", "--out", tmp_path / "flat.ply", "--json")
    assert code == 0
    report = json.loads(text)
    assert report["boundary_loops"] == 1
    assert report["area_m2"] == pytest.approx(0.16, rel=0.02)
    assert np.all(read_mesh(tmp_path / "flat.ply").vertices_m[:, 2] == 0.0)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_not_finite_are_left_out_with_a_sentence(capsys, caplog, tmp_path, value):
    caplog.set_level(logging.WARNING)
    points_m = np.concatenate([sphere(1500).points_m, np.full((7, 3), value), sphere(1500).points_m[:30]])
    np.savez(tmp_path / "messy.npz", points=points_m)
    code, text, _ = run(capsys, tmp_path / "messy.npz", "--out", tmp_path / "mesh.ply", "--json")
    assert code == 0
    assert json.loads(text)["points"] == 1500
    assert "7 points of" in caplog.text
    assert "30 repeated points are left out" in caplog.text


def test_zero_normals_are_estimated_anew_with_a_sentence(capsys, caplog, tmp_path):
    write_cloud(tmp_path / "zero.ply", replace(sphere(1500), normals=np.zeros((1500, 3))))
    code, text, _ = run(capsys, tmp_path / "zero.ply", "--out", tmp_path / "mesh.ply", "--json")
    assert code == 0
    assert json.loads(text)["genus"] == 0
    assert "estimated from the points" in caplog.text


def test_an_stl_says_that_it_has_no_place_for_colours(capsys, caplog, tmp_path, ball):
    assert run(capsys, ball, "--out", tmp_path / "mesh.stl")[0] == 0
    assert "STL has no place for the colours" in caplog.text


BAD_CLOUDS = {
    "one point": (np.zeros((1, 3)), "in one place"),
    "two points": (np.eye(3)[:2], "2 distinct points; a surface needs at least 3"),
    "equal points": (np.ones((500, 3)), "in one place"),
    "a line": (np.outer(np.arange(60.0), [0.1, 0.2, 0.3]), "lie on one line"),
    "all NaN": (np.full((500, 3), np.nan), "no point with finite"),
}


@pytest.mark.parametrize("case", BAD_CLOUDS)
def test_a_cloud_without_a_surface_is_one_sentence(capsys, tmp_path, case):
    points_m, says = BAD_CLOUDS[case]
    np.savez(tmp_path / "bad.npz", points=points_m)
    got = run(capsys, tmp_path / "bad.npz", "--out", tmp_path / "out" / "mesh.ply")
    commands.check_one_sentence(got, 1, says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        (["ball.ply", "--radii-m", "0"], 1, "A ball radius is 0.0 m"),
        (["ball.ply", "--radii-m", "0.1", "-0.2"], 1, "A ball radius is -0.2 m"),
        (["ball.ply", "--radii-m", "nan"], 1, "A ball radius is nan m"),
        (["ball.ply", "--radii-m", "50"], 1, "larger than the cloud, which is 3.46"),
        (["ball.ply", "--radii-m", "0.001"], 1, "smaller than half the point spacing"),
        (["ball.ply", "--radii-m"], 2, "at least one radius"),
        (["ball.ply", "--viewpoint", "0", "0", "inf"], 1, "three finite numbers"),
        (["ball.ply", "--max-points", "2"], 1, "At most 2 points"),
        (["ball.ply", "--smoothing-passes", "-1"], 1, "-1 smoothing passes"),
        (["missing.ply"], 1, "missing.ply does not exist"),
        (["cut.ply"], 1, "of its 1500 points"),
        (["noise.pcd"], 1, "noise.pcd"),
        (["ball.dxf"], 1, "of a kind that is not read"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_writes_nothing(capsys, tmp_path, ball, argv, code, says):
    (ball.parent / "cut.ply").write_bytes(ball.read_bytes()[:5000])
    (ball.parent / "noise.pcd").write_bytes(np.random.default_rng(0).bytes(3000))
    (ball.parent / "ball.dxf").write_bytes(ball.read_bytes())
    got = run(capsys, ball.parent / argv[0], "--out", tmp_path / "out" / "mesh.ply", *argv[1:])
    commands.check_one_sentence(got, code, says)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("out", "says"),
    [
        ("mesh.off", "no name for a mesh; try one that ends in .ply, .glb, .obj, .stl"),
        ("mesh", "no name for a mesh"),
        ("file/mesh.ply", "cannot be written"),
    ],
)
def test_a_place_that_takes_no_mesh_is_one_sentence(capsys, tmp_path, ball, out, says):
    (tmp_path / "file").write_text("no folder")
    commands.check_one_sentence(run(capsys, ball, "--out", tmp_path / out), 1, says)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_balls_that_nothing_stops_are_one_sentence(capsys, tmp_path):
    """Normals across the surface, as of one point in ten of no scanner, leave no seed."""
    across = PointCloud(np.eye(3), normals=np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 1.0]]))
    write_cloud(tmp_path / "cloud.ply", across)
    got = run(capsys, tmp_path / "cloud.ply", "--out", tmp_path / "mesh.ply", "--radii-m", 1.0)
    commands.check_one_sentence(got, 1, "rests on three points whose normals agree")


def test_an_older_mesh_survives_a_failure(capsys, tmp_path, ball):
    (tmp_path / "mesh.ply").write_text("older")
    assert run(capsys, ball, "--out", tmp_path / "mesh.ply", "--radii-m", 0.001)[0] == 1
    assert (tmp_path / "mesh.ply").read_text() == "older"


def test_columns_and_a_unit_may_be_given(capsys, caplog, tmp_path):
    points_m = sphere(1500).points_m
    table = np.hstack([np.arange(1500.0)[:, None], 1000.0 * points_m])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",")
    command = (tmp_path / "a.csv", "--out", tmp_path / "mesh.ply", "--json")
    commands.check_one_sentence(run(capsys, *command), 1, "try --columns _,x,y,z or --columns x,y,z,_")
    code, text, _ = run(capsys, *command, "--columns", "_,x,y,z", "--metres-per-unit", 0.001)
    assert code == 0
    assert json.loads(text)["width_m"] == pytest.approx(1.96, abs=0.02)
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="n,x [mm],y [mm],z [mm]", comments="")
    for unit in ((), ("--metres-per-unit", 0.001)):
        code, text, _ = run(capsys, *command, *unit)
        assert code == 0
        assert json.loads(text)["width_m"] == pytest.approx(1.96, abs=0.02)
    assert caplog.text.count("converted to metres") == 1


def test_flipped_normals_are_named_and_may_be_estimated(capsys, caplog, tmp_path):
    signs = np.where(np.random.default_rng(0).random((1500, 1)) < 0.5, -1.0, 1.0)
    write_cloud(tmp_path / "flipped.ply", replace(sphere(1500), normals=signs * sphere(1500).normals))
    command = (tmp_path / "flipped.ply", "--out", tmp_path / "mesh.ply", "--json")
    for option, says in (
        ((), "given, turned to agree among neighbours and outwards"),
        (("--estimate-normals",), "estimated, consistent among neighbours and outwards"),
        (("--viewpoint", 0, 0, 0), "given, turned to the viewpoint"),
    ):
        code, text, _ = run(capsys, *command, *option)
        assert code == 0
        assert (json.loads(text)["normals"], json.loads(text)["genus"]) == (says, 0)
    assert caplog.text.count("of neighbouring normals point against each other") == 1


def test_a_far_cloud_is_meshed_in_its_place_or_the_format_is_refused_first(capsys, tmp_path):
    far_m = sphere(1500).points_m + np.array([5e5, 4.65e6, 300.0])
    np.savez(tmp_path / "far.npz", points=far_m)
    assert run(capsys, tmp_path / "far.npz", "--out", tmp_path / "mesh.ply")[0] == 0
    vertices_m = read_mesh(tmp_path / "mesh.ply").vertices_m
    order, expected = (np.lexsort(np.round(points_m, 6).T) for points_m in (vertices_m, far_m))
    assert np.abs(vertices_m[order] - far_m[expected]).max() < 1e-4
    code, _, err = run(capsys, tmp_path / "far.npz", "--out", tmp_path / "mesh.stl")
    assert code == 1
    assert err.splitlines()[-1].endswith("32-bit numbers of .stl files are too coarse; try .ply or .obj")
    assert "rolling" not in err

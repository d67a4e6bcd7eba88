"""Problems in the form of the public benchmark: read, solved, and measured as it says."""

import csv
import json

import numpy as np
import pytest

from app.cli.bench import bench
from lab.benchmarks import problems
from lab.benchmarks.problem_lists import motions
from lab.benchmarks.problems import (
    COLUMNS,
    OURS,
    read_problems,
    scaled_displacement,
    summary,
    write_problems,
)
from packetmesh.errors import InputError, ReconstructionError
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.pairs.register import Pair
from pipeline.types import PointCloud


def corner(seed: int, count: int = 600) -> np.ndarray:
    """(3 count, 3) random points of three walls that meet."""
    a, b = np.random.default_rng(seed).uniform(0.0, 2.0, (2, count))
    zero = np.zeros(count)
    return np.concatenate([np.stack(wall, axis=1) for wall in ((a, zero, b), (zero, a, b), (a, b, zero))])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("problems")
    T_true = rigid(rotation_exp(np.array([0.0, 0.0, 0.3])), np.array([0.5, 0.0, 0.0]))
    target = PointCloud(corner(1))
    source = PointCloud(apply(np.linalg.inv(T_true), corner(2)))
    small = rigid(rotation_exp(np.radians([3.0, -4.0, 2.0])), np.array([0.05, -0.05, 0.02]))
    far = rigid(rotation_exp(np.array([0.0, 0.0, np.pi])), np.array([30.0, 0.0, 0.0]))
    write_problems(folder, "corner", [Pair(source, target, np.eye(4), T_true)], [[small, far]], [1.0])
    return folder


def test_the_error_is_that_of_the_paper():
    points_m = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, -3.0, 0.0]])
    shift = rigid(np.eye(3), np.array([0.0, 0.0, 0.3]))
    assert scaled_displacement(shift, points_m) == pytest.approx((0.3 + 0.3 + 0.1 + 0.1) / 4.0)
    assert scaled_displacement(np.eye(4), points_m) == 0.0
    half_turn = rigid(rotation_exp(np.array([0.0, 0.0, np.pi])), np.zeros(3))
    assert scaled_displacement(half_turn, 7.0 * points_m) == pytest.approx(2.0)  # whatever the size


def test_what_is_written_is_read_and_the_clouds_lie_on_each_other(folder):
    found = read_problems(folder)
    assert [problem.id for problem in found] == ["corner_00_000", "corner_00_001"]
    assert (folder / "corner_local.txt").read_text().startswith(" ".join(COLUMNS))
    np.testing.assert_allclose(found[1].T_moved[:3, 3], [30.0, 0.0, 0.0])


def test_a_small_motion_and_a_far_one_are_undone_and_every_problem_has_its_row(folder, tmp_path, capsys):
    bench(tmp_path / "out", problems=folder, json=True)
    printed = json.loads(capsys.readouterr().out)
    with (tmp_path / "out" / "problems.csv").open() as file:
        rows = list(csv.DictReader(file))
    errors = {(row["id"], row["method"]): row["error"] for row in rows}
    assert float(errors["corner_00_000", OURS]) < 0.005
    assert float(errors["corner_00_001", OURS]) < 0.005  # by features of the surfaces
    ours = next(group for group in printed["summary"] if group["method"] == OURS)
    assert (ours["problems"], ours["solved_share"]) == (2, 1.0)
    assert len(printed["problems"]) == len(rows)


@pytest.mark.parametrize("step", ["prepared_pair", "find_place", "settled_answer"])
def test_peers_run_at_the_identity_where_ours_has_no_answer(folder, monkeypatch, step):
    def fails(*arguments, **named):
        raise ReconstructionError("no start leads anywhere")

    small = read_problems(folder)[0]
    monkeypatch.setattr(problems, step, fails)
    monkeypatch.setattr(problems, "PEERS", ("open3d-plane",))
    ours, peer = problems.solve(small)
    assert (ours["method"], ours["error"], ours["elapsed_s"]) == (OURS, None, None)
    assert ours["reason"] == "no start leads anywhere"
    assert peer["method"] == "open3d-plane"
    assert peer["error"] < 0.1 * peer["error_before"]


def test_a_peer_without_an_answer_has_a_row_too(folder, monkeypatch):
    def fails(*arguments, **named):
        raise InputError("too few points")

    monkeypatch.setattr(problems, "find_place", fails)
    monkeypatch.setattr(problems, "run_peer", fails)
    monkeypatch.setattr(problems, "PEERS", ("open3d-plane",))
    rows = problems.solve(read_problems(folder)[0])
    assert [(row["error"], row["reason"]) for row in rows] == [(None, "too few points")] * 2


def test_a_problem_without_an_answer_is_not_solved():
    row = {"list": "a", "method": OURS, "error_before": 0.4, "error": None, "elapsed_s": None}
    (group,) = summary([row])
    assert (group["solved_share"], group["median_error"], group["median_s"]) == (0.0, 0.4, None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no column 'id'"),
        ("id source target overlap\n", "has no column 't1'"),
        (" ".join(COLUMNS) + "\n7 a.pcd b.pcd 0.5 1 2 3\n", "line 2: not a problem"),
        (" ".join(COLUMNS) + "\n7 a.pcd b.pcd x" + " 1" * 12 + "\n", "line 2: not a problem"),
    ],
)
def test_lists_that_are_none_are_named_in_one_sentence(tmp_path, text, said):
    (tmp_path / "stairs_local.txt").write_text(text)
    with pytest.raises(InputError, match=r"stairs_local\.txt") as refused:
        read_problems(tmp_path)
    assert said in str(refused.value)


def test_a_folder_without_lists_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no list of problems"):
        read_problems(tmp_path)


def test_extra_columns_do_not_matter(folder, tmp_path):
    lines = (folder / "corner_local.txt").read_text().splitlines()
    scaled = [
        " ".join([*line.split()[:4], extra, *line.split()[4:]])
        for line, extra in zip(lines, ("scale", "1", "2"), strict=True)
    ]
    (tmp_path / "corner_global.txt").write_text("\n".join(scaled))
    assert [one.motion for one in read_problems(tmp_path)] == [one.motion for one in read_problems(folder)]


def test_motions_turn_about_the_middle_of_a_cloud():
    cloud = PointCloud(corner(3))
    for T in motions(cloud, 20, 0):
        moved_m = apply(T, cloud.points_m.mean(axis=0, keepdims=True)) - cloud.points_m.mean(axis=0)
        assert np.linalg.norm(moved_m) <= 0.2 * 2.0 + 1e-9

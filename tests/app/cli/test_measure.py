"""`packetmesh measure`: numbers with intervals from a run's folder, one sentence for what cannot be."""

import json

import numpy as np
import pytest

import packetmesh as pm
from pipeline.folders.run import metrics_of, write_run_folder
from pipeline.measuring.surface import MEASURING, measured_surface, read_measured, write_measured
from pipeline.measuring.values import HELD
from tests.app import commands
from tests.pipeline.measuring.scenes import box_on_table, measured

TOP, SIDE, FRONT, TABLE = "0.1,0.1,0.15", "0,0.1,0.07", "0.1,0,0.07", "-0.2,-0.2,0"


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "measure", *argv)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run with a box on a table."""
    path = tmp_path_factory.mktemp("runs") / "box"
    path.mkdir()
    write_measured(path / MEASURING, measured(box_on_table(), scale_sd=0.002))
    return path


def values(capsys, *argv):
    code, out, _ = run(capsys, *argv, "--json")
    assert code == 0
    found = json.loads(out)
    for one in found:
        assert set(one) == {"kind", "name", "value", "unit", "ci95", "guessed", "ends_m"}
        assert one["ci95"][0] <= one["value"] <= one["ci95"][1]
    return found


def test_points_give_lengths_and_the_angles_between(capsys, folder):
    found = values(capsys, folder, "--points", "0,0,0.15", "0.3,0,0.15", "0.3,0.2,0.15")
    assert [one["kind"] for one in found] == ["distance", "distance", "angle"]
    assert [one["value"] for one in found] == pytest.approx([0.3, 0.2, 90.0], abs=1e-3)
    assert [one["unit"] for one in found] == ["m", "m", "deg"]
    assert np.allclose(found[0]["ends_m"], [[0.0, 0.0, 0.15], [0.3, 0.0, 0.15]], atol=1e-3)
    assert len(found[2]["ends_m"]) == 3


def test_a_point_that_is_moved_says_where_to_and_how_far(capsys, folder):
    ends = ("--points", "0,0,0.15", "0.29,0.19,0.15", "--snap", "vertex")
    _, out, err = run(capsys, folder, *ends)
    assert out.split()[2] == "0.3606"  # to the corner of the box
    (moved,) = [line for line in err.splitlines() if "was taken for" in line]
    assert moved == "The point 0.290,0.190,0.150 was taken for 0.300,0.200,0.150, 1.4 cm away (vertex)"


def test_planes_give_a_distance_an_angle_or_a_box(capsys, folder):
    (gap,) = values(capsys, folder, "--planes", TOP, TABLE)
    assert (gap["kind"], gap["value"]) == ("plane-plane", pytest.approx(0.15))
    (angle,) = values(capsys, folder, "--planes", TOP, SIDE)
    assert (angle["kind"], angle["value"]) == ("angle", pytest.approx(90.0, abs=1e-3))
    box = values(capsys, folder, "--planes", TOP, SIDE, FRONT)
    assert [one["name"] for one in box] == ["width", "depth", "height"]
    (height,) = values(capsys, folder, "--points", TOP, "--planes", TABLE)
    assert (height["kind"], height["value"]) == ("point-plane", pytest.approx(0.15))


def test_a_table_for_people_says_where_the_scale_is_from(capsys, folder):
    code, out, err = run(
        capsys, folder, "--box", TOP, "--points", "-0.1,-0.1,0", "-0.2,-0.1,0", "--snap", "vertex"
    )
    assert code == 0
    lines = out.splitlines()
    assert lines[0].split()[:4] == ["length", "(distance)", "0.1000", "m"]
    assert [line.split()[0] for line in lines[1:]] == ["width", "depth", "height"]
    assert "95 %: " in lines[0]
    assert err == f"known\n{HELD}\n"


def test_a_true_length_scales_everything(capsys, folder):
    ends = ("--points", "0,0,0.15", "0.3,0,0.15")
    code, out, err = run(capsys, folder, *ends, "--planes", TOP, TABLE, "--scale-by", "0.33", "--json")
    assert code == 0
    first, height = json.loads(out)
    assert [one["value"] for one in (first, height)] == pytest.approx([0.33, 0.165], abs=1e-3)
    assert first["ci95"] == [0.33, 0.33]
    assert height["ci95"][0] < height["value"] < height["ci95"][1]
    assert "The true length 0.33 m does not agree with the measured 0.3 m" in err


@pytest.mark.parametrize(
    ("argv", "code", "says"),
    [
        ((), 2, "say what to measure: --points"),
        (("--points", TOP), 2, "two or more points"),
        (("--planes", TOP), 2, "--planes takes a point on each of two"),
        (("--points", "0.1,0.1"), 2, "places such as 0.2,1.1,0.75"),
        (("--planes", TOP, SIDE, "--scale-by", "1"), 2, "--scale-by needs a length"),
        (("--points", TOP, TOP), 1, "the same point"),
        (("--points", TOP, "3,3,3"), 1, "Nothing of the surface is near the point (3, 3, 3)"),
        (("--planes", TOP, "0.12,0.12,0.15"), 1, "on one plane"),
        (("--planes", TOP, TABLE, SIDE), 1, "faces of a box are square"),
        (("--hole", TOP), 1, "No hole of the surface is near"),
        (("--points", TOP, SIDE, "--scale-by", "-1"), 1, "try a positive one"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(capsys, folder, argv, code, says):
    commands.check_one_sentence(run(capsys, folder, *argv), code, says)


def test_a_folder_without_a_surface_says_how_to_make_one(capsys, tmp_path):
    ends = ("--points", TOP, SIDE)
    missing = tmp_path / "nothing"
    commands.check_one_sentence(run(capsys, missing, *ends), 1, "nothing does not exist")
    commands.check_one_sentence(run(capsys, tmp_path, *ends), 1, "make it with packetmesh reconstruct")
    for damage in (b"", b"PK\x03\x04 and no more", (tmp_path / "other.npz").name.encode()):
        (tmp_path / MEASURING).write_bytes(damage)
        says = "is damaged or of another version" if damage else "is empty"
        commands.check_one_sentence(run(capsys, tmp_path, *ends), 1, says)
    np.savez(tmp_path / MEASURING, vertices_m=np.zeros((3, 3)), scale_sd=0.1, scale_source="")
    commands.check_one_sentence(run(capsys, tmp_path, *ends), 1, "is damaged or of another version")


def test_a_reconstruction_can_be_measured_from_its_folder_and_from_memory(tmp_path):
    rig = pm.load_demo("box-on-table")
    result = pm.reconstruct(rig, pm.with_settings(pm.PRESETS["packetmesh"], ["surface.max_points=15000"]))
    write_run_folder(result, metrics_of(result), tmp_path)
    stored, own = read_measured(tmp_path), measured_surface(result)
    assert stored.vertices_m == pytest.approx(own.vertices_m)
    assert stored.scale_source == own.scale_source
    assert stored.pose_covariances == pytest.approx(own.pose_covariances)
    left, right = (
        (2.48 + side * 0.15 * 0.9394 + 0.1 * 0.3429, 2.53 + side * 0.15 * 0.3429 - 0.1 * 0.9394)
        for side in (-1, 1)
    )
    ends = [(*left, 0.89), (*right, 0.89)]
    found = pm.measure(result, ends)
    low, high = found.values[0].ci95
    assert low <= 0.30 <= high
    assert high - low < 0.12
    assert found.values[0].value == pm.measure(stored, ends).values[0].value

"""``packetmesh import`` as a user meets it."""

import json

from pipeline.io.rigs import load_rig
from tests.app import commands
from tests.app.commands import check_one_sentence
from tests.pipeline.importing.recordings import orbit, write_tum
from tests.pipeline.importing.test_bag_motion import write as write_moving


def run(capsys, *argv: object) -> tuple[int, str, str]:
    return commands.run(capsys, "import", *argv)


def test_a_recording_becomes_a_rig_and_everything_assumed_is_said(capsys, tmp_path):
    write_tum(tmp_path / "desk", orbit(9))
    code, out, err = run(capsys, tmp_path / "desk", "--out", tmp_path / "rig", "--frames", 2, "--json")
    report = json.loads(out)
    assert code == 0
    assert report["kind"] == "TUM"
    assert report["candidates"] == 9
    assert report["depth_scale"] == 5000.0
    assert [frame["node"] for frame in report["frames"]] == ["node_00", "node_01"]
    assert len(load_rig(tmp_path / "rig").frames) == 2
    assert "5000 units in a metre" in err
    for note in report["notes"]:
        assert note in err


def test_without_json_nothing_goes_to_standard_output(capsys, tmp_path):
    write_tum(tmp_path / "desk", orbit(2))
    code, out, err = run(capsys, tmp_path / "desk", "--out", tmp_path / "rig", "--depth-scale", 250)
    assert (code, out) == (0, "")
    assert "try --depth-scale 5000" in err


def test_all_frames_become_a_recording_in_tums_form(capsys, tmp_path):
    write_moving(tmp_path / "walk.bag")
    out = tmp_path / "walk"
    code, printed, err = run(capsys, tmp_path / "walk.bag", "--out", out, "--frames", "all", "--json")
    report = json.loads(printed)
    assert code == 0
    assert (report["kind"], report["candidates"], report["frames"]) == ("bag", 5, 5)
    assert len(list((out / "rgb").iterdir())) == 5
    assert f"Next: packetmesh reconstruct --recording {out} --out runs/walk" in err
    for note in report["notes"]:
        assert note in err


def test_what_is_no_recording_gets_one_sentence(capsys, tmp_path):
    (tmp_path / "holidays").mkdir()
    got = run(capsys, tmp_path / "holidays", "--out", tmp_path / "rig")
    check_one_sentence(got, 1, "of no known kind; the kinds are TUM (rgb.txt and depth.txt)")
    assert not (tmp_path / "rig").exists()

"""What ``reconstruct`` says of a rig whose nodes do not know where they stand."""

import json
from dataclasses import replace
from html import unescape

import numpy as np

from pipeline.io.demos import load_demo
from pipeline.io.rigs import save_rig
from pipeline.types import DepthMap, RgbdFrame, Rig
from tests.app.commands import check_one_sentence, run, shares
from tests.pipeline.importing.bags import write_bag

QUICK = ("--set", "surface.max_points=3000")


def lost(*frames: RgbdFrame) -> Rig:
    return Rig("lost", tuple(replace(frame, pose_known=False) for frame in frames))


def test_two_rooms_are_no_rig_and_the_command_says_so(capsys, tmp_path):
    save_rig(tmp_path / "rig", lost(load_demo("office").frames[0], load_demo("living-room").frames[0]))
    code, _, err = run(capsys, "reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *QUICK)
    assert code == 1
    *_, left_out, last = err.splitlines()
    assert left_out.startswith("node_01 is left out: its pose is not known")
    assert last == "No two nodes could be placed relative to each other: the surface is of one node only"
    assert list(json.loads((tmp_path / "out" / "poses.json").read_text())) == ["node_00"]
    assert left_out in unescape((tmp_path / "out" / "report.html").read_text())


def test_progress_never_falls_and_is_whole_once(capsys, tmp_path):
    save_rig(tmp_path / "rig", Rig("pair", load_demo("box-on-table").frames[:1]))
    words = ["reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *QUICK]
    code, _, err = run(capsys, *words, "--baseline", "alpha")
    told = shares(err)
    assert code == 0
    assert told == sorted(told)
    assert told.count(100) == 1
    assert len(told) > 8


def test_a_rig_that_finds_its_places_says_how_well_it_agrees(capsys, tmp_path):
    save_rig(tmp_path / "rig", lost(*load_demo("office").frames[:2]))
    words = ["reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *QUICK, "--json"]
    code, out, err = run(capsys, *words)
    metrics = json.loads(out)
    share = metrics["measured"]["agreement_between_nodes"]
    assert code == 0
    assert share > 0.9
    assert err.splitlines()[-1] == (
        f"Where two cameras measured the same surface, {share:.1%} of the points agree within 2 %"
    )
    poses = json.loads((tmp_path / "out" / "poses.json").read_text())
    assert poses == metrics["poses"]
    assert np.shape(poses["node_01"]) == (4, 4)


def test_a_doubtful_depth_scale_reaches_the_command_line_the_report_and_the_metrics(capsys, tmp_path):
    """Millimetres times five, as TUM stores them."""
    frame = load_demo("office").frames[0]
    save_rig(tmp_path / "rig", Rig("one", (replace(frame, depth=DepthMap(5.0 * frame.depth.z_m)),)))
    words = ["reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *QUICK]
    code, _, err = run(capsys, *words)
    assert code == 0
    note = err.splitlines()[-1]
    assert "try --depth-scale 5000" in note
    assert note in (tmp_path / "out" / "report.html").read_text()
    (node,) = json.loads((tmp_path / "out" / "metrics.json").read_text())["nodes"]
    assert [f"{node['name']}: {own}" for own in node["notes"]] == [note]
    _, _, err = run(capsys, *words, "--depth-scale", 5000)
    assert "--depth-scale" not in err


def test_a_bag_of_three_cameras_is_a_mesh_by_one_command(capsys, tmp_path):
    """And by the same again, over what it left."""
    write_bag(tmp_path / "recording", load_demo("living-room"), "mcap", moments=1)
    (bag,) = (tmp_path / "recording").glob("*.mcap")
    points = ("--set", "surface.max_points=5000")
    words = ["reconstruct", "--rig", bag, "--out", tmp_path / "out", *points, "--json"]
    for _ in range(2):
        code, out, err = run(capsys, *words)
        assert code == 0
    metrics = json.loads(out)
    assert f"{bag} is a recording (bag), imported as 3 nodes of 1 moments" in err
    assert metrics["import"]["kind"] == "bag"
    assert metrics["surface_after"]["triangles"] > 1000
    assert metrics["surface_after"]["within_2pct_share"] > 0.8
    assert (tmp_path / "out" / "surface.glb").exists()


def test_a_bag_that_cannot_be_used_is_one_sentence_and_leaves_no_folder(capsys, tmp_path):
    (tmp_path / "broken.bag").write_bytes(b"not a bag at all" * 20)
    got = run(capsys, "reconstruct", "--rig", tmp_path / "broken.bag", "--out", tmp_path / "out")
    check_one_sentence(got, 1, "cannot be read")
    assert not (tmp_path / "out").exists()


def test_given_poses_that_no_other_camera_confirms_have_no_share_of_agreement(capsys, tmp_path):
    """As of translations in millimetres that are read as metres."""
    first, second, _ = load_demo("office").frames
    far = second.T_world_camera.copy()
    far[:3, 3] += 300.0
    save_rig(tmp_path / "rig", Rig("far", (first, replace(second, T_world_camera=far))))
    _, _, err = run(capsys, "reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "out", *QUICK)
    assert "nan" not in err
    assert "node_01 has a pose that no other placed camera confirms: each measured less than 5 %" in err

"""What ``reconstruct`` writes and says of recordings whose camera stands."""

import json

from pipeline.io.poses import write_pose
from pipeline.kernels.geometry import LEVEL_POSE
from tests.app.commands import check_one_sentence, run
from tests.pipeline.recording.standing import wall, write_tum

SETTINGS = ("--set", "recording.frames=4", "surface.max_points=4000")


def test_a_camera_that_stands_is_one_averaged_node(capsys, tmp_path):
    folder, out = write_tum(tmp_path / "still", wall(6)), tmp_path / "run"
    code, printed, said = run(capsys, "reconstruct", "--recording", folder, *SETTINGS, "--out", out, "--json")
    assert code == 0, said
    metrics = json.loads(printed)
    assert "recording" not in metrics
    assert not (out / "trajectory.txt").exists()
    (node,) = metrics["nodes"]
    assert node["averaged"]["frames"] == 4
    assert 0.0 <= node["averaged"]["moving_share"] < 0.01
    assert node["averaged"]["median_sd_m"] < 0.006
    sentence = "The camera stands: 4 of 6 frames were averaged"
    assert sentence in said
    assert sentence in (out / "report.html").read_text()
    assert json.loads((out / "config.json").read_text())["settings"]["recording.frames"] == "4"


def test_a_rig_of_recordings_is_averaged_node_by_node(capsys, tmp_path):
    for index in range(2):
        node = write_tum(tmp_path / "rig" / f"node_{index:02d}", wall(5, seed=index))
        write_pose(node / "pose.txt", LEVEL_POSE)
    code, printed, said = run(
        capsys, "reconstruct", "--rig", tmp_path / "rig", *SETTINGS, "--out", tmp_path / "run", "--json"
    )
    assert code == 0, said
    nodes = json.loads(printed)["nodes"]
    assert [node["name"] for node in nodes] == ["node_00", "node_01"]
    assert [node["averaged"]["frames"] for node in nodes] == [4, 4]


def test_what_is_delivered_is_averaged_over_the_frames_of_the_settings_and_replaces_a_walk(capsys, tmp_path):
    folder, out = write_tum(tmp_path / "still", wall(6)), tmp_path / "run"
    (out / "keyframes" / "images").mkdir(parents=True)
    old = [out / "keyframes" / "images" / "a.jpg", out / "trajectory.txt", out / "trajectory.json"]
    for path in (*old, out / "mine.txt"):
        path.write_text("old")
    words = "deliver", "--recording", folder, "--moments", 1, *SETTINGS, "--out", out
    code, _, said = run(capsys, *words)
    assert code == 0, said
    assert "recording: a camera that stands: averaging 4 frames" in said
    (node,) = json.loads((out / "metrics.json").read_text())["nodes"]
    assert node["averaged"]["frames"] == 4
    assert [path.name for path in out.iterdir() if path.name in ("keyframes", "mine.txt")] == ["mine.txt"]
    assert not any(path.exists() for path in old)


def test_a_rig_whose_camera_walks_gets_one_sentence(capsys, tmp_path):
    moving = [depth_m * (1.0 + 0.02 * k) for k, depth_m in enumerate(wall(6))]
    write_tum(tmp_path / "rig" / "node_00", moving)
    words = run(capsys, "reconstruct", "--rig", tmp_path / "rig", "--out", tmp_path / "run")
    check_one_sentence(words, 1, "node_00 does not stand still")
    assert not (tmp_path / "run").exists()

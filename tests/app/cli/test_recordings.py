"""What ``reconstruct --recording`` writes and says."""

import json
from html import unescape

import cv2
import numpy as np
import pycolmap
import pytest

from lab.walks.walk import kinect, read_truth, render_walk
from lab.worlds.rooms import random_room
from pipeline.importing.tum import poses_at
from pipeline.io.meshes import read_mesh
from pipeline.recording.errors import ate_m
from tests.app.commands import check_one_sentence, run, shares


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A rendered walk in TUM's form, whose poses lie beside it under another name."""
    folder = tmp_path_factory.mktemp("recordings") / "walk"
    render_walk(random_room(5_000_001), 12, kinect(160), folder)
    return folder


def share_of(line):
    return int(line.split("%")[0])


@pytest.fixture(scope="module")
def out(walk, tmp_path_factory):
    return tmp_path_factory.mktemp("out") / "run"


def test_a_recording_becomes_a_surface_a_trajectory_and_a_report(capsys, walk, out):
    code, printed, said = run(capsys, "reconstruct", "--recording", walk, "--out", out, "--json")
    assert code == 0, said
    metrics = json.loads(printed)
    recording = metrics["recording"]
    assert recording["frames"] == 12
    assert recording["lost"] == []
    told = shares(said)
    assert told == sorted(told)
    assert told.count(100) == 1
    assert min(share_of(line) for line in said.splitlines() if "recording: mapping" in line) > 20
    assert "tracking: frame 0 of 12" in said
    assert f"Tracked 12 frames over {recording['path_m']:.1f} m at" in said
    truth = read_truth(walk)
    times_s = np.arange(12) / 30.0
    poses = poses_at(out / "trajectory.txt", times_s)
    assert ate_m([poses[k] for k in range(12)], truth.T_world_camera) < 0.01
    written = json.loads((out / "trajectory.json").read_text())
    assert len(written["keyframes"]) == recording["keyframes"]
    assert sum(link["loop"] and link["used"] for link in written["links"]) == recording["loops"]
    assert set(metrics["poses"]) <= {f"frame_{k:05d}" for k in written["keyframes"]}
    assert len(read_mesh(out / "surface_after.ply").triangles) == metrics["surface_after"]["triangles"] > 1000
    assert "A recording of <b>12</b> frames" in (out / "report.html").read_text()
    model = pycolmap.Reconstruction(str(out / "keyframes" / "sparse"))
    names = {f"frame_{k:05d}.jpg" for k in written["keyframes"]}
    assert {image.name for image in model.images.values()} == names
    frames = json.loads((out / "keyframes" / "transforms.json").read_text())["frames"]
    assert {own["file_path"] for own in frames} == {f"images/{name}" for name in names}


def test_frames_that_are_lost_are_named(capsys, walk, tmp_path):
    """A copy of the recording in which some depth images show nothing."""
    copy = tmp_path / "walk"
    copy.mkdir()
    for name in ("rgb", "intrinsics.json", "rgb.txt"):
        (copy / name).symlink_to(walk / name)
    (copy / "depth").mkdir()

    lines = (walk / "depth.txt").read_text().splitlines()
    for k, path in enumerate(sorted((walk / "depth").iterdir())):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(copy / "depth" / path.name), image * (k not in (5, 6)))
    (copy / "depth.txt").write_text("\n".join(lines))
    code, _, said = run(capsys, "reconstruct", "--recording", copy, "--out", tmp_path / "out")
    assert code == 0, said
    sentence = "2 of 12 frames (5 to 6) have no depth, or too little to be tracked, and are not in the"
    assert sentence in said
    assert sentence in unescape((tmp_path / "out" / "report.html").read_text())


def test_of_a_recording_among_rigs_all_frames_are_used(capsys, walk, tmp_path):
    (tmp_path / "rigs").mkdir()
    (tmp_path / "rigs" / "walk").symlink_to(walk)
    words = ["--rigs", tmp_path / "rigs", "--out", tmp_path / "out", "--set", "surface.max_points=3000"]
    code, _, said = run(capsys, "reconstruct", *words)
    assert code == 0, said
    metrics = json.loads((tmp_path / "out" / "walk" / "metrics.json").read_text())
    assert metrics["recording"]["frames"] == 12
    assert not (tmp_path / "out" / "walk" / "imported").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--recording", "nowhere"], "nowhere does not exist"),
        (["--recording", "walk", "--scene", "office"], "--recording takes no other images"),
        (["--recording", "walk", "--depth-scale", "0"], "The depth scale is 0"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_leaves_no_folder(capsys, tmp_path, words, says):
    got = run(capsys, "reconstruct", *words, "--out", tmp_path / "out")
    check_one_sentence(got, 2 if "takes no" in says else 1, says)
    assert not (tmp_path / "out").exists()


def test_a_network_carries_the_keyframes_of_a_recording(capsys, walk, tmp_path):
    words = [
        "deliver",
        "--recording",
        walk,
        "--preset",
        "thesis-link",
        "--moments",
        2,
        "--out",
        tmp_path,
        "--json",
    ]
    code, printed, said = run(capsys, *words)
    assert code == 0, said
    last = json.loads(printed)["moments"][-1]
    assert last["delivered_bytes"] > 0
    (node,) = last["nodes"]
    assert node["name"] == "camera"
    ready_s = [image["ready_s"] for image in node["images"]]
    assert ready_s == sorted(ready_s)
    assert last["t_s"] > ready_s[-1] >= 0.0
    assert all(image["name"].startswith("frame_") for image in node["images"])
    assert "one walking camera with one radio sends" in said
    assert last["surface"]["triangles"] > 1000

"""A person's own images on the Scene screen, with real jobs and no browser."""

import io
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.screens.scene import own, recording_job
from app.screens.scene.own import MOMENTS, WALK
from app.screens.scene.panel import ScenePanel
from lab.walks.walk import kinect, render_walk
from lab.worlds.rooms import random_room
from packetmesh.errors import InputError
from pipeline.io.demos import DEMOS, load_demo
from pipeline.io.rigs import save_rig
from pipeline.sources import Demo, Recorded, RigFolder, demo_of
from tests.app.fakes import Bench, ui_of
from tests.pipeline.importing.bags import write_bag
from tests.pipeline.importing.recordings import orbit, write_colmap, write_tum

FOLDER = "Use your own images"


@pytest.fixture
def session(store, server, tmp_path):
    (tmp_path / "uploads").mkdir()
    return Bench(ScenePanel, ui_of(server.scene), store, tmp_path / "uploads", steps=("scene",))


def zipped(folder):
    """The bytes of a ZIP with all files of a folder, below its own name."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for path in folder.rglob("*"):
            archive.write(path, path.relative_to(folder.parent))
    return stream.getvalue()


@pytest.mark.parametrize("write", [write_tum, write_colmap])
def test_a_recording_in_a_zip_becomes_a_rig(session, tmp_path, write):
    written = orbit(5)
    write(tmp_path / "desk", written)
    session.gui.upload("Recording …", "my desk.zip", zipped(tmp_path / "desk"))
    nodes = session.results.view("scene").nodes
    assert len(nodes) == 3
    assert session.gui.find("Scene").value == "my-desk"
    assert session.gui.find("Node").options == ("node_00", "node_01", "node_02")
    assert "3 of 5 frames became nodes" in session.gui.text(FOLDER)
    assert "in a metre" in session.gui.text(FOLDER)
    pictures = [frame.rgb for frame in written.frames]
    assert all(any(np.array_equal(node.color.rgb, rgb) for rgb in pictures) for node in nodes)


def test_a_rig_in_a_zip_is_taken_as_it_is_and_may_come_twice(session, tmp_path):
    save_rig(tmp_path / "rig", orbit(2))
    for _ in range(2):
        session.gui.upload("Recording …", "rig.zip", zipped(tmp_path / "rig"))
        assert len(session.results.view("scene").nodes) == 2
    for upload in ("upload0", "upload1"):
        below = session.folder / upload
        there = sorted(str(path.relative_to(below)) for path in below.glob("*/*"))
        assert there == ["own/rig.zip", "rig/node_00", "rig/node_01"]


def test_a_scale_and_a_number_of_frames_hold_for_a_recording_and_a_rig(session, tmp_path):
    write_tum(tmp_path / "desk", orbit(5))
    save_rig(tmp_path / "rig", orbit(2))
    session.gui.set("Units per m", 2500.0)
    session.gui.set("Frames", 2)
    session.gui.upload("Recording …", "desk.zip", zipped(tmp_path / "desk"))
    assert "2 of 5 frames became nodes" in session.gui.text(FOLDER)
    assert "2500 units in a metre" in session.gui.text(FOLDER)
    session.gui.upload("Recording …", "rig.zip", zipped(tmp_path / "rig"))
    assert session.spec.source.depth_scale == 2500.0
    assert session.results.view("scene").nodes[0].farthest_m < 1.1


def test_a_pair_or_nodes_from_another_number_on_may_come_in_a_zip(session, tmp_path):
    save_rig(tmp_path / "rig", orbit(2))
    (tmp_path / "rig" / "node_00").rename(tmp_path / "pair")
    for folder in ("rig", "pair"):
        session.gui.upload("Recording …", f"{folder}.zip", zipped(tmp_path / folder))
        (node,) = session.results.view("scene").nodes
        assert node.name == {"rig": "node_01", "pair": "node_00"}[folder]
        assert f"A rig of {node.name}" in session.gui.text(FOLDER)


def test_a_recording_in_a_zip_may_stay_one_walk(session, tmp_path):
    render_walk(random_room(5_000_001), 6, kinect(160), tmp_path / "walk")
    session.gui.set("It becomes", WALK)
    assert not session.gui.find("Frames").seen
    session.gui.upload("Recording …", "my walk.zip", zipped(tmp_path / "walk"))
    (upload,) = session.folder.iterdir()
    assert session.spec.source == Recorded(str(upload / "my-walk"))
    assert "TUM: 6 frames become one surface" in session.gui.text(FOLDER)
    assert session.gui.find("Scene").value == "my-walk"
    assert session.results.view("scene").nodes[0].name.startswith("frame_0000")
    assert "One camera walked through the room" in session.gui.text()
    assert sorted(path.name for path in (upload / "own").iterdir()) == ["my walk.zip"]
    session.gui.set("It becomes", MOMENTS)
    assert session.gui.find("Frames").seen


def test_a_rig_stays_a_rig_whatever_a_recording_becomes(session, tmp_path):
    save_rig(tmp_path / "rig", orbit(2))
    session.gui.set("It becomes", WALK)
    session.gui.upload("Recording …", "rig.zip", zipped(tmp_path / "rig"))
    assert isinstance(session.spec.source, RigFolder)


@pytest.mark.parametrize("packed", [False, True])
def test_a_bag_may_stay_one_recording_by_its_own_name(session, tmp_path, packed):
    write_bag(tmp_path / "walk", load_demo("living-room"), "mcap", moments=2)
    (bag,) = (tmp_path / "walk").glob("*.mcap")
    content = zipped(bag.parent) if packed else bag.read_bytes()
    session.gui.set("It becomes", WALK)
    session.gui.upload("Recording …", "desk.zip" if packed else "desk.mcap", content)
    assert isinstance(session.spec.source, Recorded)
    assert Path(session.spec.source.path).exists()
    assert Path(session.spec.source.path).suffix in ("", ".mcap")


def test_a_demo_may_be_a_walk(session):
    session.gui.set("Scene", DEMOS["living-room-walk"].title)
    assert session.spec.source == demo_of("living-room-walk")


def test_a_zip_of_several_names_them_and_takes_none(session, tmp_path):
    save_rig(tmp_path / "both" / "first", orbit(1))
    write_tum(tmp_path / "both" / "second", orbit(2))
    session.gui.upload("Recording …", "both.zip", zipped(tmp_path / "both"))
    assert "holds 2 rigs or recordings (both/first, both/second); pack one" in session.notices.pop()
    assert isinstance(session.spec.source, Demo)


def test_a_pair_may_be_metres_in_floating_point_with_a_bare_matrix(session, tmp_path):
    (frame,) = orbit(1).frames
    for label, name, content in (
        ("Colour image …", "color.ppm", cv2.imencode(".ppm", frame.rgb[..., ::-1])[1].tobytes()),
        ("Depth image …", "depth.pfm", cv2.imencode(".pfm", frame.depth.z_m)[1].tobytes()),
        ("Intrinsics …", "k.txt", b"30 0 19.5\n0 30.5 14.5\n0 0 1\n"),
    ):
        session.gui.upload(label, name, content)
    session.gui.press("Reconstruct this pair")
    (node,) = session.results.view("scene").nodes
    np.testing.assert_array_equal(node.color.rgb, frame.rgb)
    assert node.coverage == pytest.approx(frame.depth.coverage)
    assert "unlikely for a room" not in session.gui.text()
    session.gui.set("Units per m", 20.0)
    session.gui.press("Reconstruct this pair")
    assert "unlikely for a room: try --depth-scale 1" in session.gui.text()

    assert session.gui.find("Scene").value == "color.ppm"


def test_images_of_one_name_are_both_kept_by_it(session):
    (frame,) = orbit(1).frames
    depth_mm = np.nan_to_num(1000.0 * frame.depth.z_m).astype(np.uint16)
    color, depth = (cv2.imencode(".png", image)[1].tobytes() for image in (frame.rgb, depth_mm))
    for label, name, content in (
        ("Colour image …", "rgb/0001.PNG", color),
        ("Depth image …", r"C:\depth\0001.png", depth),
        ("Intrinsics …", "k.txt", b"30 0 19.5\n0 30.5 14.5\n0 0 1\n"),
    ):
        session.gui.upload(label, name, content)
    session.gui.press("Reconstruct this pair")
    source = session.spec.source
    (upload,) = (path for path in session.folder.iterdir() if path.name.startswith("upload"))
    paths = [Path(one).relative_to(upload) for one in (source.color, source.depth, source.intrinsics)]
    assert [str(path) for path in paths] == ["own/0001.png", "own/depth/0001.png", "own/k.txt"]


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.zip", b"nonsense", "cannot be read as a ZIP"),
        ("a.bag", b"nonsense", "bag"),
        ("a.txt", b"nonsense", "is a file of no known kind"),
        ("a.zip", zipfile.ZipFile, "of no known kind"),
    ],
)
def test_what_is_no_recording_gets_a_sentence_and_the_scene_stays(session, name, content, sentence):
    if not isinstance(content, bytes):
        stream = io.BytesIO()
        with content(stream, "w") as archive:
            archive.writestr("../../outside.txt", "text")
        content = stream.getvalue()
    session.gui.upload("Recording …", name, content)
    assert sentence in session.notices.pop()
    assert isinstance(session.spec.source, Demo)
    assert "Nothing could be used" in session.gui.text(FOLDER)
    assert [path.name for path in session.folder.glob("upload0/**/*")] == ["own", name]
    assert not (session.folder.parent / "outside.txt").exists()


def test_too_much_is_refused_before_it_is_unpacked_or_kept(session, tmp_path, monkeypatch):
    save_rig(tmp_path / "rig", orbit(1))
    monkeypatch.setattr(recording_job, "UNPACKED_LIMIT_BYTES", 100)
    session.gui.upload("Recording …", "rig.zip", zipped(tmp_path / "rig"))
    assert "packetmesh import" in session.notices.pop()
    monkeypatch.setattr(own, "RECORDING_LIMIT_BYTES", 100)
    with pytest.raises(InputError, match="takes up to 0 MB"):
        session.gui.upload("Recording …", "rig.zip", zipped(tmp_path / "rig"))
    assert len(list(session.folder.glob("**/*.zip"))) == 1

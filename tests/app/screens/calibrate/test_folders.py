"""Parts of the Calibrate screen that need no photographs: range, noise, the calibration in use, uploads."""

from __future__ import annotations

import io
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.state import BoardViews, Spec
from app.screens.calibrate import cameras, noise_job
from app.screens.calibrate.cameras import CamerasFound
from app.screens.calibrate.noise import READY, STOPPED, NoiseFolder
from app.screens.calibrate.noise_view import NoiseRequest, NoiseView
from app.screens.calibrate.numbers import meanings
from app.screens.calibrate.trust import TrustFolder
from app.screens.calibrate.uploads import keep_photographs
from app.screens.calibrate.use import BEFORE, USE, UseRow
from app.screens.calibrate.view import CalibrationView
from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.calibration.board import Board
from pipeline.calibration.lens import FREE
from pipeline.calibration.shots import NodeShots, node_shots
from pipeline.sources import Calibrated, Demo
from tests.app.fakes import Impatient, ui_of


@pytest.fixture
def ui():
    return ui_of(kind=Impatient)


# The range of the verdict.


def test_the_scene_sets_the_range_unless_a_stop_or_a_hand_has(ui):
    folder = TrustFolder(ui, lambda: None)

    def range_m():
        return folder.request("node_00").range_m

    folder.at_range([1.0, 2.0])
    assert range_m() == 1.5
    folder.set(2.0)
    folder.at_range([1.0])
    assert range_m() == 2.0
    folder.set(None)
    assert range_m() == 1.0
    ui.gui.set("Range (m)", 2.5)
    folder.at_range([3.0])
    assert range_m() == 2.5


# The noise experiment.


def trials(count):
    """So many trials."""
    names = FREE["thesis"]
    found = np.ones((count, len(names)))
    return NoiseView(NoiseRequest("node_00", 0.5), names, np.ones(len(names)), found, np.eye(len(names)), 0.3)


@pytest.fixture
def replays():
    """Replays that were started, each by its number, noise and lens."""
    return []


@pytest.fixture
def noise(ui, replays):
    return NoiseFolder(ui, lambda *replay: replays.append(replay), lambda: None)


def test_a_second_replay_with_the_same_noise_is_shown(ui, noise, replays):
    for _ in range(2):
        ui.gui.press("Experiment", "Replay")
    (first, *same), (second, *again) = replays
    assert same == again
    noise.ended(first, None)
    assert STOPPED not in ui.gui.text()
    noise.load(second, trials(3))
    assert "3 of 200 trials" in ui.gui.text()
    noise.load(first, trials(7))
    assert "3 of 200 trials" in ui.gui.text()
    noise.ended(second, trials(200))
    assert "All trials" in ui.gui.text()


def test_results_of_a_forgotten_replay_are_ignored(ui, noise, replays):
    ui.gui.press("Experiment", "Replay")
    noise.forget()
    noise.load(replays[0][0], trials(3))
    noise.ended(replays[0][0], None)
    assert READY in ui.gui.text()


def test_a_fisheye_is_not_repeated_with_distortions_that_it_does_not_have(monkeypatch):
    fisheye = SimpleNamespace(name="node_00", calibration=SimpleNamespace(lens="fisheye"))
    found = CamerasFound(CalibrationView(Board(), (fisheye,)), {})
    monkeypatch.setattr(noise_job, "finished", lambda _: (yield from ()) or found)
    monkeypatch.setattr(noise_job, "cameras_of", lambda *_: None)
    spec = Spec(Demo("office"), views=BoardViews("photographs"))
    with pytest.raises(InputError, match="choose 'this lens' under Seen through"):
        drain(noise_job.noise_job(None, spec, NoiseRequest("node_00", 0.1, other_lens=True)))


@pytest.mark.parametrize(
    ("lens", "name", "words"),
    [
        ("thesis", "k1", "square of the distance"),
        ("rational", "k3", "sixth power of the distance"),
        ("rational", "k4", "denominator of the rational model"),
        ("fisheye", "k1", "third power of the angle"),
        ("fisheye", "k4", "ninth power of the angle"),
        ("fisheye", "fx", "Focal length"),
    ],
)
def test_every_parameter_is_explained_by_its_lens_model(lens, name, words):
    """A fisheye: theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)."""
    assert words in meanings(FREE[lens])[name]
    assert set(FREE[lens]) <= meanings(FREE[lens]).keys()


# The calibration in use.


class Chain:
    """A session that keeps its settings; a calibration is written when the test says so."""

    def __init__(self, ui):
        self.spec, self.ends = Spec(Demo("office")), []
        self.row = UseRow(ui, self)

    def new_folder(self):
        return Path("session")

    def quick_job(self, job, folder, on_end):
        self.ends.append(lambda: on_end(folder))

    def want(self, spec):
        self.spec = spec
        self.row.follow(spec)

    def show(self, holes):
        """A surface has been computed."""
        self.row.surface(SimpleNamespace(quality=SimpleNamespace(no_hit_ray_share=holes), truth=None))


def test_what_is_in_use_follows_undo_and_redo(ui):
    chain = Chain(ui)
    before = chain.spec
    ui.gui.press("In the chain", USE)
    chain.ends.pop()()
    used = chain.spec
    assert used.source == Calibrated(before.source, "session/calibration_01")
    for spec, in_use in ((used, True), (before, False), (used, True)):
        chain.want(spec)
        assert ("**In use** (calibration_01)" in ui.gui.text()) == in_use
    ui.gui.press("In the chain", BEFORE)
    assert chain.spec == before
    assert "In use" not in ui.gui.text()


def test_a_calibration_that_is_written_after_another_scene_was_opened_is_not_used(ui):
    chain = Chain(ui)
    ui.gui.press("In the chain", USE)
    chain.want(replace(chain.spec, source=Demo("box-on-table")))
    chain.ends.pop()()
    assert chain.spec.source == Demo("box-on-table")
    assert "Writing" not in ui.gui.text()


def test_only_surfaces_of_the_same_settings_are_compared(ui):
    chain = Chain(ui)
    chain.show(0.4)
    ui.gui.press("In the chain", USE)
    chain.ends.pop()()
    assert "40.0 %" not in ui.gui.text()
    chain.show(0.2)
    assert all(share in ui.gui.text() for share in ("40.0 %", "20.0 %"))
    surface = replace(chain.spec.config.surface, max_points=chain.spec.config.surface.max_points // 2)
    chain.want(replace(chain.spec, config=replace(chain.spec.config, surface=surface)))
    assert "20.0 %" not in ui.gui.text()
    chain.show(0.3)
    assert "30.0 %" in ui.gui.text()
    assert "40.0 %" not in ui.gui.text()


# Uploads, and names.


def packed(files):
    """A ZIP of these files."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return SimpleNamespace(name="boards.zip", content=content.getvalue())


def test_photographs_of_two_cameras_do_not_replace_each_other(tmp_path):
    board = {"cam0/board.json": b"{}", "cam1/board.json": b"{}"}
    mixed = packed({"cam0/color_00.png": b"0", "cam1/color_00.png": b"1", **board})
    with pytest.raises(InputError, match=r"several files for node_00/color_00\.png.*own folder: node_00"):
        keep_photographs(mixed, tmp_path, "node_00")
    assert list(tmp_path.iterdir()) == []
    apart = packed({"node_00/color_00.png": b"0", "node_01/color_00.png": b"1", **board})
    kept = keep_photographs(apart, tmp_path, "node_00")
    assert sorted(kept) == ["board.json", "node_00/color_00.png", "node_01/color_00.png"]


def test_photographs_of_one_name_are_all_kept(tmp_path):
    """A telephone names each picture that it takes for a page image.jpg; a number says the moment."""

    def keep(name, content):
        return keep_photographs(SimpleNamespace(name=name, content=content), tmp_path, "node_00")[0]

    names = [keep("image.jpg", content) for content in (b"0", b"1", b"0", b"2")]
    assert names == [f"node_00/image-{number}.jpg" for number in (1, 2, 1, 3)]
    assert keep("color_05.png", b"5") == keep("color_05.png", b"5, again") == "node_00/color_05.png"
    assert keep("color_04.png", b"4") == "node_00/color_04.png"
    assert keep("image.jpg", b"3") == "node_00/image-6.jpg"
    shots = {shot.moment: shot.color.read_bytes() for shot in node_shots([tmp_path])[0].shots}
    assert shots == {"1": b"0", "2": b"1", "3": b"2", "4": b"4", "5": b"5, again", "6": b"3"}


def test_a_zip_has_one_board(tmp_path):
    boards = packed({"a/board.json": b"{}", "b/board.json": b'{"rows": 9}', "a/color_00.png": b"0"})
    with pytest.raises(InputError, match=r"several board\.json that differ; leave one"):
        keep_photographs(boards, tmp_path, "node_00")


def test_a_camera_is_found_by_its_name_alone():
    one = SimpleNamespace(name="node_00")
    view = CalibrationView(Board(), (one,))
    assert view.camera("node_00") is one
    assert view.camera("node_07") is None


def test_a_node_without_a_colour_camera_has_a_whole_sentence_for_its_depth():
    found = CamerasFound(CalibrationView(Board()), {})
    sentence = cameras._bias(NodeShots("node_00", Path(), ()), found)
    assert sentence == "node_00 has no lens yet, and the depth bias cannot be estimated without one"

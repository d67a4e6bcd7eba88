"""The Calibrate screen over photographs of known cameras, without a browser."""

from __future__ import annotations

import io
import json
import re
import shlex
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import viser

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.calibrate import panel
from app.screens.calibrate.labels import AROUND, COVERAGE, DEPTH, HALVES, NEXT, NO_RIG, UNCERTAINTY
from app.screens.calibrate.lesson import left_out
from app.screens.calibrate.noise import OTHER, READY
from app.screens.calibrate.noise_view import NoiseRequest
from app.screens.calibrate.panel import CalibratePanel
from app.screens.calibrate.use import BEFORE, USE
from packetmesh.errors import InputError
from pipeline.io.calibrations import node_files
from pipeline.io.depth_correction import read_depth_correction
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.poses import read_pose
from pipeline.sources import Calibrated, RigFolder
from tests.app.boards import (
    BLANK,
    BOARD,
    CAMERAS,
    MOMENTS,
    OFFSET_M,
    T_WORLD_CAMERA,
    save_believing_rig,
    save_boards,
)
from tests.app.fakes import Bench, Impatient, page_calls, ui_of

pytestmark = pytest.mark.xdist_group("calibrate panel")
BENT = "The board may be bent"
UPLOADS, NOISE = "Use your own photographs", "What if the points were noisier?"


@pytest.fixture(scope="module")
def server():
    server = viser.ViserServer(port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="module")
def boards(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boards")
    save_boards(folder)
    return folder


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    save_believing_rig(folder)
    return folder


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return Store(str(tmp_path_factory.mktemp("store")))


def zipped(folder, names):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name in names:
            archive.write(folder / name, name)
    return content.getvalue()


@pytest.fixture(scope="module")
def uploads(tmp_path_factory):
    """Where every screen keeps all photographs, so that the store knows what the first one found in them."""
    return tmp_path_factory.mktemp("uploads")


@pytest.fixture
def screen(server, store, rig, boards, uploads):
    """The screen with all photographs uploaded and looked at."""
    bench = empty(server, store, rig, uploads)
    names = [str(path.relative_to(boards)) for path in sorted(boards.rglob("*.*"))]
    bench.gui.upload("Photograph or ZIP …", "boards.zip", zipped(boards, names))
    bench.gui.press("Photographs", "Find the cameras", UPLOADS)
    return bench


def empty(server, store, rig, tmp_path):
    spec = Spec(RigFolder(str(rig)))
    steps = ("scene", "calibrate")
    bench = Bench(CalibratePanel, ui_of(server.scene, kind=Impatient), store, tmp_path, steps, spec)
    bench.advance()
    bench.panel.on_show()
    return bench


def calibration(bench):
    return bench.results.view("calibrate")


def test_without_photographs_it_says_so_and_shows_the_scene(server, store, rig, tmp_path):
    bench = empty(server, store, rig, tmp_path)
    assert "without photographs of a board" in bench.gui.text()
    assert bench.gui.find("Open").seen
    assert any(name.endswith("cloud") for name in bench.ui.scene.names("/calibrate"))
    assert bench.panel.command == bench.spec.command()


def test_both_cameras_are_found_within_their_intervals(screen):
    view = calibration(screen)
    assert [camera.name for camera in view.cameras] == ["node_00", "node_01"]
    for camera, true in zip(view.cameras, CAMERAS, strict=True):
        found = camera.calibration
        for name, value in (("fx", true.fx_px), ("cx", true.cx_px), ("k1", true.distortion[0])):
            assert abs(found.parameters[name] - value) < 5.0 * found.standard_errors[name]
    placed = view.rig.cameras[1].T_first_camera
    true = np.linalg.inv(T_WORLD_CAMERA[0]) @ T_WORLD_CAMERA[1]
    assert np.abs(placed - true).max() < 0.003
    depth = view.depth["node_00"]
    assert abs(np.mean(depth.curve.before_m) + OFFSET_M) < 0.002
    assert abs(np.mean(depth.curve.after_m)) < 0.002
    assert "no depth images" in view.depth["node_01"]


def test_every_photograph_has_a_bar_and_a_click_shows_it(screen):
    (bars,) = [one for one in screen.gui.handles if "packetmesh-views" in str(getattr(one, "content", ""))]
    assert bars.content.count("data-packetmesh-pick=") == MOMENTS + 1
    assert "View 99: no board found" in bars.content
    field = screen.gui.find("View that was clicked")
    for name in ("3", BLANK):
        field.value = json.dumps([name, 1])
        screen.gui._fire(field, field)
        assert f"View {name}" in screen.gui.text()
    assert "Nothing in it looks like a circle" in screen.gui.text()
    field.value = "not from the page"
    screen.gui._fire(field, field)
    assert f"View {BLANK}" in screen.gui.text()


def test_the_address_says_whose_which_photograph_and_pictures_are_shown(screen):
    parts, gui = screen.panel.in_address, screen.gui
    keys = ("node", "photo", "pictures")
    assert [parts[key].place() for key in keys] == ["", "", ""]
    gui.set("Camera", "node_01")
    gui.press("View", "Next")
    gui.set("Compare", COVERAGE)
    gui.set("Split (%)", 30.0)
    said = [parts[key].place() for key in keys]
    assert said == ["node_01", "1", "photo,coverage,30"]
    for places in (["", "", ""], said):
        for key, place in zip(keys, places, strict=True):
            parts[key].take(place)
        assert [parts[key].place() for key in keys] == places
    assert "View 1" in gui.text()
    with pytest.raises(InputError, match="such as photo,straightened,50"):
        parts["pictures"].take("photo,halves,50")
    with pytest.raises(InputError, match="77, which does not exist here; try one of 0, 1"):
        parts["photo"].take("77")


def test_what_an_address_asks_for_is_shown_once_the_cameras_are_there(
    server, store, rig, boards, uploads, monkeypatch
):
    built = CalibratePanel.build

    def build(panel):
        built(panel)
        for key, place in (("node", "node_01"), ("photo", "2")):
            panel.in_address[key].take(place)

    monkeypatch.setattr(CalibratePanel, "build", build)
    bench = screen.__wrapped__(server, store, rig, boards, uploads)
    assert bench.gui.find("Camera").value == "node_01"
    assert bench.panel.in_address["photo"].place() == "2"


def test_a_dropped_view_is_compared_with_all_views_and_comes_back(screen):
    gui = screen.gui
    gui.press("View", "Next")
    gui.press("View", "Drop")
    assert screen.spec.views.dropped == (("node_00", "1"),)
    camera = calibration(screen).camera("node_00")
    assert len(camera.calibration.views) == MOMENTS - 1
    assert camera.unseen_rms_px("1") is not None
    assert f"{MOMENTS - 1} of {MOMENTS + 1}" in gui.text()
    assert f"{MOMENTS} of {MOMENTS + 1}" in gui.text()
    words = shlex.split(screen.panel.command)
    assert words[words.index("--without") + 1] == "node_00/color_01.png"
    gui.press("View", "Drop")
    assert screen.spec.views.dropped == ()


def test_the_verdict_follows_the_accuracy(screen):
    gui = screen.gui
    gui.set("Accuracy (mm)", 20.0)
    assert "✓ PASS" in gui.text()
    gui.set("Range (m)", 6.0)
    gui.set("Accuracy (mm)", 0.5)
    assert "✗ FAIL" in gui.text()


def test_without_a_lens_there_is_no_verdict_until_the_lens_is_back(screen):
    gui, spec = screen.gui, screen.spec
    gui.set("Accuracy (mm)", 20.0)
    few = tuple(("node_00", str(moment)) for moment in range(2, MOMENTS))
    screen.want(replace(spec, views=replace(spec.views, dropped=few)))
    assert calibration(screen).camera("node_00").calibration is None
    assert "✓ PASS" not in gui.text()
    assert "Noise, 95 %" not in gui.text("Good enough for what?")
    screen.want(spec)
    assert "✓ PASS" in gui.text()
    assert "Noise, 95 %" in gui.text("Good enough for what?")


def test_a_cancelled_verdict_comes_on_retry(screen):
    gui, screen.refuse = screen.gui, "Cancelled."
    gui.set("Accuracy (mm)", 20.0)
    assert "✓ PASS" not in gui.text()
    screen.refuse = ""
    screen.panel.on_action("Retry")
    assert "✓ PASS" in gui.text()


@pytest.mark.parametrize("pair", [UNCERTAINTY, HALVES, COVERAGE, NEXT, DEPTH])
def test_every_comparison_has_its_pictures(screen, pair):
    gui = screen.gui
    before = gui.all("image")[0].image
    gui.set("Compare", pair)
    assert "not available for this view" not in gui.text()
    assert not np.array_equal(gui.all("image")[0].image, before)


@pytest.mark.parametrize(("around", "inside"), [(name, name) for name in AROUND])
def test_boards_and_cameras_stand_in_space(screen, around, inside):
    screen.gui.set("In space", around)
    names = screen.ui.scene.names("/calibrate")
    frusta = [name for name in names if name.startswith("/calibrate/frustum-") and name.count("/") == 2]
    sheets = [name for name in names if name.startswith("/calibrate/board-") and name.count("/") == 2]
    expected = {"camera": (1, MOMENTS), "board": (MOMENTS, 1), "rig": (3, MOMENTS)}[AROUND[around]]
    assert (len(frusta), len(sheets)) == expected
    assert NO_RIG not in screen.gui.text()


def test_noise_is_replayed_and_another_lens_misses_the_truth(screen):
    gui = screen.gui
    assert READY in gui.text(NOISE)
    gui.set("Noise (px)", 0.1)
    assert "All trials" in gui.text(NOISE)
    view = screen.panel._noise._view
    assert view.trials == view.request.trials == 200
    assert 0.8 < view.rmse("fx") / view.predicted("fx") < 1.25
    assert view.inside("fx", "k1").mean() > 0.85
    gui.set("Seen through", OTHER)
    view = screen.panel._noise._view
    assert view.rmse("cy") > 2.0 * view.predicted("cy")
    assert view.inside("cx", "cy").mean() < 0.5


@pytest.fixture
def few_trials(monkeypatch):
    """Where many more would show no more."""
    monkeypatch.setattr(panel, "NoiseRequest", partial(NoiseRequest, trials=20))


def test_without_noise_the_truth_is_found(few_trials, screen):
    screen.gui.set("Noise (px)", 0.0)
    view = screen.panel._noise._view
    assert view.rmse("fx") < 1e-2
    assert view.close_share == 1.0
    assert view.halved == 0


def test_use_lays_the_calibration_over_the_rig_and_before_takes_it_away(screen):
    gui, source = screen.gui, screen.spec.source
    gui.press("In the chain", USE)
    used = screen.spec.source
    assert isinstance(used, Calibrated)
    assert used.source == source
    assert "**In use**" in gui.text()
    assert "--calibration" in screen.spec.command()
    folder = Path(used.folder)
    assert folder.relative_to(screen.folder).name == "calibration_01"
    for node, true in enumerate(CAMERAS):
        files = node_files(folder / f"node_{node:02d}")
        assert abs(read_intrinsics(files["intrinsics"]).fx_px - true.fx_px) < 2.0
        assert np.abs(read_pose(files["pose"]) - T_WORLD_CAMERA[node]).max() < 0.003
    correction = read_depth_correction(folder / "node_00/depth_correction.json")
    assert (
        abs(float(correction.corrected_m(np.array([1.0]), np.array([[160, 120]]))[0]) - 1.0 - OFFSET_M)
        < 0.004
    )
    loaded = used.load()
    assert np.allclose(loaded.frames[0].depth.z_m, 1.5 + OFFSET_M, atol=0.02)
    gui.press("In the chain", BEFORE)
    assert screen.spec.source == source
    assert "**In use**" not in gui.text()


def test_a_rational_lens_is_used_in_the_chain(screen):
    screen.gui.set("Lens", "rational")
    screen.gui.press("In the chain", USE)
    assert isinstance(screen.spec.source, Calibrated)
    assert len(screen.spec.source.load().frames[0].intrinsics.distortion) == 8


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("notes.txt", b"x", "notes.txt is no photograph"),
        ("boards.zip", b"no zip", "boards.zip cannot be read as a ZIP"),
        ("large.png", b"\0" * (65 << 20), "large.png has 65 MB"),
    ],
)
def test_an_upload_that_cannot_be_used_is_a_sentence(server, store, rig, tmp_path, name, content, sentence):
    bench = empty(server, store, rig, tmp_path)
    with pytest.raises(InputError, match=sentence):
        bench.gui.upload("Photograph or ZIP …", name, content)


def test_a_zip_does_not_reach_out_of_its_folder(server, store, rig, boards, tmp_path):
    bench = empty(server, store, rig, tmp_path)
    content, picture = io.BytesIO(), (boards / "node_00/color_00.png").read_bytes()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr(zipfile.ZipInfo("../../node_01/../evil.png"), picture)
    bench.gui.upload("Photograph or ZIP …", "evil.zip", content.getvalue())
    written = [path.relative_to(tmp_path) for path in tmp_path.rglob("*.png")]
    assert [str(path) for path in written] == ["photographs_000/node_01/evil.png"]
    assert not list(tmp_path.parent.glob("evil*"))


def one_camera(server, store, rig, boards, tmp_path):
    """The screen with the photographs of the first camera alone."""
    bench = empty(server, store, rig, tmp_path)
    names = [f"node_00/color_{moment:02d}.png" for moment in range(MOMENTS)]
    bench.gui.upload("Photograph or ZIP …", "one.zip", zipped(boards, [*names, "board.json"]))
    bench.gui.press("Photographs", "Find the cameras", UPLOADS)
    return bench


def test_the_board_of_one_camera_may_be_bent(server, store, rig, boards, tmp_path):
    bench = one_camera(server, store, rig, boards, tmp_path)
    gui = bench.gui
    gui.set("In space", next(name for name, key in AROUND.items() if key == "rig"))
    assert NO_RIG in gui.text()
    assert not gui.find(BENT).disabled
    assert "Board bent by" not in gui.text()
    assert "--board-warp" not in bench.panel.command
    gui.set(BENT, True)
    warp = calibration(bench).camera("node_00").warp
    assert warp.off_plane_m.shape == (BOARD.rows, BOARD.columns)
    assert warp.used == (warp.rms_px < warp.flat_rms_px)
    assert f"{1000.0 * warp.bend_m:.2g} mm, {'' if warp.used else 'not '}used" in gui.text()
    assert "Board bent by" in gui.text("Advanced")
    assert len(gui.all("image", "Advanced")) == 1
    assert "--board-warp" in shlex.split(bench.panel.command)
    gui.press("In the chain", USE)
    used = node_files(next(bench.folder.glob("*/calibration_01")) / "node_00")
    found = calibration(bench).camera("node_00").calibration
    assert read_intrinsics(used["intrinsics"]).fx_px == pytest.approx(found.parameters["fx"], rel=1e-9)
    gui.set(BENT, False)
    assert calibration(bench).camera("node_00").warp is None
    assert gui.all("image", "Advanced") == []


def test_several_cameras_have_a_flat_board(screen):
    box = screen.gui.find(BENT)
    assert box.disabled
    assert "Only with the photographs of **one camera**" in screen.gui.text("Advanced")
    assert not screen.spec.views.bent


def test_what_goes_together_is_shown_with_the_parameters(screen):
    told = screen.gui.text("All parameters and their uncertainty")
    assert re.search(r"Correlation</button></b>: .*\.\d\d", told)
    assert "fx and fy: " in told


def test_the_trials_are_in_the_dock_while_the_screen_is_shown(few_trials, screen):
    gui = screen.gui

    def docked():
        told = (str(getattr(one, "content", "")) for one in gui.handles)
        calls = [call for one in told for call in page_calls(one)]
        (visible,) = [message["visible"] for name, (message, *_) in calls if name == "plots"]
        return visible

    assert not docked()
    gui.set("Noise (px)", 0.2)
    assert docked()
    screen.panel.on_hide()
    assert not docked()
    screen.panel.on_show()
    assert docked()
    gui.set("Camera", "node_01")
    assert not docked()
    assert READY in gui.text(NOISE)


def test_too_few_photographs_are_a_sentence_and_shown(server, store, rig, boards, tmp_path):
    bench = empty(server, store, rig, tmp_path)
    names = ["node_00/color_00.png", "node_00/color_01.png", "board.json"]
    bench.gui.upload("Photograph or ZIP …", "two.zip", zipped(boards, names))
    bench.gui.press("Photographs", "Find the cameras", UPLOADS)
    assert "is found in 2 of 2 images" in bench.gui.text()
    assert "View 0, 35 points found" in bench.gui.text()
    assert not bench.gui.find("In the chain").seen
    bench.gui.press("Photographs", "Forget them", UPLOADS)
    assert "without photographs of a board" in bench.gui.text()


def test_a_wrong_board_shows_the_blobs_that_were_seen(server, store, rig, boards, tmp_path):
    bench = empty(server, store, rig, tmp_path)
    names = [f"node_00/color_{moment:02d}.png" for moment in range(4)]
    bench.gui.upload("Photograph or ZIP …", "some.zip", zipped(boards, names))
    bench.gui.set("Rows", 9, UPLOADS)
    bench.gui.press("Photographs", "Find the cameras", UPLOADS)
    assert re.search(r"no board found.*Red: \d+ blobs", bench.gui.text())


def test_the_lesson_leaves_three_views_that_are_tilted_most_alike(screen):
    camera = calibration(screen).camera("node_00")
    out = {name for _, name in left_out(camera, "three alike")}
    kept = [view for view in camera.calibration.views if view.name not in out]
    assert len(kept) == 3
    normals = np.array([view.T_camera_board[:3, 2] for view in kept])
    spread = np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0))).max()
    every = np.array([view.T_camera_board[:3, 2] for view in camera.calibration.views])
    assert 8.0 <= spread < np.degrees(np.arccos(np.clip(every @ every.T, -1.0, 1.0))).max()
    assert list(left_out(camera, "all")) == []


def test_the_lesson_takes_views_away_and_gives_them_back(screen):
    gui = screen.gui
    for stop in range(1, 8):
        gui.press("Go", "Next")
        gui.press("Your guess", "Skip")
        assert f"({stop} of 7)" in gui.text()
        used = len(calibration(screen).camera("node_00").calibration.views)
        assert used == (3 if stop in (2, 6) else MOMENTS)
        assert isinstance(screen.spec.source, Calibrated) == (stop == 7)
    gui.press("Go", "Back")
    assert not isinstance(screen.spec.source, Calibrated)

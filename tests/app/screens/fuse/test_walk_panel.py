"""The Fuse screen with a walk made by hand, and no browser."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
import viser

from app.compute.state import Results, Spec
from app.dock.dock import Dock
from app.lesson.files import SCENE
from app.screens.fuse.labels import RACES, RESULT, WALK
from app.screens.fuse.panel import FusePanel
from app.screens.fuse.walk_draw import WalkDrawing
from app.screens.fuse.walk_job import view_of
from app.screens.fuse.walk_lesson import NUMBERS, WalkLook
from app.screens.fuse.walk_part import NO_LOOP
from app.session.history import History
from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.sources import Demo, Recorded
from pipeline.spec import key
from pipeline.stages import Done
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig
from tests.app.fakes import Bench, Impatient, ui_of
from tests.app.screens.fuse.walks import CAMERA, FRAMES, LOST, T_COLOR_DEPTH, pose, walk

SIZE_PX = (64, 48)


def written(folder):
    """A recording in TUM's form whose images grow brighter; what is tracked is made by hand."""
    lists = {"rgb": [], "depth": []}
    for kind, lines in lists.items():
        (folder / kind).mkdir(parents=True)
        for k in range(FRAMES):
            image = np.full(SIZE_PX[::-1], 10_000, np.uint16)
            if kind == "rgb":
                image = np.full((*SIZE_PX[::-1], 3), 20 + 5 * k, np.uint8)
            cv2.imwrite(str(folder / kind / f"{k:02d}.png"), image)
            lines.append(f"{0.1 * k:.1f} {kind}/{k:02d}.png")
        (folder / f"{kind}.txt").write_text("\n".join(lines))
    matrix = [60, 0, 0, 0, 60, 0, 32, 24, 1]
    camera = {"width": SIZE_PX[0], "height": SIZE_PX[1], "intrinsic_matrix": matrix}
    (folder / "intrinsics.json").write_text(json.dumps(camera))
    return Recorded(str(folder))


def tracked(source, store):
    """Put the rig of a recording into the store, as if it had been tracked."""
    camera = CameraIntrinsics.pinhole(60.0, 60.0, 32.0, 24.0, *SIZE_PX)
    depth = DepthMap(np.full(SIZE_PX[::-1], 2.0, np.float32))
    frame = RgbdFrame("frame_00000", np.full((*SIZE_PX[::-1], 3), 90, np.uint8), depth, camera, pose(0))

    def rig():
        yield
        return Done(Rig("walk", (frame,), walk=walk()), 0.0)

    drain(store.remember(key(Spec(source), "rig"), rig))
    return source


@pytest.fixture(scope="module")
def recording(store, tmp_path_factory):
    return tracked(written(tmp_path_factory.mktemp("recordings") / "walk"), store)


@pytest.fixture(scope="module")
def bench(store, recording):
    server = viser.ViserServer(port=0, verbose=False)
    kind = ui_of(server.scene, kind=Impatient)
    bench = Bench(FusePanel, kind, store, steps=("scene",), spec=Spec(recording))
    bench.panel.on_show()
    bench.advance()
    yield bench
    server.stop()


@pytest.fixture
def fuse(bench):
    """The screen with the walk at its end, without a loop."""
    for name in ("show", "loop", "frame"):
        bench.panel.in_address[name].take("")
    return bench


def seen(bench):
    """Number of map points that are drawn."""
    drawing = bench.panel._walk._drawing
    counts = np.diff(drawing.ends, prepend=0)
    return sum(int(count) for piece, count in zip(drawing._pieces, counts, strict=True) if piece.visible)


def test_a_recording_opens_with_its_walk_and_without_a_race(fuse):
    gui = fuse.gui
    assert gui.find("Show").value == WALK
    assert gui.find("Show").options == (WALK, *tuple(RACES)[1:], RESULT)  # it has one node
    assert gui.find("Loop").seen
    assert not gui.find("Compare").seen
    assert fuse.panel._raced is None
    assert fuse.notices == []
    assert "One camera walked through the room" in gui.text()
    assert fuse.drawn("/fuse/walk").visible
    assert not fuse.drawn("/fuse/race") or not fuse.drawn("/fuse/race").visible
    assert f">{FRAMES} (10 per second)</td>" in gui.text()


def test_before_a_recording_is_tracked_its_walk_is_awaited(store, recording):
    server = viser.ViserServer(port=0, verbose=False)
    bench = Bench(FusePanel, ui_of(server.scene), store, steps=(), spec=Spec(recording))
    bench.panel.on_show()
    assert bench.gui.find("Show").value == WALK
    assert bench.gui.find_starting("Lesson: How a walk").seen
    assert "as soon as the recording is tracked" in bench.gui.text()
    bench.panel.in_address["stop-walk"].take("3")
    bench.panel.in_address["show"].take("result")
    assert bench.panel.in_address["show"].place() == "result"
    bench.steps = ("scene",)
    bench.advance()
    assert bench.gui.find("Show").value == RESULT
    server.stop()


@pytest.mark.parametrize(("loop", "chosen"), [("0-39", "0-39"), ("5-7", "")])
def test_an_address_with_an_unknown_loop_shows_the_rest_of_its_walk(store, recording, loop, chosen):
    server, posted = viser.ViserServer(port=0, verbose=False), []
    ui = ui_of(server.scene, post=lambda *call: posted.append(call))
    bench = Bench(FusePanel, ui, store, steps=("scene",), spec=Spec(recording))
    bench.panel.on_show()
    bench.panel.in_address["loop"].take(loop)
    bench.panel._walk._take_look(WalkLook(moment=None))
    bench.advance()
    part = bench.panel._walk
    assert part._view.frame_at(part._dock.now_ns) == LOST[0]
    assert part._pictures.files
    assert bench.panel.in_address["loop"].place() == chosen
    told = [call for call in posted if call != (part._draw,)]  # a slow machine draws again meanwhile
    assert len(told) == (not chosen)
    for take, text in told:
        with pytest.raises(InputError, match="loop=5-7, which is no loop; choose one"):
            take(text)
    server.stop()


@pytest.mark.parametrize(("key", "text"), [("loop", "0-39"), ("show", "result")])
def test_a_recording_that_comes_back_by_undo_can_be_left_again_by_redo(store, recording, key, text):
    posted = []
    server = viser.ViserServer(port=0, verbose=False)
    ui = ui_of(server.scene, post=lambda *call: posted.append(call))
    bench = Bench(FusePanel, ui, store, steps=("scene",), spec=Spec(recording))
    bench.panels = [bench.panel]
    bench.panel.on_show()
    bench.advance()
    history = History(bench)
    history.begin()
    bench.panel.in_address[key].take(text)
    history.follow(by_hand=True)
    bench.want(Spec(Demo("box-on-table")))
    history.follow(by_hand=True)
    bench.steps = ()  # the recording's walk is still to come
    bench.results = Results()
    history.undo()
    bench.steps = ("scene",)
    bench.advance()
    history.follow(by_hand=True)
    for function, *arguments in posted:
        function(*arguments)
        history.follow(by_hand=True)
    assert bench.panel.in_address[key].place() == text
    assert history.has_steps == (True, True)
    server.stop()


def test_the_dock_is_hidden_with_its_screen(fuse):
    dock, part = fuse.panel._walk._dock, fuse.panel._walk
    assert dock._visible
    fuse.panel.on_hide()
    part.forget()
    part.begin()
    assert part._view is not None
    assert not dock._visible
    fuse.panel.on_show()
    assert dock._visible


def test_the_clock_moves_camera_and_picture_and_the_map_grows(fuse):
    part = fuse.panel._walk
    view, drawing = part._view, part._drawing
    assert seen(fuse) == len(view.points_m)
    part._take_moment("3")
    assert 0 < seen(fuse) <= view.until[3] < len(view.points_m)
    np.testing.assert_allclose(drawing._camera.position, view.at_m[3], atol=1e-6)
    assert drawing._camera.image.shape == (120, 160, 3)
    before = drawing._camera.image.copy()
    part._take_moment("9")
    assert drawing._camera.image.mean() - before.mean() == pytest.approx(30, abs=2)
    assert len(drawing._solid.points) == 9
    part._take_moment(str(LOST[0]))
    assert not drawing._camera.visible


def test_the_moment_and_the_thing_shown_come_back_from_an_address(fuse):
    places = fuse.panel.in_address
    assert [places[name].place() for name in ("show", "frame", "loop")] == ["", "", ""]
    places["frame"].take("5")
    assert places["frame"].place() == "5"
    places["frame"].take("999")
    assert places["frame"].place() == ""
    places["show"].take("result")
    assert (places["show"].place(), fuse.drawn("/fuse/walk").visible) == ("result", False)
    places["show"].take("race")
    assert (places["show"].place(), fuse.gui.find("Compare").seen) == ("race", True)
    for name, text in (("frame", "x"), ("loop", "3"), ("loop", "2-3"), ("show", "nothing")):
        with pytest.raises(InputError):
            places[name].take(text)


def test_a_click_on_a_loop_shows_its_cameras_and_numbers(fuse, monkeypatch):
    part = fuse.panel._walk
    marks = []
    monkeypatch.setattr(Dock, "mark", lambda dock, *what: marks.append(what))
    part._clicked(0, 0)
    loop = part._view.loops[0]
    first, last = sorted((loop.source, loop.target))
    assert fuse.panel.in_address["loop"].place() == f"{first}-{last}"
    assert marks == [(0, 0)]
    cameras = part._drawing._pair
    assert all(camera.visible for camera in cameras)
    np.testing.assert_allclose(cameras[1].position, part._view.at_m[last], atol=1e-6)
    assert f"frame {last}," in fuse.gui.text()
    fuse.gui.set("Loop", NO_LOOP)
    assert not any(camera.visible for camera in cameras)


def test_the_enlarged_drift_can_be_drawn_at_its_true_size(fuse):
    drawing, view = fuse.panel._walk._drawing, fuse.panel._walk._view
    large = drawing._shifted() - view.at_m
    fuse.gui.set("Enlarge the drift", False)
    np.testing.assert_allclose(drawing._shifted(), view.tracked_m)
    assert "times as large" not in fuse.gui.text()
    fuse.gui.set("Enlarge the drift", True)
    times = np.nanmax(np.linalg.norm(large, axis=1)) / np.nanmax(view.drift_m)
    assert times > 1.0
    assert f"drawn {times:.0f} times as large" in fuse.gui.text()


def test_every_stop_of_the_lesson_shows_its_moment(fuse):
    part = fuse.panel._walk
    (folder,) = part.lessons._folders.values()
    for stop in folder._lesson.stops:
        part._take_look(stop.look)
        moment = stop.look.moment
        assert part._frame == (LOST[0] if moment is None else round(moment * (FRAMES - 1)))
        assert part._chosen == {"none": -1, "largest": 0, "contradicting": 1}[stop.look.loop]
    values = part._numbers()
    assert set(values) == {*NUMBERS, SCENE}
    assert [values[name] for name in ("frames", "lost", "drift", "step", "pair")] == [
        "40",
        "3",
        "7.8 cm",
        "0.8 cm",
        "frames 0 and 39",
    ]
    part.lessons.leave()


def test_a_rig_has_no_walk_and_its_lesson_says_so(fuse, recording):
    fuse.want(Spec(Demo("box-on-table")))
    assert WALK not in fuse.gui.find("Show").options
    assert not fuse.gui.find("Loop").seen
    assert fuse.panel._walk._view is None
    with pytest.raises(InputError, match="no camera walks"):
        fuse.panel._walk._take_look(WalkLook())
    with pytest.raises(InputError, match="walk"):
        fuse.panel.in_address["show"].take("walk")
    fuse.want(Spec(recording))
    assert fuse.gui.find("Show").value == WALK
    assert fuse.panel._walk._view.frames == FRAMES


def test_a_camera_that_was_lost_at_once_has_a_frame_but_no_path(fuse):
    known = view_of(walk(lost=tuple(range(1, FRAMES)), loops=()), CAMERA, T_COLOR_DEPTH)
    drawing = WalkDrawing(fuse.ui.scene, "/fuse/walk/lost", known)
    drawing.show(5)
    assert not drawing._camera.visible
    drawing.show(0)
    assert drawing._camera.visible
    assert not any(line.visible for line in (drawing._solid, drawing._faint, drawing._dashed))
    assert known.last == 0

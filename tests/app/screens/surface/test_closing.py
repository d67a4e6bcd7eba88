"""What would close a hole: the job on a small room, and the button with its ghost."""

from dataclasses import replace

import numpy as np
import pytest

from app.compute.state import Spec
from app.screens.surface.closing import HoleClosing, closing_sentence
from app.screens.surface.closing_job import closing_job
from app.screens.surface.view import ClosingCamera, ClosingView
from packetmesh.progress import drain
from pipeline.io.rigs import save_rig
from pipeline.sources import RigFolder
from pipeline.surface.holes import find_holes
from tests.app.fakes import ui_of
from tests.pipeline.delivery.small import CONFIG, small_rig

LABEL = "What would close this?"
POINTS_M = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]], np.float32)
DARK = np.array([False, True])
CAMERA = ClosingCamera(
    np.eye(4), "tripods", 1.42, 0.83, 0.0, 0.5, 0.8, 1.3, POINTS_M, np.array([0.9, 0.0]), DARK
)


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigs") / "small room"
    save_rig(folder, small_rig(nodes=2, scene="box-on-table"))
    return Spec(RigFolder(str(folder)), config=CONFIG)


@pytest.mark.parametrize("which", ["after", "before"])
def test_the_camera_of_a_hole_measures_points_of_that_hole(store, spec, which):
    (surface,) = drain(store.stages(spec, which))
    holes = find_holes(surface.vertices_m, surface.triangles)
    assert holes[0].open
    answer = drain(closing_job(store, spec, which, 0))
    assert (answer.which, answer.index) == (which, 0)
    camera = answer.camera
    assert camera.share == pytest.approx(camera.chance.mean(), rel=1e-5)
    assert 0.0 < camera.share <= 1.0
    assert camera.overlap_share >= 0.25
    loop_m = surface.vertices_m[holes[0].loop]
    near_m = np.linalg.norm(camera.points_m - holes[0].center_m, axis=1)
    assert near_m.max() <= np.linalg.norm(loop_m - holes[0].center_m, axis=1).max() + 1e-5


def test_a_hole_on_dark_surface_is_named():
    assert "dark" not in closing_sentence(ClosingView("after", 2, CAMERA), rim=False)
    dark = ClosingView("after", 2, replace(CAMERA, dark_share=0.52))
    assert "83 % of this hole, 52 points of that on a dark surface" in closing_sentence(dark, rim=False)


def test_a_hole_that_is_not_there_is_a_sentence(store, spec):
    answer = drain(closing_job(store, spec, "after", 100_000))
    assert answer.camera is None
    assert "There is no hole 100001" in answer.why_none
    assert "No camera would close it" in closing_sentence(answer, rim=False)


class Screen:
    """A session that only notes what is asked."""

    def __init__(self, server):
        self.ui, self.asked, self.is_fresh = ui_of(server.scene), [], True
        self.results, self.spec = self, None
        self.closing = HoleClosing(self, "/closing")

    def fresh(self, step, spec):
        return self.is_fresh

    def quick_job(self, job, *arguments, on_end):
        self.asked.append((job, arguments))
        self.answer = on_end

    @property
    def text(self):
        return self.ui.gui.text()


def test_the_button_shows_ghost_and_share_of_the_chosen_hole_alone(server):
    screen = Screen(server)
    button = screen.ui.gui.find(LABEL)
    assert not button.seen
    screen.closing.offer(("after", 3), False, np.array([5.0, 0.0, 0.0]))
    assert button.seen
    screen.ui.gui.press(LABEL)
    assert screen.asked == [("surface.closing_job:closing_job", ("after", 3))]
    screen.answer(ClosingView("after", 2, CAMERA))
    assert "83 %" not in screen.text, "that was another hole"
    screen.answer(ClosingView("after", 3, CAMERA))
    assert "would measure about 83 % of this hole" in screen.text
    assert "tripod, 1.42 m high" in screen.text
    drawn = screen.ui.scene.get_handle_by_name
    assert np.allclose(drawn("/closing/1").position, (5.0, 0.0, 0.0)), "beside its own surface"
    assert np.allclose(drawn("/closing/seen").points[0], (5.0, 0.0, 1.0))
    assert drawn("/closing/seen").points[1, 2] < -100.0
    screen.closing.offer(("after", 4), True)
    assert drawn("/closing/1") is None
    assert screen.text == ""
    screen.is_fresh = False
    screen.ui.gui.press(LABEL)
    assert "computed again" in screen.text
    screen.closing.offer(None)
    assert not button.seen

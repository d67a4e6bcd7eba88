"""The walk of the ball on the Surface screen: the record, what is drawn of it, and its player."""

import pickle
import threading
import time

import numpy as np
import pytest

from app.compute.state import Spec
from app.compute.store import Store
from app.dock.dock import COUNT_NS
from app.screens.surface.draw_rolling import RollingDrawing, pieces
from app.screens.surface.labels import AFTER, BEFORE
from app.screens.surface.rolling import CLOSE_UP, WHOLE, RollingFolder, front_lane, status_line
from app.screens.surface.walk_job import PATCH_POINTS, PLACES, walk_job, walk_over
from app.screens.surface.walk_view import WalkRequest
from packetmesh.errors import ReconstructionError
from packetmesh.progress import drain as end
from pipeline.sources import Demo
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.pivoting import roll
from tests.app.fakes import ui_of
from tests.pipeline.surface.shapes import perforated_plane

RADII_M = (0.016, 0.03)
SPEC = Spec(Demo("box-on-table"))


@pytest.fixture(scope="module")
def cloud():
    return perforated_plane(1.0, 0.02, 0.1)


@pytest.fixture(scope="module")
def close_up(cloud):
    return end(walk_over(cloud, RADII_M, WalkRequest("after", True)))


@pytest.fixture(scope="module")
def whole(cloud):
    return end(walk_over(cloud, RADII_M, WalkRequest("before", False)))


def test_a_close_up_is_a_patch_at_the_hole_in_which_every_pivot_is_a_step(close_up):
    assert len(close_up.points_m) == PATCH_POINTS
    assert np.linalg.norm(close_up.center_m) < 0.3
    counts = np.diff(close_up.step_ends, prepend=0)
    assert [close_up.happenings[step] for step in np.flatnonzero(counts == 0)] == ["end", "end"]
    assert counts.max() == 1
    assert close_up.happenings[0] == "seed"
    assert close_up.places == PLACES
    np.testing.assert_allclose(close_up.outward, [0.0, 0.0, 1.0], atol=1e-6)


def test_between_two_rests_the_ball_touches_the_edge_it_turns_about(close_up):
    turning = [step for step in range(close_up.steps) if close_up.pivot(step) is not None]
    assert len(turning) == close_up.happenings.count("join") + close_up.happenings.count("glue") > 500
    ends_m = close_up.points_m[np.stack([close_up.pivot(step) for step in turning])]
    distances_m = np.linalg.norm(close_up.places_m[turning][:, :, None] - ends_m[:, None], axis=3)
    radius_m = np.array(RADII_M)[close_up.step_radius[turning]]
    np.testing.assert_allclose(distances_m, np.broadcast_to(radius_m[:, None, None], distances_m.shape), 1e-4)
    corners_m = close_up.points_m[close_up.triangles[close_up.step_ends[turning] - 1]]
    rest_m = np.linalg.norm(corners_m - close_up.places_m[turning, -1][:, None], axis=2)
    np.testing.assert_allclose(rest_m, np.broadcast_to(radius_m[:, None], rest_m.shape), 1e-4)


def test_all_points_take_some_150_to_200_steps_and_make_the_same_surface(whole, cloud):
    assert 150 <= whole.steps <= 200
    np.testing.assert_array_equal(whole.triangles, roll(cloud.points_m, cloud.normals, RADII_M).triangles)
    assert whole.happenings == ()
    assert whole.places == 1
    assert whole.pivot(3) is None


@pytest.mark.parametrize("name", ["close_up", "whole"])
def test_front_and_dead_edges_are_together_the_rims_of_the_mesh(name, request):
    view = request.getfixturevalue(name)
    fronts = []
    for done in range(view.steps + 1):
        front, dead = view.open_edges(done)
        edges, faces = edges_and_faces(view.triangles[: view.count(done)])
        rims = sorted(map(tuple, edges[faces == 1].tolist()))
        assert sorted(tuple(sorted(edge)) for edge in [*front.tolist(), *dead.tolist()]) == rims
        fronts.append(len(front))
    assert fronts[0] == fronts[-1] == 0
    assert max(fronts) > 10


def test_the_job_remembers_its_walk_and_looks_where_it_should(tmp_path):
    store = Store(str(tmp_path))
    view = end(walk_job(store, SPEC, WalkRequest("after", True)))
    assert view is end(walk_job(store, SPEC, WalkRequest("after", True)))
    assert len(pickle.dumps(view)) < 300_000
    sensor = end(walk_job(store, SPEC, WalkRequest("before", False)))
    assert sensor.request.which == "before"
    assert len(pickle.dumps(sensor)) < 5_000_000


def test_a_ball_that_falls_through_is_one_sentence(cloud):
    with pytest.raises(ReconstructionError, match="try a larger radius"):
        end(walk_over(cloud, (0.001,), WalkRequest("after", False)))


# What is drawn.


def drawn_triangles(server, below, view):
    """(F, 3, 3) corners of all triangles that are visible, in order."""
    node = server.scene.get_handle_by_name
    shown = [
        handle.vertices[handle.faces]
        for name in (*(f"piece{index}" for index in range(len(pieces(view)[0]))), "newest")
        if (handle := node(f"{below}/{name}")).visible
    ]
    return np.concatenate([np.empty((0, 3, 3)), *shown])


@pytest.mark.parametrize("name", ["close_up", "whole"])
def test_any_step_can_be_shown_after_any_other(server, name, request):
    view, below = request.getfixturevalue(name), f"/{name}"
    drawing = RollingDrawing(server.scene, below, view)
    node = server.scene.get_handle_by_name
    for done in [0, view.steps, 1, *np.random.default_rng(0).integers(0, view.steps + 1, 25).tolist(), 0]:
        drawing.show(done, 0)
        expected_m = view.points_m[view.triangles[: view.count(done)]]
        np.testing.assert_array_equal(drawn_triangles(server, below, view), expected_m)
        for lines, ends in zip(("front", "dead"), view.open_edges(done), strict=True):
            handle = node(f"{below}/{lines}")
            assert handle.visible == bool(len(ends))
            if len(ends):
                np.testing.assert_array_equal(handle.points, view.points_m[ends])
        ball = node(f"{below}/ball")
        np.testing.assert_allclose(ball.position, view.places_m[max(done - 1, 0), -1])
        assert ball.radius == view.radii_m[view.step_radius[max(done - 1, 0)]]


def test_on_its_way_the_ball_shows_the_edge_it_turns_about(server, close_up):
    drawing = RollingDrawing(server.scene, "/way", close_up)
    step = close_up.happenings.index("join")
    drawing.show(step, 4)
    node = server.scene.get_handle_by_name
    np.testing.assert_allclose(node("/way/ball").position, close_up.places_m[step, 3])
    np.testing.assert_array_equal(node("/way/pivot").points[0], close_up.points_m[close_up.pivot(step)])
    drawing.show(step, 0)
    assert not node("/way/pivot").visible


def test_pieces_are_about_a_hundred_and_of_one_ball_each(close_up, whole):
    for view in (close_up, whole):
        ends, balls = pieces(view)
        assert 90 <= len(ends) <= 103
        assert ends[-1] == len(view.triangles)
        for start, last, ball in zip(np.append(0, ends[:-1]), ends, balls, strict=True):
            steps = np.searchsorted(view.step_ends, [start, last - 1], side="right")
            assert view.step_radius[steps].tolist() == [ball, ball]


# The folder.


class Room:
    """A folder in a control panel nobody sees, with what it asked for and what is drawn of it."""

    def __init__(self, server):
        self.requests, self.lock = [], threading.RLock()
        self.ui = ui_of(server.scene, self.post)
        self.gui, self.folder = self.ui.gui, RollingFolder(self.ui, self.requests.append)

    def post(self, function, *arguments):
        """One thing after the other, as on a session's thread."""
        with self.lock:
            function(*arguments)

    @property
    def drawn(self):
        return self.ui.scene.names("/surface/rolling")


@pytest.fixture
def room(server):
    room = Room(server)
    yield room
    room.folder.forget()
    room.ui.close()


def test_requests_are_what_is_chosen_and_change_while_somebody_watches(room, close_up):
    gui = room.gui
    gui.set("Cloud", BEFORE)
    assert room.requests == []
    gui.press("Ball", "Roll")
    gui.set("Watch", WHOLE)
    assert room.requests == [WalkRequest("before", True), WalkRequest("before", False)]
    room.folder.load(close_up)
    assert room.folder.showing
    assert [gui.find(label).value for label in ("Watch", "Cloud")] == [CLOSE_UP, AFTER]
    gui.set("Cloud", BEFORE)
    assert room.requests[-1] == WalkRequest("before", True)
    gui.press("Ball", "Close")
    assert room.requests[-1] is None
    assert not room.folder.showing
    assert room.drawn == []
    gui.set("Watch", WHOLE)
    assert room.requests[-1] is None


def test_the_player_steps_scrubs_and_plays(room, close_up):
    gui, dock = room.gui, room.folder._dock
    room.folder.visit(True)
    room.folder.load(close_up)
    assert dock.playing
    dock.pause()
    dock.seek(0)
    dock.step(1)
    dock.step(1)
    assert dock.now_ns == 2 * COUNT_NS
    dock.step(-1)
    assert dock.now_ns == COUNT_NS
    assert status_line(close_up, 1) in gui.text()
    dock.seek(200 * COUNT_NS)
    assert status_line(close_up, 200) in gui.text()
    dock.seek(10**15)
    assert status_line(close_up, close_up.steps) in gui.text()
    dock.play()
    time.sleep(0.3)
    dock.pause()
    assert 0 < dock.now_ns < 5 * COUNT_NS


def test_a_walk_that_comes_while_another_screen_is_shown_does_not_play(room, close_up):
    room.folder.visit(True)
    room.folder.visit(False)
    room.folder.load(close_up)
    assert not room.folder._dock.playing


def test_the_curve_of_the_front_ends_with_the_walk(close_up):
    said = [label.text for label in front_lane(close_up).labels(close_up.steps * COUNT_NS)]
    assert f"triangles {close_up.count(close_up.steps):.3g}" in said[0]
    assert said[1].strip() == "front edges 0"


def test_a_close_up_has_a_focus_and_the_whole_has_none(room, close_up, whole):
    assert room.folder.focus is None
    room.folder.load(close_up)
    center_m, stand_m = room.folder.focus
    np.testing.assert_array_equal(center_m, close_up.center_m)
    away_m = stand_m - center_m
    assert np.linalg.norm(away_m) > close_up.reach_m
    assert away_m @ close_up.outward == pytest.approx(np.linalg.norm(away_m))
    before = set(room.drawn)
    room.folder.load(whole)
    assert room.folder.focus is None
    assert room.drawn
    assert not before & set(room.drawn)  # the browser remembers how a node of the same name was
    room.folder.load(None)
    assert not room.folder.showing


def test_the_line_tells_step_triangles_front_radius_and_what_happened(close_up, whole):
    line = status_line(close_up, 1)
    assert line.startswith(f"**Step 1 of {close_up.steps}** · 1 triangles · front 3 edges · 0 rim edges")
    assert line.endswith("ball 16.0 mm (1 of 2) · **put down on three points**")
    assert "ball 30.0 mm (2 of 2) · **no edge is left to turn about**" in status_line(
        close_up, close_up.steps
    )
    assert status_line(whole, whole.steps).endswith("ball 30.0 mm (2 of 2)")
    assert status_line(close_up, 0).endswith("front 0 edges · 0 rim edges · ball 16.0 mm (1 of 2)")

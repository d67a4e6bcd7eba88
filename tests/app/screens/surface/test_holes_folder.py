"""Which hole a click means, and what the folder of the holes says and asks."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.cuts import Plane, Top
from app.compute.records import MeshView
from app.drawing.picking import picked_hole
from app.screens.surface.draw_holes import tape
from app.screens.surface.holes import FILL_OFF, NONE, HolesFolder, filled_sentence, hole_name, parts_sentence
from app.screens.surface.view import ExplainView, FilledView, HoleView
from pipeline.kernels.geometry import rotation_exp
from pipeline.quality import SurfaceQuality
from pipeline.surface.boundary import boundary_loops
from pipeline.surface.findings import Explanation, RayParts
from tests.app.fakes import ui_of

EYE = np.zeros(3)
AHEAD = np.array([0.0, 0.0, 1.0])
ASIDE = np.array([1.0, 0.0, 0.0])


def square(center_m=(0.0, 0.0, 2.0), side_m=0.2, rim=False, clockwise=True):
    """A square loop across the z axis; clockwise as a viewer at the origin sees it (x right, y down)."""
    half_m = side_m / 2.0
    corners_m = half_m * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    if not clockwise:
        corners_m = corners_m[::-1]
    center_m = np.array(center_m)
    return HoleView((center_m + corners_m).astype(np.float32), 4 * side_m, side_m**2, center_m, rim)


def towards(x_m, y_m, z_m):
    return np.array([x_m, y_m, z_m], float)


def test_a_ray_through_a_hole_means_it_however_long_the_direction_is():
    holes = (square((1.0, 0.0, 2.0)), square())
    assert picked_hole(holes, EYE, AHEAD) == 1
    assert picked_hole(holes, EYE, 7.3 * AHEAD) == 1
    assert picked_hole(holes, EYE, towards(1.0, 0.05, 2.0)) == 0
    assert picked_hole(holes, EYE + ASIDE, AHEAD) == 0


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("beside_deg", "meant"), [(0.2, 0), (1.45, 0), (1.55, None), (30.0, None)])
def test_a_ray_beside_an_edge_means_the_hole_up_to_one_and_a_half_degrees(seed, beside_deg, meant):
    turn = rotation_exp(np.random.default_rng(seed).normal(size=3))
    hole = square()
    hole = replace(hole, loop_m=hole.loop_m @ turn.T, center_m=turn @ hole.center_m)
    angle = np.arctan2(0.1, 2.0) + np.radians(beside_deg)
    assert picked_hole((hole,), EYE, turn @ towards(np.sin(angle), 0.0, np.cos(angle))) == meant


@pytest.mark.parametrize("seed", range(5))
def test_the_edge_that_is_passed_nearest_in_angle_wins(seed):
    rng = np.random.default_rng(seed)
    holes = [
        HoleView(rng.normal((0.0, 0.0, 2.0), 0.03, (3, 3)) + towards(*shift_m, 0.0), 0.1, 0.001, EYE, False)
        for shift_m in ((0.08, 0.0), (-0.08, 0.0), (0.0, 0.08), (0.0, -0.08))
    ]
    direction = towards(*rng.normal(0.0, 0.005, 2), 1.0)
    share = np.linspace(0.0, 1.0, 4001)[:, None, None]
    angles_deg = []
    for hole in holes:
        points_m = (hole.loop_m + share * (np.roll(hole.loop_m, -1, axis=0) - hole.loop_m)).reshape(-1, 3)
        cosine = points_m @ direction / np.linalg.norm(points_m, axis=1) / np.linalg.norm(direction)
        angles_deg.append(np.degrees(np.arccos(cosine.max())))
    nearest = int(np.argmin(angles_deg))
    assert picked_hole(holes, EYE, direction) == (nearest if angles_deg[nearest] <= 1.5 else None)


def test_of_two_holes_behind_each_other_the_nearer_is_meant():
    holes = (square((0.0, 0.0, 3.0)), square((0.0, 0.0, 2.0)), square((0.0, 0.0, 4.0)))
    assert picked_hole(holes, EYE, AHEAD) == 1


def test_a_hole_that_is_cut_off_is_not_meant():
    holes = (square((0.0, 0.0, 2.0)), square((0.0, 0.0, 3.0)))
    assert picked_hole(holes, EYE, AHEAD, Plane((0.0, 0.0, 2.5), (0.0, 0.0, 1.0))) == 1
    assert picked_hole(holes, EYE, AHEAD, Top(1.0)) is None


def test_what_lies_behind_the_viewer_is_not_meant():
    assert picked_hole((square((0.0, 0.0, -2.0)),), EYE, AHEAD) is None
    around = square((0.0, 0.0, 0.0), side_m=1.0)
    assert picked_hole((replace(around, loop_m=around.loop_m[:, [0, 2, 1]]),), EYE, ASIDE) is not None
    assert picked_hole((), EYE, AHEAD) is None


def test_a_hole_is_meant_before_a_rim_that_is_nearer():
    hole, rim = square((0.12, 0.0, 2.0)), square((0.0, 0.0, 2.0), side_m=0.01, rim=True)
    assert picked_hole((hole, rim), EYE, AHEAD) == 0
    assert picked_hole((rim,), EYE, AHEAD) == 0
    assert picked_hole((rim, hole), EYE, AHEAD) == 1


def test_inside_the_rim_around_a_surface_it_is_not_meant_and_at_its_edge_it_is():
    outer = square(side_m=2.0, rim=True, clockwise=False)
    assert picked_hole((outer,), EYE, AHEAD) is None
    assert picked_hole((outer,), EYE, towards(0.99, 0.3, 2.0)) == 0
    opening = square(side_m=2.0, rim=True)
    assert picked_hole((opening,), EYE, AHEAD) == 0


def test_loops_of_a_mesh_run_as_the_pick_expects():
    """A plate that faces the viewer with a window in it, both too long for holes."""
    side = np.arange(7) - 3.0
    x, y = np.meshgrid(side, side)
    vertices_m = np.stack([x.ravel(), y.ravel(), np.full(x.size, 4.0)], axis=1)
    corner = np.array([[row * 7 + column for column in range(6)] for row in range(6)])
    corner = np.delete(corner.ravel(), [14, 15, 20, 21])  # the four squares about the middle
    triangles = np.concatenate(
        [np.stack([corner, corner + 7, corner + 1], 1), np.stack([corner + 1, corner + 7, corner + 8], 1)]
    )
    normal = np.cross(*(vertices_m[triangles[0, 1:]] - vertices_m[triangles[0, 0]]))
    assert normal[2] < 0.0
    loops_m = sorted((vertices_m[loop] for loop in boundary_loops(triangles)), key=len)
    assert [len(loop_m) for loop_m in loops_m] == [8, 24]
    window, outer = (HoleView(loop_m, 8.0, 4.0, loop_m.mean(axis=0), True) for loop_m in loops_m)
    assert picked_hole((outer, window), EYE, AHEAD) == 1
    assert picked_hole((outer, window), EYE, towards(2.0, 0.0, 4.0)) is None


def test_the_tape_runs_around_the_loop_in_two_colours():
    loop_m = square().loop_m
    points, colors = tape(loop_m)
    assert points.shape == colors.shape == (8, 2, 3)
    np.testing.assert_array_equal(points[:, 1], np.roll(points[:, 0], -1, axis=0))
    np.testing.assert_array_equal(points[::2, 0], loop_m)
    np.testing.assert_allclose(np.linalg.norm(points[:, 1] - points[:, 0], axis=1), 0.1, rtol=1e-6)
    assert np.all(colors[::2] == colors[0, 0])
    assert np.all(colors[1::2] == colors[1, 0])
    assert np.any(colors[0] != colors[1])


HOLES = (square(side_m=0.3), square((0.6, 0.0, 2.0)), square(side_m=3.0, rim=True, clockwise=False))
FOUND = Explanation("gap", "The ball fell.", "Take a larger one.", 0.03, 0.75, 0.15, 0.1)
ANSWER = ExplainView("after", 1, FOUND)

QUALITY = SurfaceQuality(0.031, 2, 1.0, 0.0, 0, 1, 2.0, 0)
MESH = MeshView(b"", QUALITY, np.empty((0, 2, 3), np.float32), 4, 2, {"f_score_5cm": 0.87})
FILLED = FilledView(MESH, 3, 0.0123)


FILL = "Fill small holes up to (cm)"


class Screen:
    """The folder with what it asked for."""

    def __init__(self, server):
        self.asked, self.requested = [], []
        ui = ui_of(server.scene)
        self.gui = ui.gui
        self.closed, self.fresh = [], True
        self.spec = self.results = SimpleNamespace(fresh=lambda *_: self.fresh)
        self.ui = ui
        self.folder = HolesFolder(
            self, lambda which, index: self.asked.append((which, index)), self.requested.append
        )
        self.list = self.gui.find("Hole")

    def quick_job(self, job, *arguments, on_end):
        self.closed.append((arguments, on_end))

    @property
    def why(self):
        return self.gui.text()


@pytest.fixture
def screen(server):
    screen = Screen(server)
    screen.folder.load({"after": HOLES, "before": HOLES[1:]}, "after")
    return screen


def test_the_list_names_holes_then_rims_and_choosing_asks(screen):
    assert screen.list.options == (NONE, *(hole_name(index, hole) for index, hole in enumerate(HOLES)))
    assert screen.list.options[1] == "1: 120 cm around, 900.0 cm²"
    assert screen.list.options[3] == "3: outer rim, 1,200 cm long"
    assert screen.asked == []
    screen.gui.set("Hole", screen.list.options[2])
    assert screen.asked == [("after", 1)]
    screen.folder.explain(ANSWER)
    assert all(part in screen.why for part in ("Gap", FOUND.sentence, FOUND.remedy))
    assert all(share in screen.why for share in ("75 %", "15 %", "10 %"))
    screen.gui.set("Hole", NONE)
    assert "2 holes and 1 outer rim after fusion" in screen.why
    assert "share of pixels" not in screen.why


def test_an_answer_about_another_hole_is_not_shown(screen):
    screen.gui.set("Hole", screen.list.options[1])
    asking = screen.why
    screen.folder.explain(ANSWER)
    assert screen.why == asking
    screen.folder.explain(None)
    assert screen.why != asking


def test_without_cameras_that_look_there_is_no_table(screen):
    screen.gui.set("Hole", screen.list.options[2])
    unseen = float("nan")
    screen.folder.explain(
        replace(
            ANSWER, found=replace(FOUND, sensor_share=unseen, inferred_share=unseen, unknown_share=unseen)
        )
    )
    assert "share of pixels" not in screen.why


def test_previous_and_next_go_round(screen):
    for button in ("Next", "Next", "Next", "Next", "Previous", "Previous"):
        screen.gui.press("Go to", button)
    assert [index for _, index in screen.asked] == [0, 1, 2, 0, 2, 1]


def test_previous_without_a_choice_is_the_last(screen):
    screen.gui.press("Go to", "Previous")
    assert screen.asked == [("after", 2)]


def test_a_click_chooses_where_its_surface_stands(screen, server):
    offset_m = np.array([5.0, 1.0, 0.0])
    assert not screen.folder.picked(EYE, AHEAD, "before", offset_m)
    assert screen.asked == []
    assert screen.folder.picked(EYE, towards(5.6, 1.0, 2.0), "before", offset_m)
    assert screen.asked == [("before", 0)]
    assert screen.list.value.startswith("1: 80 cm")
    np.testing.assert_array_equal(server.scene.get_handle_by_name("/surface/hole").position, offset_m)
    assert server.scene.get_handle_by_name("/surface/hole/name").text == "1"


def test_a_small_hole_that_is_not_listed_can_be_clicked(screen):
    many = tuple(square((0.5 * index, 0.0, 2.0)) for index in range(60))
    screen.folder.load({"after": many}, "after")
    assert len(screen.list.options) == 31
    assert screen.folder.picked(np.array([25.0, 0.0, 0.0]), AHEAD, "after", EYE)
    assert screen.asked == [("after", 50)]
    assert screen.list.value == hole_name(50, many[50])


def test_the_same_surface_keeps_its_hole_and_its_filling_and_another_does_not(screen, server):
    screen.gui.set("Hole", screen.list.options[2])
    screen.gui.set(FILL, 40.0)
    again = tuple(replace(hole) for hole in HOLES)
    screen.folder.load({"after": again, "before": HOLES}, "after")
    assert screen.list.value.startswith("2: ")
    assert screen.gui.find(FILL).value == 40.0
    screen.folder.load({"after": HOLES[1:]}, "after")
    assert screen.list.value == NONE
    assert screen.gui.find(FILL).value == 0.0
    assert server.scene.get_handle_by_name("/surface/hole/loop") is None
    assert screen.asked == [("after", 1)]


def test_side_by_side_invites_a_click_and_forgetting_empties(screen):
    screen.folder.load({"after": HOLES, "before": HOLES}, None)
    assert screen.list.options == (NONE,)
    assert "show one surface alone" in screen.why
    assert screen.folder.picked(EYE, AHEAD, "after", EYE)
    screen.folder.load({"after": HOLES, "before": HOLES[1:]}, None)
    assert screen.list.value.startswith("1: ")
    screen.folder.load({"after": HOLES, "before": HOLES[1:]}, "after")
    assert screen.list.value == NONE
    screen.folder.forget()
    assert "after fusion" not in screen.why
    assert not screen.folder.picked(EYE, AHEAD, "after", EYE)


def test_the_slider_asks_for_metres_and_nothing_at_zero(screen):
    screen.gui.set(FILL, 25.0)
    screen.gui.set(FILL, 0.0)
    assert screen.requested == [0.25, None]


def test_an_answer_that_comes_after_filling_was_turned_off_is_not_told(screen):
    screen.gui.set(FILL, 25.0)
    screen.folder.filled(FILLED)
    assert filled_sentence(FILLED) in screen.why
    screen.folder.filled(None)
    assert "Drag the slider again" in screen.why
    screen.gui.set(FILL, 0.0)
    screen.folder.filled(FILLED)
    assert FILL_OFF in screen.why


def test_sentences_carry_the_numbers(screen):
    assert parts_sentence(RayParts(0.5, 0.3, 0.05, 0.1, 0.05)).count("%") == 6
    assert " 20.0 % are without a surface: 5.0 % where" in parts_sentence(RayParts(0.5, 0.3, 0.05, 0.1, 0.05))
    text = filled_sentence(FILLED)
    assert "**3 holes filled, 123.0 cm².**" in text
    assert "3.1 %" in text
    assert "87.0 %" in text
    assert "F-score" not in filled_sentence(replace(FILLED, mesh=replace(MESH, truth=None)))
    assert filled_sentence(FilledView(MESH, 0, 0.0)).startswith("No hole is that small")

"""The folder *Look*: controls, the state sent to the page, and the address, without a browser."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.cuts import Box, Plane, Top, kept
from app.looking import labels
from app.looking.folder import LookFolder
from app.looking.look import look_of
from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at
from tests.app.fakes import page_calls, ui_of
from tests.app.looking.test_room import CAMERA_M, CEILING, FLOOR, WALLS, view

POSE = look_at(np.array([2.0, 1.0, CAMERA_M]), np.array([2.0, 3.0, 1.2]))
OPEN, CLOSED = (np.concatenate(parts) for parts in ([FLOOR, WALLS], [FLOOR, WALLS, CEILING]))
NAMES = itertools.count()
LIVE = ("dropdown", "slider", "checkbox", "button_group", "vector2")


class Session:
    """A session that shows a room and is seen by one browser."""

    def __init__(self, scene, points_m=None, **options):
        self.ui, self.spec = ui_of(scene), SimpleNamespace(source="one")
        self.seen = None if points_m is None else view(points_m, POSE)
        self.results = SimpleNamespace(view=lambda _: self.seen)
        self.camera = SimpleNamespace(position=(2.0, -2.0, 3.0), look_at=(2.0, 2.0, 0.0))
        self.below = f"/look{next(NAMES)}"
        self.folder = LookFolder(self, self.below, **options)

    @property
    def gui(self):
        return self.ui.gui

    def clients(self):
        return [SimpleNamespace(camera=self.camera)]

    @property
    def sent(self):
        """What the page was last told."""
        html = self.gui.handles[0].content
        ((name, (below, _, state)),) = page_calls(html)
        assert (name, below) == ("look", self.below)
        return state

    def live(self):
        return [handle.label for kind in LIVE for handle in self.gui.all(kind)]


@pytest.fixture
def session(server):
    return Session(server.scene, CLOSED)


def test_nothing_is_left_out_at_first_and_few_controls_are_there(session):
    assert session.folder.place() == ""
    assert session.sent["planes"] == []
    assert set(session.live()) == {"Cut away", "Draw", "Scale bar and axes"}


def test_the_ceiling_comes_off_just_below_it(session):
    session.gui.set("Cut away", labels.TOP)
    cut = look_of(session.folder.place()).cut
    assert isinstance(cut, Top)
    assert 2.4 < cut.height_m < 2.55
    (plane,) = session.sent["planes"]
    assert plane["normal"] == [0.0, 0.0, -1.0]
    assert plane["point"][2] == pytest.approx(cut.height_m, abs=0.001)
    assert "10 cm below it" in session.gui.text()
    session.gui.set("Height (m)", 1.2)
    assert session.folder.place() == "top_1200"
    assert session.sent["planes"][0]["point"][2] == 1.2


def test_without_a_ceiling_the_folder_says_so_and_cuts_nothing_yet(server):
    session = Session(server.scene, OPEN)
    session.gui.set("Cut away", labels.TOP)
    assert "saw no ceiling" in session.gui.text()
    assert look_of(session.folder.place()).cut.height_m > 2.6


def test_without_a_scene_nothing_can_be_cut(server):
    session = Session(server.scene)
    session.gui.set("Cut away", labels.PLANE)
    assert session.folder.place() == ""
    assert session.gui.find("Cut away").value == labels.NOTHING


def test_a_plane_leaves_out_what_is_nearer_and_turns_and_flips(session):
    session.gui.set("Cut away", labels.PLANE)
    cut = look_of(session.folder.place()).cut
    assert isinstance(cut, Plane)
    assert cut.normal == pytest.approx((0.0, 1.0, 0.0))  # level, away from the viewer
    assert cut.point_m == pytest.approx((2.0, 2.0, 1.3), abs=0.1)
    session.gui.press("Plane", labels.FLIP)
    assert look_of(session.folder.place()).cut.normal == pytest.approx((0.0, -1.0, 0.0))
    session.gui.press("Plane", labels.LEVEL)
    assert look_of(session.folder.place()).cut.normal == (0.0, 0.0, -1.0)
    session.gui.press("Plane", labels.X)
    assert look_of(session.folder.place()).cut.normal == (1.0, 0.0, 0.0)
    session.gui.press("Plane", labels.VIEW)
    assert look_of(session.folder.place()).cut.normal == pytest.approx((0.0, 0.8, -0.6))
    assert session.sent["planes"][0]["axis"] == [0.0, 0.0, 1.0]


@pytest.mark.parametrize("points_m", [CLOSED, OPEN])
def test_a_box_first_holds_the_whole_room_and_is_not_much_larger(server, points_m):
    session = Session(server.scene, points_m)
    session.gui.set("Cut away", labels.BOX)
    cut = look_of(session.folder.place()).cut
    assert kept(cut, points_m).all()
    assert (np.array(cut.size_m) < 1.5 * np.ptp(points_m, axis=0)).all()


def test_a_box_turns_and_can_be_left_out_itself(session):
    session.gui.set("Cut away", labels.BOX)
    assert len(session.sent["planes"]) == 6
    session.gui.set("Turn (°)", 30)
    session.gui.set("Cut away the inside", True)
    cut = look_of(session.folder.place()).cut
    assert isinstance(cut, Box)
    assert (cut.turn_deg, cut.inside) == (30.0, True)
    assert session.sent["inside"]
    session.gui.set("Draw", labels.LIT)
    assert len(session.live()) <= 6


def test_wireframe_light_points_and_ruler_are_told_to_the_page(server, session):
    session.gui.set("Draw", labels.WIRE)
    session.gui.set("Scale bar and axes", True)
    assert session.folder.place() == "wire~ruler"
    assert (session.sent["wire"], session.sent["ruler"], session.sent["light"]) == (True, True, None)
    session.gui.set("Draw", labels.LIT)
    session.gui.set("Light (°)", (-90, 10))
    assert session.folder.place() == "light_-90_10~ruler"
    assert session.sent["light"] == [-90, 10]
    points = Session(server.scene, OPEN, surface=False)
    assert set(points.live()) == {"Cut away", "Points (mm)", "Scale bar and axes"}
    points.gui.set("Points (mm)", 8)
    assert points.folder.place() == "points_8"
    assert points.sent["point"] == 0.008


def test_an_address_waits_for_the_scene_and_is_cut_at_once(server):
    session = Session(server.scene)
    session.folder.take("top_1500~wire")
    assert session.sent["planes"] == [{"point": [0.0, 0.0, 1.5], "normal": [0.0, 0.0, -1.0]}]
    session.seen = view(CLOSED, POSE)
    session.folder.redraw()
    assert session.sent["planes"][0]["handle"].startswith(f"{session.below}/look/")
    assert session.folder.place() == "top_1500~wire"
    assert session.gui.find("Cut away").value == labels.TOP
    session.folder.take("")
    assert (session.folder.place(), session.sent["planes"]) == ("", [])
    with pytest.raises(InputError):
        session.folder.take("roof")


def test_a_dragged_handle_is_in_the_address_when_it_is_let_go(session):
    session.folder.take("top_1500")
    session.folder._dragged(Top(1.25), False)
    assert session.folder.place() == "top_1500"
    session.folder._dragged(Top(1.25), True)
    assert session.folder.place() == "top_1250"
    assert session.gui.find("Height (m)").value == 1.25
    session.folder._dragged(Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), True)  # of a cut that is gone
    assert session.folder.place() == "top_1250"


def test_another_scene_drops_the_cut_but_not_the_rest(session):
    session.folder.take("top_1500~wire")
    session.folder.on_spec()
    assert session.folder.place() == "top_1500~wire"
    session.spec = SimpleNamespace(source="two")
    session.folder.on_spec()
    assert session.folder.place() == "wire"

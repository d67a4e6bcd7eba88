"""The folder *Measure*: clicks, list, names, scale and address, without a browser."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from app.compute.cuts import Box
from app.compute.measures import Scale, Tape
from app.measuring import labels
from app.measuring.address import tape_of
from app.measuring.folder import DELETE, DELETE_ALL, NONE, SET, UNDO, MeasureFolder
from app.measuring.work import CUT_OFF, answer
from packetmesh.errors import InputError
from tests.app.fakes import ui_of
from tests.app.measuring.surfaces import EYE, steps

NAMES = itertools.count()
ON_TOP, ALSO_ON_TOP = (0.1, 0.1, 0.5), (0.7, 0.1, 0.5)
PLACE = "distance~surface~100_100_500~700_100_500~.Top"


class Session:
    """Answers at once in this process, or not at all."""

    def __init__(self, scene):
        self.ui, self.surface, self.asked, self.late = ui_of(scene), steps(), [], False
        self.tapes = []
        self.node = f"/folder{next(NAMES)}"
        self.frame = self.ui.scene.add_frame(self.node, show_axes=False)
        self.folder = MeasureFolder(self, f"{self.node}/measures", "job", self.tapes.append)

    @property
    def gui(self):
        return self.ui.gui

    def clients(self):
        return []

    def quick_job(self, job, request, *arguments, on_end):
        self.asked.append((request, on_end))
        if not self.late:
            on_end(answer([self.surface], request))

    def click(self, *point_m, cut=None):
        """Click at a point of the surface, which may be drawn elsewhere."""
        return self.folder.clicked(EYE + self.frame.position, np.array(point_m) - EYE, cut)

    def says(self, one):
        return hasattr(one, "text") and one.name.startswith(f"{self.node}/measures/")

    def texts(self):
        found = self.ui.scene._handle_from_node_name
        below = f"{self.node}/measures/"
        return [one.text for name, one in found.items() if name.startswith(below) and hasattr(one, "text")]


@pytest.fixture
def session(server):
    session = Session(server.scene)
    session.folder.load()
    return session


def test_nothing_is_measured_before_it_is_turned_on(session):
    assert not session.click(*ON_TOP)
    assert session.asked == []
    assert session.folder.place() == ""
    session.gui.set("Clicks measure", True)
    assert len(session.asked) == 1  # which prepares the surface
    assert "Click the first end." in session.gui.text()


def test_a_cut_is_where_the_surface_is_drawn(session):
    session.frame.position = (3.0, 0.0, 0.0)  # one of two surfaces side by side
    session.gui.set("Clicks measure", True)
    session.click(*ON_TOP, cut=Box((0.1, 0.1, 0.5), (0.2, 0.2, 0.2)))
    assert "Click the second end." in session.gui.text()
    session.click(*ALSO_ON_TOP, cut=Box((0.1, 0.1, 0.5), (0.2, 0.2, 0.2)))
    assert CUT_OFF in session.gui.text()
    assert session.folder.place() == ""


def test_two_clicks_are_a_length_in_list_picture_and_address(session):
    session.gui.set("Clicks measure", True)
    assert session.click(*ON_TOP)
    assert "Click the second end." in session.gui.text()
    assert session.click(*ALSO_ON_TOP)
    assert "Click the first end." in session.gui.text()
    assert session.folder.place() == "distance~surface~100_100_500~700_100_500"
    (label,) = session.texts()
    assert label.startswith("1: 60.0")
    assert "60.0" in session.gui.text()
    assert session.tapes[-1] == tape_of(session.folder.place())


def test_a_click_on_what_is_drawn_beside_counts_there(session):
    session.frame.position = (5.0, -3.0, 0.0)
    session.gui.set("Clicks measure", True)
    session.click(*ON_TOP)
    session.click(*ALSO_ON_TOP)
    assert session.folder.place() == "distance~surface~100_100_500~700_100_500"


def test_a_hidden_surface_takes_clicks_but_no_points(session):
    session.gui.set("Clicks measure", True)
    session.frame.visible = False
    assert session.click(*ON_TOP)
    assert labels.HIDDEN in session.gui.text()
    session.frame.visible = True
    session.click(*ON_TOP)
    assert labels.HIDDEN not in session.gui.text()
    assert "second end" in session.gui.text()


def test_clicks_that_come_faster_than_answers_all_count(session):
    session.gui.set("Clicks measure", True)
    session.late = True
    session.click(*ON_TOP)
    session.click(*ALSO_ON_TOP)
    session.click(0.1, 0.7, 0.5)
    assert len(session.asked) == 2  # a running request is not stopped by a further click
    for row in (1, 2):
        request, on_end = session.asked[row]
        on_end(answer([session.surface], request))
    assert len(session.asked) == 3
    assert len(tape_of(session.folder.place()).taken) == 1
    assert "second end" in session.gui.text()


def test_a_click_is_marked_at_once_where_it_was_made(session):
    session.gui.set("Clicks measure", True)
    session.late = True
    session.click(*ON_TOP)
    assert session.texts() == [labels.MEASURING]
    (label,) = (one for one in session.ui.scene._handle_from_node_name.values() if session.says(one))
    along = (np.array(label.position) - EYE) / np.linalg.norm(np.array(label.position) - EYE)
    towards = np.array(ON_TOP) - EYE
    assert along == pytest.approx(towards / np.linalg.norm(towards))
    request, on_end = session.asked[-1]
    on_end(answer([session.surface], request))
    assert session.texts() == ["Click the second end"]


def test_a_miss_and_a_surface_that_is_not_there_yet_are_told_at_the_click(session):
    session.gui.set("Clicks measure", True)
    session.click(*np.add(EYE, (0.0, 0.0, 5.0)))
    assert session.texts() == [session.folder._missed]
    assert session.folder._missed
    session.folder.unload()
    assert session.texts() == []
    session.click(*ON_TOP)
    assert session.texts() == [labels.NOT_YET]
    session.folder.load()
    assert session.texts() == []


def test_a_lost_answer_is_reported_and_another_click_works(session):
    session.gui.set("Clicks measure", True)
    session.late = True
    session.click(*ON_TOP)
    session.asked[-1][1](None)
    assert "click again" in session.gui.text()
    session.late = False
    session.click(*ON_TOP)
    assert "second end" in session.gui.text()


def test_a_kind_that_is_hardly_judged_says_so_where_it_is_chosen(session):
    session.gui.set("Clicks measure", True)
    assert "hardly judged" not in session.folder._prompt.content
    for kind in ("Box", "Hole"):
        session.gui.set("What", kind)
        assert "hardly judged" in session.folder._prompt.content
    assert "only 6 sides (5 held)" in session.gui.text()


def test_another_kind_begins_anew(session):
    session.gui.set("Clicks measure", True)
    session.click(*ON_TOP)
    session.gui.set("What", "Angle")
    assert "Click the first end." in session.gui.text()
    session.gui.set("Snap to", "Plane")
    assert "Click the first plane." in session.gui.text()


def test_a_name_is_in_list_picture_and_address(session):
    session.folder.take(PLACE.removesuffix("~.Top"))
    session.gui.set("Its name", "Top ~ left")
    assert session.folder.place().endswith("~.Top - left")
    assert session.texts()[0].startswith("Top - left: 60.0")
    assert "Top - left" in session.gui.text()
    assert len(session.asked) == 1  # a name changes no number


def test_the_chosen_measure_is_deleted_or_all_are(session):
    session.folder.take("~~".join([PLACE, "hole~surface~0_0_0", PLACE.replace("Top", "Other")]))
    session.gui.set("Chosen measure", "2: hole")
    session.gui.press("List", DELETE)
    assert [taken.name for taken in tape_of(session.folder.place()).taken] == ["Top", "Other"]
    assert len(session.texts()) == 2
    session.gui.press("List", DELETE_ALL)
    assert (session.folder.place(), session.texts()) == ("", [])
    assert session.gui.find("Chosen measure").options == (NONE,)
    assert not session.gui.find("Chosen measure").visible


def test_an_address_is_followed_when_the_surface_comes(server):
    session = Session(server.scene)
    session.folder.take(PLACE)
    assert (session.asked, session.texts()) == ([], [])
    assert "…" in session.gui.text()
    session.folder.load()
    assert session.texts()[0].startswith("Top: 60.0")
    assert session.folder.place() == PLACE
    session.folder.take("")
    assert (session.folder.place(), session.texts()) == ("", [])
    with pytest.raises(InputError):
        session.folder.take("distance")


def test_another_surface_is_measured_anew_and_never_shows_old_numbers(session):
    session.folder.take(PLACE)
    session.folder.unload()
    assert session.texts() == []
    assert "60.0" not in session.gui.text()
    higher_m = session.surface.vertices_m + np.array([0.0, 0.0, 3.0])
    session.surface = replace(session.surface, vertices_m=higher_m)
    session.folder.load()
    assert "not on this surface" in session.gui.text()
    assert "**Top**" in session.gui.text()
    assert session.texts() == []


def test_a_late_answer_about_another_surface_is_dropped(session):
    session.late = True
    session.folder.take(PLACE)
    request, on_end = session.asked[-1]
    session.folder.unload()
    on_end(answer([session.surface], request))
    assert session.texts() == []


def test_a_true_length_checks_and_sets_the_scale_and_it_is_undone(session):
    session.folder.take(PLACE)
    session.gui.set("True length (cm)", 60.1)
    assert "60.1 cm agrees" in session.gui.text() or "60.1 cm does not agree" in session.gui.text()
    session.gui.set("True length (cm)", 66.0)
    assert "66 cm does not agree" in session.gui.text()
    assert "+10.0 %" in session.gui.text()
    session.gui.press("Scale", SET)
    assert "scaled by +10.00 %" in session.gui.text()
    assert session.texts()[0] == "Top: 66 cm"
    assert session.folder.place() == f"{PLACE}~t6600"
    assert session.tapes[-1].scale == Scale(session.tapes[-1].taken[0].unnamed, 0.66)
    session.gui.set("Its name", "Side")
    assert session.folder.place().endswith("~.Side~t6600")
    session.gui.press("Scale", UNDO)
    assert session.texts()[0].startswith("Side: 60.0")
    assert "scaled" not in session.gui.text()


@pytest.mark.parametrize(("true_cm", "text"), [(30.0, "30 cm"), (61.25, "61.25 cm"), (150.0, "1.5 m")])
def test_a_typed_length_has_one_unit_everywhere(session, true_cm, text):
    session.folder.take(PLACE)
    session.gui.set("True length (cm)", true_cm)
    assert f"**{text} " in session.gui.text()
    session.gui.press("Scale", SET)
    assert session.texts()[0] == f"Top: {text}"
    assert f"**Top is {text}, as typed" in session.gui.text()
    assert {"30 cm": "0.3 m", "61.25 cm": "0.6125 m", "1.5 m": "150 cm"}[text] not in session.gui.text()


def test_a_new_name_leaves_the_typed_true_length_and_its_check(session):
    session.folder.take(PLACE)
    session.gui.set("True length (cm)", 66.0)
    session.gui.set("Its name", "Side  ~")
    assert session.gui.find("True length (cm)").value == 66.0
    assert session.gui.find("Its name").value == "Side -"
    assert session.gui.find("Chosen measure").value == "1: Side -"
    assert "66 cm does not agree" in session.gui.text()
    session.gui.press("Scale", SET)
    assert session.folder.place() == f"{PLACE.replace('Top', 'Side -')}~t6600"


@pytest.mark.parametrize("true", [70, 90, 110, 6600, 99999])
def test_the_scale_of_an_address_is_not_checked_against_itself(session, true):
    session.folder.take(f"{PLACE}~t{true}")
    session.gui.set("Chosen measure", "1: Top")
    session.gui.set("True length (cm)", session.gui.find("True length (cm)").value)
    assert session.asked[-1][0].check is None
    assert "agree" not in session.gui.text()


def test_the_scale_goes_with_the_measure_that_set_it(session):
    session.folder.take(f"{PLACE}~t6600~~{PLACE.replace('100_100', '100_200')}")
    assert session.texts()[0] == "Top: 66 cm"
    session.gui.set("Chosen measure", "1: Top")
    assert session.gui.find("True length (cm)").value == 66.0
    session.gui.press("List", DELETE)
    assert session.tapes[-1].scale is None
    assert session.texts()[0].startswith("Top: 60.8")


@pytest.mark.parametrize("place", [PLACE, "angle~surface~100_100_500~700_100_500~100_700_500"])
def test_only_a_known_length_sets_the_scale(session, place):
    session.folder.take(place)
    if place is not PLACE:
        session.gui.set("True length (cm)", 20.0)
    with pytest.raises(InputError, match="length"):
        session.gui.press("Scale", SET)
    assert session.tapes[-1] == Tape(tape_of(place).taken)

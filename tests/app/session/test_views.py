"""The app turns the view to what is shown; what a hand did to it comes back with what is looked at."""

import contextlib
from types import SimpleNamespace

import numpy as np
import pytest

from app.drawing.cameras import turn
from app.session.framing import Framing
from app.session.views import ECHO_S, Views
from packetmesh.errors import InputError

START, SCENE, RACE, HAND = ((float(i), 0.0, 1.0, 0.0, 0.0, 0.0) for i in range(1, 5))


class Eye:
    """A browser whose view the test turns by hand, and a clock."""

    def __init__(self):
        self.camera = SimpleNamespace()
        self.atomic = contextlib.nullcontext
        self.now_s = 0.0
        self.stand(START)
        self.views = Views(self, lambda: self.now_s)

    def stand(self, view):
        self.camera.position, self.camera.look_at = np.array(view[:3]), np.array(view[3:])

    def turn(self, view):
        """By hand, once the app has long been done."""
        self.now_s += 2.0 * ECHO_S
        self.stand(view)

    @property
    def view(self):
        return (*self.camera.position, *self.camera.look_at)

    def frame(self, kind, view=None, keep=True):
        def look():
            if view is not None:
                turn(self, np.array(view[3:]), np.array(view[:3]))
            return kind

        self.views.frame(look, keep)


@pytest.fixture
def eye():
    eye = Eye()
    eye.frame("scene", SCENE, keep=False)
    return eye


def test_what_nobody_has_turned_is_not_in_the_address(eye):
    assert eye.view == SCENE
    assert eye.views.place() == ""
    eye.stand(START)  # the browser's last word from before
    assert eye.views.place() == ""


def test_a_hands_view_comes_back_after_another_screen(eye):
    eye.turn(HAND)
    eye.frame("race", RACE)
    assert eye.view == RACE
    eye.now_s += 2.0 * ECHO_S
    assert eye.views.place() == ""
    eye.frame("scene", SCENE)
    assert eye.view == HAND
    assert eye.views.place() == "4.000,0.000,1.000,0.000,0.000,0.000"


def test_a_slow_browsers_report_of_an_older_view_is_not_a_hands(eye):
    """Its report of the start arrives after two turns of the app and after the address's view."""
    eye.frame("scene", RACE)
    eye.views.take("4,0,1,0,0,0")
    eye.views.settle()
    for late in (START, SCENE, RACE):
        eye.turn(late)
        eye.frame("scene", SCENE if late is RACE else RACE)
        assert eye.view == HAND


def test_what_is_new_is_looked_at_anew(eye):
    eye.turn(HAND)
    eye.frame("scene", RACE, keep=False)
    assert eye.view == RACE
    assert eye.views.place() == ""


def test_an_addresss_view_stays_while_its_scene_comes_and_no_longer(eye):
    eye.views.take("4,0,1,0,0,0")
    eye.frame("scene", RACE, keep=False)
    eye.frame("race", SCENE, keep=False)
    assert eye.view == HAND
    assert eye.views.place() == "4.000,0.000,1.000,0.000,0.000,0.000"
    eye.views.settle()
    eye.frame("race", RACE, keep=False)
    assert eye.view == RACE


def test_an_address_without_a_view_goes_back_to_the_apps(eye):
    eye.turn(HAND)
    eye.views.take("")
    assert eye.view == SCENE
    assert eye.views.place() == ""


@pytest.mark.parametrize(
    "text", ["1,2", "a,b,c,d,e,f", "nan,0,0,0,0,0", "1,1,1,1,1,1", "1e9,0,0,0,0,0", ",,,,,"]
)
def test_what_is_no_view_gets_a_sentence(eye, text):
    with pytest.raises(InputError, match="an invalid camera"):
        eye.views.take(text)
    assert eye.view == SCENE


def test_a_page_that_an_earlier_session_had_narrowed_gets_its_field_of_view_back(eye):
    eye.camera.fov = np.radians(25.0)  # of a race, when the server went away
    Framing(SimpleNamespace(target=eye), eye.views)
    assert eye.camera.fov == pytest.approx(np.radians(75.0))


def test_the_view_is_fitted_to_depth_of_its_own_scene_only():
    """The depth of the scene before stays until the new scene's has been computed."""
    at, there = np.eye(4), np.eye(4) + 2.0 * np.eye(4, k=3)
    sensor = SimpleNamespace(points_m=np.zeros((4, 3)))
    fused = SimpleNamespace(points_m=np.ones((4, 3)))
    views = {"scene": SimpleNamespace(nodes=[SimpleNamespace(T_world_camera=at, sensor=sensor)])}
    session = SimpleNamespace(
        results=SimpleNamespace(view=views.get), current=SimpleNamespace(drawn_below="/depth")
    )
    framing = Framing(session, None)
    for pose, seen in ((at, fused), (there, sensor)):
        views["depth"] = SimpleNamespace(nodes=[SimpleNamespace(T_world_camera=pose, fused=fused)])
        np.testing.assert_array_equal(framing.clouds_m[0], seen.points_m)

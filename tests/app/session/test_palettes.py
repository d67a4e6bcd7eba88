"""The command palette of a session and of a lecture: what it offers, and what its entries do."""

import contextlib
import re
from types import SimpleNamespace

import numpy as np
import pytest

from app.drawing.pictures import opaque
from app.session.framing import Framing
from app.session.looking import Looking
from app.session.palettes import TERM
from app.session.picture import size_of
from app.window.palette import KEYS, Entry, Palette
from app.window.tables import term
from app.window.tools import Tools, row_html
from packetmesh.errors import InputError
from tests.app.fakes import Gui, at_once, ui_of


class Commands(Gui):
    """A panel of controls whose commands can be removed and triggered."""

    def add_command(self, label, **given):
        handle = self.__getattr__("add_command")(label, **given)
        handle.remove = lambda: self.handles.remove(handle)
        return handle

    @property
    def commands(self):
        return [one for one in self.handles if one.kind == "add_command"]


def test_entries_keep_their_place_and_those_no_longer_offered_go():
    gui, done = Commands(), []
    palette = Palette(gui, at_once)
    entries = {name: Entry(name, "Setting", lambda name=name: done.append(name)) for name in "abc"}
    palette.offer([entries["a"], entries["b"]])
    first = gui.commands[0]
    palette.offer([entries["c"], entries["a"]])
    assert [one.label for one in gui.commands] == ["a", "c"]
    assert gui.commands[0] is first
    gui.press("c")
    assert done == ["c"]
    palette.offer([Entry("a", "Setting", lambda: done.append("new a"))])
    assert gui.commands == [first]
    gui.press("a")
    assert done == ["c", "new a"]


def test_two_of_one_name_are_both_offered_if_they_are_of_different_kinds():
    gui = Commands()
    Palette(gui, at_once).offer([Entry("Radius", kind, print) for kind in ("Setting", "Term", "Term")])
    assert [one.description for one in gui.commands] == ["Setting", "Term"]


def test_no_key_has_two_meanings_and_none_belongs_to_the_view_a_lesson_or_a_dock():
    keys = [(key.letter, key.modifier) for key in KEYS.values()]
    assert len(set(keys)) == len(keys)
    assert not {letter for letter, modifier in keys if modifier is None} & set("WASDQEK123 +-")


def test_the_page_knows_the_keys_by_the_names_that_the_buttons_have():
    row = row_html(True, True)
    named = ["mod+k", "mod+z", "mod+shift+z", "v", "p", "m"]
    assert re.findall('data-packetmesh-key="(.*?)"', row) == named
    (letters,) = re.findall('data-letters="(.*?)"', row)
    assert sorted(letters) == sorted(key.letter.lower() for key in KEYS.values() if key.modifier is None)


def test_undo_and_redo_can_be_pressed_only_while_they_have_something_to_do():
    assert row_html(True, True).count("disabled") == 0
    for undo, redo in ((True, False), (False, True)):
        buttons = re.findall(r'aria-label="(Undo|Redo)[^>]*?( disabled)?>', row_html(undo, redo))
        assert buttons == [("Undo", "" if undo else " disabled"), ("Redo", "" if redo else " disabled")]
    gui = ui_of().gui
    tools = Tools(gui)
    assert tools._html.content == row_html(False, False)
    tools.show(True, False)
    assert tools._html.content == row_html(True, False)


def test_terms_are_found_in_the_screens_tables_as_they_are_written():
    html = term("σ < 5 mm", 'What is "left".') + term("Holes", "Where nothing is.")
    assert [name for _, name in TERM.findall(html)] == ["σ &lt; 5 mm", "Holes"]


def test_the_page_tells_the_size_of_a_picture_and_nonsense_is_refused():
    assert size_of("3 720 450") == (1440, 900)
    assert size_of("4 720 450 120.0 50 cm 2.4 x,1.00,0.00;y,0.00,1.00;z,0.00,0.00") == (1440, 900)
    for text in ("", "3 720", "3 0 450", "3 720 450 1", "3 -720 450", "x 1 2", "3 99999 10", "3 1e3 10"):
        with pytest.raises(InputError):
            size_of(text)


def test_a_picture_has_the_background_where_nothing_is_drawn():
    drawn = np.zeros((1, 3, 4), np.uint8)
    drawn[0, 1] = 200, 100, 50, 255
    drawn[0, 2] = 0, 0, 0, 128
    picture = opaque(drawn)[0].tolist()
    assert picture[:2] == [[214, 219, 224], [200, 100, 50]]
    assert picture[2] == [107, 109, 112]


def node(name, x_m):
    """A camera node at x that looks north at a square, 3 m away."""
    pose = np.array([[1.0, 0, 0, x_m], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1]])
    square_m = np.array([[x, y, 3.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    return SimpleNamespace(name=name, T_world_camera=pose, sensor=SimpleNamespace(points_m=square_m))


class Window:
    """A browser, and a session that shows the scene or something of its own."""

    def __init__(self):
        camera = SimpleNamespace(position=np.zeros(3), look_at=np.ones(3), fov=1.2, aspect=1.5)
        self.client = SimpleNamespace(camera=camera, atomic=contextlib.nullcontext)
        self.scene = SimpleNamespace(nodes=[node("node_00", -1.0), node("node_01", 1.0)], stage=None)
        self.own_view = False
        screen = SimpleNamespace(drawn_below="/scene", look=lambda: self.own_view, wide=False)
        results = SimpleNamespace(view={"scene": self.scene, "depth": None}.get)
        session = SimpleNamespace(
            current=screen,
            panels=[screen],
            results=results,
            clients=lambda: [self.client],
            target=self.client,
        )
        self.framing = Framing(session, None)
        self.turns = 0
        self.looking = Looking(self.client, self.framing, self._turned)

    def _turned(self):
        self.turns += 1

    @property
    def view(self):
        return np.array(self.client.camera.position), np.array(self.client.camera.look_at)


@pytest.fixture
def window(monkeypatch):
    from app.session import framing

    monkeypatch.setattr(framing, "look", lambda clients, stage, wide: None)
    return Window()


def test_the_front_is_where_the_cameras_stand(window):
    window.looking.look("front")
    stand_m, center_m = window.view
    np.testing.assert_allclose(center_m, [0.0, 3.0, 1.0], atol=1e-9)
    assert stand_m[1] < 3.0 - 0.5  # before the square, on the cameras' side
    np.testing.assert_allclose(stand_m[[0, 2]], [0.0, 1.0], atol=1e-9)
    assert window.turns == 1  # a student's view no longer follows the teacher's


def test_fit_keeps_the_direction(window):
    window.client.camera.position, window.client.camera.look_at = np.zeros(3), np.array([3.0, 4.0, -1.0])
    window.looking.fit()
    stand_m, center_m = window.view
    forward = (center_m - stand_m) / np.linalg.norm(center_m - stand_m)
    np.testing.assert_allclose(forward, np.array([3.0, 4.0, -1.0]) / np.sqrt(26.0), atol=1e-9)


def test_one_key_goes_from_camera_to_camera(window):
    assert [window.looking.look_from_next() for _ in range(3)] == ["node_00", "node_01", "node_00"]
    stand_m, center_m = window.view
    np.testing.assert_allclose(center_m, [-1.0, 3.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(stand_m, [-1.0, 0.2, 1.0], atol=1e-9)


def test_where_no_camera_is_drawn_a_sentence_says_so(window):
    window.own_view = True
    window.framing.frame(anew=True, keep=False)
    with pytest.raises(InputError, match="go to Scene"):
        window.looking.look_from_next()
    with pytest.raises(InputError, match="node_01 is not drawn"):
        window.looking.look_from("node_01")


def test_what_a_screen_frames_itself_is_seen_from_around_what_it_looks_at(window):
    window.own_view = True
    window.client.camera.position, window.client.camera.look_at = np.zeros(3), np.array([0.0, 6.0, 0.0])
    window.framing.frame(anew=True, keep=False)
    window.looking.look("right")
    stand_m, center_m = window.view
    np.testing.assert_allclose(center_m, [0.0, 6.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(stand_m, [6.0, 6.0, 0.0], atol=0.5)
    window.looking.look_as_opened()
    np.testing.assert_allclose(window.view, [[0.0, 0.0, 0.0], [0.0, 6.0, 0.0]])

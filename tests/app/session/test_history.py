"""Undo and redo: which changes are one step, what goes back, and what is said."""

from dataclasses import dataclass, field, replace

import pytest

from app.session.history import SAME_S, History
from app.window.controls import put
from packetmesh.errors import InputError
from tests.app.fakes import START

LOWEST, POINTS = "depth.least_confidence", "surface.max_points"


@dataclass
class Part:
    """A part of a screen that is in the address."""

    text: str = ""
    refuses: bool = False

    def place(self):
        return self.text

    def take(self, place):
        if self.refuses:
            raise InputError("Its scene is gone; try another.")
        self.text = place


@dataclass
class Screen:
    title: str
    in_address: dict = field(default_factory=dict)


class Hand:
    """A session without a window: a hand changes settings, a clock stands until it is moved."""

    def __init__(self):
        self.spec, self.now_s, self.notices, self.wanted = START, 0.0, [], []
        self.show, self.stop, self.moment = Part(), Part(), Part()
        parts = {"show": self.show, "stop": self.stop, "t": self.moment}
        self.panels = [Screen("Fuse", parts), Screen("Network", {"show": Part()})]
        self.history = History(self, lambda: self.now_s)
        self.history.begin()

    def want(self, spec):
        self.wanted.append(spec)
        self.spec = spec

    def notify(self, title, sentence):
        self.notices.append(sentence)

    def set(self, path, value, after_s=10.0, by_hand=True):
        self.now_s += after_s
        self.spec = replace(self.spec, config=put(self.spec.config, path, value))
        self.history.follow(by_hand)

    def get(self, path):
        owner, name = path.split(".")
        return getattr(getattr(self.spec.config, owner), name)


@pytest.fixture
def hand():
    return Hand()


def test_steps_go_back_in_turn_and_forward_again(hand):
    before = hand.spec
    hand.set(POINTS, 5000)
    middle = hand.spec
    hand.set(LOWEST, 0.25)
    after = hand.spec
    assert hand.history.has_steps == (True, False)
    assert hand.history.undo() == "Undone: least confidence."
    assert hand.spec == middle
    assert hand.history.undo() == "Undone: max points."
    assert (hand.spec, hand.history.has_steps) == (before, (False, True))
    assert hand.history.undo() == "There is nothing to undo."
    assert hand.history.redo() == "Redone: max points."
    assert hand.history.redo() == "Redone: least confidence."
    assert (hand.spec, hand.history.redo()) == (after, "There is nothing to redo.")


def test_a_dragged_slider_is_one_step(hand):
    before = hand.spec
    for points in (6000, 7000, 8000):
        hand.set(POINTS, points, after_s=0.9 * SAME_S)
    hand.history.undo()
    assert hand.spec == before
    hand.history.redo()
    assert hand.get(POINTS) == 8000


def test_two_settings_or_a_long_rest_are_two_steps(hand):
    hand.set(POINTS, 6000)
    hand.set(LOWEST, 0.25, after_s=0.1)
    hand.history.undo()
    assert (hand.get(POINTS), hand.get(LOWEST)) == (6000, START.config.depth.least_confidence)
    hand.set(POINTS, 7000, after_s=1.1 * SAME_S)
    hand.history.undo()
    assert hand.get(POINTS) == 6000


@pytest.mark.parametrize(
    ("before", "after", "name"),
    [
        ("", "wire", "Draw"),
        ("wire~ruler", "light_120_35~ruler", "Draw"),
        ("light_120_35", "light_90_35", "Draw"),
        ("", "top_2400", "Cut away"),
        ("box_1_2_3_4_5_6_0", "plane_1_2_3_0_0_1000~ruler", "Cut away and 1 more"),
        ("wire", "wire~ruler", "Scale bar and axes"),
        ("points_8", "", "Points"),
    ],
)
def test_a_change_of_the_look_names_its_setting(hand, before, after, name):
    look = hand.panels[0].in_address["look"] = Part(before)
    hand.history.begin()
    look.text = after
    hand.history.follow(by_hand=True)
    assert hand.history.undo() == f"Undone: {name}."
    assert look.text == before
    assert hand.history.redo() == f"Redone: {name}."


def test_what_is_set_back_at_once_was_no_step(hand):
    hand.set(POINTS, 6000)
    hand.set(POINTS, START.config.surface.max_points, after_s=0.1)
    assert hand.history.has_steps == (False, False)


def test_a_new_change_forgets_what_was_undone(hand):
    hand.set(POINTS, 6000)
    hand.history.undo()
    hand.set(LOWEST, 0.25)
    assert hand.history.has_steps == (True, False)


def test_a_first_address_is_no_step_unless_a_hand_has_changed_something_before(hand):
    opened = replace(START, preset="thesis")
    hand.spec = opened
    hand.history.accept()
    hand.history.follow(by_hand=True)
    assert hand.history.has_steps == (False, False)
    hand.set(POINTS, 6000)
    hand.now_s += 10.0
    changed, hand.spec = hand.spec, opened  # the browser's Back
    hand.history.accept()
    hand.history.follow(by_hand=True)
    assert hand.history.undo() == "Undone: max points."
    assert hand.spec == changed
    hand.history.undo()
    assert hand.spec == opened


def test_what_a_result_brings_belongs_to_the_step_before(hand):
    hand.set(POINTS, 6000)
    hand.set(LOWEST, 0.25, by_hand=False)
    assert hand.history.undo() == "Undone: max points."
    assert hand.spec == START
    hand.set(LOWEST, 0.3, by_hand=False)
    assert hand.history.has_steps == (False, True)


def test_a_moment_is_no_setting(hand):
    hand.moment.text = "3.2"
    hand.history.follow(by_hand=True)
    assert hand.history.has_steps == (False, False)


def test_parts_of_all_screens_come_back_and_stops_come_first(hand):
    hand.stop.text, hand.show.text = "2", "race"
    hand.panels[1].in_address["show"].text = "walk"
    hand.history.follow(by_hand=True)
    order = []
    hand.stop.take = lambda text: (order.append("stop"), setattr(hand.stop, "text", text))
    hand.show.take = lambda text: (order.append("show"), setattr(hand.show, "text", text))
    assert hand.history.undo() == "Undone: what Fuse shows and 1 more."
    assert (order, hand.panels[1].in_address["show"].text) == (["stop", "show"], "")


def test_reset_is_a_step_of_that_name_and_can_be_undone(hand):
    hand.set(POINTS, 6000)
    hand.set(LOWEST, 0.25)
    changed = hand.spec
    hand.now_s += 10.0
    hand.spec = START
    hand.history.follow(by_hand=True)
    assert hand.history.undo() == "Undone: Reset."
    assert hand.spec == changed


def test_another_scene_is_named_alone_however_much_differs(hand):
    hand.spec = replace(hand.spec, source=replace(START.source, name="office"))
    hand.history.follow(by_hand=True)
    assert hand.history.undo() == "Undone: scene."
    assert hand.spec.source == START.source


def test_a_part_that_cannot_go_back_is_told_and_the_rest_goes_back(hand):
    hand.show.text = "race"
    hand.set(POINTS, 6000)
    hand.show.refuses = True
    hand.history.undo()
    assert hand.get(POINTS) == START.config.surface.max_points
    assert hand.notices == ["Its scene is gone; try another."]


def test_undoing_is_no_step_and_other_parts_of_the_spec_stay(hand):
    hand.set(POINTS, 6000)
    hand.spec = replace(hand.spec, shown="before")
    hand.history.undo()
    hand.history.follow(by_hand=True)
    assert hand.history.has_steps == (False, True)
    assert hand.spec.shown == "before"


def test_only_the_last_hundred_steps_are_kept(hand):
    for number in range(130):
        hand.set(POINTS, 5000 + number)
    count = 0
    while hand.history.has_steps[0]:
        hand.history.undo()
        count += 1
    assert (count, hand.get(POINTS)) == (100, 5029)

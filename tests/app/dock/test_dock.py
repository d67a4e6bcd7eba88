"""The dock's clock, and what it makes of what a page says."""

from __future__ import annotations

import html
import json
import math

import numpy as np
import pytest

from app.dock.dock import COUNT_NS, SPEEDS, Dock, speed_text, time_text
from app.drawing.levels import levels_of
from app.drawing.timeline import Curve, CurvesLane, FramesLane
from tests.app.fakes import page_calls, ui_of

STOPS_NS = np.array([1_000, 2_000_000_000, 5_000_000_000])
START_NS, END_NS = 1_000, 10_000_000_000


class Hand:
    """Says what a page would say, and reads what it is told."""

    def __init__(self, page="one"):
        self.page, self.said, self.now_s = page, 0, 0.0
        self.moves, self.picks = [], []
        self.ui = ui_of()
        self.dock = Dock(
            self.ui, self.moves.append, lambda *what: self.picks.append(what), lambda: self.now_s
        )
        none = np.zeros(3, int)
        levels = levels_of(STOPS_NS, STOPS_NS + 1000, none, none, 1)
        self.lane = FramesLane(levels, ("porch",), "frame {}".format, ("",))
        self.dock.load(START_NS, END_NS, STOPS_NS, [self.lane])
        self.dock.show(True)

    def say(self, *actions, page=None):
        numbered = []
        for action in actions:
            self.said += 1
            numbered.append([self.said, *action])
        self.repeat(numbered, page)
        return numbered

    def repeat(self, numbered, page=None):
        text = json.dumps({"page": page or self.page, "again": len(self.moves), "actions": numbered})
        self.ui.gui.set("Dock", text)

    def told(self, word):
        """The last that was told of this kind, as it is written."""
        contents = [one.content for one in self.ui.gui.handles if one.kind == "add_html"]
        calls = [call for content in contents for call in page_calls(content)]
        message = next(message for name, (message,) in calls if name == "dock" and message["kind"] == word)
        return html.escape(json.dumps(message, separators=(",", ":")))

    def later(self, seconds):
        """Let time pass, and the ticker tick."""
        self.now_s += seconds
        self.dock._tick()


@pytest.fixture
def hand():
    hand = Hand()
    yield hand
    hand.ui.close()


def test_every_timeline_begins_at_its_start_and_paused(hand):
    assert hand.moves == [START_NS]
    hand.dock.play()
    hand.dock.load(0, END_NS, STOPS_NS, [hand.lane])
    hand.dock.load(0, END_NS, STOPS_NS, [hand.lane])
    assert (hand.dock.now_ns, hand.dock.playing) == (0, False)
    assert hand.moves == [START_NS, 0, 0]


def test_it_does_not_leave_its_ends(hand):
    for asked_ns, now_ns in ((-5, START_NS), (3_000_000_000, 3_000_000_000), (10**12, END_NS)):
        hand.dock.seek(asked_ns)
        assert hand.dock.now_ns == now_ns == hand.moves[-1]


def test_playing_follows_the_persons_clock_and_stops_at_the_end(hand):
    speed = hand.dock.speed
    hand.dock.play()
    hand.later(2.0)
    assert hand.dock.now_ns == pytest.approx(START_NS + 2e9 * speed)
    hand.later(3.0)
    assert hand.dock.now_ns == pytest.approx(START_NS + 5e9 * speed)
    hand.later(1e6)
    assert (hand.dock.now_ns, hand.dock.playing) == (END_NS, False)
    hand.dock.play()
    assert hand.dock.now_ns == START_NS


def test_a_change_of_speed_while_playing_makes_no_jump(hand):
    hand.dock.play()
    hand.later(4.0)
    before_ns, before = hand.dock.now_ns, hand.dock.speed
    hand.say(["faster", 2])
    hand.later(0.0)
    assert hand.dock.now_ns == before_ns
    assert hand.dock.speed > before
    hand.later(1.0)
    assert hand.dock.now_ns - before_ns == pytest.approx(1e9 * hand.dock.speed)


def test_steps_halt_at_every_stop_and_stay_at_the_last(hand):
    hand.dock.play()
    seen = []
    for count in (1, 1, 1, -1, -1, -1):
        hand.dock.step(count)
        seen.append(hand.dock.now_ns)
    assert seen == [STOPS_NS[1], STOPS_NS[2], STOPS_NS[2], STOPS_NS[1], STOPS_NS[0], STOPS_NS[0]]
    assert not hand.dock.playing


def test_what_is_said_again_is_done_once(hand):
    said = hand.say(["step", 1])
    hand.repeat(said)
    hand.repeat([*said, [hand.said + 1, "step", 1]])
    assert hand.dock.now_ns == STOPS_NS[2]


def test_two_pages_are_told_apart(hand):
    hand.say(["seek", 3_000_000_000], page="one")
    hand.said = 0
    hand.say(["seek", 4_000_000_000], page="two")
    assert hand.dock.now_ns == 4_000_000_000
    assert "&quot;one&quot;:1" in hand.told("state")
    assert "&quot;two&quot;:1" in hand.told("state")


def test_a_click_goes_there_and_picks_what_is_there(hand):
    hand.say(["click", 0, 2_000_000_500, 3.0, 10.0])
    assert hand.dock.now_ns == 2_000_000_500
    hand.say(["click", 0, 3_000_000_000, 3.0, 10.0])
    assert hand.picks == [(0, 1), (0, -1)]


WRONG = (
    *(["loop"], [[]], [[1]], ["1", "loop"], [[math.inf, "loop"]], [[math.nan, "loop"]], [[True, "loop"]]),
    *([[10**400, "loop"]], [[1.0, "loop"]], [[1, []]], [[1, "close"]], [[1, "loop", 1]], [[1, "step"]]),
    *([[1, "seek", math.nan]], [[1, "seek", math.inf]], [[1, "seek", 10**400]], [[1, "seek", None]]),
    *([[1, "seek", "1"]], [[1, "click", 0, [], 0, 0]], [[1, "look", 0, 1e9]], [[1, "faster", 1e300]]),
)


@pytest.mark.parametrize("actions", WRONG, ids=str)
def test_what_no_page_says_changes_nothing_and_every_page_can_read_the_answer(hand, actions):
    hand.ui.gui.set("Dock", json.dumps({"page": "evil", "actions": actions}))
    assert hand.moves == [START_NS]
    assert not hand.dock._loops
    json.loads(html.unescape(hand.told("state")), parse_constant=pytest.fail)
    hand.say(["seek", 3_000_000_000])
    assert hand.dock.now_ns == 3_000_000_000


@pytest.mark.parametrize("text", ["", "{", "[]", '{"page": 1}', "[" * 4000])
def test_what_it_does_not_understand_changes_nothing(hand, text):
    hand.ui.gui.set("Dock", text)
    assert hand.moves == [START_NS]


def test_a_window_stays_within_the_run(hand):
    hand.say(["look", -5e9, 20e9, 800])
    assert f"&quot;window&quot;:[{START_NS},{END_NS}]" in hand.told("picture")
    hand.say(["look", 9.5e9, 10.5e9, 800])
    assert f"&quot;window&quot;:[9000000000,{END_NS}]" in hand.told("picture")


def test_new_lanes_leave_clock_and_window_as_they_are(hand):
    hand.say(["look", 2e9, 4e9, 800], ["seek", 3e9])
    curve = Curve("warmth", "°C", (0, 0, 0), np.array([0]), np.array([21.0]), 0, 30)
    hand.dock.update([hand.lane, CurvesLane("Weather", [curve])])
    assert hand.dock.now_ns == 3_000_000_000
    assert "&quot;window&quot;:[2000000000,4000000000]" in hand.told("setup")
    assert "warmth 21" in hand.told("state")


def test_it_begins_again_at_the_end_while_it_loops(hand):
    hand.say(["loop"])
    hand.dock.seek(END_NS - 500_000_000)
    hand.dock.play()
    speed = hand.dock.speed
    hand.later(1.5 / speed)
    assert hand.dock.playing
    assert hand.dock.now_ns == pytest.approx(START_NS + 1_000_000_000, abs=2)
    hand.later(1.0 / speed)
    assert hand.dock.now_ns == pytest.approx(START_NS + 2_000_000_000, abs=2)
    hand.say(["loop"])
    hand.later(20.0 / speed)
    assert (hand.dock.now_ns, hand.dock.playing) == (END_NS, False)


def test_it_counts_steps_at_a_pace_that_is_asked_for(hand):
    hand.dock.load(0, 50 * COUNT_NS, COUNT_NS * np.arange(51), [hand.lane], "iteration", 10.0)
    assert hand.dock.speed == 5.0
    assert "&quot;counts&quot;:&quot;iteration&quot;" in hand.told("setup")
    assert "5 a second" in hand.told("state")
    hand.dock.play()
    hand.later(2.0)
    assert hand.dock.now_ns == 10 * COUNT_NS


@pytest.mark.parametrize(("veil", "told"), [(0.8, True), (1.0, False)])
def test_pointing_ahead_tells_nothing_of_what_is_not_to_be_seen_yet(hand, veil, told):
    t_ns = np.array([0, 5_000_000_000])
    curve = Curve("warmth", "°C", (0, 0, 0), t_ns, np.array([20.0, 31.0]), 0, 40)
    hand.dock.load(0, END_NS, STOPS_NS, [CurvesLane("Weather", [curve], veil=veil)])
    hand.say(["point", 0, 6_000_000_000, 5, 0])
    assert ("warmth 31" in hand.told("state")) == told
    hand.say(["seek", 7_000_000_000], ["point", 0, 6_000_000_000, 5, 0])
    assert "&quot;tip&quot;:&quot;warmth 31" in hand.told("state")


def test_hiding_it_stops_the_clock(hand):
    hand.dock.play()
    hand.dock.show(False)
    hand.later(5.0)
    assert hand.dock.now_ns == START_NS


def test_speeds_and_times_are_round():
    speeds = {0.0002: "×1/5,000", 0.001: "×1/1,000", 0.02: "×1/50", 0.5: "×1/2", 1.0: "×1", 100.0: "×100"}
    speeds |= {1.5: "×1.5", 1000.0: "×1,000", 5000.0: "×5,000"}
    assert {speed: speed_text(speed) for speed in speeds} == speeds
    assert not any("e" in speed_text(speed) for speed in SPEEDS)
    times = [3_210_400_000, 12_430_000, 999, 157_228_380_000, 0]
    assert [time_text(t_ns) for t_ns in times] == ["3.21 s", "12.4 ms", "1.00 µs", "157 s", "0 s"]

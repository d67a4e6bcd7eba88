"""The timeline, driven by a fake clock, and the player with its controls."""

import time

import numpy as np
import pytest

from app.player import Player, Ruler, Ticker, Timeline
from tests.app.fakes import ui_of


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def moves():
    return []


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def timeline(moves, clock):
    timeline = Timeline(moves.append, clock)
    timeline.reset(10)
    timeline.speed = 4.0
    moves.clear()
    return timeline


def test_plays_at_its_speed_and_stops_at_the_end(timeline, clock, moves):
    timeline.play()
    for _ in range(100):
        clock.now_s += 0.125
        timeline.tick()
    assert moves == list(range(1, 10))
    assert not timeline.playing
    assert timeline.position == 9


def test_a_slow_viewer_skips_steps(timeline, clock, moves):
    timeline.play()
    clock.now_s += 1.0
    timeline.tick()
    assert moves == [4]


def test_play_at_the_end_starts_over(timeline, clock):
    timeline.seek(9)
    timeline.play()
    assert timeline.playing
    assert timeline.position == 0


def test_loop_wraps_around(timeline, clock, moves):
    timeline.loop = True
    timeline.play()
    clock.now_s += 2.75
    timeline.tick()
    assert timeline.position == 1
    assert timeline.playing


def test_seeking_and_changing_the_speed_while_playing_go_on_from_there(timeline, clock):
    timeline.play()
    clock.now_s += 0.5
    timeline.tick()
    assert timeline.position == 2
    timeline.seek(5)
    clock.now_s += 0.25
    timeline.tick()
    assert timeline.position == 6
    timeline.speed = 1.0
    clock.now_s += 1.0
    timeline.tick()
    assert timeline.position == 7


def test_an_empty_timeline_neither_plays_nor_moves(moves):
    timeline = Timeline(moves.append)
    timeline.reset(0)
    timeline.play()
    timeline.seek(3)
    assert not timeline.playing
    assert moves == []


def test_a_ticker_keeps_its_own_period_and_rests_when_stopped():
    ticks = []
    ticker = Ticker(lambda: ticks.append(time.monotonic()), period_s=0.01)
    assert ticks == []
    ticker.run(True)
    time.sleep(0.3)
    ticker.run(False)
    time.sleep(0.03)
    count = len(ticks)
    assert 3 < count <= 31
    time.sleep(0.05)
    assert len(ticks) == count
    ticker.close()


@pytest.fixture
def player(moves):
    ui = ui_of()
    player = Player(ui, moves.append, Ruler("Step"), "Drag.")
    player.load(10)
    moves.clear()
    player.gui = ui.gui
    yield player
    ui.close()


def test_stepping_pauses_and_stays_inside(player, moves):
    player.gui.press("Player", "Play")
    player.gui.press("Player", "Step back")
    time.sleep(0.4)
    assert moves == []
    for _ in range(12):
        player.gui.press("Player", "Step")
    assert moves == list(range(1, 10))
    assert player.gui.find("Step").value == 9


def test_the_slider_counts_as_its_ruler_says(player, moves):
    player.load(31, ruler=Ruler("Time (ms)", start=5, unit=20, every=3, step=20))
    slider = player.gui.find("Time (ms)")
    assert (slider.min, slider.max, slider.value) == (5, 205, 5)
    moves.clear()
    player.gui.set("Time (ms)", 105)
    assert moves == [15]
    player.seek(17)
    assert slider.value == 105
    player.gui.press("Player", "Step back")
    player.gui.press("Player", "Step")
    assert moves == [15, 17, 15, 18]
    assert slider.value == 125


def test_the_steps_halt_where_something_happens(player, moves):
    player.load(100, np.array([4, 40, 41]))
    moves.clear()
    for button in ("Step", "Step", "Step", "Step", "Step back"):
        player.gui.press("Player", button)
    assert moves == [4, 40, 41, 40]
    player.seek(70)
    player.gui.press("Player", "Step back")
    assert player.position == 41

"""The timeline, driven by a fake clock."""

import time

import pytest

from app.player import Ticker, Timeline


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


def test_stepping_pauses_and_stays_inside(timeline, moves):
    timeline.play()
    timeline.step(-1)
    assert not timeline.playing
    assert timeline.position == 0
    timeline.step(1)
    timeline.step(100)
    assert moves == [1, 9]


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
    timeline.step(1)
    timeline.seek(3)
    assert not timeline.playing
    assert moves == []


def test_a_ticker_keeps_its_own_period_and_rests_when_told():
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

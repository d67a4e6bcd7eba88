"""Sessions and connections are shared fairly: nobody locks others out, and whoever waits comes in."""

import sys
import threading
import time
from concurrent.futures import Future
from contextlib import closing
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

sys.path.insert(0, str(Path(__file__).parent))
from attacker import connected, receive, silent_connection

from app.load.connection import Connection, wait_for
from app.server import FULL, build_server
from app.session.session import Session
from app.web import crowd as crowds
from app.web import silent
from app.web.crowd import (
    MOST_OF_ONE_ADDRESS,
    MOST_SESSIONS,
    MOST_WAITING,
    MOST_WAITING_OF_ONE,
    Crowd,
    Visitor,
)
from app.web.door import MOST_A_SECOND, MOST_AT_ONCE, Door

pytestmark = pytest.mark.xdist_group("attack")


@pytest.fixture
def crowd():
    crowd = Crowd()
    yield crowd
    crowd.close()


class House:
    """Notes what becomes of the visitors of a crowd."""

    def __init__(self, crowd):
        self.crowd = crowd
        self.begun, self.waiting, self.away, self.building = [], [], [], None

    def come(self, number, address="a", shows=True):
        def begin():
            self.begun.append(number)
            return self.building

        told, gone = self.waiting.append, self.away.append
        self.crowd.come(
            Visitor(number, address, begin, lambda: told(number), lambda: gone(number), lambda: shows)
        )


def test_one_address_does_not_take_the_places_of_others(crowd):
    house = House(crowd)
    for number in range(MOST_OF_ONE_ADDRESS):
        house.come(number, "attacker")
        wait_for(lambda: len(house.begun) == number + 1)  # noqa: B023
    for number in range(100, 120):
        house.come(number, "attacker")
    house.come(1000, "somebody")
    wait_for(lambda: len(house.waiting) == 20)
    assert house.begun == [*range(MOST_OF_ONE_ADDRESS), 1000]


def test_a_place_that_is_left_goes_to_who_waits_longest(crowd):
    house = House(crowd)
    for number in range(MOST_SESSIONS):
        house.come(number, f"{number}")
        wait_for(lambda: len(house.begun) == number + 1)  # noqa: B023
    for number in range(MOST_SESSIONS, MOST_SESSIONS + 2):
        house.come(number, f"{number}")
    wait_for(lambda: house.waiting == [MOST_SESSIONS, MOST_SESSIONS + 1])
    assert len(house.begun) == MOST_SESSIONS
    crowd.leave(MOST_SESSIONS)  # who waited has gone
    crowd.leave(3)
    wait_for(lambda: house.begun[-1] == MOST_SESSIONS + 1)
    assert not house.away


def test_those_who_wait_are_bounded_for_an_address_and_in_all(crowd):
    house = House(crowd)
    house.building = Future()  # a session that is never built: all that come wait
    house.come(-1)
    wait_for(lambda: house.begun == [-1])
    for number in range(MOST_WAITING_OF_ONE + 1):
        house.come(number, "attacker")
    assert house.away == [MOST_WAITING_OF_ONE]
    for number in range(100, 100 + MOST_WAITING):
        house.come(number, f"{number}")
    assert len(house.away) == 1 + MOST_WAITING_OF_ONE
    house.building.set_result(None)


def test_a_hundred_that_leave_at_once_cost_nothing(crowd):
    house = House(crowd)
    house.building = Future()
    threads = threading.active_count()
    for number in range(100):
        house.come(number, f"{number % 20}")
        crowd.leave(number)
    assert threading.active_count() <= threads + 1
    house.come(100, "somebody")
    house.building.set_result(None)
    wait_for(lambda: 100 in house.begun)
    assert len(house.begun) <= 3  # a session or two that had begun before it was left


def test_a_browser_whose_session_fails_is_turned_away_and_the_next_one_comes_in(crowd):
    house = House(crowd)
    house.building = Future()
    house.building.set_exception(ValueError("no session"))
    house.come(1)
    wait_for(lambda: house.away == [1])
    house.building = None
    house.come(2)
    wait_for(lambda: house.begun == [1, 2])


def test_a_session_that_shows_no_page_goes(crowd, monkeypatch):
    monkeypatch.setattr(crowds, "NO_PAGE_S", 0.2)
    monkeypatch.setattr(crowds, "LOOK_S", 0.05)
    watched = Crowd()
    house = House(watched)
    house.come(1, shows=False)
    house.come(2)
    wait_for(lambda: 1 in house.away)
    time.sleep(0.2)
    assert set(house.away) == {1}
    watched.close()


def test_a_door_is_shut_until_it_is_opened_and_bounds_the_rate_of_each_address():
    now = [0.0]
    door = Door(lambda: now[0])
    assert not door.lets_in("a")
    door.is_open = True
    assert sum(door.lets_in("a") for _ in range(500)) == MOST_AT_ONCE
    assert door.lets_in("b")
    now[0] += 2.0
    assert sum(door.lets_in("a") for _ in range(500)) == 2 * MOST_A_SECOND
    now[0] += 1e6
    assert sum(door.lets_in("a") for _ in range(500)) == MOST_AT_ONCE


@pytest.fixture(scope="module")
def running():
    app = build_server("box-on-table", port=0)
    yield app
    app.stop()


def come_and_leave(url):
    """The status with which a connection was answered."""
    try:
        Connection(url).close()
    except InvalidStatus as refusal:
        return refusal.response.status_code
    return 101


def test_after_a_hundred_connections_in_a_second_the_next_browser_is_in_soon(running, monkeypatch):
    begun = []
    real = Session.__init__

    def counted(session, *arguments):
        begun.append(session)
        real(session, *arguments)

    monkeypatch.setattr(Session, "__init__", counted)
    answers = [come_and_leave(running.url) for _ in range(100)]
    while 503 not in answers and len(answers) < 1000:  # a slow machine comes seldom enough
        answers.append(come_and_leave(running.url))
    assert set(answers) == {101, 503}
    time.sleep(1.0)  # the page tries again by itself
    with connected(running.url, "Radius (mm)"):
        wait_for(lambda: len(running.sessions) == 1)
    assert len(begun) < answers.count(101) / 2  # those that left at once were not built for


def test_the_app_closes_a_connection_that_sends_nothing(running, monkeypatch):
    monkeypatch.setattr(silent, "SILENT_S", 0.2)
    with silent_connection(running.url) as connection, pytest.raises(ConnectionClosed):
        receive(connection)


def test_who_finds_no_place_is_told_and_comes_in_when_one_is_free(running, monkeypatch):
    monkeypatch.setattr(crowds, "MOST_SESSIONS", 1)
    wait_for(lambda: not running.sessions)
    time.sleep(1.0)
    with closing(Connection(running.url)) as first:
        wait_for(lambda: "Radius (mm)" in first.uuids, 60.0)
        with closing(Connection(running.url)) as second:
            wait_for(lambda: f"You are waiting for a place: {FULL}" in second.notices)
            assert len(running.sessions) == 1
            first.close()
            wait_for(lambda: "Radius (mm)" in second.uuids, 60.0)

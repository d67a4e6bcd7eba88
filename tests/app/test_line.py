"""A line of limited rate, and a class behind it."""

import contextlib
import http.client
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit

import numpy as np
import pytest

from app.load import classroom, one_more
from app.load.classroom import ClassPage, ClassTimes
from app.load.line import BURST_S, line
from app.web.contents import FOLDER

SIZE = 300_000


class Sender(BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Length", str(SIZE))
        self.end_headers()
        self.wfile.write(bytes(SIZE))

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def sender():
    with ThreadingHTTPServer(("127.0.0.1", 0), Sender) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def get(url):
    there = urlsplit(url)
    with contextlib.closing(http.client.HTTPConnection(there.hostname, there.port)) as one:
        one.request("GET", "/")
        return one.getresponse().read()


@pytest.mark.parametrize("browsers", [1, 4])
def test_all_together_get_no_more_than_the_rate(sender, browsers):
    bits_per_s = 8e6
    with line(sender, bits_per_s) as shared:
        began_s, found = time.monotonic(), []
        threads = [threading.Thread(target=lambda: found.append(get(shared.url))) for _ in range(browsers)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        spent_s = time.monotonic() - began_s
        assert [len(body) for body in found] == [SIZE] * browsers
        assert browsers * SIZE <= shared.bytes_down < browsers * (SIZE + 1000)
        assert 0 < shared.bytes_up < browsers * 1000
        assert spent_s >= 8 * browsers * SIZE / bits_per_s - BURST_S


def test_a_line_to_nowhere_ends_its_connections():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        nowhere = f"http://127.0.0.1:{free.getsockname()[1]}"
    with line(nowhere, 1e6) as shared, pytest.raises((http.client.HTTPException, OSError)):
        get(shared.url)


class Answers(ClassPage):
    """A page whose server is a list."""

    def __init__(self):
        self.asked = []
        self._hidden, self._held = set(), {}
        self.coarse_s, self.whole_s = {}, {}
        self._fetching, self._under_way = classroom.ThreadPoolExecutor(1), []

    def _get(self, path):
        self.asked.append(path.removeprefix(FOLDER))
        return b""

    def take(self, *messages):
        for message in messages:
            self._take_message(message)
        self._fetching.submit(int).result()


def mesh(name, content, coarse=True):
    data = {"packetmesh": content, "coarse": coarse}
    return {"type": "GlbMessage", "name": name, "props": {"glb_data": data, "scale": 1.0}}


def visible(name, shown):
    return {"type": "SetSceneNodeVisibilityMessage", "name": name, "visible": shown}


def test_a_page_fetches_what_is_shown_and_the_first_surface_coarse_first():
    page = Answers()
    first, second = classroom.MESHES + "1", classroom.MESHES + "2"
    page.take(visible("/surface", False), mesh(first, "a"), mesh("/scene/x", "b", coarse=False))
    assert page.asked == ["b"]
    page.take(visible("/surface", True))
    assert page.asked == ["b", "a?coarse", "a"]
    assert page.coarse_s[first] <= page.whole_s[first]
    page.take(mesh(second, "c"))
    assert page.asked[3:] == ["c"]
    removal = {"type": "RemoveSceneNodeMessage", "name": "/fuse/x"}
    page.take(visible("/fuse", False), mesh("/fuse/x", "d"), removal)
    page.take(visible("/fuse", True))
    assert page.asked[4:] == []


def test_a_page_says_that_all_is_drawn_once_its_contents_are_there():
    page, there, answered = Answers(), threading.Event(), threading.Event()
    page._get = lambda path: there.wait(5.0) and b""
    page._drawn = {"drawn"}
    page.send = lambda message: answered.set()
    page._take_message(mesh(classroom.MESHES + "1", "a", coarse=False))
    page._answer_drawn()
    assert not answered.wait(0.2)
    there.set()
    assert answered.wait(5.0)


def test_a_page_whose_data_are_in_the_messages_has_its_surface_with_them():
    page = Answers()
    page.take({"type": "GlbMessage", "name": classroom.MESHES + "1", "props": {"glb_data": b"mesh"}})
    assert page.asked == []
    assert list(page.whole_s) == list(page.coarse_s) == [classroom.MESHES + "1"]


def test_the_figures_of_a_lesson():
    lesson = ClassTimes(True, 3, 700_000, 600_000.0, (1.0, 2.0), (5.0, 7.0), 500_000.0, (1.5, 1.7))
    assert lesson.record()["whole_s"] == {"median": 6.0, "p95": pytest.approx(6.9)}
    assert "coarse 1.5 s, 95 % 1.9, whole 6.0 s" in lesson.note()
    assert "0.60 MB each" in lesson.note()
    assert "by name, 3 lost:" in lesson.note()


def test_a_class_on_the_running_app(monkeypatch):
    """Two pages, a quick line, the smallest scene: all that is timed comes."""
    monkeypatch.setattr(classroom, "BROWSERS", 2)
    monkeypatch.setattr(classroom, "SCENE", "box-on-table")
    monkeypatch.setattr(classroom, "BITS_PER_S", 400e6)
    for by_name in (True, False):
        lesson = classroom.time_class(by_name)
        assert (lesson.by_name, lesson.lost) == (by_name, 0)
        assert lesson.page_bytes > 500_000
        assert lesson.drag_bytes > 50_000  # how many looks a drag sends depends on the machine's load
        assert len(lesson.coarse_s) == len(lesson.whole_s) == 2
        assert len(lesson.drags_s) == 4
        assert min(*lesson.coarse_s, *lesson.drags_s) > 0.0
        assert all(np.asarray(lesson.coarse_s) <= lesson.whole_s)


def test_the_work_for_one_more_browser_on_the_running_app(monkeypatch):
    monkeypatch.setattr(one_more, "BROWSERS", 2)
    monkeypatch.setattr(one_more, "SCENE", "box-on-table")
    figures = one_more.work_for_one_more().record()
    assert min(figures.values()) >= 0.0
    assert 0.0 < figures["opens_s"] < one_more.PATIENCE_S


def test_the_work_is_stated_in_milliseconds():
    note = one_more.OneMore(0.25, 0.01, 0.0304).note()
    assert "250 ms to open the page, 10 to show the surface, 30 for a radius" in note

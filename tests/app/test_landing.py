"""The landing screen in the page that a browser opens, and what it offers."""

from __future__ import annotations

import gzip
import http.client
import re

import pytest
import viser

from app.landing import OPEN, PICTURES, STEP_OF_LESSON, landing_first, landing_html
from app.lesson import LESSONS
from app.server import PANELS
from pipeline.io.demos import DEMO_SCENES


@pytest.fixture(scope="module")
def port():
    with landing_first():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server.get_port()
    server.stop()


def get(port, path):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers={"Accept-Encoding": "gzip"})
    answer = connection.getresponse()
    body, encoding = answer.read(), answer.getheader("Content-Encoding")
    connection.close()
    return answer.status, (gzip.decompress(body) if encoding == "gzip" else body).decode()


def test_it_is_in_the_page_of_the_bare_address_only(port):
    status, page = get(port, "/")
    assert status == 200
    assert page.count('id="packetmesh-landing"') == 1
    assert page.rstrip().endswith("</html>")
    assert "packetmesh-landing" not in get(port, "/?scene")[1]
    assert get(port, "/nothing")[0] == 404


def test_it_offers_every_lesson_and_every_scene_with_a_small_picture():
    assert set(STEP_OF_LESSON) == {path.stem for path in LESSONS.glob("*.md")}
    assert set(STEP_OF_LESSON.values()) <= {panel.title for panel in PANELS}
    names = {*STEP_OF_LESSON, *DEMO_SCENES}
    assert {path.stem for path in PICTURES.iterdir()} == names
    assert all(path.stat().st_size <= 40_000 for path in PICTURES.iterdir())
    page = landing_html()
    assert page.count("data:image/jpeg") == len(names)
    assert set(re.findall('data-scene="([^"]+)"', page)) == set(DEMO_SCENES)
    for name in STEP_OF_LESSON:
        title = (LESSONS / f"{name}.md").read_text().splitlines()[0].removeprefix("# ")
        assert f">{title}</span>" in page


def test_its_script_presses_the_buttons_that_the_session_adds():
    assert f"starting(`{OPEN}${{name}}`)" in landing_html()

"""A student of a lecture, who may steer or not, breaks nothing that the teacher has."""

import http.client
import sys
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from viser import _messages as messages

sys.path.insert(0, str(Path(__file__).parent))
from attacker import connected

from app.load.connection import wait_for
from app.server import build_server
from tests.app.web.attack.test_gate import PROPERTIES

pytestmark = pytest.mark.xdist_group("attack")


@pytest.fixture(scope="module")
def lecture():
    app = build_server("box-on-table", port=0, lecture=True)
    yield app
    app.stop()


@pytest.fixture
def teacher(lecture):
    parts = urlsplit(lecture.teacher_url)
    with closing(http.client.HTTPConnection(parts.netloc)) as connection:
        connection.request("GET", f"/?{parts.query}")
        cookie = connection.getresponse().headers["Set-Cookie"].partition(";")[0]
    with connected(lecture.url, "The class may steer", cookie) as one:
        wait_for(lambda: "Lane" in one.uuids and bool(one.steps), 120.0)
        yield one
        one.set("The class may steer", False)


@pytest.mark.parametrize("steers", [True, False])
def test_no_control_of_the_teacher_goes_dead(lecture, teacher, steers):
    teacher.go("Scene")
    teacher.set("The class may steer", steers)
    with connected(lecture.url, "Steps") as student:
        wait_for(lambda: "Node" in student.uuids)
        wait_for(lambda: teacher.current == "Scene")
        for uuid in [*student.uuids["Steps"], *student.uuids["Node"], *teacher.uuids["The class may steer"]]:
            for updates in PROPERTIES:
                student.send(messages.GuiUpdateMessage(uuid, updates))
        if steers:
            student.go("Depth")
            wait_for(lambda: teacher.current == "Depth")
        else:
            student.go("Depth")
            student.set("Node", "node_01")
    teacher.go("Surface")
    wait_for(lambda: teacher.current == "Surface")
    teacher.go("Scene")
    wait_for(lambda: teacher.current == "Scene")


def test_a_student_cannot_give_the_class_the_right_to_steer(lecture, teacher):
    with connected(lecture.url, "Seat") as student:
        student.send(messages.GuiUpdateMessage(teacher.uuids["The class may steer"][0], {"value": True}))
        student.go("Depth")
        teacher.go("Fuse")
        wait_for(lambda: teacher.current == "Fuse")
    assert teacher.value("The class may steer") in (False, None)

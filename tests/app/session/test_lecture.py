"""Lectures: who steers, who follows, and whose votes are counted."""

import http.client
from contextlib import closing
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from viser import _messages as messages

from app.lesson.files import Choice, Question
from app.lesson.player import question_paragraphs, with_votes
from app.load.connection import Connection, wait_for
from app.server import build_server
from app.session.lecture import modules_of, qr_html
from app.web.entrance import Token, is_loopback

pytestmark = pytest.mark.xdist_group("lecture")  # one worker starts the server once
CLASS = 30


@pytest.fixture(scope="module")
def lecture():
    app = build_server("box-on-table", port=0, lecture=True)
    yield app
    app.stop()


@pytest.fixture(scope="module")
def cookie(lecture):
    return answer(lecture.teacher_url).headers["Set-Cookie"].partition(";")[0]


def answer(url):
    """The server's own answer, no redirection followed."""
    parts = urlsplit(url)
    with closing(http.client.HTTPConnection(parts.netloc)) as connection:
        connection.request("GET", f"{parts.path or '/'}?{parts.query}")
        response = connection.getresponse()
        response.text = response.read().decode()
        return response


@pytest.fixture
def teacher(lecture, cookie):
    with closing(Connection(lecture.url, cookie)) as one:
        wait_for(lambda: "The class may steer" in one.uuids)
        yield one
        one.set("The class may steer", False)


@pytest.fixture
def student(lecture, teacher):
    with closing(Connection(lecture.url)) as one:
        wait_for(lambda: "Seat" in one.uuids)
        yield one


def test_the_teachers_link_gives_a_cookie_and_leaves_no_token_in_the_address(lecture):
    response = answer(lecture.teacher_url)
    assert (response.status, response.headers["Location"]) == (303, "./?welcome")
    assert "HttpOnly" in response.headers["Set-Cookie"]
    assert "SameSite=Lax" in response.headers["Set-Cookie"]


def test_the_teacher_is_welcomed_with_the_lessons_and_the_class_is_not(lecture):
    welcome, page = (answer(f"{lecture.url}{path}").text for path in ("/?welcome", "/"))
    assert 'id="packetmesh-landing"' not in page
    assert "ICP against CEICP" in welcome
    assert "Or a scene" not in welcome


@pytest.mark.parametrize(
    ("url", "alone"),
    [
        ("http://127.0.0.1:8080", True),
        ("http://localhost:8080", True),
        ("http://[::1]:8080", True),
        ("http://192.0.2.7:8080", False),
        ("http://room.example:80", False),
    ],
)
def test_an_address_that_no_other_machine_reaches_is_known(url, alone):
    assert is_loopback(urlsplit(url).hostname) == alone


def test_another_token_is_refused_in_one_sentence_and_none_gives_the_page(lecture):
    wrong = answer(f"{lecture.url}/?teacher=x")
    assert (wrong.status, wrong.text.count(".")) == (403, 1)
    assert "Set-Cookie" not in wrong.headers
    assert answer(lecture.url).status == 200


@pytest.mark.parametrize(
    "cookies", ["", "{name}=x", "other={text}", "{name}=", "{name}={text}x", "@\x00;;=,"]
)
def test_only_its_own_cookie_makes_a_teacher(cookies):
    token = Token("teacher")
    assert not token.is_in(cookies.format(name=token.cookie, text=token.text))
    assert token.is_in(f"a=b; {token.cookie}={token.text}; c=d")


def test_a_student_cannot_change_a_setting_and_gets_its_value_back(lecture, teacher, student):
    before = lecture.sessions[-1].spec
    wait_for(lambda: student.uuids.keys() >= {"Preset", "Steps"})
    student.values.clear()
    student.set("Preset", "thesis")
    wait_for(lambda: student.values.get(student.uuids["Preset"][0]) == "packetmesh")
    student.set("Steps", "Export")
    teacher.set("Preset", "thesis")
    wait_for(lambda: lecture.sessions[-1].spec.preset == "thesis")
    teacher.set("Preset", "packetmesh")
    wait_for(lambda: lecture.sessions[-1].spec == before)
    assert lecture.sessions[-1].current.title == "Scene"


def test_the_teachers_address_leads_the_class_and_a_student_has_none(lecture, teacher, student):
    teacher.set("Address", "1 scene=box-on-table&preset=thesis&screen=export")
    wait_for(lambda: lecture.sessions[-1].current.title == "Export")
    assert lecture.sessions[-1].spec.preset == "thesis"
    teacher.set("Address", "2 preset=packetmesh&screen=scene")
    wait_for(lambda: lecture.sessions[-1].current.title == "Scene")
    assert "Address" not in student.uuids


def test_the_class_steers_once_the_teacher_lets_it(lecture, teacher, student):
    teacher.set("The class may steer", True)
    wait_for(lambda: lecture.sessions[-1].ui.lecture._all_steer)
    student.set("Preset", "thesis")
    wait_for(lambda: lecture.sessions[-1].spec.preset == "thesis")
    student.set("Preset", "packetmesh")
    wait_for(lambda: lecture.sessions[-1].spec.preset == "packetmesh")


def test_a_student_sees_what_the_teacher_sees_until_a_hand_turns_the_view(teacher, student):
    teacher.stand((4.0, 5.0, 6.0))
    wait_for(lambda: student.positions[-1:] == [(4.0, 5.0, 6.0)])
    student.set("Seat", "1 roam")
    wait_for(lambda: teacher.reads("**0** of them follow"))
    teacher.stand((7.0, 8.0, 9.0))
    student.set("Seat", "2 follow")
    wait_for(lambda: student.positions[-1:] == [(7.0, 8.0, 9.0)])
    wait_for(lambda: teacher.reads("**1** of them follow"))


def trigger(one, label):
    """Choose an entry of the command palette."""
    wait_for(lambda: label in one.commands)
    one.send(messages.CommandTriggerMessage(one.commands[label]))


def test_a_students_key_turns_only_the_own_view_which_then_stays(lecture, teacher, student):
    wait_for(lambda: student.positions)
    wait_for(lambda: lecture.sessions[-1].results.view("scene") is not None)
    trigger(student, "View from above")
    wait_for(lambda: teacher.reads("**0** of them follow"))
    wait_for(lambda: student.positions[-1] not in teacher.positions)
    above = student.positions[-1]
    teacher.stand((4.0, 5.0, 7.0))
    trigger(student, "Fit the view to the window")
    wait_for(lambda: len(student.positions) > 1)
    assert (4.0, 5.0, 7.0) not in student.positions
    assert not {above, student.positions[-1]} & set(teacher.positions)
    assert above[2] > 1.0


def test_a_student_cannot_choose_in_the_palette_what_is_the_teachers(lecture, teacher, student):
    trigger(student, "Export")
    student.set("Seat", "1 roam")  # comes after it
    wait_for(lambda: teacher.reads("**0** of them follow"))
    assert lecture.sessions[-1].current.title == "Scene"
    trigger(teacher, "Export")
    wait_for(lambda: lecture.sessions[-1].current.title == "Export")
    trigger(teacher, "Scene")
    wait_for(lambda: lecture.sessions[-1].current.title == "Scene")


def test_only_the_student_whose_command_failed_is_told(teacher, student):
    student.set("Size of the view", "no size")
    wait_for(lambda: any("did not report the size" in notice for notice in student.notices))
    student.set("Seat", "1 roam")  # comes after it
    wait_for(lambda: teacher.reads("**0** of them follow"))
    assert teacher.notices == []


def test_what_no_page_says_is_not_heard(teacher, student):
    student.set("Seat", f"1 vote 9 {voter_id(0)}")
    student.set("Seat", "1 vote 1")
    student.set("Seat", "roam")
    student.set("Seat", "2 roam")
    wait_for(lambda: teacher.reads("**0** of them follow"))


def voter_id(number):
    """An id as a page makes it."""
    return f"{number:032x}"


def test_thirty_browsers_see_the_room_and_each_vote_is_counted_once(lecture, teacher):
    wait_for(lambda: "Go" in teacher.uuids)
    students = [Connection(lecture.url) for _ in range(CLASS)]
    try:
        wait_for(lambda: teacher.reads(f"**{CLASS}** in the class"))
        wait_for(lambda: all("Seat" in one.uuids and "Scene" in one.uuids for one in students))
        wait_for(lambda: all(one.positions for one in students))
        teacher.go("Depth")  # the second of the screens with a lesson; that of Calibrate needs photographs
        wait_for(lambda: teacher.current == "Depth")
        teacher.set("Go", "Next", which=1)
        wait_for(lambda: all(one.reads("The class votes") for one in students))
        for number, one in enumerate(students):
            one.set("Seat", f"1 vote 3 {voter_id(number)}")
            one.set("Seat", f"2 vote {1 if number < 20 else 2} {voter_id(number)}")
        wait_for(lambda: all(one.reads("████████ **20**") and one.reads("████ **10**") for one in students))
        students[1].set("Seat", f"3 vote 1 {voter_id(CLASS)}")  # another id, but the same connection
        students.append(Connection(lecture.url))  # the browser of the last one, which has reloaded the page
        students[-1].set("Seat", f"1 vote 3 {voter_id(CLASS - 1)}")
        wait_for(lambda: all(one.reads("**20**") and one.reads("███ **9**") for one in students))
        assert teacher.reads("**1**")
        teacher.set("Your guess", "Skip", which=1)
        wait_for(lambda: all(not one.reads("The class votes") for one in students))
        students[0].set("Seat", f"3 vote 3 {voter_id(0)}")
        teacher.set("Go", "Back", which=1)
        assert students[1].reads("**20**")
    finally:
        for one in students:
            one.close()
    wait_for(lambda: teacher.reads("Nobody is in the class yet"))


def test_bars_are_as_long_as_their_share_and_stay_when_the_answer_is_told():
    question = Question("q?", (Choice("a"), Choice("b", "no"), Choice("c", "no")), "why")
    assert with_votes(question, []) == question
    voted = with_votes(question, [0, 0, 0, 1])
    assert [choice.text for choice in voted.choices] == ["a █████████ **3**", "b ███ **1**", "c **0**"]
    assert question_paragraphs(voted, 0, "")[0].startswith("1. ✓ a █████████ **3**")


def test_the_qr_code_says_the_address():
    text = "http://192.168.178.23:8080"
    picture = cv2.resize(modules_of(text), None, fx=6, fy=6, interpolation=cv2.INTER_NEAREST)
    assert cv2.QRCodeDetector().detectAndDecode(np.pad(picture, 40, constant_values=255))[0] == text
    assert f'alt="QR code of {text}"' in qr_html(text)

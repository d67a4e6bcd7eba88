"""A lecture in three browsers: a teacher's, a student's, and that of one who comes late."""

import contextlib
import re
from types import SimpleNamespace

import pytest
from playwright.sync_api import expect

from tests.browser.hands import (
    ALIKE,
    PATIENCE_MS,
    TEXTS,
    canvas,
    differing,
    dismiss_notifications,
    go,
    press,
    unfold,
)

STEERS = "You see what the teacher sees"


STOP = "## Too small a ball\nset: radii = 0.6 r_F\n\nThis ball leaves {unused} of the points unused.\n"
OWN = {
    "elsewhere": f"# How good is the other scene?\nscreen: surface\nscene: uncalibrated\n{STOP}",
    "here": f"# How good is this scene?\nscreen: surface\n{STOP}",
}
"""A teacher's own lessons: one in a scene of its own, one in the scene that is shown."""


@pytest.fixture(scope="module")
def lecture(app, tmp_path_factory):
    """A server of its own, with the computing processes of the other one, which goes on with them."""
    from app.lessons import own_lessons
    from app.server import build_server

    folder = tmp_path_factory.mktemp("lessons")
    for name, text in OWN.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    lessons = own_lessons([folder])
    lecture = build_server("box-on-table", port=0, lecture=True, pool=app.pool, lessons=lessons)
    yield lecture
    lecture.pool = SimpleNamespace(close=lambda: None)
    lecture.stop()


@contextlib.contextmanager
def opened(browser, url):
    """A browser of its own at an address, until it leaves."""
    context = browser.new_context(viewport={"width": 900, "height": 640})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(url)
    page.get_by_text("Up to date").wait_for()
    if page.get_by_role("dialog", name="Welcome").count():
        page.keyboard.press("Escape")
    dismiss_notifications(page)
    yield page
    context.close()


@pytest.fixture(scope="module")
def desk(lecture, browser):
    with opened(browser, lecture.teacher_url) as page:
        assert lecture.entrance.teacher.text not in page.url
        yield page


@pytest.fixture
def teacher(desk):
    desk.get_by_text("The class may steer").wait_for()
    go(desk, "Scene")
    return desk


@pytest.fixture(scope="module")
def first(lecture, desk, browser):
    with opened(browser, lecture.url) as page:
        yield page


@pytest.fixture
def student(teacher, first):
    first.get_by_text(STEERS).wait_for()
    return first


@pytest.fixture
def second(student, lecture, browser):
    """One who comes when the others are there, and leaves."""
    with opened(browser, lecture.url) as page:
        yield page


def chip(page):
    return page.locator(".packetmesh-seat")


def drag(page):
    """Turn the view with a hand."""
    box = page.locator("canvas").first.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 120, y + 20, steps=6)
    page.mouse.up()


def alike(one, other):
    """Whether two browsers come to show the same, without the row that only one of them has."""
    script = "document.querySelectorAll('.packetmesh-seat').forEach(one => one.style.display = 'none')"
    for _ in range(20):
        pictures = []
        for page in (one, other):
            page.evaluate(script)
            pictures.append(canvas(page))
            page.evaluate(script.replace("none", ""))
        if differing(*pictures) <= ALIKE:
            return True
    return False


def test_who_comes_late_sees_the_room_as_the_teacher_has_turned_it(teacher, student, lecture, browser):
    drag(teacher)
    with opened(browser, lecture.url) as late:
        assert alike(teacher, late)
        assert alike(teacher, student)
        expect(teacher.get_by_text("2 in the class, 2 of them follow your view")).to_be_visible()


def test_a_student_changes_nothing_and_is_told_who_steers(teacher, student):
    press(student, re.compile("^Export"))
    expect(chip(student)).to_contain_text("The teacher steers")
    expect(student.get_by_text(TEXTS["Scene"])).to_be_visible()
    go(teacher, "Export")
    student.get_by_text(TEXTS["Export"]).wait_for()
    teacher.get_by_text("The class may steer").click()
    expect(chip(student)).to_contain_text("You may steer")
    go(student, "Scene")
    teacher.get_by_text(TEXTS["Scene"]).wait_for()
    teacher.get_by_text("The class may steer").click()


def test_a_hand_turns_the_own_view_and_one_click_brings_the_class_back(teacher, student):
    assert alike(teacher, student)
    drag(student)
    expect(chip(student)).to_contain_text("You look around on your own")
    assert differing(canvas(teacher), canvas(student)) > ALIKE
    expect(teacher.get_by_text("1 in the class, 0 of them follow your view")).to_be_visible()
    press(student, "Back to the class")
    assert alike(teacher, student)


def test_votes_are_counted_by_keys_and_by_buttons_and_stay_with_the_answer(teacher, student, second):
    go(teacher, "Depth")
    unfold(teacher, "Lesson: Can a picture measure?")
    press(teacher, "Next")
    for page in (student, second):
        expect(page.locator(".choice")).to_have_count(3)
    student.keyboard.press("3")
    student.keyboard.press("2")
    second.locator(".choice").nth(1).click()
    for page in (student, second):
        expect(page.locator(".choice[aria-pressed=true]")).to_contain_text("one side of the camera")
    bar = "████████████ 2"
    for page in (teacher, student, second):
        expect(page.locator(".packetmesh-lesson-card")).to_contain_text(bar)
    teacher.keyboard.press("s")
    expect(student.locator(".choice")).to_have_count(0)
    expect(student.locator(".packetmesh-lesson-card")).to_contain_text(bar)


def test_the_address_of_the_class_is_shown_large(teacher, lecture):
    press(teacher, "Address of the class")
    expect(teacher.get_by_alt_text(f"QR code of {lecture.class_link}")).to_be_visible()
    expect(teacher.locator(".packetmesh-join")).to_contain_text(lecture.class_link)
    expect(teacher.locator(".packetmesh-join")).to_contain_text("No other machine reaches this address")
    press(teacher, "Close")


def learn(page, lecture, title, first):
    """Open the teacher's link anew, and a lesson on its start page. Returns the address once it begins."""
    page.goto(lecture.teacher_url)
    page.get_by_role("dialog", name="Welcome").get_by_role("button", name=title).click()
    expect(page.get_by_role("dialog", name="Welcome")).to_have_count(0)
    page.get_by_text(first).locator("visible=true").first.wait_for()
    return page.url


def test_a_lesson_begins_in_its_scene_and_one_without_a_scene_in_the_one_that_is_shown(teacher, lecture):
    """Last, because the class is then in another scene."""
    url = learn(teacher, lecture, "How good is the other scene?", "Too small a ball")
    assert "scene=uncalibrated&" in url
    assert "stop-own-elsewhere=1&screen=surface" in url
    assert "welcome" not in url
    url = learn(teacher, lecture, "How good is this scene?", "Too small a ball")
    assert "scene=uncalibrated&" in url
    assert "stop-own-here=1&screen=surface" in url
    # The class had left this one at its first stop, in the scene of before.
    assert "scene=living-room&" in learn(teacher, lecture, "Can a picture measure?", "Why are such strips")

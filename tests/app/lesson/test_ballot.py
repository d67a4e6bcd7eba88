"""A lecture's votes as a table."""

import csv
import io
from types import SimpleNamespace

from app.lesson.player import LessonFolder
from app.lesson.reading import read_lesson
from tests.app.fakes import ui_of
from tests.app.lesson.test_files import kind_of

LESSON = """# Sky
## One
Now {end}.
ask: Which **colour**, {end}?
choices:
- [ ] =Red. | No.
- [x] Blue, <b>bold</b>.
- [ ] Grey. | No.
reveal: So.
## Two
The sea.
"""


class Lecture:
    """Stands for a lecture: keeps the function that counts."""

    count = None

    def poll(self, count):
        self.count = count


class Lectured:
    def __init__(self, tmp_path):
        (tmp_path / "sky.md").write_text(LESSON)
        self.lecture = Lecture()
        ui = ui_of()
        object.__setattr__(ui, "lecture", self.lecture)
        lesson = read_lesson(tmp_path / "sky.md", kind_of("end"))
        LessonFolder(ui, lesson, lambda look: None, lambda: {"end": "2 cm", "scene": "room"})
        self.gui, self.sent = ui.gui, []

    def table(self):
        """The rows that a press of the button sends."""
        client = SimpleNamespace(
            send_file_download=lambda name, content, **_: self.sent.append((name, content))
        )
        (handle,) = (one for one in self.gui.handles if getattr(one, "label", "") == "Download the votes")
        for callback in handle.callbacks:
            callback(SimpleNamespace(client=client, target=handle))
        return list(csv.DictReader(io.StringIO(self.sent[-1][1].decode("utf-8-sig"))))


def test_the_table_has_a_row_for_each_choice_with_the_last_vote_of_each_voter(tmp_path):
    lectured = Lectured(tmp_path)
    gui = lectured.gui
    assert lectured.table() == []
    gui.press("Go", "Next")
    for voter, vote in (("a", 1), ("b", 2), ("c", 2), ("a", 3)):
        lectured.lecture.count(voter, vote)
    gui.press("Your guess", "1")
    assert lectured.lecture.count is None
    rows = lectured.table()
    assert lectured.sent[-1][0] == "votes-sky.csv"
    assert [row["votes"] for row in rows] == ["0", "2", "1"]
    assert [row["right"] for row in rows] == ["no", "yes", "no"]
    assert [row["teacher"] for row in rows] == ["yes", "", ""]
    assert {row["voters"] for row in rows} == {"3"}
    assert {row["question"] for row in rows} == {"Which colour, 2 cm?"}
    assert [row["text"] for row in rows] == ["'=Red.", "Blue, <b>bold</b>.", "Grey."]
    assert {(row["lesson"], row["stop"], row["title"], row["round"]) for row in rows} == {
        ("Sky", "1", "One", "1")
    }


def test_a_lesson_that_is_given_again_is_a_round_of_its_own_and_the_first_stays(tmp_path):
    lectured = Lectured(tmp_path)
    gui = lectured.gui
    for vote in (1, 2):
        gui.press("Go", "Next")
        lectured.lecture.count("a", vote)
        gui.press("Your guess", "Skip")
        gui.press("Go", "End")
    votes = [(row["round"], row["choice"]) for row in lectured.table() if row["votes"] == "1"]
    assert votes == [("1", "1"), ("2", "2")]
    assert {row["teacher"] for row in lectured.table()} == {""}


def test_going_back_to_a_question_that_is_still_open_continues_its_vote(tmp_path):
    lectured = Lectured(tmp_path)
    gui = lectured.gui
    gui.press("Go", "Next")
    lectured.lecture.count("a", 2)
    gui.set("Stop", "2. Two")
    assert lectured.lecture.count is None
    gui.press("Go", "Back")
    lectured.lecture.count("b", 2)
    assert [row["votes"] for row in lectured.table()] == ["0", "2", "0"]

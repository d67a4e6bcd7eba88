"""The language of lessons: the browser's, a chosen one, and English."""

import pytest

from app.lesson.languages import preferred
from app.lesson.player import LessonFolder
from app.lesson.reading import read_lesson
from app.screens.surface.lesson import KIND, SHIPPED
from app.window.teaching import Teaching
from packetmesh.errors import InputError
from tests.app.fakes import ui_of

OFFERED = ("en", "de", "es", "th")
NAMES = {"en": "English", "de": "Deutsch", "es": "Español", "th": "ไทย"}


@pytest.mark.parametrize(
    ("header", "language"),
    [
        ("de-CH,de;q=0.9,en;q=0.8", "de"),
        ("fr, es-MX;q=0.7, de;q=0.3", "es"),
        ("en;q=0.5, th;q=0.6", "th"),
        ("fr,nl", "en"),
        ("", "en"),
        ("*", "en"),
        ("DE", "de"),
        ("de;q=0, es;q=0.1", "es"),
        ("de;q=many, <script>, es", "es"),
        ("zh-Hant-TW", "en"),
    ],
)
def test_the_browsers_order_decides_and_english_is_the_fallback(header, language):
    assert preferred(header, OFFERED) == language


def folder(own_language="en"):
    """The folder of a shipped lesson for a browser of this language."""
    ui, looks = ui_of(), []
    object.__setattr__(ui, "teaching", Teaching({}, NAMES, own_language))
    return ui, LessonFolder(ui, read_lesson(SHIPPED, KIND), looks.append), looks


def test_a_lesson_is_in_the_browsers_language_and_another_can_be_chosen_at_any_stop():
    ui, lesson, looks = folder("de")
    gui = ui.gui
    assert gui.find("Language").value == "Deutsch"
    gui.press("Go", "Next")
    gui.press("Go", "Next")
    assert "Raten Sie zuerst" in gui.text()
    assert "(1 von 10)" in gui.text()
    gui.press("Your guess", "3")
    assert "**Richtig.**" in gui.text()
    gui.set("Language", "ไทย")
    assert lesson.place() == "1"
    assert "**ถูกต้อง**" in gui.text()
    assert "(1 จาก 10)" in gui.text()
    assert len(looks) == 1  # the screen is as it was
    assert ui.teaching.place() == "th"
    assert any(getattr(one, "label", "").startswith("Lesson: รัศมี") for one in gui.handles)
    ui.teaching.take("")
    assert "(1 von 10)" in gui.text()


def test_an_address_with_a_language_that_no_lesson_has_is_one_sentence():
    ui, _, _ = folder()
    with pytest.raises(InputError, match="lang=<script>a; try one of en, de, es, th"):
        ui.teaching.take("<script>alert(1)</script>")
    assert ui.teaching.language == "en"


def test_a_lesson_without_the_language_is_shown_as_it_was_written(tmp_path):
    (tmp_path / "mine.md").write_text("# Mine\n## One\nHello.\n")
    ui = ui_of()
    object.__setattr__(ui, "teaching", Teaching({}, NAMES, "de"))
    LessonFolder(ui, read_lesson(tmp_path / "mine.md", KIND), lambda look: None)
    ui.gui.press("Go", "Next")
    assert "(1 of 1)" in ui.gui.text()
    assert not any(getattr(one, "label", "") == "Language" for one in ui.gui.handles)

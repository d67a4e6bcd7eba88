"""packetmesh lesson check, and serve with a lesson that has a fault."""

import json
import os
import re

import pytest

from app.lesson.files import LESSONS
from tests.app.commands import run as ran
from tests.app.lesson.written import LESSON, TRANSLATION


def checked(capsys, *files):
    """Exit code, and the JSON and the lines on stderr."""
    code, out, err = ran(capsys, "lesson", "check", *map(str, files), "--json")
    return code, json.loads(out) if out else None, err


def test_a_good_lesson_and_all_that_ship_have_no_fault(capsys, tmp_path):
    (tmp_path / "mine.md").write_text(LESSON)
    code, found, _ = checked(capsys, tmp_path / "mine.md", LESSONS)
    assert (code, found["faults"]) == (0, [])
    assert found["lessons"][0] == {
        "file": str(tmp_path / "mine.md"),
        "title": "My radius",
        "screen": "surface",
        "scene": "office",
        "stops": 1,
        "languages": ["en"],
    }
    assert [one["languages"] for one in found["lessons"][1:]] == [["en", "de", "es", "th"]] * 8


@pytest.mark.parametrize(
    ("old", "new", "line", "sentence"),
    [
        (
            "screen: surface",
            "screen: kitchen",
            2,
            "unknown screen 'kitchen'; write one such as 'screen: surface'",
        ),
        ("screen: surface\n", "", 1, "names no screen; write one such as"),
        ("scene: office", "scene: moon", 3, "has the scene 'moon'; write one of"),
        (
            "open: Holes",
            "open: Hole",
            7,
            "has the folder or tab 'Hole', which its screen does not have; try Holes",
        ),
        (
            "Radius (mm)",
            "Radius (cm)",
            8,
            "has the control or number 'Radius (cm)', which its screen does not",
        ),
        ("Radius (mm)", "Nothing", 8, "has the control or number 'Nothing', which its screen does not have"),
        ("Radius (mm)", "after fusion", 8, "has the control or number 'after fusion', which its screen"),
        ("open: Holes", "open: Nowhere", 7, "it has Advanced, "),
        ("set: radii = 2 r_F", "set: radius = 2", 6, "cannot set radius = 2: try one of show, radii"),
        ("open: Holes", "open: Look\nopen: Measure\nopen: None", 9, "the folder or tab 'None'"),
        ("open: Holes", "Open: Holes", 7, "begins with 'Open:'; write 'open:', without a space and in small"),
        ("set: radii", " set: radii", 6, "begins with ' set:'; write 'set:', without a space"),
        (
            "- [ ] Red. | No.\n- [x] Blue.\n- [ ] Grey",
            "- [better=ball] Red. | No.\n- [better=poisson] Blue. | No.\n- [better=none] Grey",
            12,
            "take the three words of one name (better: ball, poisson, untold), or '- [x] choice' once",
        ),
        ("{missed}", "{missed", 9, "has a brace that is not part of a field; write a number as {missed}"),
        ("{missed}", "{Missed}", 9, "has a brace that is not part of a field"),
        ("{missed}", "{{as {missed}", 9, "has a brace that is not part of a field"),
        ("{missed}", "{{as {2:missed}}}", 9, "has the field 2:missed; number the stop from 1 to 1"),
        ("reveal: So.", "reveal: So.\nask: Or?", 11, "in this order, each once and with text"),
        (
            "scene: office",
            "scene: office\nscene: workshop",
            4,
            "one line each of screen, scene, language can be",
        ),
        (
            "{missed}",
            "{mised}",
            9,
            "has the field mised, which is not a number of its screen; try one of missed",
        ),
        (
            "choices:\n- [ ] Red. | No.\n- [x] Blue.\n- [ ] Grey. | No.\n",
            "",
            11,
            "must ask with 'ask:', 'choices:'",
        ),
        ("- [ ] Red. | No.\n", "", 12, "needs 3 choices"),
        ("# My radius\n", "", 1, "has no title; begin it with a line '# title'"),
        (
            "# My radius",
            "# Which ball radius?",
            1,
            "has the title of a lesson that ships; give it another title",
        ),
        ("# My radius", "# Welcher Kugelradius?", 1, "has the title of a lesson that ships"),
        ("scene: office", "language: xx", 3, "has an unknown language; write one of en"),
    ],
)
def test_a_fault_is_one_sentence_with_file_line_and_remedy(capsys, tmp_path, old, new, line, sentence):
    (tmp_path / "mine.md").write_text(LESSON.replace(old, new))
    code, found, err = checked(capsys, tmp_path / "mine.md")
    assert code == 1
    assert (found["faults"][0]["file"], found["faults"][0]["line"]) == (str(tmp_path / "mine.md"), line)
    assert sentence in found["faults"][0]["sentence"]
    assert "Traceback" not in err


@pytest.mark.parametrize("screen", ["screen: Surfaces", "screen: kitchen", ""])
def test_with_an_unknown_screen_all_other_faults_are_named_too(capsys, tmp_path, screen):
    faulty = LESSON.replace("scene: office", "scene: moon").replace("open: Holes", "open: Nowhere")
    faulty = faulty.replace("set: radii = 2 r_F", "set: radii = 0 r_F").replace("reveal: So.\n", "")
    (tmp_path / "mine.md").write_text(faulty)
    (tmp_path / "mine.de.md").write_text(TRANSLATION.replace("{missed}", "{mised}"))
    others = checked(capsys, tmp_path)[1]["faults"]
    assert len({fault["line"] for fault in others if fault["file"].endswith("mine.md")}) == 4
    assert any(fault["file"].endswith("mine.de.md") for fault in others)
    (tmp_path / "mine.md").write_text(faulty.replace("screen: surface", screen))
    faults = checked(capsys, tmp_path)[1]["faults"]
    of_screen = [fault for fault in faults if "screen: surface" in fault["sentence"]]
    assert len(of_screen) == 1
    assert of_screen[0]["sentence"].endswith("; the other faults are those on the screen surface")
    assert [fault for fault in faults if fault not in of_screen] == others


def test_a_translation_is_checked_although_the_original_has_a_fault(capsys, tmp_path):
    (tmp_path / "mine.md").write_text(LESSON.replace("{missed}", "{mised}"))
    (tmp_path / "mine.de.md").write_text(
        f"{TRANSLATION}\n## Zwei\nset: radii = 1 r_F\n".replace("Jetzt {", "{")
    )
    found = [(fault["file"], fault["sentence"]) for fault in checked(capsys, tmp_path)[1]["faults"]]
    assert [file.rpartition("/")[2] for file, _ in found].count("mine.md") == 1
    of_translation = "; ".join(sentence for file, sentence in found if file.endswith("mine.de.md"))
    assert "ends with stop 2, and mine.md has 1" in of_translation
    assert "is a translation; leave out 'set:'" in of_translation
    assert "stop 'Zwei' has no text" in of_translation
    assert "section" not in of_translation


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is empty; begin it with"),
        ("# Grüße".encode("latin-1"), "save it in the encoding UTF-8"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "save it in the encoding UTF-8"),
        (b"# A\x00\nx", "save it in the encoding UTF-8"),
        (b"x" * 50_000_000, "has more than 1 MB"),
    ],
    ids=["empty", "latin-1", "binary", "nul", "50 MB"],
)
def test_a_file_that_is_no_lesson_is_one_sentence(capsys, tmp_path, content, sentence):
    (tmp_path / "mine.md").write_bytes(content)
    code, found, _ = checked(capsys, tmp_path / "mine.md")
    assert code == 1
    assert [fault["line"] for fault in found["faults"]] == [0]
    assert sentence in found["faults"][0]["sentence"]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_lesson_as_windows_writes_it_has_no_fault(capsys, tmp_path, encoding):
    (tmp_path / "mine.md").write_bytes(LESSON.replace("\n", "\r\n").encode(encoding))
    assert checked(capsys, tmp_path / "mine.md")[1]["faults"] == []


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_what_is_no_readable_file_is_one_sentence_and_never_waited_for(capsys, tmp_path):
    os.mkfifo(tmp_path / "a.md")
    (tmp_path / "b.md").mkdir()
    (tmp_path / "c.md").symlink_to(tmp_path / "c.md")
    code, found, _ = checked(capsys, tmp_path)
    assert code == 1
    sentences = [fault["sentence"] for fault in found["faults"]]
    assert sentences[:2] == ["is no file; write the lesson in a text file"] * 2
    assert re.fullmatch(r"cannot be read \(.+\); give a file that a text editor can open", sentences[2])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("mine.xx.md", "has the unknown language 'xx' in its name; write one of en"),
        ("mine.pt-BR.md", "has the unknown language 'pt-BR' in its name"),
        ("mine.en.md", "is in the language of mine.md; rename it, or write 'language:' in mine.md"),
    ],
)
def test_a_translation_into_no_other_language_says_how_to_name_it(capsys, tmp_path, name, sentence):
    (tmp_path / "mine.md").write_text(LESSON)
    (tmp_path / name).write_text(TRANSLATION)
    code, found, _ = checked(capsys, tmp_path)
    assert code == 1
    assert [fault["file"] for fault in found["faults"]] == [str(tmp_path / name)]
    assert sentence in found["faults"][0]["sentence"]


def test_the_title_of_a_translation_is_compared_with_all_titles(capsys, tmp_path):
    (tmp_path / "mine.md").write_text(LESSON)
    (tmp_path / "mine.de.md").write_text(TRANSLATION.replace("Mein Radius", "Welcher Kugelradius?"))
    _, found, _ = checked(capsys, tmp_path)
    assert [(fault["file"], fault["sentence"]) for fault in found["faults"]] == [
        (str(tmp_path / "mine.de.md"), "has the title of a lesson that ships; give it another title")
    ]


def test_two_lessons_of_one_name_or_title(capsys, tmp_path):
    for name in ("a/mine.md", "b/mine.md", "a/other.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(LESSON)
    code, found, _ = checked(capsys, tmp_path / "a", tmp_path / "b", tmp_path / "a" / "mine.md")
    assert code == 1
    sentences = [fault["sentence"] for fault in found["faults"]]
    assert sentences == [
        "has the title of mine.md; give it another title",
        f"has the name of {tmp_path}/a/mine.md; rename one of the two files",
    ]


def test_a_place_without_lessons_and_wrong_use(capsys, tmp_path):
    (tmp_path / "notes.txt").write_text("x")
    code, _, err = ran(capsys, "lesson", "check", str(tmp_path))
    assert code == 1
    assert re.search(r"The folder .* has no lesson; write one as .*my-lesson\.md", err)
    code, _, err = ran(capsys, "lesson", "check", str(tmp_path / "none.md"))
    assert (code, "There is no lesson" in err) == (1, True)
    assert ran(capsys, "lesson", "check")[0] == 2
    assert ran(capsys, "lesson", "mend", "x.md")[0] == 2


def test_serve_does_not_start_with_a_lesson_that_has_a_fault(capsys, tmp_path):
    (tmp_path / "mine.md").write_text(LESSON.replace("{missed}", "{mised} {fo}"))
    code, _, err = ran(capsys, "serve", "--lesson", str(tmp_path / "mine.md"))
    assert code == 1
    assert "mine.md, line 9, has the field mised" in err
    assert "packetmesh lesson check shows the other faults" in err
    assert err.count("\n") == 1

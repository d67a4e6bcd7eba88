"""The lessons that ship in other languages: complete, and with the same names of controls and numbers."""

import re
from collections import Counter

import pytest

from app.lesson.files import CLAUSE, FIELD, LESSONS, screen_of
from app.lesson.languages import NAMES, PHRASES
from app.lesson.reading import check_lesson, languages, read_lesson, translations_of
from app.lessons import check_lessons, names_on
from app.screens.surface import lesson as surface
from tests.app.lesson.test_files import KINDS
from tests.app.lesson.written import LESSON, TRANSLATION

SHIPPED = ("de", "es", "th")
EMPHASIZED = re.compile(r"\*+([^*]+)\*+")
LATIN = re.compile(r"[A-Za-z]{4,}")
KEPT = (
    r"node_02|RVL|JPEG|IEEE|Ethernet|Poisson|TrICP|FICP|CEICP|RMSE|Mbit|kbit|F-scores?|Depth|point cloud"
    r"|point|plane"
    r"|backoff|inpainting|access point|contention window|preamble|sink|tile|mesh|true pose|pose graph|pose"
    r"|registration|calibration|overfitting|drift|magenta|ask:|choices:|reveal:|- \[[^\]]*\]"
)
"""Names, units and terms of the field that a Thai text has in Latin letters."""
ENGLISH = re.compile(
    r"\b(the|of|and|is|are|with|from|this|that|which|what|why|how|not|all|when|where|depth|surface|point|points)\b",
    re.IGNORECASE,
)
QUESTION = TRANSLATION[TRANSLATION.index("ask:") :]
CASES = [(path, code) for path in KINDS for code in SHIPPED]


def bodies(path):
    """The texts of each section."""
    kept = [
        line
        for line in path.read_text("utf-8").splitlines()
        if not re.match(r"(set|open|see|screen|scene):", line)
    ]
    return re.split(r"^## ", "\n".join(kept), flags=re.MULTILINE)[1:]


def emphasized_labels(text, names):
    """The labels of the screen that a text emphasizes."""
    found = {" ".join(one.split()) for one in EMPHASIZED.findall(text)} & names
    return {one for one in found if one[0].isupper() or " " in one}


def test_every_lesson_ships_in_every_language_and_nothing_else_does():
    for path in KINDS:
        assert tuple(translations_of(path)) == SHIPPED
    assert set(languages()) == {"en", *SHIPPED}
    assert len(list(LESSONS.glob("*.md"))) == len(KINDS) * (1 + len(SHIPPED))


@pytest.mark.parametrize(("path", "code"), CASES, ids=lambda value: getattr(value, "stem", value))
def test_a_translation_has_the_stops_the_choices_and_the_numbers_of_the_original(path, code):
    original = read_lesson(path, KINDS[path])
    other = original.translations[code]
    assert other.language == code
    assert len(other.stops) == len(original.stops)
    for one, same in zip(other.stops, original.stops, strict=True):
        assert (one.look, one.opens, one.sees) == (same.look, same.opens, same.sees)
        rights = [[(not choice.reason, choice.when) for choice in x.question.choices] for x in (one, same)]
        assert rights[0] == rights[1]
        fields = [{found[0] for text in x.texts for found in FIELD.finditer(text)} for x in (one, same)]
        assert fields[0] == fields[1]
        assert one.title != same.title


@pytest.mark.parametrize(("path", "code"), CASES, ids=lambda value: getattr(value, "stem", value))
def test_a_translation_names_the_controls_as_the_screen_does(path, code):
    names = names_on(screen_of(KINDS[path].name))[1] | names_on("surface")[0]
    other = path.with_name(f"{path.stem}.{code}.md")
    for one, same in zip(bodies(path), bodies(other), strict=True):
        missing = {name for name in emphasized_labels(one, names) if name not in " ".join(same.split())}
        assert missing == set()


@pytest.mark.parametrize(("path", "code"), CASES, ids=lambda value: getattr(value, "stem", value))
def test_a_translation_types_the_numbers_that_the_original_types(path, code):
    def typed(text):
        plain = FIELD.sub("", CLAUSE.sub(r"\1", text)).replace("1,500", "1500")
        return Counter(re.findall(r"\d+(?:\.\d+)?", plain))

    for one, same in zip(bodies(path), bodies(path.with_name(f"{path.stem}.{code}.md")), strict=True):
        assert set(typed(same)) == set(typed(one))


@pytest.mark.parametrize(("path", "code"), CASES, ids=lambda value: getattr(value, "stem", value))
def test_nothing_is_left_in_english_but_names(path, code):
    for body in bodies(path.with_name(f"{path.stem}.{code}.md")):
        own = re.sub(KEPT, "", FIELD.sub("", EMPHASIZED.sub("", body)))
        assert (LATIN if code == "th" else ENGLISH).findall(own) == []


def test_a_language_has_all_phrases_with_the_same_places():
    assert set(PHRASES) == {"en", *SHIPPED} <= set(NAMES)
    for phrases in PHRASES.values():
        for name in phrases.__slots__:
            own, english = getattr(phrases, name), getattr(PHRASES["en"], name)
            assert own.strip()
            assert own.count("{}") == english.count("{}")
            assert own.count("**Skip**") == english.count("**Skip**")
    assert all(
        len({getattr(one, name) for one in PHRASES.values()}) == 4 for name in ("begin", "guess", "right")
    )


@pytest.mark.parametrize(
    ("old", "new", "line", "sentence"),
    [
        ("## Eins\n", "## Eins\nset: radii = 2 r_F\n", 4, "leave out 'set:'"),
        ("# Mein Radius\n", "# Mein Radius\nscreen: surface\n", 2, "leave out 'screen:', it is in mine.md"),
        ("# Mein Radius\n", "# Mein Radius\nlanguage: de\n", 2, "it is in this file's name"),
        ("reveal: So.", "reveal: So.\n\n## Zwei\nDort.", 13, "ends with stop 2, and mine.md has 1"),
        (TRANSLATION.partition("ask:")[2], "", 6, "must ask with 'ask:', 'choices:' and 'reveal:'"),
        (QUESTION, "", 3, "must ask if and only if 'One' of the original does"),
        ("{missed}", "", 3, "lacks the field {missed}"),
        ("{missed}", "{missed} {unused}", 3, "field {unused}, which 'One' of the original does not have"),
        (
            "- [ ] Rot. | Nein.\n- [x] Blau.",
            "- [x] Rot.\n- [ ] Blau. | Nein.",
            3,
            "must have the marks of 'One' of the original",
        ),
    ],
)
def test_a_translation_that_differs_is_told_by_file_and_line(tmp_path, old, new, line, sentence):
    (tmp_path / "mine.md").write_text(LESSON)
    (tmp_path / "mine.de.md").write_text(TRANSLATION.replace(old, new))
    _, faults = check_lesson(tmp_path / "mine.md", surface.KIND)
    assert [(fault.path.name, fault.line) for fault in faults][:1] == [("mine.de.md", line)]
    assert sentence in faults[0].sentence


def test_a_translation_of_a_lesson_that_does_not_exist_names_the_file_to_write(tmp_path):
    (tmp_path / "mine.de.md").write_text(TRANSLATION)
    lessons, faults = check_lessons([tmp_path / "mine.de.md"])
    assert lessons == []
    assert "mine.md, which does not exist; write that file first" in str(faults[0])

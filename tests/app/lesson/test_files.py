"""Lesson files, the one about the race that ships and bad ones, and the folder that shows them."""

import re
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import pytest
from markdown_it import MarkdownIt

from app.compute import jobs
from app.compute.state import CHAIN, Spec
from app.lesson.files import CLAUSE, FIELD, SCENE, Kind, settled
from app.lesson.languages import PHRASES
from app.lesson.player import OFF, SKIP, SKIPPED, LessonFolder, question_paragraphs
from app.lesson.reading import read_lesson
from app.screens.calibrate import lesson as calibrate
from app.screens.depth import lesson as depth
from app.screens.fuse import lesson as fuse
from app.screens.fuse import walk_lesson as walk
from app.screens.fuse.labels import STARTS
from app.screens.fuse.lesson import SETTINGS, SHIPPED, RaceLook
from app.screens.fuse.view import Race, RaceMode, Start
from app.screens.network import lesson as network
from app.screens.surface import lesson as surface
from app.window.tables import UNKNOWN
from packetmesh.errors import InputError
from packetmesh.progress import drain
from pipeline.sources import Demo
from tests.app.fakes import page_calls, ui_of

ENGLISH = PHRASES["en"]
BEGIN, COMPUTING, FIRST = ENGLISH.begin, ENGLISH.computing, ENGLISH.first

ASKED = """# A
## One
The sky.
ask: Which colour
is it?
choices:
- [ ] Red. | green.
- [x] Blue.
- [ ] Grey. | Only when
  clouded.
reveal: Air scatters blue.
## Two
The sea.
"""


def kind_of(*numbers):
    """A screen that sets what the race sets, and computes these numbers."""
    return Kind("fuse", SETTINGS, RaceLook(), numbers, words={"sky": ("red", "blue", "grey")})


def lesson(tmp_path, text):
    path = tmp_path / "lesson.md"
    path.write_text(text)
    return read_lesson(path, kind_of())


def test_the_stops_of_the_lesson_that_ships_have_different_titles_and_text():
    shipped = read_lesson(SHIPPED, fuse.KIND)
    assert len({stop.title for stop in shipped.stops}) == len(shipped.stops) > 1
    assert all("set:" not in stop.text and len(stop.text) > 100 for stop in shipped.stops)
    assert {stop.look.race.mode for stop in shipped.stops} == {*get_args(RaceMode)}
    assert any(stop.look.in_ms for stop in shipped.stops)


KINDS = {
    calibrate.SHIPPED: calibrate.KIND,
    depth.SHIPPED: depth.KIND,
    surface.SHIPPED: surface.KIND,
    network.CROSSING: network.KIND,
    network.LOST_PACKET: network.KIND,
    network.PLACING: network.KIND,
    SHIPPED: fuse.KIND,
    walk.SHIPPED: walk.KIND,
}


@pytest.mark.parametrize("path", KINDS, ids=lambda path: path.stem)
def test_every_stop_that_ships_differs_and_asks_what_cannot_be_guessed_by_its_place(path):
    shipped = read_lesson(path, KINDS[path])
    assert len({stop.title for stop in shipped.stops}) == len(shipped.stops) >= 5
    assert len({(stop.look, stop.sees) for stop in shipped.stops}) == len(shipped.stops)
    rights = []
    for stop in shipped.stops:
        assert stop.question is not None
        assert "set:" not in stop.text
        assert "Answer" not in stop.text + stop.question.reveal
        rights += [i for i, choice in enumerate(stop.question.choices) if not choice.reason]
    computed = [stop for stop in shipped.stops if stop.question.choices[0].when]
    assert len(rights) + len(computed) == len(shipped.stops)
    assert set(rights) == {0, 1, 2}


def test_a_stop_sets_what_it_names_and_leaves_the_rest_at_the_default(tmp_path):
    (stop,) = lesson(
        tmp_path,
        "# A\n## One\nset: methods = ICP point, ficp plane\nset: start = far off\nset: noise = 2.5 cm\n"
        "set: holes = 30 %\nset: pairs = both\nset: axis = milliseconds\nset: position = 40\nset: lane = 2\n"
        "\nLook *here*.\n\nAnd there.\n",
    ).stops
    assert stop.look.race == Race(
        rivals=(("icp", "point"), ("ficp", "plane")),
        start=Start.towards(*STARTS["far off (20°, 40 cm)"], seed=0),
        noise_m=0.025,
        hole_share=0.3,
        direction="both",
    )
    assert (stop.look.in_ms, stop.look.place, stop.look.lane) == (True, 40, 1)
    assert stop.text == "Look *here*.\n\nAnd there."


def test_a_stop_unfolds_what_it_speaks_of(tmp_path):
    bare, stop = lesson(tmp_path, "# A\n## One\nx\n## Two\nopen: Capture range\nopen: Chain\n\nSee.\n").stops
    assert (bare.opens, stop.opens, stop.text) == ((), ("Capture range", "Chain"), "See.")
    ui = ui_of()
    LessonFolder(ui, lesson(tmp_path, "# A\n## One\nopen: Chain\nx\n"), lambda look: None)
    contents = [one for one in ui.gui.handles if one.kind == "add_html"]
    assert not any("unfold" in one.content for one in contents)
    ui.gui.press("Go", "Next")
    (once,) = [one.content for one in contents if "unfold" in one.content]
    assert ("lesson", [["Chain"], []]) in page_calls(once)
    ui.gui.press("Go", "Back")
    ui.gui.set("Stop", "1. One")
    (again,) = [one.content for one in contents if "unfold" in one.content]
    assert again != once


def test_a_lesson_file_holds_markdown_and_no_tags(tmp_path):
    evil = "<script>parent.pwned=1</script> <img src=x onerror=parent.pwned=1> {number}"
    text = f"# A\n## One {evil[:8]}\n{evil} and *emphasis*\n\n> a quote\n"
    ui = ui_of()
    numbers = {"number": "<b>*3*</b>", SCENE: ""}
    (tmp_path / "lesson.md").write_text(text)
    read = read_lesson(tmp_path / "lesson.md", kind_of("number"))
    LessonFolder(ui, read, lambda look: None, lambda: numbers)
    ui.gui.press("Go", "Next")
    (shown,) = [one.content for one in ui.gui.handles if one.kind == "add_markdown"]
    assert "<" not in shown
    assert "&lt;script>parent.pwned=1&lt;/script>" in shown
    assert "&lt;b&gt;&#42;3&#42;&lt;/b&gt;" in shown
    assert "*emphasis*" in shown
    assert "\n> a quote" in shown


@pytest.mark.parametrize(
    "text",
    [
        "![x](https://a.org/x.png)",
        "![x](data:image/png;base64,AA)",
        "[x](data:text/html,x)",
        "[x]( javascript:x)",
        "[x](/x) [y](#y) [z](mailto:z)",
        "[x][y] [y] ![y]\n\n[y]: data:text/html,x",
        "[x]{number}(data:text/html,x)",
    ],
)
def test_a_lesson_file_shows_no_images_and_leads_to_the_web_only(tmp_path, text):
    ui = ui_of()
    (tmp_path / "lesson.md").write_text(f"# A\n## One\n{text}\n\n[here](https://a.org/) and *there*\n")
    read = read_lesson(tmp_path / "lesson.md", kind_of("number"))
    LessonFolder(ui, read, lambda look: None, lambda: {"number": "", SCENE: ""})
    ui.gui.press("Go", "Next")
    (shown,) = [one.content for one in ui.gui.handles if one.kind == "add_markdown"]
    markdown = MarkdownIt("commonmark", {"html": True})
    markdown.validateLink = lambda _: True  # viser's lets more through than this one
    html = markdown.render(shown)
    assert "<img" not in html
    assert set(re.findall('href="(.*?)"', html)) <= {"https://a.org/", "https://a.org/x.png"}
    assert '<a href="https://a.org/">here</a> and <em>there</em>' in html


def test_reset_leaves_the_lesson_and_takes_back_what_its_stop_had_set(tmp_path):
    ui, looks = ui_of(), []
    LessonFolder(ui, lesson(tmp_path, ASKED.replace("The sky", "set: lane = 2\n\nThe sky")), looks.append)
    ui.resets[0]()
    assert looks == []  # it was at no stop
    ui.gui.press("Go", "Next")
    ui.gui.press("Your guess", SKIP)
    ui.resets[0]()
    assert [look.lane for look in looks] == [1, 0]
    assert ui.gui.find("Stop").value == OFF
    ui.gui.press("Go", "Next")
    assert "Air scatters blue" not in ui.gui.text()


PLAIN = (
    r"3-D|k[12]|802\.11b?|1,500 bytes|only 1\.5 m|1\.25 m|20 µs|0\.02 ms|\b11? Mbit/s|250 kbit/s"
    r"|0\.1 to the|node_02|32 × 32|32 pixels|√3|\+ 1, 2 and 4|from 0 to 2|within 5 %"
    r"|30 cm|8 dB|95 %|95 of 100|99 %"
)
"""Numbers that no scene changes: of formulas, standards and settings."""


@pytest.mark.parametrize("path", KINDS, ids=lambda path: path.stem)
def test_no_lesson_holds_a_number_that_somebody_measured(path):
    text = re.sub(r"^(set|open|see|screen|scene):.*$", "", path.read_text(), flags=re.MULTILINE)
    assert FIELD.search(text)
    typed = re.sub(PLAIN, "", FIELD.sub("", CLAUSE.sub(r"\1", text)))
    assert [line for line in typed.splitlines() if re.search(r"\d", line)] == []
    fractions = r"\b(two fifths|a fifth of the|a third (more|of)|(nine|seven) in (ten|eight)|per cent)\b"
    assert re.search(fractions, typed) is None


def test_a_field_is_the_number_of_now_or_of_another_stop_in_the_same_scene(tmp_path):
    path = tmp_path / "lesson.md"
    path.write_text("# A\n## One\nNow {end}.\n## Two\nNow {end}{{, it was {1:end}}}.\n")
    shipped, ui, shown = read_lesson(path, kind_of("end")), ui_of(), {}
    folder = LessonFolder(ui, shipped, lambda look: shown.clear(), lambda: dict(shown))
    ui.gui.press("Go", "Next")
    assert "Now …." in ui.gui.text()
    shown.update(scene="room", end="2 cm")
    folder.refresh()
    assert "Now 2 cm." in ui.gui.text()
    ui.gui.press("Go", "Next")
    shown.update(scene="room", end="3 cm")
    folder.refresh()
    assert "Now 3 cm, it was 2 cm." in ui.gui.text()
    shown.clear()  # another scene is being computed
    folder.refresh()
    assert "Now …, it was …." in ui.gui.text()
    shown.update(scene="desk", end="4 cm")
    folder.refresh()
    assert "Now 4 cm." in ui.gui.text()
    ui.gui.press("Go", "End")
    assert ui.gui.text() == BEGIN


@pytest.mark.parametrize(
    ("field", "sentence"),
    [
        ("{begun}", "not a number of its screen; try one of end"),
        ("{{was {3:end}}}", "the field 3:end; number the stop from 1 to 2"),
        ("{{was {0:end}}}", "the field 0:end; number the stop from 1 to 2"),
    ],
)
def test_a_field_that_nobody_computes_is_one_sentence(tmp_path, field, sentence):
    path = tmp_path / "lesson.md"
    path.write_text(f"# A\n## One\nx {field}\n## Two\ny")
    with pytest.raises(InputError, match=sentence):
        read_lesson(path, kind_of("end"))


def test_a_number_of_another_stop_stands_in_a_clause_that_can_be_left_out(tmp_path):
    path = tmp_path / "lesson.md"
    path.write_text("# A\n## One\nx\n## Two\nIt was {1:end}.")
    with pytest.raises(InputError, match="1:end outside of double braces"):
        read_lesson(path, kind_of("end"))


@pytest.mark.parametrize("scene", ["box-on-table", "office"])
def test_the_numbers_of_a_lesson_are_those_of_the_scene(scene, store):
    spec, views = Spec(Demo(scene)), {}
    for step in CHAIN:
        views[step] = drain(jobs.run_step(step, store, spec))
    race = Race(start=Start.towards(*fuse.START, seed=0))
    raced = drain(jobs.run("fuse.race_job:race_job", store, spec, race))
    title = views["scene"].title
    screen_numbers = {
        depth: depth.numbers(views["scene"], 0, views["depth"].nodes[0]),
        fuse: fuse.numbers(title, race, raced),
        surface: surface.numbers(title, views["surface"], {}),
    }
    for screen, numbers in screen_numbers.items():
        text = screen.SHIPPED.read_text()
        assert set(numbers) == {*screen.NUMBERS, SCENE}
        lacking = {name for _, name in FIELD.findall(text) if numbers[name] == UNKNOWN}
        assert all(name.endswith(("_3", "_4", "_poisson")) for name in lacking)
    missed = views["surface"].after.quality.no_hit_ray_share
    assert screen_numbers[surface]["missed"] == f"{missed:.1%}".replace("%", " %")
    assert screen_numbers[fuse]["turn"] == "3°"


def right_of(screen, path, name, numbers):
    """The choice that is marked right at the stop whose question is settled by that name."""
    stops = read_lesson(path, screen.KIND).stops
    (asked,) = [stop.question for stop in stops if (stop.question.choices[0].when or [""])[0] == name]
    (right,) = [one.text for one in settled(asked, numbers).choices if not one.reason]
    return right


@pytest.mark.parametrize("scene", ["box-on-table", "office"])
def test_the_choice_that_is_marked_right_is_so_by_the_numbers_of_the_scene(scene, store):
    spec = Spec(Demo(scene))
    views = {step: drain(jobs.run_step(step, store, spec)) for step in CHAIN}
    stops = read_lesson(SHIPPED, fuse.KIND).stops

    def raced(name, title):
        race = next(stop.look.race for stop in stops if stop.title == title)
        view = drain(jobs.run("fuse.race_job:race_job", store, spec, race))
        right = right_of(fuse, SHIPPED, name, fuse.numbers(scene, race, view))
        return [100.0 * lane.steps[-1].off_m for lane in view.lanes], right

    (_, plane_cm, weights_cm, _), right = raced("more", "Plane or point?")
    assert right.startswith("The weights") == (weights_cm < plane_cm - 0.5)
    assert right.startswith("The plane") == (plane_cm < weights_cm - 0.5)
    ends_cm, right = raced("others", "Is entropy the reason?")
    assert ("close" in right) == (abs(min(ends_cm[:2]) - min(ends_cm[2:])) <= 0.5)
    poisson = drain(jobs.run("surface.baselines_job:baseline_job", store, spec, "poisson"))
    values = surface.numbers(scene, views["surface"], {"poisson": poisson})
    right = right_of(surface, surface.SHIPPED, "better", values)
    ball, other = (mesh.truth["f_score_5cm"] for mesh in (views["surface"].after, poisson.mesh))
    assert right.startswith("No" if ball >= other else "Yes")


def test_the_mark_of_a_choice_follows_what_is_computed(tmp_path):
    path = tmp_path / "lesson.md"
    text = ASKED.replace("- [ ] Red", "- [sky=red] Red").replace("- [ ] Grey", "- [sky=grey] Grey")
    path.write_text(text.replace("- [x] Blue.", "- [sky=blue] Blue. | by day."))
    shipped, ui, shown = read_lesson(path, kind_of("sky")), ui_of(), {}
    folder = LessonFolder(ui, shipped, lambda look: None, lambda: dict(shown))
    ui.gui.press("Go", "Next")
    ui.gui.press("Your guess", "1")
    assert COMPUTING in ui.gui.text()
    assert "✓" not in ui.gui.text()
    shown.update({SCENE: "evening", "sky": "red"})
    folder.refresh()
    assert "✓ Red." in ui.gui.text()
    assert "**Right.** Air scatters blue." in ui.gui.text()
    shown.update({SCENE: "noon", "sky": "blue"})
    folder.refresh()
    assert "✓ Blue." in ui.gui.text()
    assert "✗ Red." in ui.gui.text()
    assert "**Not quite, and many think so.** green." in ui.gui.text()


def test_a_clause_whose_number_does_not_exist_gives_way_to_its_second_wording(tmp_path):
    written = "x\n\n{{Yours: {own}.||None is yours.}}{{ There {2:own}.}}{{ Last {2:own}|| Never there}}"
    (tmp_path / "lesson.md").write_text(f"# A\n## One\n{written}\n\n## Two\ny\n")
    ui, now = ui_of(), {SCENE: "noon", "own": UNKNOWN}
    folder = LessonFolder(
        ui, read_lesson(tmp_path / "lesson.md", kind_of("own")), lambda look: None, lambda: now
    )
    ui.gui.press("Go", "Next")
    assert "\nNone is yours. Never there\n" in ui.gui.text()
    now["own"] = "3"
    folder.refresh()
    assert "\nYours: 3. Never there\n" in ui.gui.text()
    ui.gui.press("Go", "Next")
    ui.gui.press("Go", "Back")
    assert "\nYours: 3. There 3. Last 3\n" in ui.gui.text()


def test_the_screen_hears_when_its_lesson_is_left(tmp_path):
    ui, left = ui_of(), []
    LessonFolder(
        ui, lesson(tmp_path, ASKED), lambda look: None, on_end=lambda: left.append(ui.gui.find("Stop").value)
    )
    ui.gui.press("Go", "Next")
    assert left == []
    ui.gui.press("Go", "End")
    assert left == [OFF]


def test_what_a_lost_packet_costs_is_told_by_what_is_left_of_the_cameras():
    def cost(depth_shares, missed):
        view = SimpleNamespace(lossless=SimpleNamespace(no_hit_share=0.1))
        nodes = [SimpleNamespace(depth_share=share) for share in depth_shares]
        return network._cost(view, SimpleNamespace(nodes=nodes, no_hit_share=missed))

    assert cost([1.0, 0.0, 1.0], 0.4) == "camera"
    assert cost([0.9, 0.8], 0.2) == "spread"
    assert cost([0.9, 0.8], 0.1) == "nothing"


@pytest.mark.parametrize(
    ("path", "screen"),
    [
        (calibrate.SHIPPED, calibrate),
        (depth.SHIPPED, depth),
        (surface.SHIPPED, surface),
        (network.CROSSING, network),
        (network.LOST_PACKET, network),
        (network.PLACING, network),
        (SHIPPED, fuse),
        (walk.SHIPPED, walk),
    ],
    ids=lambda value: getattr(value, "stem", ""),
)
def test_the_folders_that_lessons_unfold_are_on_their_screens(path, screen):
    sources = "".join(one.read_text() for one in Path(screen.__file__).parent.rglob("*.py"))
    folders = set(re.findall(r'add_(?:folder|tab)\(\s*"([^"]+)"', sources))
    named = set(re.findall(r"^open: (.+)$", path.read_text(), re.MULTILINE))
    assert named <= folders
    sources += Path("app/window/compare.py").read_text()
    seen = re.findall(r"^see: (.+)$", path.read_text(), re.MULTILINE)
    assert [name for name in seen if f'"{name}"' not in sources] == []


def test_a_start_in_numbers_and_the_end(tmp_path):
    (stop,) = lesson(tmp_path, "# A\n## One\nset: start = 10 deg 20 cm\nset: position = end\nx").stops
    assert stop.look.race.start == Start.towards(10.0, 20.0, seed=0)
    assert stop.look.place is None


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("## One\nx", "has no title"),
        ("# A\nx", "has no stops"),
        ("# A\n## One\nset: noise = 1 cm\n", "stop 'One' has no text"),
        ("# A\n## One\nset: colour = red\nx", "cannot set colour = red: try one of mode"),
        ("# A\n## One\nset: methods = icp\nx", "cannot set methods = icp: try one of icp point"),
        ("# A\n## One\nset: methods = icp point, icp point, icp point, icp point, icp point\nx", "at most 4"),
        ("# A\n## One\nset: noise = much\nx", "try 0 to 10 cm"),
        ("# A\n## One\nopen:\nx", "stop 'One' opens nothing"),
        ("# A\n## One\nset: holes = 95 %\nx", "try 0 to 80 %"),
        ("# A\n## One\nset: start = near\nx", "try one of aligned, slightly off, far off or for example"),
        ("# A\n## One\nset: position = -1\nx", "try start, end or the number"),
        (f"# A\n## One\nset: position = {'9' * 400}\nx", "try start, end or the number"),
        (f"# A\n## One\nset: start = 1 deg {'9' * 400} cm\nx", "try at most 1000 deg and 1000 cm"),
        ("# A\n## One\nset: start = turn 0 0 0 deg shift 0 -1001 0 cm\nx", "try at most 1000 deg"),
        ("# A\n## One\nset: mode = corridor\nset: noise = 1 cm\nx", "a synthetic room cannot be degraded"),
        ("# A\n## One\nset: holes = 10 %\nset: mode = square room\nx", "a synthetic room cannot be degraded"),
        ("# A\n## One\nset: mode\nx", "cannot set mode = : try one of node on node"),
        ("# A\n## One\nask: Why?\nchoices:\n- [x] So.\nreveal: So.", "has no text"),
        ("# A\n## One\nx\nask: Why?", "must ask with 'ask:', 'choices:' and 'reveal:'"),
        ("# A\n## One\nx\nreveal: So.", "must ask with"),
        ("# A\n## One\nx\nask:\nchoices:\n- [x] a\nreveal: So.", "must ask with"),
        ("# A\n## One\nx\nask: Why?\nchoices:\n- [x] a\n- [ ] b | c\nreveal: So.", "needs 3 choices"),
        (ASKED.replace("choices:", "choices: One\nis right."), "has 'One is right.' before the first choice"),
        (ASKED.replace("[x] Blue.", "[sky=blue] Blue. | no."), "or all of them such as"),
        (ASKED.replace("[ ]", "[sky=blue]").replace("[x]", "[sky=red]"), "or all of them such as"),
        (ASKED.replace("[x]", "[ ]"), "needs 3 choices: '- \\[x\\] choice' once"),
        (ASKED.replace(" | green.", ""), "'Red.' has no reason why it is wrong"),
        (ASKED.replace("Blue.", "Blue. | no."), "'Blue.' is right but has a reason why not"),
    ],
)
def test_a_bad_lesson_is_one_sentence(tmp_path, text, sentence):
    with pytest.raises(InputError, match=sentence) as error:
        lesson(tmp_path, text)
    assert re.match(r"The lesson lesson\.md, line \d+, ", str(error.value))
    assert "\n" not in str(error.value)


def test_a_question_has_choices_with_reasons_and_an_answer(tmp_path):
    one, two = lesson(tmp_path, ASKED).stops
    assert (one.text, two.text, two.question) == ("The sky.", "The sea.", None)
    assert one.question.text == "Which colour\nis it?"
    assert [choice.text for choice in one.question.choices] == ["Red.", "Blue.", "Grey."]
    assert [choice.reason for choice in one.question.choices] == ["green.", "", "Only when clouded."]
    assert one.question.reveal == "Air scatters blue."


def test_next_waits_for_a_guess_or_a_skip(tmp_path):
    ui, shown = ui_of(), []
    LessonFolder(ui, lesson(tmp_path, ASKED), shown.append)
    gui, guess = ui.gui, ui.gui.find("Your guess")
    assert not guess.seen
    gui.press("Go", "Next")
    assert guess.seen
    assert "Air scatters" not in gui.text()
    gui.press("Go", "Next")
    assert FIRST in gui.text()
    assert (len(shown), "One" in gui.text()) == (1, True)
    gui.press("Your guess", "3")
    assert "Only when clouded." in gui.text()
    assert "Air scatters blue." in gui.text()
    assert "green." not in gui.text()
    assert not guess.seen
    gui.press("Your guess", "2")
    assert "**Right.**" not in gui.text()
    gui.press("Go", "Next")
    assert "The sea." in gui.text()
    assert not guess.seen
    gui.press("Go", "Back")
    assert "Only when clouded." in gui.text()
    gui.set("Stop", OFF)
    gui.press("Go", "Next")
    assert "Air scatters" not in gui.text()
    gui.press("Your guess", SKIP)
    assert "Air scatters blue." in gui.text()


def test_a_guess_is_answered_with_the_reason_and_the_right_choice_is_marked(tmp_path):
    question = lesson(tmp_path, ASKED).stops[0].question
    wrong, right, skipped, waiting = (
        question_paragraphs(question, guess, "Guess!") for guess in (0, 1, SKIPPED, None)
    )
    assert wrong[:2] == ["1. ✗ Red.", "2. ✓ Blue."]
    assert right[:3] == skipped[:3] == ["1. Red.", "2. ✓ Blue.", "3. Grey."]
    assert "green." in wrong[-1]
    assert right[-1].endswith(skipped[-1])
    assert right[-1] != skipped[-1] == "Air scatters blue."
    assert waiting[-1] == "Guess!"
    assert not any("✓" in line for line in waiting)


def test_a_missing_or_binary_lesson_is_one_sentence(tmp_path):
    (tmp_path / "binary.md").write_bytes(b"\xff\xfe\x00")
    for name in ("none.md", "binary.md"):
        with pytest.raises(InputError, match=f"{name} cannot be read"):
            read_lesson(tmp_path / name, kind_of())


def test_the_folder_begins_with_how_to_begin_and_goes_from_stop_to_stop():
    ui, shown = ui_of(), []
    shipped = read_lesson(surface.SHIPPED, surface.KIND)
    LessonFolder(ui, shipped, shown.append)
    stops, gui = shipped.stops, ui.gui
    assert gui.text() == BEGIN
    gui.press("Go", "Back")
    gui.press("Your guess", "1")
    assert shown == []
    for _ in range(len(stops) + 2):
        gui.press("Go", "Next")
        gui.press("Your guess", "1")
    assert shown == [stop.look for stop in stops]
    gui.press("Go", "Back")
    assert shown[-1] == stops[-2].look
    assert stops[-2].title in gui.text()
    gui.set("Stop", gui.find("Stop").options[1])
    assert shown[-1] == stops[0].look
    gui.set("Stop", OFF)
    assert gui.text() == BEGIN

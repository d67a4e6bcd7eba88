"""A lesson on a screen: it leads from stop to stop, asks before it explains, and counts a class's votes."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import Any, Generic, TypeVar

from app.lesson.ballot import Ballot, votes_csv
from app.lesson.files import (
    CHOICES,
    CLAUSE,
    FIELD,
    OTHERWISE,
    SCENE,
    Lesson,
    Look,
    Numbers,
    Question,
    settled,
)
from app.lesson.languages import PHRASES, Phrases, phrases_of
from app.web.markup import Markup, escape, shipped_markdown
from app.window.page import page_call
from app.window.tables import UNKNOWN
from app.window.teaching import ENGLISH
from app.window.ui import Ui
from packetmesh.errors import InputError

Text = TypeVar("Text", bound=str)
OFF = "not now"
SKIP, SKIPPED = "Skip", -1
FIRST_OF_ALL = -1.0
"""Order of the lesson's folder in its screen's panel: it comes first."""
BAR = 12
"""Length of a bar that stands for all votes, in block characters."""
TO_COME = "…"
REPLACED = re.compile(rf"{FIELD.pattern}|!\[|\](?!\(https?://)")
"""Parts of a file's markdown to replace: fields, and the start of an image or of a link that leads to no web
address, so that both are shown as text."""


class LessonFolder(Generic[Look]):
    """A panel folder that leads through a lesson; each stop sets the screen's controls and asks before it
    explains.
    """

    def __init__(
        self,
        ui: Ui,
        lesson: Lesson[Look],
        on_stop: Callable[[Look], None],
        numbers: Callable[[], Numbers] = dict,
        on_end: Callable[[], None] = lambda: None,
    ) -> None:
        """Add the folder to the panel.

        Args:
            ui: panel of the browser.
            lesson: the lesson.
            on_stop: called with the state that the stop shows.
            numbers: returns the texts for the fields; empty until the screen shows the stop.
            on_end: called when the user leaves the lesson.
        """
        self._written, self._on_stop, self._numbers, self._on_end = lesson, on_stop, numbers, on_end
        self._teaching, self._lecture = ui.teaching, ui.lecture
        self._known: dict[int, Numbers] = {}
        """Numbers by the index of the stop."""
        self._guesses: dict[int, int] = {}
        self._ballots: list[Ballot] = []
        """The votes on all questions that were asked, in their order."""
        self._open: dict[int, Ballot] = {}
        """The votes since the lesson began, by the index of the stop."""
        self._refused = False
        """Whether the last press of *Next* came before a guess."""
        self._translate()
        self._folder = ui.gui.add_folder(self._title, expand_by_default=False, order=FIRST_OF_ALL)
        with self._folder:
            self._stop = ui.gui.add_dropdown(
                "Stop",
                [OFF, *self._names],
                hint="Explains what to look at and sets the controls below; you may change them.",
            )
            ui.when_changed(self._stop, self._picked)
            self._large = ui.gui.add_checkbox(
                "Large",
                ui.lecture is not None,
                hint="Shows less text in large type, readable across a room.",
            )
            ui.when_changed(self._large, self._point_out)
            self._add_languages(ui)
            self._text = ui.gui.add_markdown(shipped_markdown(self._phrases.begin))
            guesses = {str(index + 1): partial(self._take, index) for index in range(CHOICES)}
            self._guess = ui.buttons(
                "Your guess",
                {**guesses, SKIP: partial(self._take, SKIPPED)},
                "The answer that you expect. The lesson then explains why it is right or wrong.",
                visible=False,
            )
            ui.buttons(
                "Go",
                {"Back": lambda: self._go(-1), "Next": lambda: self._go(1), "End": self._end},
                "Back, Next: previous or next stop. End: leave the lesson.",
            )
            if ui.lecture is not None:
                votes = ui.gui.add_button(
                    "Download the votes",
                    hint="All votes of this lecture on this lesson, as a table (CSV), without names.",
                )
                votes.on_click(lambda event: ui.post(self._send_votes, event.client))
            self._mark = ui.gui.add_html(Markup(""))
        self._marked = 0
        ui.resets.append(self.reset)

    @property
    def lesson(self) -> Lesson[Look]:
        """Return the lesson in the language in which it was written."""
        return self._written

    def _add_languages(self, ui: Ui) -> None:
        """Add the choice of the language, if the lesson is translated and all its languages have a name."""
        lesson = self._written
        codes = [lesson.language, *lesson.translations]
        known = ui.teaching.languages
        self._languages = {known[code]: code for code in codes if code in known}
        if not lesson.translations or len(self._languages) < len(codes):
            return
        self._language = ui.gui.add_dropdown(
            "Language",
            list(self._languages),
            initial_value=known[self._lesson.language],
            hint="Language of the lessons' texts. The app itself is in English.",
        )
        ui.when_changed(self._language, lambda: ui.teaching.take(self._languages[self._language.value]))
        ui.teaching.on_change.append(self._change_language)

    def _translate(self) -> None:
        """Take the texts in the chosen language."""
        self._lesson = self._written.in_language(self._teaching.language)
        self._phrases = phrases_of(self._lesson.language)
        self._names = [f"{i}. {stop.title}" for i, stop in enumerate(self._lesson.stops, 1)]
        self._title = f"Lesson: {self._lesson.title}"

    def _change_language(self) -> None:
        """Show the lesson in the chosen language, at the same stop."""
        index = self._index()
        self._translate()
        self._folder.label = self._title
        self._stop.options = (OFF, *self._names)
        self._stop.value = (OFF, *self._names)[index + 1]
        self._language.value = self._teaching.languages[self._lesson.language]
        if index < 0:
            self._text.content = shipped_markdown(self._phrases.begin)
        else:
            self._write()
            self._point_out()

    def reset(self) -> None:
        """If a stop is shown, leave the lesson, forget the guesses and set the screen to its defaults."""
        if self._stop.value != OFF:
            self._stop.value = OFF
            self._picked()
            self._on_stop(self._written.default)

    def _go(self, count: int) -> None:
        index = self._index() + count
        if count > 0 and self._waits():
            self._refused = True
            self._write()
        elif 0 <= index < len(self._names):
            self._stop.value = self._names[index]
            self._picked()

    def _end(self) -> None:
        self._stop.value = OFF
        self._picked()

    def place(self) -> str:
        """Return the stop's number for the address; empty without a stop."""
        return "" if self._index() < 0 else str(self._index() + 1)

    def take(self, place: str) -> None:
        """Go to the stop with this number; an empty ``place`` leaves the lesson.

        Raises:
            InputError: there is no such stop.
        """
        numbers = ["", *(str(number) for number in range(1, len(self._names) + 1))]
        if place not in numbers:
            raise InputError(f"The address has stop {place[:9]}; this lesson has 1 to {len(self._names)}")
        self._stop.value = (OFF, *self._names)[numbers.index(place)]
        self._picked()

    def _index(self) -> int:
        """Return the index of the stop that is shown; -1 without one."""
        return -1 if self._stop.value == OFF else self._names.index(self._stop.value)

    def _waits(self) -> bool:
        """Whether the stop's question has no guess yet."""
        index = self._index()
        return index >= 0 and self._lesson.stops[index].question is not None and index not in self._guesses

    def _picked(self) -> None:
        index = self._index()
        self._refused = False
        if index < 0:
            self._guesses.clear()
            self._open.clear()
            self._text.content, self._guess.visible = shipped_markdown(self._phrases.begin), False
            self._poll()
            self._point_out()
            self._on_end()
            return
        self._known.pop(index, None)
        self._on_stop(self._lesson.stops[index].look)
        self._write()
        self._poll()
        self._point_out()

    def refresh(self) -> None:
        """Update the numbers of the stop after the screen has changed."""
        if self._index() >= 0:
            self._write()

    def _point_out(self) -> None:
        """Let the page show the stop in the chosen type size, open its folders, frame its controls, and give
        the keys to the lesson; nothing without a stop.
        """
        index = self._index()
        self._marked += 1
        if index < 0:
            self._mark.content = Markup("")
            return
        stop = self._lesson.stops[index]
        unfold = page_call("unfold", [self._title, *stop.opens], mark=self._marked)
        lesson = page_call("lesson", stop.opens, stop.sees, mark=self._marked)
        large = "data-large" if self._large.value else ""
        self._mark.content = Markup("<div class='packetmesh-lesson' lang='{}' {}>{}{}</div>").format(
            self._lesson.language, large, keys_html(self._phrases), unfold + lesson
        )

    # The answers.

    def _take(self, guess: int) -> None:
        """Take a guess; only the first one counts."""
        if self._waits():
            self._guesses[self._index()] = guess
            ballot = self._open.get(self._index())
            if ballot is not None and guess != SKIPPED:
                ballot.teacher = guess
            self._write()
            self._poll()

    def _voted(self, voter: str, vote: int) -> None:
        """Count a vote of the class (1: the first choice). A voter's last vote before the answer counts."""
        ballot = self._open.get(self._index())
        if self._waits() and ballot is not None:
            ballot.votes[voter] = vote - 1
            self._write()

    def _poll(self) -> None:
        """Open a vote while the stop waits for an answer, and close it otherwise."""
        if self._lecture is None:
            return
        index, waits = self._index(), self._waits()
        question = self._lesson.stops[index].question if waits else None
        if question is not None and index not in self._open:
            rounds = sum(one.stop == index + 1 for one in self._ballots)
            self._open[index] = Ballot(rounds + 1, index + 1, self._lesson.stops[index].title, question)
            self._ballots.append(self._open[index])
        self._lecture.poll(self._voted if waits else None)

    def _send_votes(self, client: Any) -> None:
        """Send a browser the table of the votes."""
        answered = [one for one in self._ballots if one.votes or one.teacher is not None]
        content = votes_csv(self._written.title, answered)
        client.send_file_download(f"votes-{self._written.name}.csv", content, save_immediately=True)

    # The text.

    def _waiting(self) -> str:
        """Return the text that stands in place of the answer until there is one."""
        if self._refused:
            return self._phrases.first
        return self._phrases.guess if self._lecture is None else self._phrases.voting

    def _write(self) -> None:
        """Show the stop's text and question, and after a guess the answer."""
        index, phrases, waiting = self._index(), self._phrases, self._waiting()
        stop, ballot = self._lesson.stops[index], self._open.get(index)
        place = phrases.place.format(index + 1, len(self._names))
        lines = [f"**{stop.title}** {place}", stop.text]
        if stop.question is not None:
            guess, question = self._guesses.get(index), settled(stop.question, self._numbers())
            if guess is not None and question is None:
                guess, waiting = None, phrases.computing
            shown = question or stop.question
            if ballot is not None:
                ballot.question = _with_texts(shown, lambda text: self._filled(text, index, _plain))
                shown = with_votes(shown, ballot.votes.values())
            lines += [f"**{stop.question.text}**", *question_paragraphs(shown, guess, waiting, phrases)]
        text = self._filled("\n\n".join(lines), index, shipped_markdown)
        if text != self._text.content:
            self._text.content = text
        self._guess.visible = self._waits()

    def _filled(self, text: str, index: int, fill: Callable[..., Text]) -> Text:
        """Replace the text's fields by numbers, and choose the wording of its clauses.

        A field has the number of this stop, or the one stored at another stop in the same scene; while this
        stop's numbers are computed, all are ``TO_COME``, as the scene may be another one. A clause with a
        number that does not exist, or of a stop not visited, becomes its second wording or is left out.
        ``fill`` returns its text with each match of a pattern replaced.
        """
        now = self._numbers()
        if now:
            same = {at: known for at, known in self._known.items() if known[SCENE] == now[SCENE]}
            self._known = {index: now, **same}

        def exists(stop: str, name: str) -> bool:
            known = self._known.get(int(stop) - 1, {}) if stop else now
            return known.get(name, UNKNOWN if stop else TO_COME) != UNKNOWN

        def clause(found: re.Match[str]) -> str:
            ways = found[1].split(OTHERWISE, 1)
            return next((way for way in ways if all(exists(*one) for one in FIELD.findall(way))), "")

        def value(found: re.Match[str]) -> str:
            if found[2] is None:
                return found[0]  # shown as text
            known = self._known[int(found[1]) - 1] if found[1] and now else now
            return known.get(found[2], TO_COME)

        return fill(CLAUSE.sub(clause, text), REPLACED, value)


def _plain(text: str, fields: re.Pattern[str], value: Callable[[re.Match[str]], str]) -> str:
    """Return the text with its fields replaced and without emphasis."""
    return fields.sub(value, text).replace("*", "")


def _with_texts(question: Question, read: Callable[[str], str]) -> Question:
    choices = tuple(replace(choice, text=read(choice.text)) for choice in question.choices)
    return replace(question, text=read(question.text), choices=choices)


def keys_html(phrases: Phrases) -> Markup:
    """Return HTML of the line about the keys: a text while they control the lesson, another for the dock."""
    names = ("→", phrases.space, "←", "1 2 3", "S")
    keys = escape(phrases.keys).format(*map(Markup("<b>{}</b>").format, names))
    dock_keys = escape(phrases.dock_keys).format(Markup("<b>Esc</b>"))
    return Markup(
        "<span class='keys'><span>{}<span class='docked'> {}</span></span><span>{}</span></span>"
    ).format(keys, phrases.docked, dock_keys)


def with_votes(question: Question, votes: Collection[int]) -> Question:
    """Return the question with a bar and a count after each choice, if there are votes.

    Args:
        question: the question.
        votes: index of the choice in each vote.
    """
    if not votes:
        return question
    counts = [sum(vote == index for vote in votes) for index in range(CHOICES)]
    bars = ("█" * round(BAR * count / len(votes)) for count in counts)
    choices = (
        replace(choice, text=f"{choice.text} {bar} **{count}**".replace("  ", " "))
        for choice, bar, count in zip(question.choices, bars, counts, strict=True)
    )
    return replace(question, choices=tuple(choices))


def question_paragraphs(
    question: Question, guess: int | None, waiting: str, phrases: Phrases = PHRASES[ENGLISH]
) -> list[str]:
    """Return paragraphs of markdown: the choices, and the answer to a guess, or ``waiting`` before it.

    Args:
        question: the question.
        guess: index of a choice, ``SKIPPED``, or None before a guess.
        waiting: text shown before a guess.
        phrases: in the language of the question.
    """
    if guess is None:
        return [*(f"{i}. {choice.text}" for i, choice in enumerate(question.choices, 1)), waiting]
    marks = ["" if choice.reason else "✓ " for choice in question.choices]
    answer = ""
    if guess != SKIPPED:
        reason = question.choices[guess].reason
        marks[guess] = "✗ " if reason else "✓ "
        answer = f"**{phrases.wrong}** {reason} " if reason else f"**{phrases.right}** "
    listed = zip(marks, question.choices, strict=True)
    choices = (f"{i}. {mark}{choice.text}" for i, (mark, choice) in enumerate(listed, 1))
    return [*choices, answer + question.reveal]

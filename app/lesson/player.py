"""A lesson on a screen: it leads from stop to stop, asks before it explains, and counts a class's votes."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import Generic

from app.lesson.files import CHOICES, CLAUSE, FIELD, SCENE, Lesson, Look, Numbers, Question, settled
from app.web.markup import Markdown, Markup, shipped_markdown
from app.window.page import page_call
from app.window.ui import Ui
from packetmesh.errors import InputError

OFF, BEGIN = "not now", Markdown("Choose a stop, or press **Next**.")
SKIP, SKIPPED = "Skip", -1
GUESS = f"Take a guess: 1, 2 or 3. Or press **{SKIP}**."
FIRST = "**Guess before you go on: 1, 2 or 3.** A wrong guess costs nothing. Or press **Skip**."
VOTING = f"The class votes: 1, 2 or 3. The teacher's guess, or **{SKIP}**, shows the answer."
COMPUTING = "The answer depends on the scene: it appears when the numbers of this stop are computed."
FIRST_OF_ALL = -1.0
"""Order of the lesson's folder in its screen's panel: it comes first."""
BAR = 12
"""Length of the bar for all votes, blocks."""
KEYS = Markup(
    "<span class='keys'><span><b>→</b> or <b>space</b> next, <b>←</b> back, <b>1 2 3</b> guess, <b>S</b> "
    "skip.<span class='docked'> After a click on the dock, the keys control the "
    "dock.</span></span><span>The keys control the dock now; <b>Esc</b> returns them to the "
    "lesson.</span></span>"
)
"""The page's line about the keys, while they belong to the lesson and while they belong to the dock."""
TO_COME = "…"
REPLACED = re.compile(rf"{FIELD.pattern}|!\[|\](?!\(https?://)")
"""Parts of a file's markdown to replace: fields, and the start of an image or of a link outside the web."""


class LessonFolder(Generic[Look]):
    """Leads through a lesson; each stop sets the screen's controls and asks before it explains."""

    def __init__(
        self,
        ui: Ui,
        lesson: Lesson[Look],
        on_stop: Callable[[Look], None],
        numbers: Callable[[], Numbers] = dict,
    ) -> None:
        """Add the folder to the panel.

        Args:
            ui: panel of the browser.
            lesson: the lesson.
            on_stop: called with the state that the stop shows.
            numbers: returns the texts for the fields, once the screen shows the stop.
        """
        self._lesson, self._on_stop, self._numbers = lesson, on_stop, numbers
        self._known: dict[int, Numbers] = {}
        """Numbers by stop."""
        self._names = [f"{i}. {stop.title}" for i, stop in enumerate(lesson.stops, 1)]
        self._guesses: dict[int, int] = {}
        self._votes: dict[int, dict[int, int]] = {}
        """Votes by stop and voter."""
        self._lecture = ui.lecture
        self._waiting = self._prompt()
        self._title = f"Lesson: {lesson.title}"
        with ui.gui.add_folder(self._title, expand_by_default=False, order=FIRST_OF_ALL):
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
            self._text = ui.gui.add_markdown(BEGIN)
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
            self._mark = ui.gui.add_html(Markup(""))
        self._marked = 0
        ui.resets.append(self.reset)

    def reset(self) -> None:
        """Leave the lesson, restore the settings of its stop and forget the guesses."""
        if self._stop.value != OFF:
            self._stop.value = OFF
            self._picked()
            self._on_stop(self._lesson.default)

    def _go(self, count: int) -> None:
        index = self._index() + count
        if count > 0 and self._waits():
            self._write(FIRST)
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
        """Go to the stop with this number; leave the lesson if it is empty.

        Raises:
            InputError: there is no such stop.
        """
        numbers = ["", *(str(number) for number in range(1, len(self._names) + 1))]
        if place not in numbers:
            raise InputError(f"The address has stop {place[:9]}; this lesson has 1 to {len(self._names)}")
        self._stop.value = (OFF, *self._names)[numbers.index(place)]
        self._picked()

    def _index(self) -> int:
        return -1 if self._stop.value == OFF else self._names.index(self._stop.value)

    def _waits(self) -> bool:
        """Whether the stop's question has no guess yet."""
        index = self._index()
        return index >= 0 and self._lesson.stops[index].question is not None and index not in self._guesses

    def _picked(self) -> None:
        index = self._index()
        if index < 0:
            self._guesses.clear()
            self._votes.clear()
            self._text.content, self._guess.visible = BEGIN, False
            self._poll()
            self._point_out()
            return
        self._known.pop(index, None)
        self._on_stop(self._lesson.stops[index].look)
        self._write(self._prompt())
        self._poll()
        self._point_out()

    def refresh(self) -> None:
        """Update the numbers of the stop, because the screen shows something else."""
        if self._index() >= 0:
            self._write(self._waiting)

    def _point_out(self) -> None:
        """Let the page show the stop in its size, give it the keys and open its folders."""
        index = self._index()
        self._marked += 1
        if index < 0:
            self._mark.content = Markup("")
            return
        stop = self._lesson.stops[index]
        unfold = page_call("unfold", [self._title, *stop.opens], mark=self._marked)
        lesson = page_call("lesson", stop.opens, stop.sees, mark=self._marked)
        large = "data-large" if self._large.value else ""
        self._mark.content = Markup("<div class='packetmesh-lesson' {}>{}{}</div>").format(
            large, KEYS, unfold + lesson
        )

    def _take(self, guess: int) -> None:
        """Take a guess; only the first one counts."""
        if self._waits():
            self._guesses[self._index()] = guess
            self._write(self._prompt())
            self._poll()

    def _voted(self, voter: int, vote: int) -> None:
        """Count a vote of the class; each voter's last vote counts until the answer is shown."""
        if self._waits():
            self._votes.setdefault(self._index(), {})[voter] = vote - 1
            self._write(self._prompt())

    def _poll(self) -> None:
        """Open a vote while the stop waits for an answer, and close it otherwise."""
        if self._lecture is not None:
            self._lecture.poll(self._voted if self._waits() else None)

    def _prompt(self) -> str:
        return GUESS if self._lecture is None else VOTING

    def _write(self, waiting: str) -> None:
        """Show the stop; ``waiting`` is in the place of the answer until there is one."""
        index, self._waiting = self._index(), waiting
        stop = self._lesson.stops[index]
        lines = [f"**{stop.title}** ({index + 1} of {len(self._names)})", stop.text]
        if stop.question is not None:
            guess, question = self._guesses.get(index), settled(stop.question, self._numbers())
            if guess is not None and question is None:
                guess, waiting = None, COMPUTING
            shown_question = with_votes(question or stop.question, self._votes.get(index, {}).values())
            lines += [f"**{stop.question.text}**", *question_paragraphs(shown_question, guess, waiting)]
        text = self._filled("\n\n".join(lines), index)
        if text != self._text.content:
            self._text.content = text
        self._guess.visible = self._waits()

    def _filled(self, text: str, index: int) -> Markdown:
        """Return the text with its numbers, of this stop or as they were at another in the same scene.
        Clauses about stops that the user has not visited are left out."""
        now = self._numbers()
        if now:
            same = {at: known for at, known in self._known.items() if known[SCENE] == now[SCENE]}
            self._known = {index: now, **same}

        def clause(found: re.Match[str]) -> str:
            stops = {int(stop) - 1 for stop, _ in FIELD.findall(found[1]) if stop}
            return found[1] if stops <= self._known.keys() else ""

        def value(found: re.Match[str]) -> str:
            if found[2] is None:
                return found[0]  # shown as text
            known = self._known[int(found[1]) - 1] if found[1] else now
            return known.get(found[2], TO_COME)

        return shipped_markdown(CLAUSE.sub(clause, text), REPLACED, value)


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


def question_paragraphs(question: Question, guess: int | None, waiting: str) -> list[str]:
    """Return paragraphs of markdown: the choices, and the answer to a guess, or ``waiting`` before it.

    Args:
        question: the question.
        guess: index of a choice, ``SKIPPED``, or None before a guess.
        waiting: text shown before a guess.
    """
    if guess is None:
        return [*(f"{i}. {choice.text}" for i, choice in enumerate(question.choices, 1)), waiting]
    marks = ["" if choice.reason else "✓ " for choice in question.choices]
    answer = ""
    if guess != SKIPPED:
        reason = question.choices[guess].reason
        marks[guess] = "✗ " if reason else "✓ "
        answer = f"**Not quite, and many think so.** {reason} " if reason else "**Right.** "
    listed = zip(marks, question.choices, strict=True)
    choices = (f"{i}. {mark}{choice.text}" for i, (mark, choice) in enumerate(listed, 1))
    return [*choices, answer + question.reveal]

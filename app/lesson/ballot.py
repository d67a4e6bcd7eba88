"""A lecture's votes on a lesson as a table: one row for each choice of each question that was asked."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection
from dataclasses import dataclass, field

from app.lesson.files import Question

COLUMNS = ("lesson", "round", "stop", "title", "question", "choice", "text", "right", "votes", "voters")
TEACHER = "teacher"
"""Last column: whether the choice was the teacher's."""
_FORMULA = re.compile(r"^[=+\-@\t\r]")
"""Beginning of a text that a spreadsheet would take for a formula."""


@dataclass(slots=True)
class Ballot:
    """The vote on one question."""

    round: int
    """1 for the first time that the question was asked, 2 for the second."""
    stop: int
    """Number of the stop, from 1."""
    title: str
    question: Question
    """The question as it is shown."""
    votes: dict[str, int] = field(default_factory=dict)
    """The last choice of each voter, by the voter's id; the first choice is 0."""
    teacher: int | None = None
    """The teacher's choice; None if the teacher has not answered, or skipped."""


def votes_csv(lesson: str, ballots: Collection[Ballot]) -> bytes:
    """Return the table of a lesson's votes as CSV in UTF-8, with the byte order mark that spreadsheets need.

    The column ``right`` is empty where the right choice depends on the scene and was not known.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\r\n")
    table.writerow([*COLUMNS, TEACHER])
    for one in ballots:
        choices = one.question.choices
        known = sum(not choice.reason for choice in choices) == 1
        for index, choice in enumerate(choices):
            right = ("yes" if not choice.reason else "no") if known else ""
            votes = sum(vote == index for vote in one.votes.values())
            row = [lesson, one.round, one.stop, one.title, one.question.text, index + 1, choice.text]
            row += [right, votes, len(one.votes), "yes" if one.teacher == index else ""]
            table.writerow([_plain(cell) for cell in row])
    return text.getvalue().encode("utf-8-sig")


def _plain(cell: object) -> str:
    """Return a cell's text on one line, quoted if a spreadsheet would take it for a formula."""
    line = " ".join(str(cell).split())
    return f"'{line}" if _FORMULA.match(line) else line

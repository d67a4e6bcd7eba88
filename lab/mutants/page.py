"""The page docs/mutants.md: shares of the faults that tests see, and the reasons why some are not seen."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lab.mutants.mutations import GROUPS, Mutation

WHYS = Path(__file__).with_name("whys.json")
"""File with a sentence per mutant that is not seen, by ``Mutation.place``: ``equivalent`` ones change no
result, and the sentence says why; of the others it says why no test sees them."""


@dataclass(frozen=True, slots=True)
class Reasons:
    """Sentences of ``WHYS`` by ``Mutation.place``."""

    equivalent: dict[str, str]
    other: dict[str, str]


def reasons() -> Reasons:
    """Read ``WHYS``."""
    return Reasons(**json.loads(WHYS.read_text(encoding="utf-8")))


@dataclass(frozen=True, slots=True)
class Score:
    """Which of the drawn mutants were seen."""

    drawn: int
    """Number of mutants that were drawn."""
    tested: Sequence[Mutation]
    """Those with an answer."""
    seen: Sequence[bool]
    """In the order of ``tested``."""
    reasons: Reasons

    @property
    def survivors(self) -> list[Mutation]:
        """The mutants that were not seen."""
        return [one for one, seen in zip(self.tested, self.seen, strict=True) if not seen]

    @property
    def equivalents(self) -> list[Mutation]:
        """The survivors that change no result (equivalent mutants)."""
        return [one for one in self.survivors if one.place in self.reasons.equivalent]

    @property
    def share(self) -> float:
        """Share of the mutants that change a result, as far as is known, that were seen."""
        return sum(self.seen) / (len(self.tested) - len(self.equivalents))


def scored(drawn: Sequence[Mutation], seen: Mapping[str, bool]) -> Score:
    """Return the score of drawn mutants with answers by their names, and the reasons of ``WHYS``."""
    tested = [one for one in drawn if one.name in seen]
    return Score(len(drawn), tested, [seen[one.name] for one in tested], reasons())


def page(score: Score, seed: int) -> str:
    """Return the page: the score, also of each group, and each survivor with its reason."""
    tested, seen, equivalents = len(score.tested), sum(score.seen), len(score.equivalents)
    rows = []
    for group in GROUPS:
        planted = [seen for one, seen in zip(score.tested, score.seen, strict=True) if one.group == group]
        same = sum(one.group == group for one in score.equivalents)
        rows.append(f"| {group} | {len(planted)} | {sum(planted)} | {same} |")
    return "\n".join(
        [
            "# Mutants",
            "",
            f'`make mutants ARGS="--count {score.drawn} --seed {seed}"` plants {score.drawn} faults, drawn '
            f"with seed {seed} from the modules that hold formulae, one at a time, and runs the tests of "
            "their group. A fault is seen if a test fails. A fault that changes no result (an equivalent "
            "mutant) cannot be seen; the table says which ones were judged so by reading the code.",
            "",
            f"Tested so far: {tested}. Seen: {seen} of {tested} ({seen / tested:.1%}). Without the "
            f"equivalent mutants ({equivalents}): {seen} of {tested - equivalents} ({score.share:.1%}).",
            "",
            *("| group | tested | seen | equivalent |", "| --- | --- | --- | --- |", *rows),
            "",
            *("| not seen | equivalent | why |", "| --- | --- | --- |"),
            *(_row(one, score) for one in score.survivors),
            "",
        ]
    )


def _row(one: Mutation, score: Score) -> str:
    source = one.source.replace("|", r"\|")
    whys = score.reasons.equivalent | score.reasons.other
    kind = "yes" if one.place in score.reasons.equivalent else "no"
    return f"| line {one.line}, `{source}`: `{one.name}` | {kind} | {whys.get(one.place, '')} |"

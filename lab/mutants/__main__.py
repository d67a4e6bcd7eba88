"""``python -m lab.mutants``: plant faults one at a time, run the tests, and write which ones no test saw."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import repeat
from pathlib import Path
from typing import Any

from lab.mutants.mutations import GROUPS, Mutation, draw
from lab.mutants.page import page, reasons, scored
from lab.mutants.testing import copied, digest, sees, time_limit_s
from lab.trials import ROOT
from packetmesh.errors import InputError

AIM = 0.9
"""Least share of the mutants that change a result that the tests must see."""
PAGE = ROOT / "docs" / "mutants.md"
DESCRIPTION = "Plant faults one at a time, run the tests, and list the faults that no test detected."


def main() -> None:
    """Test the mutants that have no answer yet, then write the page; exit with 1 below ``AIM``.

    After Ctrl-C the page says how many were tested, and the same command goes on with the others.
    """
    parser = argparse.ArgumentParser(prog="make mutants", description=DESCRIPTION)
    parser.add_argument("--count", type=int, default=300, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random draw")
    parser.add_argument("--workers", type=int, default=2, help="mutants tested at once")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "mutants", help="where answers are kept")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    answers = options.out / f"answers-{options.seed}.jsonl"
    with tempfile.TemporaryDirectory() as folder:
        copies = [copied(Path(folder) / str(k)) for k in range(options.workers)]
        drawn = draw(copies[0], options.count, options.seed)
        try:
            answered(copies, drawn, answers)
        except InputError as error:
            sys.exit(str(error))
        except KeyboardInterrupt:
            print("stopped; the same command goes on where it was", file=sys.stderr)
        seen = _known(answers, copies[0], drawn)
    found = scored(drawn, seen)
    PAGE.write_text(page(found, options.seed), encoding="utf-8")
    counted = len(found.tested) - len(found.equivalents)
    if found.share < AIM:
        sys.exit(
            f"{found.share:.1%} of {counted} mutants that change a result were seen; the aim is {AIM:.0%}"
        )


def answered(copies: list[Path], drawn: list[Mutation], answers: Path) -> list[bool]:
    """Return whether the tests see each mutant; test those whose answer is not in the file, and add it.

    An answer counts as long as the module is unchanged, and the test that failed or, if none did, all tests
    that run for it. Those that ``page.WHYS`` calls equivalent are not tested: no test can see them.

    Args:
        copies: copies of the repository; as many mutants are tested at once.
        drawn: the mutants.
        answers: file with a line of JSON for each answer.

    Raises:
        InputError: a test fails without a fault, or tests were killed.
    """
    seen, before = _known(answers, copies[0], drawn), _seen_by(answers)
    waiting = [one for one in drawn if one.name not in seen]

    def work(mutation: Mutation, limit_s: float) -> None:
        copy = copies.pop()
        try:
            answer = sees(copy, mutation, limit_s, before.get(mutation.name, ""))
        finally:
            copies.append(copy)
        line = {"name": mutation.name, "digest": digest(copy, mutation, answer.by), **asdict(answer)}
        with answers.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line | asdict(mutation)) + "\n")
        seen[mutation.name] = answer.seen
        print(f"{'seen    ' if answer.seen else 'SURVIVED'} {mutation.name}", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(len(copies)) as pool:
        for group in GROUPS:
            some = [one for one in waiting if one.group == group]
            if some:
                limit_s = max(pool.map(time_limit_s, copies, repeat(group), repeat(some)))
                list(pool.map(work, some, repeat(limit_s)))
    return [seen[one.name] for one in drawn]


def _known(answers: Path, copy: Path, drawn: list[Mutation]) -> dict[str, bool]:
    """Return, by name, the stored answers that count, and those of the equivalent mutants."""
    by_name = {one.name: one for one in drawn}
    seen = dict.fromkeys((one.name for one in drawn if one.place in reasons().equivalent), False)
    for line in _lines(answers):
        mutation = by_name.get(line["name"])
        if mutation is not None and line["digest"] == digest(copy, mutation, line["by"]):
            seen[mutation.name] = line["seen"]
    return seen


def _seen_by(answers: Path) -> dict[str, str]:
    """Return, by name of the mutant, the test file that saw it last, in whatever version."""
    return {line["name"]: line["by"] for line in _lines(answers) if line["by"]}


def _lines(answers: Path) -> list[dict[str, Any]]:
    return list(map(json.loads, answers.read_text(encoding="utf-8").splitlines())) if answers.exists() else []


if __name__ == "__main__":
    main()

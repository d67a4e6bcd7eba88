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
    """Test the mutants that have no answer yet, then write the page; exit with 1 below ``AIM``."""
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
            seen = answered(copies, drawn, answers)
        except InputError as error:
            sys.exit(str(error))
    found = scored(drawn, seen)
    PAGE.write_text(page(found, options.seed), encoding="utf-8")
    counted = len(drawn) - len(found.equivalents)
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
    seen = dict.fromkeys((one.name for one in drawn if one.place in reasons().equivalent), False)
    counting, before = _read(answers, copies[0], drawn)
    seen |= counting
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


def _read(answers: Path, copy: Path, drawn: list[Mutation]) -> tuple[dict[str, bool], dict[str, str]]:
    """Return, by name of the mutant, the stored answers that count, and the tests that ever saw it."""
    if not answers.exists():
        return {}, {}
    by_name = {one.name: one for one in drawn}
    seen, tests = {}, {}
    for line in map(json.loads, answers.read_text(encoding="utf-8").splitlines()):
        mutation = by_name.get(line["name"])
        if mutation is None:
            continue
        if line["by"]:
            tests[mutation.name] = line["by"]
        if line["digest"] == digest(copy, mutation, line["by"]):
            seen[mutation.name] = line["seen"]
    return seen, tests


if __name__ == "__main__":
    main()

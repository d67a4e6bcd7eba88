"""``python -m lab.mutants``: plant faults one at a time, run the tests, and write which ones no test saw."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from lab.mutants.mutations import GROUPS, Mutation, draw
from lab.trials import ROOT

PATIENCE_S = 600.0
"""Time limit of each test run; a mutant that exceeds it counts as seen, because it may never stop."""
AIM = 0.9
"""Least share of mutants that the tests must see."""
WHYS = Path(__file__).with_name("whys.json")
"""File with a sentence per surviving mutant, by name: why it is no fault, or why no test sees it."""
PAGE = ROOT / "docs" / "mutants.md"


def main() -> None:
    """Test the mutants that have no answer yet, then write the page; exit with 1 below ``AIM``.

    Answers are found by the mutant's name only: delete them after changing a module or its tests.
    """
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--workers", type=int, default=2, help="mutants tested at once")
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "mutants", help="where answers are kept")
    options = parser.parse_args()
    drawn = draw(ROOT, options.count, options.seed)
    options.out.mkdir(parents=True, exist_ok=True)
    answers = options.out / f"answers-{options.seed}.jsonl"
    seen = _read(answers)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.workers) as pool:
        copies = [_copy(Path(folder) / str(k)) for k in range(options.workers)]

        def work(mutation: Mutation) -> None:
            copy = copies.pop()
            try:
                answer = _test(copy, mutation)
            finally:
                copies.append(copy)
            with answers.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"name": mutation.name, "seen": answer, **asdict(mutation)}) + "\n")
            print(f"{'seen    ' if answer else 'SURVIVED'} {mutation.name}", file=sys.stderr, flush=True)

        list(pool.map(work, [one for one in drawn if one.name not in seen]))
    seen = _read(answers)
    share = sum(seen[one.name] for one in drawn) / len(drawn)
    PAGE.write_text(_page(drawn, seen, options.seed), encoding="utf-8")
    sys.exit(0 if share >= AIM else f"{share:.1%} of {len(drawn)} mutants were seen, and {AIM:.0%} is asked")


def _read(answers: Path) -> dict[str, bool]:
    if not answers.exists():
        return {}
    lines = map(json.loads, answers.read_text(encoding="utf-8").splitlines())
    return {line["name"]: line["seen"] for line in lines}


def _copy(folder: Path) -> Path:
    """Copy every file that git tracks, so that faults are never in the working tree."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in names.stdout.splitlines():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, folder / name)
    return folder


def _test(copy: Path, mutation: Mutation) -> bool:
    """Return whether a test fails, or exceeds the time, with the fault in the copy.

    Test files named after the module run first, then those of its group.
    """
    module = copy / mutation.path
    code = module.read_text(encoding="utf-8")
    own = [str(path) for path in copy.glob(f"tests/**/test_{module.stem}.py")]
    everything = [str(copy / path) for path in GROUPS[mutation.group][1]]
    module.write_text(mutation.applied(code), encoding="utf-8")
    try:
        _forget_compiled(copy, code)
        return any(_fails(copy, paths) for paths in (own, everything) if paths)
    finally:
        module.write_text(code, encoding="utf-8")
        _forget_compiled(copy, code)


def _forget_compiled(copy: Path, code: str) -> None:
    """Delete Numba's cache in the copy if the module's ``code`` has compiled functions.

    Numba recompiles a changed function, but not its callers, which may be in any module.
    """
    if "compiled" in code or "njit" in code:
        shutil.rmtree(copy / ".numba", ignore_errors=True)


def _fails(copy: Path, paths: list[str]) -> bool:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *paths]
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {"NUMBA_CACHE_DIR": str(copy / ".numba"), "OMP_NUM_THREADS": "1"}
    try:
        run = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        return True
    return run.returncode != 0


def _page(drawn: list[Mutation], seen: dict[str, bool], seed: int) -> str:
    """Return docs/mutants.md: the score of each group, and each survivor with its reason."""
    whys: dict[str, str] = json.loads(WHYS.read_text(encoding="utf-8"))
    rows = []
    for group in GROUPS:
        found = [seen[one.name] for one in drawn if one.group == group]
        rows.append(f"| {group} | {len(found)} | {sum(found)} |")
    survivors = [one for one in drawn if not seen[one.name]]
    total = len(drawn) - len(survivors)
    lines = [f"| line {one.line}: `{one.name}` | {whys.get(one.name, '')} |" for one in survivors]
    return "\n".join(
        [
            "# Mutants",
            "",
            f"`make mutants` plants {len(drawn)} faults, drawn with seed {seed} from the modules that hold "
            "formulae, one at a time, and runs the tests of their group. A fault is seen if a test fails.",
            "",
            f"Seen: {total} of {len(drawn)} ({total / len(drawn):.1%}).",
            "",
            *("| group | planted | seen |", "| --- | --- | --- |", *rows),
            "",
            *("| not seen | why |", "| --- | --- |", *lines),
            "",
        ]
    )


if __name__ == "__main__":
    main()

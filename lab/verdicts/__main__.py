"""Measure how often verdicts on simulated calibration sessions are right.

``python -m lab.verdicts --seed 2026 --sessions 400`` prints one JSON object. The limits in
``pipeline/calibration/verdict.py`` were chosen by the sessions of seed 100; the record is of another seed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from lab.trials import iterate_trials
from lab.verdicts.rules import OURS, judge, mrcal_installed
from packetmesh.errors import PacketMeshError
from packetmesh.files import finite
from packetmesh.progress import drain

BINS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""Edges of the bins of stated probability in which good cameras are counted."""


def summary(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return counts of right and wrong verdicts by rule, and of good cameras by our stated probability.

    Args:
        answers: the results of ``judge``.
    """
    rules = dict.fromkeys(rule for one in answers for rule in one["verdicts"])
    judged = [one for one in answers if "probability" in one]
    bins = []
    for low, high in pairwise(BINS):
        within = [
            one for one in judged if low <= one["probability"] < high or high == one["probability"] == 1.0
        ]
        mean = sum(one["probability"] for one in within) / max(len(within), 1)
        bins.append(
            {
                "from": low,
                "to": high,
                "sessions": len(within),
                "mean_probability": mean,
                "good": sum(one["good"] for one in within),
            }
        )
    return {
        "sessions": len(answers),
        "without_a_camera": len(answers) - len(judged),
        "rules": {
            rule: counts([one["verdicts"][rule] for one in answers if rule in one["verdicts"]])
            for rule in rules
        },
        "groups": {
            title: counts([one["verdicts"][OURS] for one in judged if one[key] == value])
            for title, key, value in GROUPS
        },
        "probabilities": bins,
    }


GROUPS = (
    *(("right lens model", "right_lens", True), ("wrong lens model", "right_lens", False)),
    *(("flat board", "bent", False), ("bent board", "bent", True)),
    *(("good views", "views", "good"), ("few views", "views", "few"), ("similar views", "views", "similar")),
    *(("no view blurred", "blurred", False), ("blurred views", "blurred", True)),
)
"""Title of each group of sessions, and the key and value of the answers that belong to it."""


def counts(verdicts: Sequence[dict[str, Any]]) -> dict[str, int]:
    """Count verdicts, the wrong ones among them, and the good cameras among the undecided."""
    numbers = {"judged": len(verdicts)}
    for word, wrong_if in (("pass", False), ("fail", True), ("not decided", True)):
        found = [one for one in verdicts if one["word"] == word]
        numbers[word] = len(found)
        numbers[f"{word}, wrong" if word != "not decided" else "not decided, good"] = sum(
            one["good"] is wrong_if for one in found
        )
    return numbers


def main() -> None:
    """Print the counts as one JSON object; the trials are stored, so that an interrupted run resumes."""
    parser = argparse.ArgumentParser(prog="python -m lab.verdicts", description=__doc__)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--sessions", type=int, default=400)
    parser.add_argument("--out", type=Path, default=Path("runs/verdicts"))
    parser.add_argument("--processes", type=int, default=None)
    options = parser.parse_args()
    with_mrcal = mrcal_installed()
    tasks = [(options.seed, number, with_mrcal) for number in range(options.sessions)]
    try:
        trials = iterate_trials("verdicts", judge, tasks, options.out, processes=options.processes)
        answers = drain(
            trials, lambda progress: sys.stderr.write(f"{progress.fraction:4.0%} {progress.stage}\n")
        )
        record = {"seed": options.seed, "mrcal": with_mrcal, **summary(answers)}
    except PacketMeshError as error:
        sys.exit(f"verdicts: {error}")
    sys.stdout.write(f"{json.dumps(finite(record), allow_nan=False)}\n")


if __name__ == "__main__":
    main()

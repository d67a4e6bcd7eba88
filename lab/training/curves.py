"""The learning curves of a training run, from its log; needs no torch."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import FloatArray


def curve(out: Path) -> dict[str, FloatArray]:
    """What a run wrote into ``log.jsonl``, one (n,) array a quantity, in the order of its steps.

    All have the same length: ``step``, ``images_seen``, ``elapsed_s``, ``loss`` (mean since the entry before)
    and ``val_...`` (validation errors at the input size of that time), NaN where an entry has none. Where a
    run was broken off and continued from an older checkpoint, the repeated steps count, not the lost ones.

    Raises:
        InputError: the folder has no log.
    """
    file = out / "log.jsonl"
    if not file.is_file():
        raise InputError(f"There is no log.jsonl in {out}: name the folder of a training run.")
    entries: list[dict[str, float]] = []
    for line in file.read_text().splitlines():
        try:
            entry = json.loads(line)
        except ValueError:  # the last line of a run that was killed while it wrote
            continue
        while entries and entries[-1]["step"] > entry["step"]:
            entries.pop()
        if entries and entries[-1]["step"] == entry["step"]:
            entries[-1] |= entry
        else:
            entries.append(entry)
    names = dict.fromkeys(name for entry in entries for name in entry)
    return {name: np.array([entry.get(name, np.nan) for entry in entries], np.float64) for name in names}

"""Judge the order of depth tiles: ``python -m lab.worth [--rooms 20] [--json]``."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from lab.between_cameras.rigs import room_seeds
from lab.trials import iterate_trials
from lab.worth.tables import lines, measures
from lab.worth.trials import OWN, RANDOM, WORTH, Task, judged
from packetmesh.progress import drain
from pipeline.io.demos import CALIBRATED_SCENES


def main() -> None:
    """Print the table of the demo rooms and of held-out rooms; about a minute a rig on one core."""
    parser = argparse.ArgumentParser(prog="python -m lab.worth", description=__doc__)
    parser.add_argument("--rooms", type=int, default=20, help="number of held-out rooms")
    parser.add_argument("--split", default="test", choices=("validation", "test"), help="split of the rooms")
    parser.add_argument("--out", type=Path, default=Path("runs/worth"), help="folder of the trials")
    parser.add_argument("--processes", type=int, default=1, help="rigs that are computed in parallel")
    parser.add_argument("--scenes", nargs="*", default=CALIBRATED_SCENES, help="demo rooms")
    parser.add_argument("--random", action="store_true", help="also a random order of the tiles")
    parser.add_argument("--json", action="store_true", help="print the table as JSON")
    options = parser.parse_args()
    rigs = [*options.scenes, *(f"room-{seed}" for seed in room_seeds(options.split, options.rooms))]
    orders = [(OWN, WORTH), *([(RANDOM,)] if options.random else [])]
    tasks = [Task(rig, some) for some in orders for rig in rigs]
    trials = iterate_trials("orders", judged, tasks, options.out, processes=options.processes)
    found = [row for rows in drain(trials) for row in rows]
    if options.json:
        sys.stdout.write(f"{json.dumps(measures(found), indent=1)}\n")
        return
    for line in lines(measures(found)):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()

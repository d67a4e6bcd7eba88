"""Judge tiles left out between cameras: ``python -m lab.between_cameras [--rooms 20] [--json]``."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path

from lab.between_cameras.control import control
from lab.between_cameras.rigs import room_seeds
from lab.between_cameras.tables import lines, measures
from lab.between_cameras.trials import POSES, RIGHT, Row, Task, judged
from lab.trials import iterate_trials
from packetmesh.progress import drain
from pipeline.io.demos import CALIBRATED_SCENES


def main() -> None:
    """Print the table of the demo rooms and of held-out rooms; about two minutes a rig on one core."""
    parser = argparse.ArgumentParser(prog="python -m lab.between_cameras", description=__doc__)
    parser.add_argument("--rooms", type=int, default=20, help="number of held-out rooms")
    parser.add_argument("--split", default="test", choices=("validation", "test"), help="split of the rooms")
    parser.add_argument("--out", type=Path, default=Path("runs/between-cameras"), help="folder of the trials")
    parser.add_argument("--processes", type=int, default=1, help="rigs that are computed in parallel")
    parser.add_argument("--scenes", nargs="*", default=CALIBRATED_SCENES, help="demo rooms")
    parser.add_argument("--json", action="store_true", help="print the table as JSON")
    options = parser.parse_args()
    rigs = [*options.scenes, *(f"room-{seed}" for seed in room_seeds(options.split, options.rooms))]
    tasks = [Task(rig, poses) for rig in rigs for poses in POSES]
    right = [task for task in tasks if task.poses == RIGHT]
    run = partial(iterate_trials, folder=options.out, processes=options.processes)
    found = drain(run("between cameras", judged, tasks)) + drain(run("random tiles", control, right))
    rows: list[Row] = [row for rows_of_task in found for row in rows_of_task]
    if options.json:
        sys.stdout.write(f"{json.dumps(measures(rows), indent=1)}\n")
        return
    for line in lines(rows):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()

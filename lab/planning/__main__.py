"""Judge the planner's promises: ``python -m lab.planning [--rooms 20] [--out FOLDER]``."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path

from lab.between_cameras.rigs import room_seeds
from lab.planning.judging import judged_room
from lab.planning.measures import measures
from lab.trials import iterate_trials
from packetmesh.progress import drain

GAINS = ("room", "rank", "promised", "low", "high", "real", "placed")
"""Values of each suggestion that are printed."""


def main() -> None:
    """Print the measures of held-out rooms as JSON; about two minutes a room on one core."""
    parser = argparse.ArgumentParser(prog="python -m lab.planning", description=__doc__)
    parser.add_argument("--rooms", type=int, default=20, help="number of rooms")
    parser.add_argument("--skip", type=int, default=0, help="number of rooms that are left out before them")
    parser.add_argument("--split", default="test", choices=("validation", "test"), help="split of the rooms")
    parser.add_argument("--out", type=Path, default=Path("runs/planning"), help="folder of the trials")
    parser.add_argument("--processes", type=int, default=1, help="rooms that are computed in parallel")
    options = parser.parse_args()
    run = partial(iterate_trials, folder=options.out, processes=options.processes)
    found = drain(
        run("planning", judged_room, room_seeds(options.split, options.skip + options.rooms)[options.skip :])
    )
    rows = [row for one in found for row in one]
    gains = [{name: row[name] for name in GAINS} for row in rows]
    sys.stdout.write(f"{json.dumps(measures(rows) | {'gains': gains}, indent=1)}\n")


if __name__ == "__main__":
    main()

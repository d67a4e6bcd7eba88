"""Fit the table of ``pipeline.measuring.guesses``: ``python -m lab.measuring [ROOMS]``."""

from __future__ import annotations

import sys
from itertools import islice

import numpy as np

from lab.measuring.clicks import clicks
from lab.measuring.rooms import TUNING, measured_room
from pipeline.measuring.guesses import CHANCES, CONFIDENCES, class_of

ROOMS = 40
CLICKS = 3000
MOST_OF_A_ROOM = 60
"""Guessed clicks of a room that count in a class, so that no room decides alone."""


def main(rooms: int = ROOMS) -> None:
    """Print the quantiles of the guesses' errors by class of confidence, from the tuning rooms."""
    errors: list[list[float]] = [[] for _ in CONFIDENCES[1:]]
    for seed in range(TUNING, TUNING + rooms):
        room = measured_room(seed)
        if room is None:
            continue
        own: list[list[float]] = [[] for _ in errors]
        for click in islice(clicks(room, np.random.default_rng([seed, 31])), CLICKS):
            if click.mark.guessed:
                own[class_of(click.mark.confidence)].append(click.log_error)
        for all_rooms, some in zip(errors, own, strict=True):
            all_rooms += some[:MOST_OF_A_ROOM]
        sys.stderr.write(f"{seed}: {[len(some) for some in errors]}\n")
    for some in errors:
        values = ", ".join(f"{value:.3f}" for value in np.quantile(some, CHANCES))
        sys.stdout.write(f"    ({values}),\n")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

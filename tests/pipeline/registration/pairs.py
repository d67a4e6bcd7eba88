"""Matchings whose distances alone matter."""

import numpy as np

from pipeline.registration.matching import Matching


def pairs_at(distances_m, target_rows=None) -> Matching:
    """Pairs at given distances, each with its own source point, and its own target point unless given."""
    rows, points = np.arange(len(distances_m)), np.zeros((len(distances_m), 3))
    targets = rows if target_rows is None else np.asarray(target_rows)
    return Matching(rows, targets, points, points, np.asarray(distances_m, dtype=float))

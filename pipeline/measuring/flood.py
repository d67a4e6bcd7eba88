"""Connected part of a surface around a vertex; compiled, because a click on a plane grows several parts."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.kdtree import compiled
from pipeline.types import BoolArray, IntArray


@compiled
def flooded(first: IntArray, neighbours: IntArray, within: BoolArray, seed: int) -> BoolArray:
    """Return (V,) True for the vertices of ``within`` that are connected with a seed through others of it.

    Args:
        first: (V + 1,) first place of each vertex's neighbours.
        neighbours: (2 E,) all neighbours.
        within: (V,) vertices that may be entered.
        seed: the vertex from which the part grows.
    """
    reached = np.zeros(len(within), np.bool_)
    waiting = np.empty(len(within), np.int64)
    waiting[0], count = seed, 1
    reached[seed] = True
    while count > 0:
        count -= 1
        vertex = waiting[count]
        for place in range(first[vertex], first[vertex + 1]):
            other = neighbours[place]
            if within[other] and not reached[other]:
                reached[other] = True
                waiting[count] = other
                count += 1
    return reached

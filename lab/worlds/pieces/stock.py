"""Bounds and motion of pieces (lists of parts), a stock of prebuilt ones, and a weighted random choice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from lab.worlds.scene import Part, Rng
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray

_Made = TypeVar("_Made")
VARIANTS = 400
"""Number of prebuilt pieces per maker and stock."""
SEEDS_OF_A_SPLIT = 1_000_000
"""Number of consecutive room seeds that share a stock."""
Makers = Sequence[tuple[float, Callable[[], _Made]]]
"""Weights and makers of pieces or other objects."""


@lru_cache(maxsize=2048)
def stocked(maker: Callable[[Rng], _Made], variant: int) -> _Made:
    """Return a maker's piece for the seed ``variant``, cached because building costs more than rendering."""
    return maker(np.random.default_rng([variant, 404]))


def from_stock(maker: Callable[[Rng], _Made], room_seed: int, rng: Rng) -> _Made:
    """Return a random prebuilt piece of a maker, before recolouring, from the stock of the room's seed.

    Rooms whose seeds are in the same million share a stock; those of different millions share no piece. The
    first million is for training, the second for validation, the others are for tests.
    """
    return stocked(maker, room_seed // SEEDS_OF_A_SPLIT * VARIANTS + int(rng.integers(VARIANTS)))


def bounds(parts: list[Part]) -> tuple[FloatArray, FloatArray]:
    """Return the (3,) low and (3,) high corner of the parts' bounding box, along the axes of the world."""
    places = [apply(part.T_world_part, part.vertices_m) for part in parts]
    return np.min([p.min(axis=0) for p in places], axis=0), np.max([p.max(axis=0) for p in places], axis=0)


def moved(parts: list[Part], T: FloatArray) -> list[Part]:
    """Return the piece after a rigid (4, 4) motion."""
    return [replace(part, T_world_part=T @ part.T_world_part) for part in parts]


def draw(rng: Rng, makers: Makers[_Made]) -> _Made:
    """Call a random maker, drawn with a probability in proportion to its weight; return its product."""
    weight = np.array([w for w, _ in makers])
    return makers[int(rng.choice(len(makers), p=weight / weight.sum()))][1]()

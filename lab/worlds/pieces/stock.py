"""Pieces (lists of parts) as wholes: their bounds, their motion, and a stock of prebuilt ones."""

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
SEEDS_OF_A_SPLIT = 1_000_000
Makers = Sequence[tuple[float, Callable[[], _Made]]]
"""Weights and makers of pieces or other objects."""


@lru_cache(maxsize=2048)
def stocked(maker: Callable[[Rng], _Made], variant: int) -> _Made:
    """Return a maker's piece for its own seed, cached because building costs more than rendering."""
    return maker(np.random.default_rng([variant, 404]))


def from_stock(maker: Callable[[Rng], _Made], room_seed: int, rng: Rng) -> _Made:
    """Return a random prebuilt piece of a kind, before recolouring, from the stock of the room's split.

    Seeds below a million are for training, below two million for validation, others for tests; the splits
    share no piece.
    """
    return stocked(maker, room_seed // SEEDS_OF_A_SPLIT * VARIANTS + int(rng.integers(VARIANTS)))


def bounds(parts: list[Part]) -> tuple[FloatArray, FloatArray]:
    """Return the (3,) lowest and (3,) highest corner."""
    places = [apply(part.T_world_part, part.vertices_m) for part in parts]
    return np.min([p.min(axis=0) for p in places], axis=0), np.max([p.max(axis=0) for p in places], axis=0)


def moved(parts: list[Part], T: FloatArray) -> list[Part]:
    """Return the piece after a rigid (4, 4) motion."""
    return [replace(part, T_world_part=T @ part.T_world_part) for part in parts]


def draw(rng: Rng, makers: Makers[_Made]) -> _Made:
    """Call one of the (weight, maker) pairs, chosen by weight."""
    weight = np.array([w for w, _ in makers])
    return makers[int(rng.choice(len(makers), p=weight / weight.sum()))][1]()

"""Pieces (lists of parts) as wholes: their bounds, their motion, and a stock of ready ones."""

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
"""Weights, and what makes a piece (or another thing) where its turn comes."""


@lru_cache(maxsize=2048)
def stocked(maker: Callable[[Rng], _Made], variant: int) -> _Made:
    """The piece that a maker builds from its own seed, kept: building costs more than rendering."""
    return maker(np.random.default_rng([variant, 404]))


def from_stock(maker: Callable[[Rng], _Made], room_seed: int, rng: Rng) -> _Made:
    """One of the pieces of a kind that rooms of this split draw from, before recolouring.

    Seeds below a million are for training, below two for validation, the others for tests; no piece is in
    the stock of two.
    """
    return stocked(maker, room_seed // SEEDS_OF_A_SPLIT * VARIANTS + int(rng.integers(VARIANTS)))


def bounds(parts: list[Part]) -> tuple[FloatArray, FloatArray]:
    """(3,) lowest and (3,) highest corner."""
    places = [apply(part.T_world_part, part.vertices_m) for part in parts]
    return np.min([p.min(axis=0) for p in places], axis=0), np.max([p.max(axis=0) for p in places], axis=0)


def moved(parts: list[Part], T: FloatArray) -> list[Part]:
    """The piece after a rigid (4, 4) motion."""
    return [replace(part, T_world_part=T @ part.T_world_part) for part in parts]


def draw(rng: Rng, makers: Makers[_Made]) -> _Made:
    """Calls one of the (weight, maker) pairs, chosen by weight."""
    weight = np.array([w for w, _ in makers])
    return makers[int(rng.choice(len(makers), p=weight / weight.sum()))][1]()

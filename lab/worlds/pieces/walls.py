"""Objects that hang on walls or are built into them."""

from __future__ import annotations

from dataclasses import dataclass

from lab.worlds.furniture import fixtures
from lab.worlds.furniture.placing import place
from lab.worlds.pieces.small import things_on
from lab.worlds.pieces.stock import moved
from lab.worlds.scene import Part, Rng


@dataclass(frozen=True, slots=True)
class WallPiece:
    """A piece with its back at y = 0, and the place that it needs on a wall."""

    parts: list[Part]
    width_m: float
    """Width along the wall."""
    height_m: float
    """Height of its origin above the floor."""
    daylight: bool = False
    """Whether light comes in through it."""


def random_wall_piece(rng: Rng) -> WallPiece:
    """A window, door, picture, shelf, radiator, clock or some notes."""
    kind = rng.choice(7, p=[0.2, 0.08, 0.34, 0.14, 0.08, 0.05, 0.11])
    if kind == 0:
        return _window(rng)
    if kind == 1:
        return WallPiece(fixtures.door(rng), 1.05, 0.0)
    if kind == 2:
        width, height = rng.uniform((0.25, 0.2), (1.3, 1.0))
        picture = fixtures.picture(rng, size_m=(width, height))
        return WallPiece(picture, width + 0.05, rng.uniform(1.25, 1.75))
    if kind == 3:
        return _shelf(rng)
    if kind == 4:
        return WallPiece(fixtures.radiator(rng, width_m=rng.uniform(0.5, 1.4)), 1.5, 0.0)
    if kind == 5:
        return WallPiece(fixtures.wall_clock(rng, radius_m=rng.uniform(0.1, 0.2)), 0.4, rng.uniform(1.6, 1.9))
    return _notes(rng)


def _window(rng: Rng) -> WallPiece:
    width, height = rng.uniform(0.7, 1.9), rng.uniform(0.7, 1.4)
    sill = min(rng.uniform(0.6, 1.0), 2.1 - height)
    brightness, panes = rng.uniform(0.8, 3.0), int(rng.integers(1, 4))
    parts = fixtures.window(rng, size_m=(width, height), brightness=brightness, panes=panes)
    if rng.random() < 0.4:
        curtains = fixtures.curtains(rng, width_m=width + 0.6, height_m=2.2)
        return WallPiece(parts + moved(curtains, place(0.0, 0.0, 0.0, -sill)), width + 0.7, sill, True)
    return WallPiece(parts, width + 0.2, sill, True)


def _shelf(rng: Rng) -> WallPiece:
    width = rng.uniform(0.5, 1.4)
    parts = fixtures.wall_shelf(rng, width_m=width)
    parts += things_on(rng, (-width / 2, -0.2), (width / 2, -0.05), 0.0, int(rng.integers(1, 5)))
    return WallPiece(parts, width, rng.uniform(1.0, 1.7))


def _notes(rng: Rng) -> WallPiece:
    parts: list[Part] = []
    for _ in range(int(rng.integers(1, 6))):
        x, y, z = rng.uniform(-0.4, 0.4), -0.002 * rng.random(), rng.uniform(-0.4, 0.4)
        parts += moved(fixtures.note(rng), place(x, y, 0.0, z))
    return WallPiece(parts, 1.0, 1.45)

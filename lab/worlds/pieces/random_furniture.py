"""Random choices of furniture and clutter for a room, with their frequencies."""

from __future__ import annotations

from lab.worlds.furniture import fixtures, lights, plants, seating, storage, tables
from lab.worlds.pieces.groups import bed, dining, filled_crate, office, sofa, television
from lab.worlds.pieces.small import laden, small_thing
from lab.worlds.pieces.solids import random_solid, stack
from lab.worlds.pieces.stock import Makers, draw
from lab.worlds.scene import Part, Rng


def random_wall_furniture(rng: Rng) -> list[Part]:
    """A random large piece with its back to a wall and objects on it."""
    makers: Makers[list[Part]] = [
        (1.5, lambda: sofa(rng)),
        (2.0, lambda: storage.bookshelf(rng, size_m=rng.uniform((0.6, 0.25, 0.8), (1.4, 0.4, 2.1)))),
        (2.0, lambda: laden(rng, _sideboard(rng))),
        (1.0, lambda: storage.cabinet(rng, size_m=rng.uniform((0.8, 0.5, 1.7), (1.8, 0.65, 2.2)), doors=2)),
        (2.0, lambda: office(rng)),
        (0.8, lambda: laden(rng, tables.workbench(rng, width_m=rng.uniform(1.2, 2.2)))),
        (0.8, lambda: bed(rng)),
        (1.0, lambda: laden(rng, tables.table(rng, size_m=rng.uniform((0.9, 0.5, 0.6), (2.0, 0.9, 0.8))))),
        (0.7, lambda: television(rng)),
        (0.6, lambda: plants.potted_plant(rng, height_m=rng.uniform(0.7, 1.6))),
        (0.5, lambda: lights.floor_lamp(rng, height_m=rng.uniform(1.3, 1.8))),
        (0.7, lambda: stack(rng)),
        (1.2, lambda: random_solid(rng, 0.3, 1.2)),
    ]
    return draw(rng, makers)


def random_group(rng: Rng) -> list[Part]:
    """A random group for the middle of a room: a table with chairs, a coffee table, an armchair."""
    makers: Makers[list[Part]] = [
        (2.5, lambda: dining(rng)),
        (2.0, lambda: laden(rng, tables.coffee_table(rng, round_top=bool(rng.integers(2))), 0.7)),
        (1.0, lambda: seating.armchair(rng)),
        (1.0, lambda: office(rng)),
        (1.0, lambda: sofa(rng)),
    ]
    return draw(rng, makers)


def random_floor_thing(rng: Rng) -> list[Part]:
    """A random object on the floor: a chair, box, bucket, plant or plain solid."""
    makers: Makers[list[Part]] = [
        (1.0, lambda: seating.dining_chair(rng)),
        (1.0, lambda: seating.office_chair(rng)),
        (0.7, lambda: seating.stool(rng)),
        (0.7, lambda: seating.cushion(rng, size_m=rng.uniform(0.35, 0.7))),
        (1.2, lambda: storage.cardboard_box(rng, size_m=rng.uniform(0.2, 0.7, 3))),
        (0.8, lambda: filled_crate(rng)),
        (1.3, lambda: storage.bucket(rng)),
        (0.5, lambda: storage.waste_bin(rng)),
        (0.6, lambda: plants.potted_plant(rng, height_m=rng.uniform(0.5, 1.3))),
        (0.4, lambda: lights.floor_lamp(rng)),
        (0.6, lambda: stack(rng)),
        (2.5, lambda: random_solid(rng, 0.15, 0.7)),
        (0.8, lambda: small_thing(rng)),
    ]
    return draw(rng, makers)


def random_rug(rng: Rng) -> list[Part]:
    """A rug of any size, flat on the floor."""
    return fixtures.rug(rng, size_m=rng.uniform((0.8, 0.6), (3.0, 2.0)))


def _sideboard(rng: Rng) -> list[Part]:
    return storage.cabinet(rng, size_m=rng.uniform((0.6, 0.35, 0.5), (1.8, 0.6, 1.2)))

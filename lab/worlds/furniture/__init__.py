"""Furniture and things: ``piece(rng, T_world, ...) -> list[Part]``.

A piece stands on its own floor with its front towards -y; ``T_world`` (see ``place``) puts it into the room.
Wall pieces have their back at y = 0. ``rng`` chooses colours and disorder; keywords fix what a scene wants.
"""

from lab.worlds.furniture.electronics import (
    keyboard,
    laptop,
    monitor,
    mouse,
    speaker,
    tablet,
    television,
)
from lab.worlds.furniture.fixtures import (
    curtains,
    door,
    note,
    picture,
    radiator,
    rug,
    wall_clock,
    wall_shelf,
    window,
)
from lab.worlds.furniture.lights import desk_lamp, floor_lamp, pendant_lamp, table_lamp
from lab.worlds.furniture.placing import board, place, solid
from lab.worlds.furniture.plants import grass_plant, potted_plant
from lab.worlds.furniture.seating import armchair, cushion, dining_chair, office_chair, sofa, stool
from lab.worlds.furniture.stock import broom, gas_bottle, shavings, timber
from lab.worlds.furniture.storage import (
    books,
    bookshelf,
    bucket,
    cabinet,
    cardboard_box,
    crate,
    paint_can,
    waste_bin,
)
from lab.worlds.furniture.tables import coffee_table, desk, table, workbench
from lab.worlds.furniture.things import (
    blocks,
    book_pile,
    bottle,
    cup,
    fruit_bowl,
    globe,
    papers,
    pen_pot,
    teapot,
    vase,
)
from lab.worlds.furniture.tools import drill, plane, tool_board, toolbox

__all__ = [
    "armchair",
    "blocks",
    "board",
    "book_pile",
    "books",
    "bookshelf",
    "bottle",
    "broom",
    "bucket",
    "cabinet",
    "cardboard_box",
    "coffee_table",
    "crate",
    "cup",
    "curtains",
    "cushion",
    "desk",
    "desk_lamp",
    "dining_chair",
    "door",
    "drill",
    "floor_lamp",
    "fruit_bowl",
    "gas_bottle",
    "globe",
    "grass_plant",
    "keyboard",
    "laptop",
    "monitor",
    "mouse",
    "note",
    "office_chair",
    "paint_can",
    "papers",
    "pen_pot",
    "pendant_lamp",
    "picture",
    "place",
    "plane",
    "potted_plant",
    "radiator",
    "rug",
    "shavings",
    "sofa",
    "solid",
    "speaker",
    "stool",
    "table",
    "table_lamp",
    "tablet",
    "teapot",
    "television",
    "timber",
    "tool_board",
    "toolbox",
    "vase",
    "wall_clock",
    "wall_shelf",
    "waste_bin",
    "window",
    "workbench",
]

"""Furniture and things: ``piece(rng, T_world, ...) -> list[Part]``.

A piece stands on its own floor with its front towards -y; ``T_world`` (see ``place``) puts it into the room.
Wall pieces have their back at y = 0. ``rng`` chooses colours and disorder; keywords fix what a scene wants.
"""

from pipeline.scenes.furniture.electronics import (
    keyboard,
    laptop,
    monitor,
    mouse,
    speaker,
    tablet,
    television,
)
from pipeline.scenes.furniture.fixtures import (
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
from pipeline.scenes.furniture.lights import desk_lamp, floor_lamp, pendant_lamp, table_lamp
from pipeline.scenes.furniture.placing import board, place, solid
from pipeline.scenes.furniture.plants import grass_plant, potted_plant
from pipeline.scenes.furniture.seating import armchair, cushion, dining_chair, office_chair, sofa, stool
from pipeline.scenes.furniture.stock import broom, gas_bottle, shavings, timber
from pipeline.scenes.furniture.storage import (
    books,
    bookshelf,
    bucket,
    cabinet,
    cardboard_box,
    crate,
    paint_can,
    waste_bin,
)
from pipeline.scenes.furniture.tables import coffee_table, desk, table, workbench
from pipeline.scenes.furniture.things import (
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
from pipeline.scenes.furniture.tools import drill, plane, tool_board, toolbox

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

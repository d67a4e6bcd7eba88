"""Contents of random rooms: furniture with objects on it, wall pieces, clutter and plain solids.

A piece is a list of parts that stands on z = 0 about the origin, its front towards -y, as in ``furniture``.
"""

from lab.worlds.pieces.random_furniture import (
    random_floor_thing,
    random_group,
    random_rug,
    random_wall_furniture,
)
from lab.worlds.pieces.stock import bounds, from_stock, moved
from lab.worlds.pieces.walls import WallPiece, random_wall_piece

__all__ = [
    "WallPiece",
    "bounds",
    "from_stock",
    "moved",
    "random_floor_thing",
    "random_group",
    "random_rug",
    "random_wall_furniture",
    "random_wall_piece",
]

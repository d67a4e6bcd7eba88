"""What random rooms are filled with: furniture with things on it, wall pieces, clutter and plain solids.

A piece is a list of parts that stands on z = 0 about the origin, its front towards -y, as in ``furniture``.
"""

from pipeline.scenes.pieces.draws import random_floor_thing, random_group, random_rug, random_wall_furniture
from pipeline.scenes.pieces.stock import bounds, moved, stocked
from pipeline.scenes.pieces.walls import WallPiece, random_wall_piece

__all__ = [
    "WallPiece",
    "bounds",
    "moved",
    "random_floor_thing",
    "random_group",
    "random_rug",
    "random_wall_furniture",
    "random_wall_piece",
    "stocked",
]

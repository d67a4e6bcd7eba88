"""Procedural textures: each function but ``random_palette`` returns a Texture, solid or box-mapped.

Colours are linear RGB, 0 to 1, or "#rrggbb" in sRGB; lengths are metres. A solid texture depends on the
position in space. A box-mapped one is projected along the axis of the part that is nearest to the normal.
"""

from lab.worlds.textures.building import brick, concrete, marble, paint, parquet, planks, plaster, tiles
from lab.worlds.textures.cloth import carpet, checker, fabric, motif, rug, stripes
from lab.worlds.textures.materials import brushed_metal, cardboard, leaf, patches, solid, wood
from lab.worlds.textures.mixing import random_palette
from lab.worlds.textures.prints import display, outdoors, painting, paper

__all__ = [
    "brick",
    "brushed_metal",
    "cardboard",
    "carpet",
    "checker",
    "concrete",
    "display",
    "fabric",
    "leaf",
    "marble",
    "motif",
    "outdoors",
    "paint",
    "painting",
    "paper",
    "parquet",
    "patches",
    "planks",
    "plaster",
    "random_palette",
    "rug",
    "solid",
    "stripes",
    "tiles",
    "wood",
]

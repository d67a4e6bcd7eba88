"""Procedural surfaces: each function returns a Texture, a solid or box-mapped linear albedo.

Colours are linear RGB, 0 to 1, or "#rrggbb" in sRGB; lengths are metres. A box-mapped texture is projected on
the box face that the normal points out of, so boxes need no unwrapping.
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

"""Procedural surfaces: each function returns a Texture, a solid or box-mapped linear albedo.

Colours are linear (not sRGB) RGB, 0 to 1; ``from_srgb`` converts what a colour picker shows. Lengths are
metres. Box-mapped textures lie on the face that the normal points out of, so boxes need no unwrapping.
"""

from lab.worlds.textures.building import brick, concrete, marble, paint, parquet, planks, plaster, tiles
from lab.worlds.textures.cloth import carpet, checker, fabric, motif, rug, stripes
from lab.worlds.textures.materials import brushed_metal, cardboard, leaf, patches, solid, wood
from lab.worlds.textures.mixing import from_srgb, random_palette
from lab.worlds.textures.prints import book_spines, display, outdoors, painting, paper

__all__ = [
    "book_spines",
    "brick",
    "brushed_metal",
    "cardboard",
    "carpet",
    "checker",
    "concrete",
    "display",
    "fabric",
    "from_srgb",
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

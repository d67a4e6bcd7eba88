"""Codings of a node's images: encoding at the node, decoding of the bytes that reach the sink (SPEC 6.5)."""

from packetmesh.errors import InputError
from pipeline.delivery import tiled
from pipeline.delivery.coding import Coding
from pipeline.delivery.raw import Raw, raster, spread_rows, tile_after_tile
from pipeline.delivery.tiled import Tiled
from pipeline.delivery.whole import JPEG, PNG, RVL, Whole

_ALL: tuple[Coding, ...] = (
    Raw("raw", "Raw, depth first", raster),
    Raw("raw-color-first", "Raw, colour first", raster, color_first=True),
    Raw("raw-rows", "Raw, rows spread", spread_rows),
    Raw("raw-tiles", "Raw, 16 × 16 tiles", tile_after_tile),
    Whole("png", "PNG depth, PNG colour", PNG, PNG),
    Whole("jpeg", "RVL depth, JPEG colour", RVL, JPEG),
    Whole("rvl", "RVL depth, PNG colour", RVL, PNG),
    Tiled("tiles", "Tiles that stand alone", tiled.JPEG, base=False, repair_every=64),
    Tiled("layered", "Coarse base, then tiles", tiled.JPEG, base=True, repair_every=24),
    Tiled("exact", "Coarse base, then tiles, AVIF colour", tiled.AVIF, base=True, repair_every=24),
)

CODINGS: dict[str, Coding] = {coding.name: coding for coding in _ALL}
"""Codings by name, as in ``--coding``."""


def coding_named(name: str) -> Coding:
    """Return the coding with this name.

    Raises:
        InputError: there is no such coding.
    """
    if name not in CODINGS:
        raise InputError(f"There is no coding '{name}'; try one of {', '.join(CODINGS)}")
    return CODINGS[name]


__all__ = ["CODINGS", "Coding", "coding_named"]

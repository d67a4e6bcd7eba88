"""Labels of the Depth screen and of its lesson."""

from __future__ import annotations

from typing import Any, Literal, get_args

from app.screens.depth.view import PictureName
from pipeline.config import ModelKind, NetworkPreset, Normalisation

PICTURES: dict[PictureName, str] = {
    "photo": "photo",
    "sensor": "sensor depth",
    "inferred": "inferred depth",
    "difference": "difference",
    "confidence": "confidence",
}
"""Pictures to choose from on both sides of the split."""
PointColoring = Literal["source", "photo", "confidence"]
COLORINGS: dict[str, PointColoring] = {
    "source: blue measured, violet inferred": "source",
    "photo": "photo",
    "confidence of inferred points": "confidence",
}
"""Colourings of the points."""
ALIGNMENTS: dict[str, str] = {
    "none": "none (the network's values)",
    "median": "one scale",
    "affine_depth": "scale and shift",
    "affine_inverse": "scale and shift of 1/depth",
    "local": "scale, shift, smooth correction",
}
"""Methods that make inferred depth metric."""
HOLES, EVERYWHERE, UNSEEN = "only in the holes", "everywhere", "hidden"
DRAWN = (HOLES, EVERYWHERE, UNSEEN)
"""Choices of the inferred points to draw."""
FILLS = {
    "measured": "as measured",
    "hidden": "hidden",
    "ours": "with these settings",
    "shipped": "completion that ships",
    "network": "colour network, aligned",
    "nearest": "nearest fill",
    "inpaint-telea": "OpenCV inpainting, Telea",
    "inpaint-ns": "OpenCV inpainting, Navier-Stokes",
    "joint-bilateral": "joint bilateral fill",
}
"""The hidden part: as measured, hidden, and filled by each method; the completion that ships has a row of its
own if another one is set."""
AS_IN_FILE = "from the file"


def _choices(literal: object) -> dict[str, Any]:
    """Return the choices of a network's property; None takes it from the network's file."""
    return {AS_IN_FILE: None, **{name: name for name in get_args(literal)}}


NETWORK_PRESETS, NETWORK_KINDS, NORMALISATIONS = map(_choices, (NetworkPreset, ModelKind, Normalisation))

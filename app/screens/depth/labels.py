"""What the Depth screen and its lesson call things."""

from __future__ import annotations

from typing import Literal, get_args

from pipeline.config import ModelKind, NetworkPreset, Normalisation

PHOTO, SENSOR, INFERRED = "photo", "sensor depth", "inferred depth"
DIFFERENCE, CONFIDENCE = "difference", "confidence"
PICTURES = (PHOTO, SENSOR, INFERRED, DIFFERENCE, CONFIDENCE)
"""What stands left and right of the split."""
PointColoring = Literal["source", "photo", "confidence"]
COLORINGS: dict[str, PointColoring] = {
    "source: blue measured, violet inferred": "source",
    "photo": "photo",
    "confidence of inferred points": "confidence",
}
"""What the colours of the points mean."""
HOLES, EVERYWHERE, UNSEEN = "only in the holes", "everywhere", "hidden"
DRAWN = (HOLES, EVERYWHERE, UNSEEN)
"""Which of the inferred points are drawn."""
MEASURED, BLANK, OURS = "as measured", "hidden", "inferred and aligned"
PEER_NAMES = {
    "nearest": "nearest fill",
    "inpaint-telea": "OpenCV inpainting, Telea",
    "inpaint-ns": "OpenCV inpainting, Navier-Stokes",
    "joint-bilateral": "joint bilateral fill",
}
"""What the ways to fill without a network are called."""
NETWORK_PRESETS: tuple[NetworkPreset, ...] = get_args(NetworkPreset)
NETWORK_KINDS: tuple[ModelKind, ...] = get_args(ModelKind)
NORMALISATIONS: tuple[Normalisation, ...] = get_args(Normalisation)

"""What the Depth screen asks for beside the chain, and the answers."""

from __future__ import annotations

from dataclasses import dataclass

from app.jobs.records import Picture
from pipeline.config import ModelKind, NetworkPreset


@dataclass(frozen=True, slots=True)
class HideWish:
    """A disc of one node's sensor depth that is to be hidden and filled again."""

    node: int = 0
    """Index."""
    x_share: float = 0.5
    """Centre, in widths of the image from its left."""
    y_share: float = 0.5
    """Centre, in heights of the image from its top."""
    size_share: float = 0.2
    """Diameter, in widths of the image."""


@dataclass(frozen=True, slots=True)
class FillRow:
    """How well one way filled the hidden disc."""

    name: str
    """One of ``app.depthwords.OURS`` and the names of the peers."""
    abs_rel: float
    """Mean of |filled - measured| / measured over the hidden pixels it filled; NaN if it filled none."""
    within_share: float
    """Hidden pixels filled with a depth within 5 % of the measured one; what stays empty counts as wrong."""
    filled_share: float
    """Hidden pixels that got a depth."""
    elapsed_s: float
    """Without the network, whose depth is there already."""


@dataclass(frozen=True, slots=True)
class HiddenView:
    """A part of the sensor's depth before, while and after it was hidden."""

    wish: HideWish
    node: str
    hidden_px: int
    """Measured pixels that were hidden."""
    rows: tuple[FillRow, ...]
    pictures: dict[str, Picture]
    """``MEASURED``, ``BLANK`` and one by every row's name: the disc and what is around it."""


@dataclass(frozen=True, slots=True)
class NetworkWish:
    """The depth network that is to be used: these three fields of ``DepthConfig``."""

    model: str | None = None
    preset: NetworkPreset | None = None
    model_kind: ModelKind | None = None


@dataclass(frozen=True, slots=True)
class NetworkView:
    """A depth network that could be loaded and answered."""

    wish: NetworkWish
    kind: ModelKind
    """What it gives."""
    provider: str
    inference_s: float
    """One test image, the first, which takes longer than those that follow."""
    size_bytes: int
    description: dict[str, str]
    """What the file says about itself."""

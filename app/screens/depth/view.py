"""What the Depth screen asks for beside the chain, and the answers."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Literal

from app.compute.records import Picture, Sample
from pipeline.config import DepthConfig, ModelKind, NetworkPreset, Normalisation
from pipeline.types import IntArray

PictureName = Literal["photo", "sensor", "inferred", "difference", "confidence"]


@dataclass(frozen=True, slots=True)
class SeenSample(Sample):
    """A thinned cloud whose points know where in the image they were seen."""

    pixels: IntArray
    """(N, 2) column and row."""
    width_px: int
    """This and the height: of the image."""
    height_px: int


@dataclass(frozen=True, slots=True)
class Disc:
    """A round part of an image."""

    x_share: float = 0.5
    """Centre, in widths of the image from its left."""
    y_share: float = 0.5
    """Centre, in heights of the image from its top."""
    size_share: float = 0.2
    """Diameter, in widths of the image."""


@dataclass(frozen=True, slots=True)
class HideRequest:
    """The part of one node's sensor depth that is to be hidden and filled again: all discs together."""

    node: int = 0
    """Index."""
    discs: tuple[Disc, ...] = (Disc(),)


@dataclass(frozen=True, slots=True)
class FillRow:
    """How well one way filled what was hidden."""

    name: str
    """"ours", "network" or one of ``pipeline.depth.fillers.PEERS``."""
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

    request: HideRequest
    node: str
    hidden_px: int
    """Measured pixels that were hidden."""
    rows: tuple[FillRow, ...]
    pictures: dict[str, Picture]
    """By "measured", "hidden" and every row's name: the discs and what is around them."""


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """The depth network that is to be used: the fields of ``DepthConfig`` by the same names."""

    model: str | None = None
    preset: NetworkPreset | None = None
    model_kind: ModelKind | None = None
    input_width_px: int | None = None
    input_height_px: int | None = None
    normalisation: Normalisation | None = None

    def put_into(self, config: DepthConfig) -> DepthConfig:
        """``config`` with this network.

        Raises:
            InputError: the size makes no sense.
        """
        return replace(config, **asdict(self))


@dataclass(frozen=True, slots=True)
class ModelView:
    """A depth network that could be loaded and answered."""

    choice: ModelChoice
    kind: ModelKind
    """What it gives."""
    provider: str
    inference_s: float
    """One test image, the first, which takes longer than those that follow."""
    size_bytes: int
    description: dict[str, str]
    """From the metadata of the file."""

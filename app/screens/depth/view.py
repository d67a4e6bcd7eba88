"""Requests and results of the Depth screen besides those of the chain."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Literal

from app.compute.records import Picture, Sample
from pipeline.config import DepthConfig, ModelKind, NetworkPreset, Normalisation
from pipeline.types import IntArray

PictureName = Literal["photo", "sensor", "inferred", "difference", "confidence"]


@dataclass(frozen=True, slots=True)
class SeenSample(Sample):
    """A thinned cloud with the image positions of its points."""

    pixels: IntArray
    """(N, 2) column and row."""
    width_px: int
    """Width of the image; ``height_px`` is its height."""
    height_px: int


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in an image."""

    x_share: float = 0.5
    """Column of the centre over the last column, 0 to 1."""
    y_share: float = 0.5
    """Row of the centre over the last row, 0 to 1."""
    size_share: float = 0.2
    """Diameter over the image's width."""


@dataclass(frozen=True, slots=True)
class HideRequest:
    """The part of one node's sensor depth to hide and fill: all discs together."""

    node: int = 0
    """Index of the node."""
    discs: tuple[Disc, ...] = (Disc(),)


@dataclass(frozen=True, slots=True)
class FillRow:
    """Errors of one fill method in the hidden part."""

    name: str
    """"ours", "shipped", "network" or one of ``pipeline.depth.fillers.PEERS``."""
    abs_rel: float
    """Mean of |filled - measured| / measured over the hidden pixels it filled; NaN if it filled none."""
    within_share: float
    """Share of hidden pixels filled within 5 % of the measured depth; empty pixels count as wrong."""
    filled_share: float
    """Share of hidden pixels that got a depth."""
    elapsed_s: float
    """Time of the filling, without the inference of the colour network, whose output is stored."""


@dataclass(frozen=True, slots=True)
class HiddenView:
    """A part of the sensor's depth: measured, hidden and filled."""

    request: HideRequest
    node: str
    hidden_px: int
    """Number of measured pixels that were hidden."""
    rows: tuple[FillRow, ...]
    pictures: dict[str, Picture]
    """By "measured", "hidden" and every row's name: the discs and their surroundings."""


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """The depth network to use: fields of ``DepthConfig`` with the same names."""

    model: str | None = None
    preset: NetworkPreset | None = None
    model_kind: ModelKind | None = None
    input_width_px: int | None = None
    input_height_px: int | None = None
    normalisation: Normalisation | None = None
    completion: str | None = None
    completion_normalisation: Normalisation | None = None

    def put_into(self, config: DepthConfig) -> DepthConfig:
        """Return ``config`` with this network.

        Raises:
            InputError: the input size is invalid.
        """
        return replace(config, **asdict(self))


@dataclass(frozen=True, slots=True)
class ModelView:
    """A depth network that was loaded and gave an answer."""

    choice: ModelChoice
    """The choice; a network that takes image and depth is in ``completion``, not in ``model``."""
    kind: ModelKind
    """Kind of the network's output."""
    provider: str
    inference_s: float
    """Time of the first test image, which takes longer than later ones."""
    size_bytes: int
    description: dict[str, str]
    """Metadata of the file."""

"""Inputs and output of an ONNX graph that completes measured depth, found by their shapes and names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.depth.signature import (
    FLOATS,
    Layout,
    Shape,
    Signature,
    is_depth,
    is_fixed,
    listed,
    may_be,
)

TYPES = {**FLOATS, "tensor(bool)": "bool", "tensor(uint8)": "uint8"}
ACCEPTED = (
    "a completion network maps one float image [1, 3, H, W] or [1, H, W, 3] and the measured depth "
    "[1, 1, H, W], [1, H, W, 1], [1, H, W] or [H, W] of the same size, and perhaps a mask named so, to one "
    "depth map; or it takes both in one input [1, 4, H, W]"
)
MASKS = ("mask", "valid")
"""Parts of the names of inputs that mask the measured pixels."""


@dataclass(frozen=True, slots=True)
class MapInput:
    """An input of one value for each pixel."""

    name: str
    dtype: str
    rank: int
    channel_last: bool

    def tensor(self, values: np.ndarray) -> np.ndarray:
        """Return (H, W) values as the input's tensor."""
        shaped = values.astype(self.dtype)
        if self.rank == 4:
            return shaped[None, ..., None] if self.channel_last else shaped[None, None]
        return shaped[None] if self.rank == 3 else shaped


@dataclass(frozen=True, slots=True)
class CompletionSignature:
    """Inputs and output of a network that completes depth."""

    image: Signature
    """Input image and output depth."""
    depth: MapInput | None
    """Input of measured depth; None if depth is the fourth channel of the image."""
    mask: MapInput | None
    """Input of the mask of measured pixels; None if the network takes none."""


def takes_depth(session: Any) -> bool:
    """Return whether the graph takes an image and a map, as two inputs or as one with four channels."""
    inputs = session.get_inputs()
    if any(_channels(entry.shape) == 4 for entry in inputs):
        return True
    images = [entry for entry in inputs if _channels(entry.shape) == 3]
    return len(images) == 1 and any(_is_map(entry.shape) for entry in inputs if entry is not images[0])


def completion_signature_of(session: Any, name: str) -> CompletionSignature:
    """Read the signature of an onnxruntime session; ``name`` is the network's name in errors.

    Raises:
        InputError: the graph does not map an image and depth of one size to depth.
    """
    inputs, outputs = session.get_inputs(), session.get_outputs()
    images = [entry for entry in inputs if _channels(entry.shape) in (3, 4) and entry.type in FLOATS]
    others = [entry for entry in inputs if entry not in images]
    masks = [entry for entry in others if _is_mask(entry)]
    depths = [entry for entry in others if entry not in masks and entry.type in FLOATS]
    fits = len(images) == 1 and len(masks) <= 1 and len(depths) == (_channels(images[0].shape) == 3)
    fits = fits and len(others) == len(masks) + len(depths) and all(_is_map(entry.shape) for entry in others)
    given = [entry for entry in outputs if is_depth(entry.shape)]
    if not fits or not given:
        raise InputError(
            f"{name} maps {listed(inputs)} to {listed(outputs)}, but {ACCEPTED}: give another network"
        )
    (image,) = images
    layout = _layout(image.shape)
    depth, mask = (_map_input(found[0], layout) if found else None for found in (depths, masks))
    sides = [_sides(image.shape, layout == "NHWC")]
    sides += [_sides(entry.shape, _channel_last(entry.shape, layout)) for entry in others]
    heights, widths = ({side for side in along if is_fixed(side)} for along in zip(*sides, strict=True))
    if len(heights) > 1 or len(widths) > 1:
        raise InputError(
            f"{name} takes {listed(inputs)}, of different heights or widths: give a network whose image and "
            "depth have one size"
        )
    width_px, height_px = next(iter(widths), None), next(iter(heights), None)
    output = _output(given).name
    return CompletionSignature(
        Signature(image.name, output, FLOATS[image.type], layout, width_px, height_px), depth, mask
    )


def _channels(shape: Shape) -> int | None:
    """Return 3 or 4 for the shape of one image with so many channels; None for others."""
    if len(shape) != 4 or not may_be(shape[0], 1):
        return None
    return next((count for count in (3, 4) for side in (shape[1], shape[3]) if side == count), None)


def _layout(shape: Shape) -> Layout:
    return "NCHW" if shape[1] in (3, 4) else "NHWC"


def _is_map(shape: Shape) -> bool:
    if len(shape) == 4:
        return may_be(shape[0], 1) and (may_be(shape[1], 1) or may_be(shape[3], 1))
    return len(shape) == 2 or (len(shape) == 3 and may_be(shape[0], 1))


def _is_mask(entry: Any) -> bool:
    named = any(part in entry.name.lower() for part in MASKS)
    return entry.type in TYPES and (named or entry.type not in FLOATS)


def _output(outputs: Sequence[Any]) -> Any:
    """Return the largest output with depth in its name, or of all outputs; of equal ones the first."""
    named = [entry for entry in outputs if "depth" in entry.name.lower()]
    return max(named or outputs, key=lambda entry: prod(side for side in entry.shape if is_fixed(side)))


def _map_input(entry: Any, layout: Layout) -> MapInput:
    return MapInput(entry.name, TYPES[entry.type], len(entry.shape), _channel_last(entry.shape, layout))


def _channel_last(shape: Shape, layout: Layout) -> bool:
    """Return whether a map's channel is its last side; if the graph leaves this open, as in the image."""
    if len(shape) != 4 or shape[1] == 1:
        return False
    return shape[3] == 1 or (layout == "NHWC" and not is_fixed(shape[3]))


def _sides(shape: Shape, channel_last: bool) -> Shape:
    """Return height and width."""
    return shape[1:3] if channel_last else shape[-2:]

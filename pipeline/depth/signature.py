"""Inputs and outputs of an ONNX graph, checked to be one image and one depth map."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any, Literal

from packetmesh.errors import InputError

Layout = Literal["NCHW", "NHWC"]
Shape = list[int | str | None]
FLOATS = {"tensor(float)": "float32", "tensor(float16)": "float16"}
ACCEPTED = (
    "a depth network maps one float image [1, 3, H, W] or [1, H, W, 3] to one depth map [1, 1, H, W], "
    "[1, H, W, 1], [1, H, W] or [H, W]"
)


@dataclass(frozen=True, slots=True)
class Signature:
    """Input image and output depth of a network; None where the graph leaves a size or layout open."""

    input_name: str
    output_name: str
    """Name of the largest depth map, or of the first if their sizes are open."""
    dtype: str
    """float32 or float16."""
    layout: Layout | None
    width_px: int | None
    height_px: int | None


def signature_of(session: Any, name: str) -> Signature:
    """Read the signature of an onnxruntime session; ``name`` is the network's name in errors.

    Raises:
        InputError: the graph does not map one image to one depth map.
    """
    inputs, outputs = session.get_inputs(), session.get_outputs()
    depths = [output for output in outputs if is_depth(output.shape)]
    if len(inputs) != 1 or inputs[0].type not in FLOATS or not _is_image(inputs[0].shape) or not depths:
        raise InputError(
            f"{name} maps {listed(inputs)} to {listed(outputs)}, but {ACCEPTED}: give another network"
        )
    (image,) = inputs
    layout = layout_of(image.shape)
    rows, columns = image.shape[1:3] if layout == "NHWC" else image.shape[2:4]
    size = (columns, rows) if layout is not None else (None, None)
    width_px, height_px = (side if is_fixed(side) else None for side in size)
    largest = max(depths, key=lambda output: prod(side for side in output.shape if is_fixed(side)))
    return Signature(image.name, largest.name, FLOATS[image.type], layout, width_px, height_px)


def layout_of(shape: Shape) -> Layout | None:
    """Return the layout of a shape of rank 4 with three channels; None if it leaves them open."""
    if shape[1] == 3:
        return "NCHW"
    return "NHWC" if shape[3] == 3 else None


def _is_image(shape: Shape) -> bool:
    """Return whether a shape has rank 4, one image, and three channels unless these are open."""
    if len(shape) != 4 or not may_be(shape[0], 1):
        return False
    return layout_of(shape) is not None or not (is_fixed(shape[1]) and is_fixed(shape[3]))


def is_depth(shape: Shape) -> bool:
    """Return whether a shape is that of one depth map."""
    if len(shape) == 4:
        return may_be(shape[0], 1) and (may_be(shape[1], 1) or may_be(shape[3], 1))
    if len(shape) == 2:  # a fixed and an open size mean a list of classes
        return 1 not in shape and is_fixed(shape[0]) == is_fixed(shape[1])
    return len(shape) == 3 and may_be(shape[0], 1)


def may_be(side: int | str | None, value: int) -> bool:
    """Return whether a side is ``value`` or open."""
    return side == value or not is_fixed(side)


def is_fixed(side: Any) -> bool:
    """Return whether the graph fixes a side."""
    return isinstance(side, int)


def listed(nodes: Any) -> str:
    """Return the inputs or outputs of a graph with their shapes, for a sentence."""
    return ", ".join(f"{node.name} {node.shape} of {node.type}" for node in nodes) or "nothing"

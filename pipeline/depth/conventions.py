"""Conventions of depth networks: formats of input and output, read from the file, a preset or flags.

An ONNX file stores its convention in ``metadata_props``. All keys are optional text, plain or JSON:

    preset             name of a preset, for the values that other keys do not set
    depth_kind         metric: metres; relative: depth up to scale; inverse: disparity up to scale and shift
    depth_range_m      0.1,100: the output is a sigmoid between the disparities of these depths (monodepth2)
    input_size_px      320x256: width and height; 518: any size whose shorter side is that long
    input_multiple_px  14: both sides are multiples of it, unless the graph fixes them
    input_fit_px       320x240: the centre box of the input into which the image is fitted
    input_resize       fit (keeps the aspect and pads by reflection) or stretch
    input_scale        255 or 1: divisor of pixel values
    input_mean         0.485,0.456,0.406: red, green, blue; subtracted afterwards
    input_deviation    0.229,0.224,0.225: red, green, blue; divisor afterwards
    input_normalised   inside (the graph itself subtracts and divides) or outside
    input_channels     RGB or BGR
    input_layout       NCHW or NHWC

A fixed size or layout in the graph overrides the others.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import inf
from typing import Any, Literal, get_args

from packetmesh.errors import InputError
from pipeline.config import DepthConfig, ModelKind, NetworkPreset, Normalisation
from pipeline.depth.preprocessing import (
    HEIGHT_PX,
    IMAGENET_DEVIATION,
    IMAGENET_MEAN,
    PADDED_HEIGHT_PX,
    WIDTH_PX,
)
from pipeline.depth.signature import Layout, Signature, signature_of

Channels = Literal["RGB", "BGR"]
Resize = Literal["fit", "stretch"]
MOST_SIDE_PX = 4096
"""Largest side of an input; more would exhaust the memory."""
Values = dict[str, Any]
"""Fields of ``Convention`` by name, as far as they are known."""
Reader = Callable[[str], Values]
"""Parses a metadata value to fields; raises a ValueError with an example of a correct value."""


@dataclass(frozen=True, slots=True)
class Convention:
    """Conversion of an 8-bit RGB image to the network's input, and of its output to depth."""

    kind: ModelKind
    width_px: int
    """Width of the input, or its shorter side if ``height_px`` is None."""
    height_px: int | None
    """Height of the input; None allows any size with the image's aspect, in multiples of ``multiple_px``."""
    multiple_px: int = 1
    mean: tuple[float, ...] = IMAGENET_MEAN
    """(3,) red, green, blue; of pixel values divided by ``scale``."""
    deviation: tuple[float, ...] = IMAGENET_DEVIATION
    """(3,) red, green, blue."""
    scale: float = 255.0
    """Divisor of pixel values: 255 or 1."""
    layout: Layout = "NCHW"
    channels: Channels = "RGB"
    normalised_inside: bool = False
    """Whether the graph itself subtracts the mean and divides by the deviation."""
    resize: Resize = "stretch"
    fit_px: tuple[int, int] | None = None
    """Width and height of the centre box into which "fit" fits the image; None is the whole input."""
    depth_range_m: tuple[float, float] | None = None
    """Nearest and farthest depth, if the output is a sigmoid between their disparities; else None."""

    @property
    def gives_disparity(self) -> bool:
        """Whether the output is larger for nearer pixels."""
        return self.kind == "inverse" or self.depth_range_m is not None


@dataclass(frozen=True, slots=True)
class Overrides:
    """Parts of the convention set by flags; None leaves a part to the file or the preset."""

    kind: ModelKind | None = None
    size_px: tuple[int, int] | None = None
    """Width and height of the input."""
    normalisation: Normalisation | None = None
    """imagenet: mean and deviation of ImageNet; unit: values from 0 to 1; bytes: values from 0 to 255."""
    channels: Channels | None = None

    @staticmethod
    def of(config: DepthConfig) -> Overrides:
        """Return the overrides in the settings."""
        size_px = None
        if config.input_width_px is not None and config.input_height_px is not None:
            size_px = config.input_width_px, config.input_height_px
        return Overrides(config.model_kind, size_px, config.normalisation)


PRESETS: dict[NetworkPreset, Convention] = {
    "packetmesh": Convention(
        "relative", WIDTH_PX, PADDED_HEIGHT_PX, resize="fit", fit_px=(WIDTH_PX, HEIGHT_PX)
    ),
    "midas-small": Convention("inverse", 256, 256, multiple_px=32),
    "depth-anything-v2-small": Convention("inverse", 518, None, multiple_px=14),
    "depth-anything-v2-metric": Convention("metric", 518, None, multiple_px=14),
    "monodepth2": Convention(
        "inverse", 640, 192, multiple_px=32, normalised_inside=True, depth_range_m=(0.1, 100.0)
    ),
}
"""Known networks, each with the image preparation of its own repository:

packetmesh: the network that comes with PacketMesh (SPEC 3.2).
midas-small: MiDaS v2.1 small as exported by ``torch.hub`` (isl-org/MiDaS, midas/transforms.py). Files made
by ``tf/make_onnx_model.py`` normalise their input themselves: add normalisation=unit for those.
depth-anything-v2-small: ``Resize(518, lower_bound, multiple of 14)`` (depth_anything_v2/util/transform.py).
depth-anything-v2-metric: the same; depth in metres up to 20 (Hypersim) or 80 (Virtual KITTI).
monodepth2: 640 x 192, values from 0 to 1, ``disp_to_depth(disp, 0.1, 100)``; its encoder normalises.
"""


def convention_of(
    session: Any, preset: str | None = None, overrides: Overrides | None = None, name: str = "The network"
) -> Convention:
    """Return a network's convention: flags override a preset, which replaces the file's metadata.

    Without a kind, a network of 320 x 256 pixels gets the convention of the preset packetmesh.

    Args:
        session: onnxruntime session.
        preset: name in ``PRESETS``; it replaces all metadata. None uses the metadata.
        overrides: parts set by flags.
        name: name of the network for error messages.

    Raises:
        InputError: an unknown preset, invalid metadata, a graph that is no depth network, or an unknown kind
            of output.
    """
    signature = signature_of(session, name)
    given = overrides or Overrides()
    if preset is None:
        values = from_metadata(session.get_modelmeta().custom_metadata_map, name)
        if "kind" not in values and (signature.width_px, signature.height_px) == (WIDTH_PX, PADDED_HEIGHT_PX):
            values = {**_values(PRESETS["packetmesh"]), **values}
    else:
        values = _values(preset_named(preset))
    values |= flagged(given)
    if "kind" not in values:
        raise InputError(
            f"{name} does not state the kind of its output: name a preset ({', '.join(PRESETS)}), or its "
            f"kind ({', '.join(get_args(ModelKind))})"
        )
    return in_graph(values, signature, given.size_px, name)


def preset_named(name: str) -> Convention:
    """Return the convention of this preset.

    Raises:
        InputError: there is no such preset.
    """
    for known, convention in PRESETS.items():
        if known == name:
            return convention
    raise InputError(f"There is no preset '{name}' for depth networks; try one of {', '.join(PRESETS)}")


def from_metadata(metadata: Mapping[str, str], name: str) -> Values:
    """Return the fields of ``Convention`` that a file's metadata set.

    Raises:
        InputError: one of our keys has an invalid value.
    """
    values: Values = {}
    for key, read in READERS.items():
        if key in metadata:
            text = _plain(metadata[key])
            try:
                values |= read(text)
            except ValueError as error:
                raise InputError(f"{name} says {key} = '{text}' in its metadata; try {error}") from None
    return values


def metadata_of(convention: Convention) -> dict[str, str]:
    """Return the metadata from which ``convention_of`` reads this convention, for exporting a network."""
    size = [side for side in (convention.width_px, convention.height_px) if side is not None]
    metadata = {
        "depth_kind": convention.kind,
        "input_size_px": "x".join(map(str, size)),
        "input_multiple_px": str(convention.multiple_px),
        "input_resize": convention.resize,
        "input_scale": f"{convention.scale:g}",
        "input_mean": ",".join(map(str, convention.mean)),
        "input_deviation": ",".join(map(str, convention.deviation)),
        "input_normalised": "inside" if convention.normalised_inside else "outside",
        "input_channels": convention.channels,
        "input_layout": convention.layout,
    }
    if convention.fit_px is not None:
        metadata["input_fit_px"] = "x".join(map(str, convention.fit_px))
    if convention.depth_range_m is not None:
        metadata["depth_range_m"] = ",".join(map(str, convention.depth_range_m))
    return metadata


def in_graph(values: Values, signature: Signature, size_px: tuple[int, int] | None, name: str) -> Convention:
    """Build the convention, with size and layout from the graph where it fixes them.

    Raises:
        InputError: the size is unknown, impossible, or not the one that the graph fixes.
    """
    if signature.layout is not None:
        values["layout"] = signature.layout
    fixed = (signature.width_px, signature.height_px)
    if None not in fixed:
        if size_px not in (None, fixed):
            raise InputError(f"{name} takes images of {_by(fixed)} pixels only, not of {_by(size_px)}")
        if "width_px" in values and fixed != (values["width_px"], values["height_px"]):
            values["fit_px"] = None  # the box of another size
        values |= {"width_px": fixed[0], "height_px": fixed[1]}
    elif "width_px" not in values:
        raise InputError(
            f"{name} takes images of any size and does not say which suits it: name a preset "
            f"({', '.join(PRESETS)}), or a width and height"
        )
    elif size_px is not None:
        _divided(size_px, values.get("multiple_px", 1), name)
    return _possible(Convention(**values), name)


def _divided(size_px: tuple[int, int], multiple_px: int, name: str) -> None:
    """Raise an error for an input size that the network's strides do not divide."""
    if any(side % multiple_px for side in size_px):
        nearest = tuple(multiple_px * max(1, round(side / multiple_px)) for side in size_px)
        raise InputError(
            f"{name} takes images whose sides are multiples of {multiple_px} pixels, not {_by(size_px)}; "
            f"try {_by(nearest)}"
        )


def _possible(convention: Convention, name: str) -> Convention:
    """Return the convention after checking that images can be converted to it.

    Raises:
        InputError: the size is impossible, or the nearest depth is beyond the farthest.
    """
    size = (convention.width_px, convention.height_px or convention.width_px)
    box, (near_m, far_m) = convention.fit_px or size, convention.depth_range_m or (0.0, 1.0)
    if not all(0 < side <= MOST_SIDE_PX for side in size):
        raise InputError(
            f"{name} cannot have an input of {_by(size)} pixels; give sides of 1 to {MOST_SIDE_PX}"
        )
    if box[0] > size[0] or box[1] > size[1]:
        raise InputError(f"{name} fits images into {_by(box)} of {_by(size)} pixels; try a box inside")
    if near_m >= far_m:
        raise InputError(f"{name} gives depths from {near_m:g} to {far_m:g} m; try the nearest first")
    return convention


def flagged(given: Overrides) -> Values:
    """Return the fields of ``Convention`` that flags set."""
    values: Values = {}
    if given.kind is not None:
        values["kind"] = given.kind
    if given.channels is not None:
        values["channels"] = given.channels
    if given.size_px is not None:
        values |= {"width_px": given.size_px[0], "height_px": given.size_px[1], "fit_px": None}
    if given.normalisation is not None:
        values |= {
            "scale": 1.0 if given.normalisation == "bytes" else 255.0,
            "mean": IMAGENET_MEAN,
            "deviation": IMAGENET_DEVIATION,
            "normalised_inside": given.normalisation != "imagenet",
        }
    return values


def _values(convention: Convention) -> Values:
    return {field.name: getattr(convention, field.name) for field in fields(convention)}


def _choice(field: str, choices: tuple[str, ...], suggestion: str) -> Reader:
    def read(text: str) -> Values:
        if text not in choices:
            raise ValueError(suggestion)
        return {field: text}

    return read


def _numbers(
    field: str, count: int, suggestion: str, separator: str = ",", of: type = float, above: float = 0.0
) -> Reader:
    """Return a reader of a tuple of finite numbers above a bound."""

    def read(text: str) -> Values:
        try:
            numbers = tuple(of(part) for part in text.split(separator))
        except ValueError:
            raise ValueError(suggestion) from None
        if len(numbers) != count or not all(above < number < inf for number in numbers):
            raise ValueError(suggestion)
        return {field: numbers}

    return read


def _size(text: str) -> Values:
    sides = _numbers("size", 1 + text.count("x"), "320x256, or 518", "x", int)(text)["size"]
    if len(sides) > 2:
        raise ValueError("320x256, or 518")
    return {"width_px": sides[0], "height_px": sides[1] if len(sides) == 2 else None}


def _scalar(reader: Reader) -> Reader:
    return lambda text: {field: value for field, (value,) in reader(text).items()}


def _normalised(text: str) -> Values:
    choice = _choice("normalised", ("inside", "outside"), "inside or outside")(text)
    return {"normalised_inside": choice["normalised"] == "inside"}


READERS: dict[str, Reader] = {
    "preset": lambda text: _values(preset_named(text)),
    "depth_kind": _choice("kind", get_args(ModelKind), "metric, relative or inverse"),
    "depth_range_m": _numbers("depth_range_m", 2, "0.1,100"),
    "input_size_px": _size,
    "input_multiple_px": _scalar(_numbers("multiple_px", 1, "14", of=int)),
    "input_fit_px": _numbers("fit_px", 2, "320x240", "x", int),
    "input_resize": _choice("resize", get_args(Resize), "fit or stretch"),
    "input_scale": _scalar(_numbers("scale", 1, "255 or 1")),
    "input_mean": _numbers("mean", 3, "0.485,0.456,0.406", above=-inf),
    "input_deviation": _numbers("deviation", 3, "0.229,0.224,0.225"),
    "input_normalised": _normalised,
    "input_channels": _choice("channels", get_args(Channels), "RGB or BGR"),
    "input_layout": _choice("layout", get_args(Layout), "NCHW or NHWC"),
}
"""Parsers by metadata key, in order: keys after a preset override parts of it."""


def _plain(text: str) -> str:
    """Return text without the quotes and brackets of a JSON string or list."""
    try:
        value = json.loads(text)
    except ValueError:
        return text.strip()
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def _by(size: tuple[int | None, ...] | None) -> str:
    return " x ".join(map(str, size or ()))

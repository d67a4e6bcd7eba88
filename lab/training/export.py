"""Export of a trained checkpoint to the ONNX file that ships: full-resolution head, static 8-bit integers."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import torch
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)
from onnxruntime.quantization.shape_inference import quant_pre_process
from torch import Tensor, nn

from lab.training.dataset import Shards, rendered
from lab.training.initial import LICENCES
from lab.training.network import DepthNet, depth_from_logit
from packetmesh.errors import InputError
from pipeline.depth.conventions import Convention, metadata_of
from pipeline.depth.metrics import depth_errors
from pipeline.depth.preprocessing import (
    HEIGHT_PX,
    MEAN,
    PADDED_HEIGHT_PX,
    STANDARD_DEVIATION,
    WIDTH_PX,
    padded,
    unpad,
)
from pipeline.types import ByteArray, FloatArray

OPSET = 17
CALIBRATION_IMAGES = 100
COMPARED_IMAGES = 60
CONVENTION = Convention(
    "relative",
    WIDTH_PX,
    PADDED_HEIGHT_PX,
    scale=1.0,
    normalised_inside=True,
    resize="fit",
    fit_px=(WIDTH_PX, HEIGHT_PX),
)
"""Input and output of an exported file: unscaled 8-bit values, and metres up to an unknown scale, which an
image does not determine."""
INTEGER_LAYERS = ("/encoder/pool/", "/encoder/stages.", "/decoder/")
"""Prefixes of the nodes that are quantised, apart from ``FLOAT_LAYERS``."""
FLOAT_LAYERS = ("/decoder/reduce.4/", "/decoder/join.4/", "/decoder/heads.3/")
"""Prefixes of decoder nodes that stay in floating point. So do the input, the first convolution, and all
nodes from the head's logit to depth, because 8 bits would reduce the depth to 256 steps."""
FACTS = ("seed", "width", "initial", "loss", "step", "images_seen", "elapsed_s", "learning_rate")
"""Facts about the training that are copied from the checkpoint to the file's metadata."""


class Normalise(nn.Module):
    """Maps RGB in 0 to 255 to the encoder's input."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("mean", torch.tensor(255.0 * MEAN)[None, :, None, None])
        self.register_buffer("deviation", torch.tensor(255.0 * STANDARD_DEVIATION)[None, :, None, None])

    def forward(self, rgb: Tensor) -> Tensor:
        return (rgb - self.mean) / self.deviation


class Mirrored(nn.Module):
    """The network with its finest head only, for RGB (N, 3, H, W) in 0 to 255.

    It infers each image and its mirror image and returns the geometric mean of both depths, which has lower
    errors than either (Godard et al. 2017, post-processing).
    """

    def __init__(self, network: DepthNet) -> None:
        super().__init__()
        self.normalise = Normalise()
        self.encoder, self.decoder = network.encoder, network.decoder

    def forward(self, rgb: Tensor) -> Tensor:
        both = self.normalise(torch.cat([rgb, rgb.flip(3)]))
        straight_m, mirrored_m = depth_from_logit(self.decoder(self.encoder(both))[-1]).chunk(2)
        return torch.sqrt(straight_m * mirrored_m.flip(3))


class CalibrationImages(CalibrationDataReader):
    """Training images, one after the other, to find the range of every activation."""

    def __init__(self, shards: Shards, count: int) -> None:
        self.images = (network_input(rgb) for rgb, _ in shards.evenly(count))

    def get_next(self) -> dict[str, np.ndarray] | None:
        image = next(self.images, None)
        return None if image is None else {"rgb": image}


def network_input(rgb: ByteArray) -> FloatArray:
    """Return (240, 320, 3) uint8 as (1, 3, 256, 320) float32, 0 to 255."""
    image = padded(rgb, WIDTH_PX, PADDED_HEIGHT_PX).astype(np.float32)
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None])


def export(checkpoint: Path, data: Path, out: Path) -> dict[str, float]:
    """Write ``out`` (8 bit) and ``out`` with suffix ``.float.onnx``; return errors on validation rooms.

    Args:
        checkpoint: ``best.pt`` or ``last.pt`` of a training run.
        data: folder of shards; training images calibrate, validation images compare.
        out: the ONNX file to write.

    Raises:
        InputError: there is no such checkpoint, or there are no shards.
    """
    if not checkpoint.is_file():
        raise InputError(
            f"There is no checkpoint at {checkpoint}: name the best.pt or last.pt of a training run."
        )
    training, validation = rendered(data, "train"), rendered(data, "validation")
    saved = torch.load(checkpoint, weights_only=True, map_location="cpu")
    network = DepthNet(saved["config"]["width"]).eval()
    network.load_state_dict(saved["model"])
    float_file = out.with_suffix(".float.onnx")
    write_float(network, float_file)
    quantise(float_file, out, training)
    errors = mean_errors(out, validation)
    errors["float_abs_rel"] = mean_errors(float_file, validation)["abs_rel"]
    facts = saved["config"] | saved["state"]
    for file in (float_file, out):
        describe(file, {name: facts[name] for name in FACTS}, errors, described_data(training))
    return errors


def write_float(network: DepthNet, file: Path) -> None:
    """Write the network as ONNX in 32-bit floating point."""
    torch.onnx.export(
        Mirrored(network).eval(),
        (torch.zeros(1, 3, PADDED_HEIGHT_PX, WIDTH_PX),),
        str(file),
        input_names=["rgb"],
        output_names=["depth_m"],
        opset_version=OPSET,
        dynamo=False,
    )


def quantise(float_file: Path, out: Path, training: Shards) -> None:
    """Write the network with 8-bit weights and activations in its integer layers; images give the ranges."""
    prepared = out.with_suffix(".prepared.onnx")
    quant_pre_process(str(float_file), str(prepared), skip_symbolic_shape=True)
    nodes = [node.name for node in onnx.load(prepared).graph.node]
    quantize_static(
        str(prepared),
        str(out),
        CalibrationImages(training, CALIBRATION_IMAGES),
        quant_format=QuantFormat.QDQ,
        activation_type=QuantType.QUInt8,
        weight_type=QuantType.QInt8,
        per_channel=True,
        calibrate_method=CalibrationMethod.MinMax,
        nodes_to_exclude=[n for n in nodes if n.startswith(FLOAT_LAYERS) or not n.startswith(INTEGER_LAYERS)],
    )
    prepared.unlink()


def mean_errors(file: Path, shards: Shards) -> dict[str, float]:
    """Return mean errors of an ONNX file over evenly chosen images, unscaled and scaled by the median."""
    session = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
    rows: list[dict[str, float]] = []
    for rgb, truth_m in shards.evenly(COMPARED_IMAGES):
        (output,) = session.run(None, {"rgb": network_input(rgb)})
        depth_m = unpad(output[0, 0])
        known = np.isfinite(truth_m)
        scale = np.median(truth_m[known]) / np.median(depth_m[known])
        raw, scaled = depth_errors(depth_m, truth_m), depth_errors(scale * depth_m, truth_m)
        rows.append(
            {"abs_rel": raw.abs_rel, "rmse_m": raw.rmse_m, "delta_1": raw.delta_1, "silog": raw.silog}
            | {"scaled_abs_rel": scaled.abs_rel, "scaled_delta_1": scaled.delta_1}
        )
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def described_data(training: Shards) -> str:
    """Describe the training data by the names of the shards."""
    kinds = sorted({re.sub(r"_\d+_rgb\.npy$", "", file.name) for file in training.files})
    return f"{len(training)} images in {len(training.files)} shards ({', '.join(kinds)})"


def describe(file: Path, facts: dict[str, Any], errors: dict[str, float], data: str) -> None:
    """Write the file's metadata: convention of input and output, training, errors on validation rooms."""
    model = onnx.load(file)
    properties = {
        **metadata_of(CONVENTION),
        "kind": CONVENTION.kind,
        "normalised_inside": "true",
        "licence": LICENCES[facts["initial"]],
        "data": data,
        "metrics": json.dumps(errors),
        "abs_rel": str(errors["abs_rel"]),
        "float_abs_rel": str(errors["float_abs_rel"]),
        **{name: str(value) for name, value in facts.items()},
    }
    onnx.helper.set_model_props(model, properties)
    model.producer_name = "PacketMesh"
    onnx.save(model, file)

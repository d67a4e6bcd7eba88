"""A trained checkpoint to the ONNX file that ships: full-resolution head, static 8-bit integers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

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

from pipeline.depth.metrics import depth_errors
from pipeline.depth.preprocessing import PADDED_HEIGHT_PX, WIDTH_PX, normalised_input, unpad
from pipeline.depth.training.dataset import Shards
from pipeline.depth.training.network import DepthResNet, depth_from_logit

OPSET = 17
CALIBRATION_IMAGES = 100
COMPARED_IMAGES = 60
FLOAT_LAYERS = ("/encoder/stem/", "/decoder/reduce.4/", "/decoder/join.4/", "/decoder/heads.3/")
"""Layers that stay in floating point: the first convolution, the last decoder level and the head."""


class FullResolution(nn.Module):
    """The network with its finest head only."""

    def __init__(self, network: DepthResNet) -> None:
        super().__init__()
        self.encoder, self.decoder = network.encoder, network.decoder

    def forward(self, rgb: Tensor) -> Tensor:
        return depth_from_logit(self.decoder(self.encoder(rgb))[-1])


class CalibrationImages(CalibrationDataReader):
    """Training images, one at a time, to find the range of every activation."""

    def __init__(self, shards: Shards, count: int) -> None:
        self.samples = inputs(shards, count)

    def get_next(self) -> dict[str, np.ndarray] | None:
        image = next(self.samples, None)
        return None if image is None else {"rgb": image}


def inputs(shards: Shards, count: int) -> Iterator[np.ndarray]:
    """Network inputs of evenly chosen images."""
    for row in np.linspace(0, len(shards) - 1, count).astype(int):
        yield normalised_input(shards[row][0])


def export(checkpoint: Path, data: Path, out: Path) -> dict[str, float]:
    """Write ``out`` (8 bit) and ``out`` with suffix ``.float.onnx``; returns both AbsRel on validation rooms.

    Args:
        checkpoint: ``last.pt`` of a training run.
        data: folder of shards; training images calibrate, validation images compare.
        out: the ONNX file to write.
    """
    saved = torch.load(checkpoint, weights_only=True, map_location="cpu")
    network = DepthResNet().eval()
    network.load_state_dict(saved["model"])
    float_file, prepared = out.with_suffix(".float.onnx"), out.with_suffix(".prepared.onnx")
    example = torch.zeros(1, 3, PADDED_HEIGHT_PX, WIDTH_PX)
    torch.onnx.export(
        FullResolution(network).eval(),
        (example,),
        str(float_file),
        input_names=["rgb"],
        output_names=["depth_m"],
        opset_version=OPSET,
        dynamo=False,
    )
    quant_pre_process(str(float_file), str(prepared), skip_symbolic_shape=True)
    nodes = [node.name for node in onnx.load(prepared).graph.node]
    quantize_static(
        str(prepared),
        str(out),
        CalibrationImages(Shards(data, "train"), CALIBRATION_IMAGES),
        quant_format=QuantFormat.QDQ,
        activation_type=QuantType.QUInt8,
        weight_type=QuantType.QInt8,
        per_channel=True,
        calibrate_method=CalibrationMethod.MinMax,
        nodes_to_exclude=[name for name in nodes if name.startswith(FLOAT_LAYERS) or not name],
    )
    prepared.unlink()
    validation = Shards(data, "validation")
    errors = {"float_abs_rel": mean_abs_rel(float_file, validation), "abs_rel": mean_abs_rel(out, validation)}
    describe(out, {**saved["state"], **saved["config"], **errors})
    return errors


def mean_abs_rel(file: Path, shards: Shards) -> float:
    """Mean AbsRel of an ONNX file over evenly chosen images."""
    session = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
    errors = []
    for row in np.linspace(0, len(shards) - 1, COMPARED_IMAGES).astype(int):
        rgb, truth_m = shards[row]
        (depth_m,) = session.run(None, {"rgb": normalised_input(rgb)})
        errors.append(depth_errors(unpad(depth_m[0, 0]), truth_m).abs_rel)
    return float(np.mean(errors))


def describe(file: Path, facts: dict[str, object]) -> None:
    """Write into the file how it was made: seed, steps, images seen, errors on validation rooms."""
    model = onnx.load(file)
    shown = ("seed", "step", "images_seen", "elapsed_s", "learning_rate", "abs_rel", "float_abs_rel")
    onnx.helper.set_model_props(model, {key: json.dumps(facts[key]) for key in shown})
    model.producer_name = "PacketMesh"
    onnx.save(model, file)

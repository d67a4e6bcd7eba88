"""EfficientNet-Lite0 as an encoder: a control for the ResNet-50 (Tan and Le 2019; the Lite variant of 2020).

It is EfficientNet-B0 without squeeze-and-excitation and with ReLU6 in place of swish.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

STEM_CHANNELS = 32
NORM_EPSILON = 1e-3


@dataclass(frozen=True, slots=True)
class Repeat:
    """Equal blocks in a row; the first one has the stride and the change of channels."""

    blocks: int
    kernel_px: int
    stride: int
    expansion: int
    channels: int


LEVELS = (
    (Repeat(1, 3, 1, 1, 16),),
    (Repeat(2, 3, 2, 6, 24),),
    (Repeat(2, 5, 2, 6, 40),),
    (Repeat(3, 3, 2, 6, 80), Repeat(3, 5, 1, 6, 112)),
    (Repeat(4, 5, 2, 6, 192), Repeat(1, 3, 1, 6, 320)),
)
"""Blocks that end in the features of strides 2, 4, 8, 16 and 32."""


class InvertedBottleneck(nn.Module):
    """1x1 to more channels, depthwise convolution, 1x1 to fewer; added to the input if the shapes agree."""

    def __init__(self, channels_in: int, repeat: Repeat, stride: int) -> None:
        super().__init__()
        inner = repeat.expansion * channels_in
        layers = [*conv_norm(channels_in, inner, 1), nn.ReLU6(inplace=True)] if repeat.expansion > 1 else []
        layers += [*conv_norm(inner, inner, repeat.kernel_px, stride, groups=inner), nn.ReLU6(inplace=True)]
        self.residual = nn.Sequential(*layers, *conv_norm(inner, repeat.channels, 1))
        self.adds = stride == 1 and channels_in == repeat.channels

    def forward(self, x: Tensor) -> Tensor:
        return x + self.residual(x) if self.adds else self.residual(x)


class EfficientNetLite0(nn.Module):
    """The encoder without its classifier; returns the features at strides 2, 4, 8, 16 and 32."""

    channels = tuple(level[-1].channels for level in LEVELS)
    """Channels of the features."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("offset", torch.zeros(1, 3, 1, 1))
        self.stem = nn.Sequential(*conv_norm(3, STEM_CHANNELS, 3, 2), nn.ReLU6(inplace=True))
        self.stages = nn.ModuleList()
        channels = STEM_CHANNELS
        for level in LEVELS:
            blocks = []
            for repeat in level:
                for index in range(repeat.blocks):
                    blocks.append(InvertedBottleneck(channels, repeat, 1 if index else repeat.stride))
                    channels = repeat.channels
            self.stages.append(nn.Sequential(*blocks))

    def forward(self, x: Tensor) -> list[Tensor]:
        """Return features of a normalised image (N, 3, H, W), finest first; H and W are multiples of 32.

        ``offset`` is the value of the first convolution's zero padding, as in the ResNet-50.
        """
        x = self.stem(x - self.offset)
        features = []
        for stage in self.stages:
            x = stage(x)
            features.append(x)
        return features


def conv_norm(
    channels_in: int, channels_out: int, kernel_px: int, stride: int = 1, groups: int = 1
) -> list[nn.Module]:
    """Return a convolution padded as in TensorFlow ("SAME") and its norm.

    If it halves an even size, TensorFlow's odd padding pixel is at the right and at the bottom.
    """
    before = (kernel_px - stride) // 2
    after = kernel_px - stride - before
    convolution = nn.Conv2d(
        channels_in,
        channels_out,
        kernel_px,
        stride,
        before if before == after else 0,
        groups=groups,
        bias=False,
    )
    layers = [convolution, nn.BatchNorm2d(channels_out, eps=NORM_EPSILON)]
    return layers if before == after else [nn.ZeroPad2d((before, after, before, after)), *layers]

"""The depth network: an encoder, usually a ResNet-50, and a five-level decoder with skips (SPEC 3.2)."""

from __future__ import annotations

import math
from typing import Any, Literal

import torch
from torch import Tensor, nn

from lab.training.config import Width
from lab.training.efficientnet import EfficientNetLite0

DEPTH_MIN_M = 0.1
DEPTH_MAX_M = 10.0
STEM_CHANNELS = 64
BLOCK_WIDTH = {"full": 64, "half": 32}
"""Channels inside the bottlenecks of the first stage; every stage doubles them."""
BLOCKS = (3, 4, 6, 3)
DECODER_CHANNELS = (16, 32, 64, 128, 256)
HEAD_LEVELS = (0, 1, 2, 3)
TYPICAL_ROOM_DEPTH_M = 2.5
ELU_GAIN = 1.25
HEAD_GAIN = 0.1


class Bottleneck(nn.Module):
    """1x1, 3x3, 1x1 convolutions with a shortcut (He et al. 2016).

    The stride is in the 3x3, or, ``early``, in the first 1x1 as in Caffe's ResNets.
    """

    def __init__(self, channels_in: int, width: int, stride: int, early: bool) -> None:
        super().__init__()
        channels_out = 4 * width
        first, second = (stride, 1) if early else (1, stride)
        self.residual = nn.Sequential(
            nn.Conv2d(channels_in, width, 1, first, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            nn.Conv2d(width, width, 3, second, 1, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            nn.Conv2d(width, channels_out, 1, bias=False),
            nn.BatchNorm2d(channels_out),
        )
        self.shortcut: nn.Module = nn.Identity()
        if stride != 1 or channels_in != channels_out:
            self.shortcut = nn.Sequential(
                nn.Conv2d(channels_in, channels_out, 1, stride, bias=False), nn.BatchNorm2d(channels_out)
            )

    def forward(self, x: Tensor) -> Tensor:
        return torch.relu(self.residual(x) + self.shortcut(x))


class ResNet50(nn.Module):
    """The encoder without its classifier; returns the features at strides 2, 4, 8, 16 and 32.

    At full width it is the usual ResNet-50. At half width it is the ResNet-50-thin of Yahoo's Open-NSFW
    (2016): half the channels, strides in the first 1x1, and pooling windows that start at the image's first
    pixel.
    """

    def __init__(self, width: Literal["full", "half"] = "full") -> None:
        super().__init__()
        thin, inner = width == "half", BLOCK_WIDTH[width]
        self.channels = (STEM_CHANNELS, *(4 * inner << level for level in range(len(BLOCKS))))
        self.register_buffer("offset", torch.zeros(1, 3, 1, 1))
        self.stem = nn.Sequential(
            nn.Conv2d(3, STEM_CHANNELS, 7, 2, 3, bias=False),
            nn.BatchNorm2d(STEM_CHANNELS),
            nn.ReLU(inplace=True),
        )
        self.pool = nn.MaxPool2d(3, 2, 0, ceil_mode=True) if thin else nn.MaxPool2d(3, 2, 1)
        self.stages = nn.ModuleList()
        channels = STEM_CHANNELS
        for level, blocks in enumerate(BLOCKS):
            stage = [Bottleneck(channels, inner << level, 2 if level else 1, early=thin)]
            channels = 4 * inner << level
            stage += [Bottleneck(channels, inner << level, 1, early=thin) for _ in range(blocks - 1)]
            self.stages.append(nn.Sequential(*stage))

    def forward(self, x: Tensor) -> list[Tensor]:
        """Return features of a normalised image (N, 3, H, W), finest first.

        ``offset`` is the input value that the first convolution's zero padding represents. It differs from 0
        for weights trained with another mean; subtracting it, unlike a bias, is exact at the borders too.
        """
        features = [self.stem(x - self.offset)]
        x = self.pool(features[0])
        for stage in self.stages:
            x = stage(x)
            features.append(x)
        return features


def encoder_of(width: Width) -> ResNet50 | EfficientNetLite0:
    """Return the encoder of this name; its ``channels`` are of the features at strides 2, 4, 8, 16 and 32."""
    return EfficientNetLite0() if width == "lite0" else ResNet50(width)


class ReflectPadFunction(torch.autograd.Function):
    """Pads one reflected pixel on every side, several times faster than torch's on channels-last memory."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        n, c, h, w = x.shape
        size = (n, c, h + 2, w + 2)
        out = torch.empty(size, dtype=x.dtype, device=x.device, memory_format=torch.channels_last)
        out[..., 1:-1, 1:-1] = x
        out[..., 0, 1:-1], out[..., -1, 1:-1] = x[..., 1, :], x[..., -2, :]
        out[..., 0], out[..., -1] = out[..., 2], out[..., -3]
        return out

    @staticmethod
    def backward(ctx: Any, grad: Tensor) -> Tensor:
        rows = grad[..., 1:-1, :].clone(memory_format=torch.channels_last)
        rows[..., 1, :] += grad[..., 0, :]
        rows[..., -2, :] += grad[..., -1, :]
        rows[..., 2] += rows[..., 0]
        rows[..., -3] += rows[..., -1]
        return rows[..., 1:-1]


class ReflectPad(nn.Module):
    """Pads one reflected pixel on every side."""

    def forward(self, x: Tensor) -> Tensor:
        if self.training:
            return ReflectPadFunction.apply(x)
        return nn.functional.pad(x, (1, 1, 1, 1), mode="reflect")


def conv_elu(channels_in: int, channels_out: int) -> nn.Sequential:
    """3x3 convolution with reflect padding, then ELU."""
    return nn.Sequential(ReflectPad(), nn.Conv2d(channels_in, channels_out, 3), nn.ELU(inplace=True))


class Decoder(nn.Module):
    """Five levels of (conv, upsample, join the encoder's skip, conv), heads at strides 8, 4, 2 and 1."""

    def __init__(self, encoder: tuple[int, ...]) -> None:
        super().__init__()
        reduce, join, heads = [], [], []
        channels = encoder[-1]
        for level in (4, 3, 2, 1, 0):
            width = DECODER_CHANNELS[level]
            skip = encoder[level - 1] if level else 0
            reduce.append(conv_elu(channels, width))
            join.append(conv_elu(width + skip, width))
            if level in HEAD_LEVELS:
                heads.append(nn.Sequential(ReflectPad(), nn.Conv2d(width, 1, 3)))
            channels = width
        self.reduce, self.join, self.heads = map(nn.ModuleList, (reduce, join, heads))

    def forward(self, features: list[Tensor]) -> list[Tensor]:
        """Return logits of the heads, coarsest (stride 8) first."""
        x, logits = features[-1], []
        for step, level in enumerate((4, 3, 2, 1, 0)):
            x = nn.functional.interpolate(self.reduce[step](x), scale_factor=2.0, mode="nearest")
            if level:
                x = torch.cat([x, features[level - 1]], dim=1)
            x = self.join[step](x)
            if level in HEAD_LEVELS:
                logits.append(self.heads[step - 1](x))
        return logits


class DepthNet(nn.Module):
    """Maps normalised RGB (N, 3, H, W) to depth in metres; H and W are multiples of 32."""

    def __init__(self, width: Width = "full") -> None:
        super().__init__()
        self.encoder = encoder_of(width)
        self.decoder = Decoder(self.encoder.channels)
        self.reset()

    def reset(self) -> None:
        """Draw the weights: the encoder's after He, the decoder's so that ELU keeps the variance.

        The heads start near the typical depth of a room.
        """
        for module in self.encoder.modules():
            if isinstance(module, nn.Conv2d):
                fan_out = module.out_channels * module.weight[0, 0].numel() / module.groups
                nn.init.normal_(module.weight, std=math.sqrt(2.0 / fan_out))
        for module in self.decoder.modules():
            if isinstance(module, nn.Conv2d):
                gain = ELU_GAIN if module.out_channels > 1 else HEAD_GAIN
                nn.init.normal_(module.weight, std=gain * module.weight[0].numel() ** -0.5)
                nn.init.zeros_(module.bias)
        share = (1 / TYPICAL_ROOM_DEPTH_M - 1 / DEPTH_MAX_M) / (1 / DEPTH_MIN_M - 1 / DEPTH_MAX_M)
        for head in self.decoder.heads:
            nn.init.constant_(head[-1].bias, float(torch.logit(torch.tensor(share))))

    def forward(self, x: Tensor) -> list[Tensor]:
        """Return depths in metres at strides 1, 2, 4 and 8, each (N, 1, H/s, W/s) float32."""
        return [depth_from_logit(logit) for logit in reversed(self.decoder(self.encoder(x)))]


def depth_from_logit(logit: Tensor) -> Tensor:
    """Return depth = 1 / (1/dmax + (1/dmin - 1/dmax) sigmoid(logit)), in float32 metres."""
    share = torch.sigmoid(logit.float())
    return 1.0 / (1 / DEPTH_MAX_M + (1 / DEPTH_MIN_M - 1 / DEPTH_MAX_M) * share)

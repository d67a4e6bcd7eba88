"""The completion network: a small U-Net that predicts differences of log depth and their scales."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from pipeline.depth.slopes import CHANNELS_IN, CHANNELS_OUT, DISTANCES

WIDTHS = (16, 32, 64, 96, 128)
"""Channels at strides 1, 2, 4, 8 and 16."""
START_SPREAD, START_LOG_SCALE = 0.3, -3.0
STEP_SPREAD, STEP_LOG_SCALE = 0.1, -4.0


class Block(nn.Module):
    """Two 3x3 convolutions with a shortcut."""

    def __init__(self, channels_in: int, channels: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(channels_in, channels, 3, 1, 1, bias=False)
        self.norm = nn.BatchNorm2d(channels)
        self.second = nn.Conv2d(channels, channels, 3, 1, 1, bias=False)
        self.norm_second = nn.BatchNorm2d(channels)

    def forward(self, x: Tensor) -> Tensor:
        x = torch.relu(self.norm(self.first(x)))
        return torch.relu(x + self.norm_second(self.second(x)))


class CompletionNet(nn.Module):
    """Maps (N, 8, H, W) of ``pipeline.depth.slopes.network_input`` to (N, 14, H, W).

    H and W are multiples of 16.
    """

    def __init__(self) -> None:
        super().__init__()
        ins = (CHANNELS_IN, *WIDTHS[:-1])
        self.down = nn.ModuleList(Block(a, b) for a, b in zip(ins, WIDTHS, strict=True))
        self.up = nn.ModuleList(
            Block(deep + fine, fine) for deep, fine in zip(WIDTHS[:0:-1], WIDTHS[-2::-1], strict=True)
        )
        self.deepest = nn.Sequential(Block(WIDTHS[-1], WIDTHS[-1]), Block(WIDTHS[-1], WIDTHS[-1]))
        self.head = nn.Conv2d(WIDTHS[0], CHANNELS_OUT, 3, 1, 1)
        nn.init.normal_(self.head.weight, 0.0, 1e-3)
        nn.init.zeros_(self.head.bias)
        scale, offset = head_units()
        self.register_buffer("scale", scale, persistent=False)
        self.register_buffer("offset", offset, persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """Return, per pixel, the start's correction and its log scale, then both for every difference."""
        kept = []
        for level, block in enumerate(self.down):
            x = block(nn.functional.max_pool2d(x, 2) if level else x)
            kept.append(x)
        x = self.deepest(x)
        for block, fine in zip(self.up, kept[-2::-1], strict=True):
            x = block(torch.cat([nn.functional.interpolate(x, scale_factor=2.0), fine], dim=1))
        return self.head(x).float() * self.scale + self.offset


def head_units() -> tuple[Tensor, Tensor]:
    """Return (1, 14, 1, 1) scales and offsets of the head's outputs, which are of order one."""
    scale, offset = [START_SPREAD, 1.0], [0.0, START_LOG_SCALE]
    for distance in DISTANCES:
        scale += 2 * [STEP_SPREAD * distance**0.5, 1.0]
        offset += 2 * [0.0, STEP_LOG_SCALE]
    return torch.tensor(scale).view(1, -1, 1, 1), torch.tensor(offset).view(1, -1, 1, 1)

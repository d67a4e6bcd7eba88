"""Settings of the depth network's training; without torch, so that the command line starts at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Width = Literal["full", "half", "lite0"]
"""Width of the encoder: the ResNet-50 at full or half width, or EfficientNet-Lite0, which has one width."""
Initial = Literal["random", "open-nsfw", "efficientnet-lite0"]
Loss = Literal["scale-invariant", "berhu"]
Precision = Literal["bf16", "fp32"]

WIDTHS: dict[Initial, Width] = {"random": "full", "open-nsfw": "half", "efficientnet-lite0": "lite0"}
"""Default encoder for each kind of initial weights; weights that are not random fit no other."""


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """Settings of a training; recorded in every checkpoint."""

    data: Path
    """Folder of rendered shards."""
    out: Path
    """Folder of checkpoints and the log; continued if it holds a last.pt."""
    minutes: float = 75.0
    """Wall-clock budget of this and all resumed runs together."""
    pause_minutes: float = math.inf
    """This run saves and stops after so long even if the budget is not spent; the next one continues it."""
    learning_rate: float = 4e-4
    """Peak of the one-cycle schedule; it rises for 4 % of the budget and falls by a cosine to zero."""
    seed: int = 0
    width: Width | None = None
    """Of the encoder; the command takes what fits the initial weights if none is given."""
    initial: Initial = "random"
    loss: Loss = "scale-invariant"
    precision: Precision = "bf16"
    """Of the network's arithmetic; the loss is always fp32."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """``auto`` takes a GPU when there is one."""
    processes: int = 2
    """Processes that share each batch, one core each: 1, 2, 4 or 8. On a GPU one process trains."""

"""Training of the completion network: AdamW, one-cycle rate tied to a time budget, bfloat16."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset

from lab.training.completion.config import CompletionConfig
from lab.training.completion.holes import lesson
from lab.training.completion.losses import negative_log_likelihood
from lab.training.completion.network import CompletionNet
from lab.training.dataset import Shards, rendered
from lab.training.train import GRADIENT_CLIP, TrainingState, log, scheduled_rate
from packetmesh.files import atomic_path
from pipeline.depth.slopes import network_input
from pipeline.types import ByteArray, FloatArray

CHECKPOINT_EVERY_S = 120.0
WEIGHT_DECAY = 1e-4
VALIDATION_IMAGES = 64
VALIDATION_SEED = 5


def train_completion(config: CompletionConfig) -> None:
    """Train until the time budget is spent; write the network to ``out/last.pt``.

    Raises:
        InputError: there are no shards.
    """
    for split in ("train", "validation"):
        rendered(config.data, split)
    config.out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(config.seed)
    torch.set_num_threads(config.threads)
    model = CompletionNet().to(memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(model.parameters(), config.learning_rate, weight_decay=WEIGHT_DECAY)
    validation = collate(list(validation_frames(config.data)))
    frames = Frames(config.data, config.seed + 1)
    batches = iter(DataLoader(frames, config.batch, num_workers=1, prefetch_factor=4))
    state, began_s, saved_s = TrainingState(), time.monotonic(), 0.0
    while state.elapsed_s < 60.0 * config.minutes:
        for group in optimizer.param_groups:
            group["lr"] = scheduled_rate(config.learning_rate, state.elapsed_s / (60.0 * config.minutes))
        learn(model, optimizer, next(batches))
        elapsed_s = time.monotonic() - began_s
        state = TrainingState(state.step + 1, state.images_seen + config.batch, elapsed_s)
        if elapsed_s - saved_s > CHECKPOINT_EVERY_S or elapsed_s >= 60.0 * config.minutes:
            log(config.out, state, val_nll=validate(model, validation))
            write(config, model, state)
            saved_s = elapsed_s


def learn(model: CompletionNet, optimizer: torch.optim.Optimizer, batch: list[Tensor]) -> None:
    """Take one step along the clipped gradients of a batch; none if they are not finite."""
    planes, start, log_z = batch
    model.train()
    with torch.autocast("cpu", torch.bfloat16):
        output = model(planes.contiguous(memory_format=torch.channels_last))
    loss = negative_log_likelihood(output.float(), planes, start, log_z)
    model.zero_grad(set_to_none=True)
    loss.backward()
    if torch.isfinite(torch.nn.utils.clip_grad_norm_(model.parameters(), GRADIENT_CLIP)):
        optimizer.step()


@torch.no_grad()
def validate(model: CompletionNet, frames: list[Tensor]) -> float:
    """Return the mean negative log likelihood of ``collate``'s frames."""
    model.eval()
    planes, start, log_z = frames
    output = torch.cat([model(part) for part in planes.split(16)])
    return float(negative_log_likelihood(output, planes, start, log_z))


@dataclass(frozen=True, slots=True)
class Frames(IterableDataset):
    """Endless frames with holes; an epoch has every view once, including those of shards added before it."""

    data: Path
    seed: int

    def __iter__(self) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        cv2.setNumThreads(0)
        rng, shards = np.random.default_rng(self.seed), Shards(self.data, "train")
        while True:
            shards.refresh()
            for row in rng.permutation(len(shards)):
                yield frame(*shards[row], rng)


def validation_frames(data: Path) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Yield the same frames with the same holes at every call."""
    rng = np.random.default_rng(VALIDATION_SEED)
    for view in Shards(data, "validation").evenly(VALIDATION_IMAGES):
        yield frame(*view, rng)


def frame(
    rgb: ByteArray, depth_m: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the network's input, the start and the true log depth of one view, padded to one size."""
    seen = lesson(rgb, depth_m, rng)
    planes, start = network_input(seen.grid)
    pad = [(0, whole - part) for whole, part in zip(planes.shape[1:], start.shape, strict=True)]
    return planes, np.pad(start, pad), np.pad(seen.log_z, pad, constant_values=np.nan)


def collate(frames: list[tuple[FloatArray, FloatArray, FloatArray]]) -> list[Tensor]:
    """Return the frames' inputs, starts and truths, each stacked."""
    return [torch.from_numpy(np.stack(part)) for part in zip(*frames, strict=True)]


def write(config: CompletionConfig, model: CompletionNet, state: TrainingState) -> None:
    """Replace ``out/last.pt`` atomically."""
    plain = {name: str(value) for name, value in asdict(config).items()}
    with atomic_path(config.out / "last.pt") as temporary:
        torch.save({"model": model.state_dict(), "state": asdict(state), "config": plain}, temporary)

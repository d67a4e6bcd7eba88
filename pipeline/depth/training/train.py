"""The training loop: Adam, one-cycle rate tied to a time budget, bfloat16, resumable (SPEC 3.3)."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor

from pipeline.depth.metrics import depth_errors
from pipeline.depth.preprocessing import normalised_input
from pipeline.depth.training.dataset import Shards, augment
from pipeline.depth.training.losses import supervised_loss
from pipeline.depth.training.network import DEPTH_MAX_M, DEPTH_MIN_M, DepthResNet
from pipeline.depth.training.parallel import Team, run_team

CHECKPOINT_EVERY_S = 180.0
VALIDATION_IMAGES = 48


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """How a network is trained; recorded in every checkpoint."""

    data: Path
    """Folder of rendered shards."""
    out: Path
    """Folder of checkpoints and the log."""
    minutes: float = 75.0
    """Wall-clock budget of this and all resumed runs together."""
    learning_rate: float = 4e-4
    """Peak of the one-cycle schedule; it rises for 4 % of the budget and falls by a cosine to zero."""
    gradient_clip: float = 1.0
    seed: int = 0
    processes: int = 2
    """They share each batch; one core each."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of the training with inputs of one size."""

    until: float
    """Share of the time budget at which it ends."""
    size_px: tuple[int, int]
    """Height and width of the input."""
    batch: int


STAGES = (Stage(0.3, (64, 96), 16), Stage(0.65, (128, 160), 8), Stage(math.inf, (256, 320), 8))
"""Small images first: the layout of rooms is learned from many of them, the detail from fewer large ones."""


@dataclass(frozen=True, slots=True)
class TrainingState:
    """Where a run stands."""

    step: int = 0
    images_seen: int = 0
    elapsed_s: float = 0.0


def train(config: TrainingConfig) -> None:
    """Train until the time budget is spent; continues from ``out/last.pt`` when there is one."""
    config.out.mkdir(parents=True, exist_ok=True)
    parameters = sum(p.numel() for p in DepthResNet().parameters())
    run_team(config.processes, parameters, train_member, config)


def train_member(team: Team, config: TrainingConfig) -> None:
    """What every process of the team does with its share of each batch."""
    torch.manual_seed(config.seed)
    model = DepthResNet().to(memory_format=torch.channels_last)
    optimizer = torch.optim.Adam(model.parameters(), lr=config.learning_rate, fused=True)
    state = resume(config.out / "last.pt", model, optimizer)
    samples = endless_samples(config.data, np.random.default_rng((config.seed, state.step, team.rank)))
    validation = Shards(config.data, "validation")
    clock = time.monotonic() - state.elapsed_s
    saved_at_s = state.elapsed_s
    losses: list[float] = []
    finished = False
    while not finished:
        spent = state.elapsed_s / (60.0 * config.minutes)
        stage = next(stage for stage in STAGES if spent < stage.until)
        image, target_m = collate(list(islice(samples, stage.batch // team.size)), stage)
        losses.append(backward(model, image, target_m))
        now_s = team.average_gradients(model.parameters(), state.step, time.monotonic() - clock)
        update(model, optimizer, scheduled_rate(config.learning_rate, spent), config.gradient_clip)
        state = TrainingState(state.step + 1, state.images_seen + stage.batch, now_s)
        finished = now_s >= 60.0 * config.minutes
        if team.leads and state.step % 20 == 0:
            log(config.out, state, loss=float(np.mean(losses)))
            losses.clear()
        if team.leads and (finished or now_s - saved_at_s > CHECKPOINT_EVERY_S):
            log(config.out, state, **validate(model, validation, stage))
            save_checkpoint(config, model, optimizer, state)
            saved_at_s = now_s


def backward(model: DepthResNet, image: Tensor, target_m: Tensor) -> float:
    """Leave the gradients of one batch in the model; returns the loss."""
    model.train()
    with torch.autocast("cpu", dtype=torch.bfloat16):
        depths_m = model(image)
    loss = supervised_loss(depths_m, target_m, image)
    model.zero_grad(set_to_none=True)
    loss.backward()
    return loss.item()


def update(model: DepthResNet, optimizer: torch.optim.Optimizer, rate: float, gradient_clip: float) -> None:
    """One step along the clipped gradients; none if they are not finite."""
    for group in optimizer.param_groups:
        group["lr"] = rate
    norm = torch.nn.utils.clip_grad_norm_(model.parameters(), gradient_clip)
    if torch.isfinite(norm):
        optimizer.step()


def scheduled_rate(peak: float, spent: float, rise: float = 0.04) -> float:
    """One-cycle learning rate when the share ``spent`` (0 to 1) of the budget is gone."""
    if spent < rise:
        return peak * (0.05 + 0.95 * spent / rise)
    return peak * 0.5 * (1.0 + math.cos(math.pi * min(1.0, (spent - rise) / (1.0 - rise))))


def endless_samples(data: Path, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Augmented training images, every one once an epoch; newly rendered shards join at the next."""
    cv2.setNumThreads(0)
    shards = Shards(data, "train")
    while True:
        shards.refresh()
        for row in rng.permutation(len(shards)):
            yield augment(*shards[row], rng)


def collate(samples: list[tuple[np.ndarray, np.ndarray]], stage: Stage) -> tuple[Tensor, Tensor]:
    """Images (N, 3, h, w) and targets (N, 1, h, w) of a stage's size, padded; the padding has no target."""
    images = np.concatenate([normalised_input(rgb) for rgb, _ in samples])
    depth_m = np.stack([depth_m for _, depth_m in samples])
    rows = (images.shape[2] - depth_m.shape[1]) // 2
    depth_m = np.where((depth_m > DEPTH_MIN_M) & (depth_m < DEPTH_MAX_M), depth_m, np.nan)
    target = np.pad(depth_m, ((0, 0), (rows, rows), (0, 0)), constant_values=np.nan)[:, None]
    image = torch.nn.functional.interpolate(torch.from_numpy(images), stage.size_px, mode="area")
    target_m = torch.nn.functional.interpolate(torch.from_numpy(target.astype(np.float32)), stage.size_px)
    return image.contiguous(memory_format=torch.channels_last), target_m


@torch.no_grad()
def validate(model: DepthResNet, shards: Shards, stage: Stage) -> dict[str, float]:
    """Mean errors over evenly chosen validation images, at the stage's size."""
    model.eval()
    errors = []
    for row in np.linspace(0, len(shards) - 1, VALIDATION_IMAGES).astype(int):
        image, truth_m = collate([shards[row]], stage)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            depth_m = model(image)[0]
        errors.append(depth_errors(depth_m.numpy(), truth_m.numpy()))
    return {
        f"val_{name}": float(np.mean([getattr(error, name) for error in errors]))
        for name in ("abs_rel", "rmse_m", "delta_1", "silog")
    }


def log(folder: Path, state: TrainingState, **values: float) -> None:
    """Append one line to ``log.jsonl`` and say it."""
    line = json.dumps(asdict(state) | values)
    with (folder / "log.jsonl").open("a") as stream:
        stream.write(line + "\n")
    print(line, flush=True)


def save_checkpoint(
    config: TrainingConfig, model: DepthResNet, optimizer: torch.optim.Optimizer, state: TrainingState
) -> None:
    """Replace ``out/last.pt`` in one move."""
    temporary = config.out / "last.tmp"
    plain = asdict(replace(config, data=str(config.data), out=str(config.out)))
    torch.save(
        {
            "model": model.state_dict(),
            "optimizer": optimizer.state_dict(),
            "state": asdict(state),
            "config": plain,
        },
        temporary,
    )
    temporary.rename(config.out / "last.pt")


def resume(file: Path, model: DepthResNet, optimizer: torch.optim.Optimizer) -> TrainingState:
    """Load a checkpoint into the model and optimiser if there is one."""
    if not file.exists():
        return TrainingState()
    checkpoint = torch.load(file, weights_only=True)
    model.load_state_dict(checkpoint["model"])
    optimizer.load_state_dict(checkpoint["optimizer"])
    return TrainingState(**checkpoint["state"])

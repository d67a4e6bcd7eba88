"""The training loop: Adam, one-cycle rate tied to a time budget, bfloat16, resumable (SPEC 3.3)."""

from __future__ import annotations

import json
import math
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from lab.training.config import Precision, TrainingConfig
from lab.training.dataset import Shards, augment, rendered
from lab.training.initial import initial_network
from lab.training.losses import supervised_loss
from lab.training.network import DEPTH_MAX_M, DEPTH_MIN_M, DepthNet
from lab.training.parallel import Team, run_team
from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.depth.metrics import depth_errors
from pipeline.depth.preprocessing import normalised_input

CHECKPOINT_EVERY_S = 180.0
GRADIENT_CLIP = 1.0
RISE = 0.04
"""Share of the budget in which the learning rate rises."""
VALIDATION_IMAGES = 48
MEASURED_BATCHES = 8
"""Batches on which ``initial_network`` measures variances."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of the training with one input size."""

    until: float
    """Share of the time budget at which the stage ends."""
    size_px: tuple[int, int]
    """Height and width of the input."""
    batch: int
    """Images per step, of all processes together."""


STAGES = {
    "cpu": (Stage(0.3, (64, 96), 16), Stage(0.65, (128, 160), 8), Stage(math.inf, (256, 320), 8)),
    "cuda": (Stage(0.25, (128, 160), 64), Stage(math.inf, (256, 320), 32)),
}
"""Small images first: room layouts are learned from many of them, detail from fewer large ones."""


ALONE = Team(0, 1, torch.empty(0), torch.empty(0), None)
"""A team of one process."""


@dataclass(frozen=True, slots=True)
class TrainingState:
    """Progress of a run."""

    step: int = 0
    images_seen: int = 0
    elapsed_s: float = 0.0


def train(config: TrainingConfig) -> None:
    """Train until the time budget is spent; continue from ``out/last.pt`` if there is one.

    The network with the least validation error at the final input size is in ``out/best.pt``.

    Raises:
        InputError: there are no shards, no GPU although one is configured, another network in ``out``, or
            processes that cannot share the batches.
        PacketMeshError: one of several processes failed.
    """
    for split in ("train", "validation"):
        rendered(config.data, split)
    processes = 1 if device_of(config).type == "cuda" else config.processes
    check_shares(processes)
    config.out.mkdir(parents=True, exist_ok=True)
    with stop_on_signals() as stop:
        if not (config.out / "last.pt").exists():
            start(config)
        if processes == 1:
            train_member(ALONE, config, stop)
        else:
            run_team(processes, resumable_parameters(config), train_member, config, stop)
        if stop:
            print(f"Stopped; the same command continues from {config.out / 'last.pt'}.", flush=True)


@contextmanager
def stop_on_signals() -> Iterator[Tensor]:
    """Yield a shared flag (1,), set by the first SIGINT or SIGTERM; the second one acts as usual."""
    stop = torch.zeros(1, dtype=torch.bool).share_memory_()
    usual = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def request_stop(number: int, _: object) -> None:
        stop.fill_(True)
        signal.signal(number, usual[signal.Signals(number)])

    for number in usual:
        signal.signal(number, request_stop)
    try:
        yield stop
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)


def device_of(config: TrainingConfig) -> torch.device:
    """Return the device of the training.

    Raises:
        InputError: the device is cuda and there is no GPU.
    """
    if config.device == "cuda" and not torch.cuda.is_available():
        raise InputError("device is cuda, but torch finds no GPU on this machine: use cpu or auto.")
    return torch.device("cuda" if config.device != "cpu" and torch.cuda.is_available() else "cpu")


def check_shares(processes: int) -> None:
    """Check that the processes of a training on CPUs can share each batch evenly.

    Raises:
        InputError: they cannot.
    """
    most = math.gcd(*(stage.batch for stage in STAGES["cpu"]))
    if processes < 1 or most % processes:
        fitting = ", ".join(str(count) for count in range(1, most + 1) if most % count == 0)
        raise InputError(f"{processes} processes cannot share the batches evenly: use one of {fitting}.")


def start(config: TrainingConfig) -> None:
    """Write ``out/last.pt`` with an untrained network.

    Raises:
        InputError: ``out`` holds the best network of another training, or the initial weights cannot be used.
    """
    if (config.out / "best.pt").exists():
        raise InputError(f"{config.out} holds a best.pt but no last.pt to continue from: use another folder.")
    torch.manual_seed(config.seed)
    stage = STAGES["cpu"][-1]
    samples = endless_samples(config.data, np.random.default_rng(config.seed))
    images = (collate(list(islice(samples, stage.batch)), stage)[0] for _ in range(MEASURED_BATCHES))
    model = initial_network(config.initial, config.width, images)
    write(config, "last", model, TrainingState(), optimizer=optimizer_of(model, config).state_dict())


def train_member(team: Team, config: TrainingConfig, stop: Tensor) -> None:
    """Train on one process's share of each batch, until the time is over or the leader sees ``stop``."""
    device = device_of(config)
    model = DepthNet(config.width).to(device, memory_format=torch.channels_last)
    optimizer = optimizer_of(model, config)
    state = resume(config, model, optimizer)
    validation = Shards(config.data, "validation")
    began_s = saved_at_s = state.elapsed_s
    clock = time.monotonic() - began_s
    end_s = min(60.0 * config.minutes, began_s + 60.0 * config.pause_minutes)
    losses: list[Tensor] = []
    stage: Stage | None = None
    batches: Iterator[tuple[Tensor, Tensor]] = iter(())
    stopping = False
    while state.elapsed_s < end_s and not stopping:
        spent = state.elapsed_s / (60.0 * config.minutes)
        due = next(stage for stage in STAGES[device.type] if spent < stage.until)
        if due != stage:
            stage, batches = due, iter(loader(config, due, team, state.step, device))
        image, target_m = next(batches)
        image, target_m = image.to(device, non_blocking=True), target_m.to(device, non_blocking=True)
        losses.append(backward(model, image, target_m, config))
        now_s = time.monotonic() - clock
        if stop:
            now_s = -now_s  # the leader's negative time tells the team that this was the last step
        if team.size > 1:
            now_s = team.average_gradients(model.parameters(), state.step, now_s)
        stopping, now_s = now_s < 0.0, abs(now_s)
        update(model, optimizer, scheduled_rate(config.learning_rate, spent))
        state = TrainingState(state.step + 1, state.images_seen + stage.batch, now_s)
        if state.step % 20 == 0:
            if team.leads:
                log(config.out, state, loss=float(torch.stack(losses).mean()))
            losses.clear()
        if team.leads and (stopping or now_s >= end_s or now_s - saved_at_s > CHECKPOINT_EVERY_S):
            if not stopping:
                judge(config, model, validation, stage, state)
            write(config, "last", model, state, optimizer=optimizer.state_dict())
            saved_at_s = now_s


def judge(
    config: TrainingConfig, model: DepthNet, validation: Shards, stage: Stage, state: TrainingState
) -> None:
    """Log the validation errors; in the last stage, whose errors are comparable, keep the best network."""
    errors = validate(model, validation, stage, config.precision)
    log(config.out, state, **errors)
    if math.isinf(stage.until):
        keep_best(config, model, state, errors)


def optimizer_of(model: DepthNet, config: TrainingConfig) -> torch.optim.Optimizer:
    """Return Adam over the whole network."""
    return torch.optim.Adam(model.parameters(), lr=config.learning_rate, fused=True)


def backward(model: DepthNet, image: Tensor, target_m: Tensor, config: TrainingConfig) -> Tensor:
    """Compute the gradients of one batch in the model; return the loss, detached."""
    model.train()
    with torch.autocast(image.device.type, torch.bfloat16, enabled=config.precision == "bf16"):
        depths_m = model(image)
    loss = supervised_loss(depths_m, target_m, image, config.loss)
    model.zero_grad(set_to_none=True)
    loss.backward()
    return loss.detach()


def update(model: DepthNet, optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Take one step along the clipped gradients; none if they are not finite."""
    for group in optimizer.param_groups:
        group["lr"] = rate
    norm = torch.nn.utils.clip_grad_norm_(model.parameters(), GRADIENT_CLIP)
    if torch.isfinite(norm):
        optimizer.step()


def scheduled_rate(peak: float, spent: float) -> float:
    """Return the one-cycle learning rate after the share ``spent`` (0 to 1) of the budget."""
    if spent < RISE:
        return peak * (0.05 + 0.95 * spent / RISE)
    return peak * 0.5 * (1.0 + math.cos(math.pi * min(1.0, (spent - RISE) / (1.0 - RISE))))


@dataclass(frozen=True, slots=True)
class Batches(IterableDataset):
    """Endless augmented batches of one stage, different in every worker process."""

    data: Path
    stage: Stage
    images: int
    """Images per batch."""
    seed: tuple[int, ...]

    def __iter__(self) -> Iterator[tuple[Tensor, Tensor]]:
        worker = get_worker_info()
        rng = np.random.default_rng((*self.seed, worker.id if worker else 0))
        samples = endless_samples(self.data, rng)
        while True:
            yield collate(list(islice(samples, self.images)), self.stage)


def loader(config: TrainingConfig, stage: Stage, team: Team, step: int, device: torch.device) -> DataLoader:
    """Return a loader of this process's share of a stage's batches; on a GPU, worker processes load them."""
    on_gpu = device.type == "cuda"
    batches = Batches(config.data, stage, stage.batch // team.size, (config.seed, step, team.rank))
    workers = max(1, len(os.sched_getaffinity(0)) - 2) if on_gpu else 0
    return DataLoader(batches, batch_size=None, num_workers=workers, pin_memory=on_gpu)


def endless_samples(data: Path, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield augmented training images, each once per epoch; new shards are used from the next epoch on."""
    cv2.setNumThreads(0)
    shards = Shards(data, "train")
    while True:
        shards.refresh()
        for row in rng.permutation(len(shards)):
            yield augment(*shards[row], rng)


def collate(samples: list[tuple[np.ndarray, np.ndarray]], stage: Stage) -> tuple[Tensor, Tensor]:
    """Return images (N, 3, h, w) and targets (N, 1, h, w) in metres, both of a stage's size.

    Targets are NaN in the padding and beyond ``DEPTH_MIN_M`` and ``DEPTH_MAX_M``.
    """
    images = np.concatenate([normalised_input(rgb) for rgb, _ in samples])
    depth_m = np.stack([depth_m for _, depth_m in samples])
    rows = (images.shape[2] - depth_m.shape[1]) // 2
    depth_m = np.where((depth_m > DEPTH_MIN_M) & (depth_m < DEPTH_MAX_M), depth_m, np.nan)
    target = np.pad(depth_m, ((0, 0), (rows, rows), (0, 0)), constant_values=np.nan)[:, None]
    image = torch.nn.functional.interpolate(torch.from_numpy(images), stage.size_px, mode="area")
    target_m = torch.nn.functional.interpolate(torch.from_numpy(target.astype(np.float32)), stage.size_px)
    return image.contiguous(memory_format=torch.channels_last), target_m


@torch.no_grad()
def validate(
    model: DepthNet, shards: Shards, stage: Stage, precision: Precision = "bf16"
) -> dict[str, float]:
    """Return mean errors over evenly chosen validation images, at the stage's size."""
    model.eval()
    device = next(model.parameters()).device
    errors = []
    for sample in shards.evenly(VALIDATION_IMAGES):
        image, truth_m = collate([sample], stage)
        with torch.autocast(device.type, torch.bfloat16, enabled=precision == "bf16"):
            depth_m = model(image.to(device))[0]
        errors.append(depth_errors(depth_m.cpu().numpy(), truth_m.numpy()))
    return {
        f"val_{name}": float(np.mean([getattr(error, name) for error in errors]))
        for name in ("abs_rel", "rmse_m", "delta_1", "silog")
    }


def log(folder: Path, state: TrainingState, **values: float) -> None:
    """Append one line to ``log.jsonl`` and print it."""
    line = json.dumps(asdict(state) | values)
    with (folder / "log.jsonl").open("a") as stream:
        stream.write(line + "\n")
    print(line, flush=True)


def keep_best(
    config: TrainingConfig, model: DepthNet, state: TrainingState, errors: dict[str, float]
) -> None:
    """Replace ``out/best.pt`` if this network's AbsRel is lower."""
    file, best = config.out / "best.pt", math.inf
    if file.exists():
        best = torch.load(file, weights_only=True, map_location="cpu")["validation"]["val_abs_rel"]
    if errors["val_abs_rel"] < best:
        write(config, "best", model, state, validation=errors)


def resumable_parameters(config: TrainingConfig) -> int:
    """Return the number of parameters of the network in ``out/last.pt``.

    Raises:
        InputError: ``resume`` refuses it.
    """
    model = DepthNet(config.width)
    resume(config, model, optimizer_of(model, config))
    return sum(p.numel() for p in model.parameters())


def write(config: TrainingConfig, name: str, model: DepthNet, state: TrainingState, **more: object) -> None:
    """Replace the checkpoint ``name``.pt in ``out`` atomically; it also stores ``more``."""
    plain = asdict(replace(config, data=str(config.data), out=str(config.out)))  # type: ignore[arg-type]
    with atomic_path(config.out / f"{name}.pt") as temporary:
        torch.save({"model": model.state_dict(), "state": asdict(state), "config": plain, **more}, temporary)


def resume(config: TrainingConfig, model: DepthNet, optimizer: torch.optim.Optimizer) -> TrainingState:
    """Load ``out/last.pt`` into the model and the optimiser.

    Raises:
        InputError: it holds a network of another width or other initial weights.
    """
    file = config.out / "last.pt"
    checkpoint = torch.load(file, weights_only=True, map_location="cpu")
    for option in ("width", "initial"):
        saved, given = checkpoint["config"][option], getattr(config, option)
        if saved != given:
            raise InputError(
                f"{file} was started with {option} {saved}, not {given}: continue it with {saved}, "
                "or train into another folder."
            )
    model.load_state_dict(checkpoint["model"])
    optimizer.load_state_dict(checkpoint["optimizer"])
    return TrainingState(**checkpoint["state"])

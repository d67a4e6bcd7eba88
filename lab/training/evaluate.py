"""Errors of a network on held-out rooms, the demo scenes and real frames (SPEC 3.4); needs no torch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lab.training.dataset import FIRST_SEED, viewed_room
from lab.worlds.sensor import sense_depth
from pipeline.config import AlignmentMode
from pipeline.depth.alignment import align_depth
from pipeline.depth.inference import DepthNetwork
from pipeline.depth.metrics import depth_errors
from pipeline.io.demos import CALIBRATED_SCENES, load_demo
from pipeline.io.rigs import load_frame
from pipeline.types import ByteArray, DepthMap, FloatArray

FIRST_TEST_ROOM = FIRST_SEED["test"]
"""First seed of the test split's rooms."""
MODES: tuple[AlignmentMode, ...] = ("none", "median", "affine_depth", "affine_inverse", "local")
BLOCK_PX = 32
"""Side of the blocks of a real frame that align or evaluate."""
SHOWN = ("abs_rel", "rmse_m", "rmse_log", "delta_1", "silog")


@dataclass(frozen=True, slots=True)
class Example:
    """One image with the depth for its alignment and the depth for its evaluation."""

    rgb: ByteArray
    sensor: DepthMap
    """(H, W) depth that the alignment may use."""
    truth_m: FloatArray
    """(H, W) depth for the evaluation; NaN elsewhere."""


def evaluate(model: Path | None, real: Path | None, rooms: int) -> Iterator[str]:
    """Yield lines of a Markdown table of mean errors, by set of images and alignment mode.

    Args:
        model: ONNX file; None takes the one that ships.
        real: folder whose subfolders hold real frames (color.png, depth.png, intrinsics.json).
        rooms: number of held-out rooms, one view each.
    """
    network = DepthNetwork(model)
    yield "| images | depth | aligned by | AbsRel | in holes | RMSE m | RMSE log | delta 1 | SILog |"
    yield "|---|---|---|---|---|---|---|---|---|"
    seeds = range(FIRST_TEST_ROOM, FIRST_TEST_ROOM + rooms)
    examples = list(held_out_rooms(seeds, views=1))
    yield from rows(f"{rooms} held-out rooms", examples, network)
    for name in CALIBRATED_SCENES:
        yield from rows(f"demo {name}", list(demo(name)), network)
    for folder in sorted(real.iterdir()) if real else ():
        if (folder / "depth.png").exists():
            yield from rows(f"real {folder.name}", [real_frame(folder)], network)


def rows(title: str, examples: list[Example], network: DepthNetwork) -> Iterator[str]:
    """Yield two table lines for constant depth aligned with the sensor's, and one per mode of the network."""
    flat = [DepthMap(np.ones_like(example.truth_m)) for example in examples]
    for mode in ("median", "local"):
        yield row(f"| {title} | constant | {mode} |", examples, flat, mode)
    inferred = [network.infer(example.rgb) for example in examples]
    for mode in MODES:
        yield row(f"| {title} | network | {mode} |", examples, inferred, mode)


def row(start: str, examples: list[Example], inferred: list[DepthMap], mode: AlignmentMode) -> str:
    """Return one table line: errors averaged over images, AbsRel also where the sensor has no depth."""
    errors, in_holes = [], []
    for example, depth in zip(examples, inferred, strict=True):
        aligned_m = align_depth(depth, example.sensor, mode).depth.z_m
        hole_m = np.where(example.sensor.valid, np.nan, example.truth_m)
        errors.append(depth_errors(aligned_m, example.truth_m))
        in_holes.append(depth_errors(aligned_m, hole_m).abs_rel)
    mean = {name: np.mean([getattr(error, name) for error in errors]) for name in SHOWN}
    shown = [mean["abs_rel"], np.mean(in_holes), *(mean[name] for name in SHOWN[1:])]
    return f"{start} " + " | ".join(f"{value:.3f}" for value in shown) + " |"


def held_out_rooms(seeds: range, views: int) -> Iterator[Example]:
    """Yield ``views`` views at the network's size of each room, with simulated sensor depth.

    Args:
        seeds: the rooms; those of the test split start at ``FIRST_TEST_ROOM``.
        views: views per room, one after the other.
    """
    for seed in seeds:
        room = viewed_room(seed, None, threads=0, views=views)
        for intrinsics, T_world_camera in room.cameras:
            view = room.renderer.view(intrinsics, T_world_camera, "fast", room.rng)
            yield Example(view.rgb, sense_depth(view, intrinsics, room.rng), view.z_m)


def demo(name: str) -> Iterator[Example]:
    """Yield the nodes of a demo scene, evaluated against its true depth."""
    rig = load_demo(name)
    if rig.truth is not None:
        for frame, truth in zip(rig.frames, rig.truth.depth, strict=True):
            yield Example(frame.rgb, frame.depth, truth.z_m)


def real_frame(folder: Path) -> Example:
    """Return a real frame without truth: half of its 32-pixel blocks align, the other half evaluate."""
    frame = load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json")
    v, u = np.indices(frame.depth.z_m.shape) // BLOCK_PX
    seen = (u + v) % 2 == 0
    sensor_m = np.where(seen, frame.depth.z_m, np.nan)
    return Example(frame.rgb, DepthMap(sensor_m), np.where(seen, np.nan, frame.depth.z_m))

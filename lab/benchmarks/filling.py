"""Filling realistic holes: sensor depth is hidden, filled by us and by the obvious peers, and compared."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from lab.benchmarks.hidden_depth import hide
from lab.claims.depth.scenes import demo_scenes, held_out_scenes, load_real, real_folders
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, align_depth
from pipeline.depth.confidence import judge
from pipeline.depth.fillers import PEERS
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

OURS = "packetmesh"
HIDDEN_SHARE = 0.15
ROOMS, VIEWS = 5, 3
"""Of each held-out scene, and of each room."""
REAL_DRAWS = 10
"""How often another part of each real frame is hidden: there are few of them."""
CLOSE = 0.05
Filler = Callable[[DepthMap, ByteArray], DepthMap]


@dataclass(frozen=True, slots=True)
class HoleCase:
    """One image whose holes can be judged."""

    name: str
    group: str
    rgb: ByteArray
    """(H, W, 3)."""
    sensor: DepthMap
    """(H, W) what is left to fill from."""
    hole: BoolArray
    """(H, W) pixels to be filled and judged."""
    truth_m: FloatArray
    """(H, W) what judges there."""


@dataclass(frozen=True, slots=True)
class Filling:
    """One program's fillings of a group of images."""

    program: str
    group: str
    images: int
    abs_rel: float
    """Of the hole pixels it filled, all images pooled."""
    abs_rel_shared: float
    """Of the hole pixels that every program filled."""
    close_share: float
    """Of all hole pixels: filled within 5 % of what judges."""
    filled_share: float
    """Of all hole pixels."""
    median_error_m: float
    """Of the hole pixels that every program filled."""
    elapsed_s: float
    """Median for an image; ours infers, aligns and judges."""


def hidden_cases(seed: int = 0) -> Iterator[HoleCase]:
    """Every image of rooms, demo scenes and real frames with a part of the sensor's depth hidden.

    That very depth judges. Where the truth is known the images come a second time with nothing hidden: their
    sensor's own holes, judged by the truth.
    """
    for site in (*held_out_scenes(ROOMS, VIEWS), *demo_scenes()):
        for number, example in enumerate(site.examples()):
            place, sensor = f"{site.name}/{number}", example.sensor
            yield hidden_case(place, f"{site.group}, hidden", example.rgb, sensor, seed)
            hole = np.isfinite(example.truth_m) & ~sensor.valid
            yield HoleCase(place, f"{site.group}, own holes", example.rgb, sensor, hole, example.truth_m)
    for folder in real_folders():
        frame = load_real(folder)
        for draw in range(REAL_DRAWS):
            place = f"{frame.name}/{draw}"
            yield hidden_case(place, "real frames, hidden", frame.rgb, frame.depth, seed)


def hidden_case(name: str, group: str, rgb: ByteArray, depth: DepthMap, seed: int) -> HoleCase:
    """An image without a part of its sensor depth, which part is drawn from the seed and the name."""
    hole = hide(depth, np.random.default_rng([seed, *name.encode()]), HIDDEN_SHARE)
    left = DepthMap(np.where(hole, np.float32(np.nan), depth.z_m))
    return HoleCase(name, group, rgb, left, hole, depth.z_m)


def our_filling(network: DepthNetwork) -> Filler:
    """Inferred, aligned and trusted depth, as the chain makes it."""
    config = DepthConfig()

    def fill(sensor: DepthMap, rgb: ByteArray) -> DepthMap:
        aligned = align_depth(network.infer(rgb), sensor, config.alignment)
        return judge(aligned, sensor, rgb, config.reach, config.least_confidence).depth

    return fill


def compare_fillings(cases: Iterator[HoleCase], programs: dict[str, Filler]) -> tuple[Filling, ...]:
    """Every program over every case, summed up by group; the programs are warmed up on the first."""
    judged: dict[str, list[FloatArray]] = {}
    seconds: dict[tuple[str, str], list[float]] = {}
    for number, case in enumerate(cases):
        rows = []
        for name, fill in programs.items():
            if number == 0:
                fill(case.sensor, case.rgb)
            started = time.perf_counter()
            filled = fill(case.sensor, case.rgb)
            seconds.setdefault((case.group, name), []).append(time.perf_counter() - started)
            rows.append(filled.z_m[case.hole])
        judged.setdefault(case.group, []).append(np.vstack([case.truth_m[case.hole], *rows]))
    return tuple(
        filling
        for group, columns in judged.items()
        for filling in group_fillings(group, columns, {name: seconds[group, name] for name in programs})
    )


def group_fillings(
    group: str, columns: list[FloatArray], seconds: dict[str, list[float]]
) -> Iterator[Filling]:
    """Each program's measures over the hole pixels of a group.

    Args:
        group: its name.
        columns: of every image (1 + programs, N) true depth and fillings, metres, NaN where not filled.
        seconds: of every program, in the order of the rows, one for each image.
    """
    true_m, *fillings = np.hstack(columns).astype(np.float64)
    shared = np.isfinite(fillings).all(axis=0)
    for (name, elapsed_s), filled_m in zip(seconds.items(), fillings, strict=True):
        error_m = np.abs(filled_m - true_m)
        relative = error_m / true_m
        yield Filling(
            name,
            group,
            len(columns),
            float(np.nanmean(relative)),
            float(relative[shared].mean()),
            float((relative <= CLOSE).mean()),
            float(np.isfinite(filled_m).mean()),
            float(np.median(error_m[shared])),
            statistics.median(elapsed_s),
        )


def fillings(network: DepthNetwork) -> tuple[Filling, ...]:
    """Ours and every peer on held-out rooms, the demo scenes and the real frames there are, in one run."""
    return compare_fillings(hidden_cases(), {OURS: our_filling(network), **PEERS})

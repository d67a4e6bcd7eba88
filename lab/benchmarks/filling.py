"""Errors of hole filling: sensor depth is hidden, filled by us and by the usual peers, and compared."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from lab.benchmarks.hidden_depth import disc, hide
from lab.claims.claim import bootstrap_ci95
from lab.claims.depth.scenes import HELD_OUT, REAL, Site, demo_scenes, held_out_scenes, real_frames
from lab.training.evaluate import Example
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, align_depth, complete
from pipeline.depth.confidence import judge
from pipeline.depth.fillers import PEERS, nearest
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray, IntArray

OURS = "packetmesh"
NETWORK, FLAT, PIXELS = "colour network", "flat guess", "pixel baseline"
HIDDEN_SHARE = 0.15
ROOMS, VIEWS = 5, 3
"""Rooms of each held-out scene, and views of each room."""
REAL_DRAWS = 10
"""Number of times that different parts of each real frame are hidden, as there are few frames."""
RADII_PX = (10, 20, 40, 75, 120)
"""Radii of the hidden discs in images ``RADII_WIDTH_PX`` wide; scaled in others."""
RADII_WIDTH_PX = 640
CLOSE = 0.05
Filler = Callable[[DepthMap, ByteArray], DepthMap]


@dataclass(frozen=True, slots=True)
class HoleCase:
    """One image with holes whose depth is known."""

    place: str
    """Its room, demo scene or draw: the unit that intervals resample."""
    group: str
    rgb: ByteArray
    """(H, W, 3)."""
    sensor: DepthMap
    """(H, W) depth to fill from."""
    hole: BoolArray
    """(H, W) pixels to be filled and evaluated."""
    truth_m: FloatArray
    """(H, W) depth, metres; in the hole it is the reference."""
    measured: bool = True
    """True if the sensor measured the hole's depth, which was then hidden; False for its own holes."""


@dataclass(frozen=True, slots=True)
class Filling:
    """Results of one program on a group of images."""

    program: str
    group: str
    images: int
    abs_rel: float
    """AbsRel over all hole pixels of all images; empty ones take the nearest measured depth."""
    abs_rel_ci95: tuple[float, float]
    """95 % interval of ``abs_rel``, by resampling rooms, demo scenes, or draws of the real frames."""
    excess_ci95: tuple[float, float]
    """95 % interval of ``abs_rel`` minus that of our program on the same pixels; above 0 is worse."""
    abs_rel_filled: float
    """AbsRel over the filled hole pixels; NaN if none is filled."""
    close_share: float
    """Share of all hole pixels filled within 5 % of the reference."""
    filled_share: float
    """Share of all hole pixels that are filled."""
    median_error_m: float
    """Median over all hole pixels, with empty ones as in ``abs_rel``."""
    elapsed_s: float
    """Median time for an image; ours includes inference, alignment and judgement."""


def sites() -> tuple[Site, ...]:
    """Return the sites of the test: held-out rooms, the demo scenes and the available real frames."""
    return (*held_out_scenes(ROOMS, VIEWS), *demo_scenes(), *real_frames())


def hidden_cases(site: Site, seed: int = 0) -> Iterator[HoleCase]:
    """Yield every image of a site with a part of the sensor's depth hidden, real frames several times.

    The hidden depth is the reference. If the truth is known the images come a second time with nothing
    hidden: the sensor's own holes, with the truth as reference.
    """
    for place, rng, example in _drawn(site, seed):
        yield hidden_case(place, f"{site.group}, hidden", example.rgb, example.sensor, rng)
        if site.truth:
            hole = np.isfinite(example.truth_m) & ~example.sensor.valid
            yield HoleCase(
                place, f"{site.group}, own holes", example.rgb, example.sensor, hole, example.truth_m, False
            )


def disc_cases(site: Site, seed: int = 0) -> Iterator[HoleCase]:
    """Yield every image once for each size of disc that fits, with one such disc hidden as the reference."""
    for place, rng, example in _drawn(site, seed):
        yield from discs(place, site.group, example.rgb, example.sensor, rng)


def _drawn(site: Site, seed: int) -> Iterator[tuple[str, np.random.Generator, Example]]:
    """Yield every image with its place and the generator of its holes; views of one room are one place."""
    for number, example in enumerate(site.examples()):
        for draw in range(1 if site.truth else REAL_DRAWS):
            room = {HELD_OUT: f"/{number // VIEWS}", REAL: f"/{draw}"}.get(site.group, "")
            rng = np.random.default_rng([seed, draw, *f"{site.name}/{number}".encode()])
            yield f"{site.name}{room}", rng, example


def hidden_case(
    place: str, group: str, rgb: ByteArray, depth: DepthMap, rng: np.random.Generator
) -> HoleCase:
    """Return an image without a part of its sensor depth."""
    return without(hide(depth, rng, HIDDEN_SHARE), place, group, rgb, depth)


def discs(
    place: str, group: str, rgb: ByteArray, depth: DepthMap, rng: np.random.Generator
) -> Iterator[HoleCase]:
    """Yield an image without the depth in a disc, for every radius of ``RADII_PX`` that fits."""
    for radius_px in RADII_PX:
        hole = disc(depth, radius_px * depth.z_m.shape[1] / RADII_WIDTH_PX, rng)
        if hole is not None:
            yield without(hole, place, f"{group}, disc of {radius_px} px", rgb, depth)


def without(hole: BoolArray, place: str, group: str, rgb: ByteArray, depth: DepthMap) -> HoleCase:
    """Return an image whose depth in (H, W) ``hole`` is hidden and is the reference."""
    left = DepthMap(np.where(hole, np.float32(np.nan), depth.z_m))
    return HoleCase(place, group, rgb, left, hole, depth.z_m)


def chain_filling(infer: Callable[[ByteArray], DepthMap], completes: bool) -> Filler:
    """Return a filler that works as the chain does on the depth of ``infer``, with or without completion."""
    config = DepthConfig(least_confidence=0.0)  # every hidden pixel counts

    def fill(sensor: DepthMap, rgb: ByteArray) -> DepthMap:
        aligned = align_depth(infer(rgb), sensor, config.alignment)
        completed = complete(sensor, rgb) if completes else None
        return judge(aligned, sensor, rgb, config.reach, config.least_confidence, completed).depth

    return fill


def flat(rgb: ByteArray) -> DepthMap:
    """Return a depth of 1 m everywhere, to show what alignment and judgement alone achieve."""
    return DepthMap(np.ones(rgb.shape[:2], np.float32))


def pixel_filling(network: DepthNetwork) -> Filler:
    """Return a filler that maps inferred depth by one robust line through the sensor's pixels (SPEC 4.6)."""
    return lambda sensor, rgb: align_depth(network.infer(rgb), sensor, "affine_depth").depth


def programs(network: DepthNetwork) -> dict[str, Filler]:
    """Return all compared programs; a new one is one line more."""
    return {
        OURS: chain_filling(network.infer, completes=True),
        NETWORK: chain_filling(network.infer, completes=False),
        FLAT: chain_filling(flat, completes=False),
        PIXELS: pixel_filling(network),
        **PEERS,
    }


def compare_fillings(cases: Iterable[HoleCase], programs: dict[str, Filler]) -> tuple[Filling, ...]:
    """Run every program on every case, and sum up by group.

    Every program runs twice on the first case, where the second run counts. The first program must be ours.
    """
    judged: dict[str, list[tuple[str, FloatArray]]] = {}
    seconds: dict[tuple[str, str], list[float]] = {}
    for number, case in enumerate(cases):
        rows = [case.truth_m[case.hole], nearest(case.sensor, case.rgb).z_m[case.hole]]
        for name, fill in programs.items():
            if number == 0:
                fill(case.sensor, case.rgb)
            started = time.perf_counter()
            filled = fill(case.sensor, case.rgb)
            seconds.setdefault((case.group, name), []).append(time.perf_counter() - started)
            rows.append(filled.z_m[case.hole])
        judged.setdefault(case.group, []).append((case.place, np.vstack(rows)))
    return tuple(
        filling
        for group, images in judged.items()
        for filling in group_fillings(group, images, {name: seconds[group, name] for name in programs})
    )


def group_fillings(
    group: str, images: list[tuple[str, FloatArray]], seconds: dict[str, list[float]]
) -> Iterator[Filling]:
    """Yield each program's measures over the hole pixels of a group.

    Args:
        group: name of the group.
        images: the place of every image, and (2 + programs, N) true depth, nearest measured depth and
            fillings, metres, NaN where not filled.
        seconds: times of every program, in the order of the rows, one per image.
    """
    _, numbers = np.unique([place for place, _ in images], return_inverse=True)
    places = np.repeat(numbers, [columns.shape[1] for _, columns in images])
    true_m, nearest_m, *filled_by = np.hstack([columns for _, columns in images]).astype(np.float64)
    errors_m = [np.abs(np.where(np.isfinite(z_m), z_m, nearest_m) - true_m) for z_m in filled_by]
    first = errors_m[0] / true_m
    for (name, elapsed_s), filled_m, error_m in zip(seconds.items(), filled_by, errors_m, strict=True):
        filled, relative = np.isfinite(filled_m), error_m / true_m
        yield Filling(
            name,
            group,
            len(images),
            float(relative.mean()),
            mean_ci95(relative, places),
            mean_ci95(relative - first, places),
            float(relative[filled].mean()) if filled.any() else float("nan"),
            float((filled & (relative <= CLOSE)).mean()),
            float(filled.mean()),
            float(np.median(error_m)),
            statistics.median(elapsed_s),
        )


def mean_ci95(values: FloatArray, places: IntArray) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of the mean of (N,) values over whole places, numbered from 0."""
    sums = np.stack([np.bincount(places, values), np.bincount(places).astype(float)], axis=1)
    return bootstrap_ci95(sums, statistic=lambda sums, axis: np.divide(*sums.sum(axis=axis).T))


def fillings(network: DepthNetwork) -> tuple[Filling, ...]:
    """Run all programs on all cases."""
    cases = (make(site) for make in (hidden_cases, disc_cases) for site in sites())
    return compare_fillings(chain.from_iterable(cases), programs(network))

"""A disc of sensor depth is hidden, filled in several ways, and compared with what was measured there."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from functools import partial

import numpy as np

from app.depthwords import BLANK, MEASURED, OURS, PEER_NAMES
from app.jobs.chain import prepared, rig_of
from app.jobs.depth_records import FillRow, HiddenView, HideWish
from app.jobs.pictures import depth_picture, depth_range_m
from app.jobs.records import Picture
from app.jobs.store import Store
from app.state import Spec
from pipeline.config import DepthConfig
from pipeline.depth import align_depth
from pipeline.depth.trust import judge
from pipeline.errors import InputError
from pipeline.experiments.depth.peers import PEERS
from pipeline.progress import Progress
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

LEAST_HIDDEN_PX = 50
WITHIN = 0.05
"""Relative error up to which a filled pixel counts as right."""
AROUND = 2.5
"""Side of the part that is shown, in diameters of the disc."""
SHOWN_PX = 480


def hide_job(store: Store, spec: Spec, wish: HideWish) -> Generator[Progress, None, HiddenView]:
    """Hide a disc of one node's sensor depth, align without it, fill it, and measure.

    Raises:
        InputError: the node does not exist, or nothing is measured in the disc.
    """
    rig = yield from rig_of(store, spec)
    work = yield from prepared(store, spec)
    if not 0 <= wish.node < len(rig.frames):
        raise InputError(f"There is no node {wish.node}, only {len(rig.frames)} of them; choose one anew.")
    frame, node = rig.frames[wish.node], work.nodes[wish.node]
    disc = hidden_disc(frame.depth, wish)
    rest = DepthMap(np.where(disc, np.float32(np.nan), frame.depth.z_m))
    ways: dict[str, Callable[[], DepthMap]] = {
        OURS: partial(
            believed, node.inferred_depth, rest, frame.rgb, spec.config.depth, node.alignment.disparity
        ),
        **{PEER_NAMES.get(name, name): partial(peer, rest, frame.rgb) for name, peer in PEERS.items()},
    }
    rows, maps = [], {MEASURED: frame.depth, BLANK: rest}
    for index, (name, fill) in enumerate(ways.items()):
        yield Progress(f"filling the hidden disc: {name}", (index + 1) / (len(ways) + 1))
        started = time.perf_counter()
        filled_m = fill().z_m
        elapsed_s = time.perf_counter() - started
        maps[name] = DepthMap(np.where(disc, filled_m, frame.depth.z_m).astype(np.float32))
        rows.append(fill_row(name, filled_m[disc], frame.depth.z_m[disc], elapsed_s))
    return HiddenView(wish, frame.name, int(disc.sum()), tuple(rows), _pictures(maps, frame.depth, wish))


def hidden_disc(sensor: DepthMap, wish: HideWish) -> BoolArray:
    """(H, W) the measured pixels of the disc.

    Raises:
        InputError: there are fewer than 50.
    """
    rows, columns = sensor.z_m.shape
    y, x = np.ogrid[:rows, :columns]
    u, v, radius = _disc_px(sensor, wish)
    disc = ((x - u) ** 2 + (y - v) ** 2 <= radius**2) & sensor.valid
    if disc.sum() < LEAST_HIDDEN_PX:
        raise InputError(
            f"Only {disc.sum()} pixels of this disc are measured, and the test takes {LEAST_HIDDEN_PX}: "
            "move it off the holes or make it larger."
        )
    return disc


def believed(
    inferred: DepthMap, rest: DepthMap, rgb: ByteArray, config: DepthConfig, disparity: bool = False
) -> DepthMap:
    """The inferred depth as it is aligned and believed without knowing what is hidden."""
    alignment = align_depth(inferred, rest, config.alignment, disparity)
    return judge(alignment, rest, rgb, config.reach, config.least_confidence).depth


def fill_row(name: str, filled_m: FloatArray, measured_m: FloatArray, elapsed_s: float) -> FillRow:
    """The errors of (N,) filled depths, NaN where nothing was filled."""
    relative = np.abs(filled_m.astype(float) - measured_m) / measured_m
    known = np.isfinite(relative)
    return FillRow(
        name=name,
        abs_rel=float(relative[known].mean()) if known.any() else float("nan"),
        within_share=float(np.mean(known & (np.nan_to_num(relative) < WITHIN))),
        filled_share=float(known.mean()),
        elapsed_s=elapsed_s,
    )


def _disc_px(sensor: DepthMap, wish: HideWish) -> tuple[float, float, float]:
    """Centre u, v and radius."""
    rows, columns = sensor.z_m.shape
    return wish.x_share * (columns - 1), wish.y_share * (rows - 1), 0.5 * wish.size_share * columns


def _pictures(maps: dict[str, DepthMap], sensor: DepthMap, wish: HideWish) -> dict[str, Picture]:
    """The disc and its surroundings, all in the colours of what was measured there."""
    rows, columns = sensor.z_m.shape
    u, v, radius = _disc_px(sensor, wish)
    half = AROUND * radius
    window = (
        slice(max(0, int(v - half)), min(rows, int(v + half) + 1)),
        slice(max(0, int(u - half)), min(columns, int(u + half) + 1)),
    )
    range_m = depth_range_m(DepthMap(sensor.z_m[window]))
    return {
        name: _enlarged(depth_picture(DepthMap(depth.z_m[window]), range_m, name.capitalize()))
        for name, depth in maps.items()
    }


def _enlarged(picture: Picture) -> Picture:
    """Whole pixels grow to squares, so that nothing is blurred."""
    times = max(1, SHOWN_PX // max(picture.rgb.shape[:2]))
    rgb = picture.rgb.repeat(times, axis=0).repeat(times, axis=1)
    return Picture(rgb, picture.caption, picture.bar)

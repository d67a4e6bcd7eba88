"""The job that hides a part of the sensor depth, fills it in several ways, and measures the errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from app.compute.records import Picture
from app.compute.state import Spec
from app.compute.store import Store
from app.drawing.pictures import depth_picture, depth_range_m
from app.screens.depth.discs import covered, window_around
from app.screens.depth.view import Disc, FillRow, HiddenView, HideRequest
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.config import DepthConfig
from pipeline.depth import align_depth, completed_by
from pipeline.depth.confidence import judge
from pipeline.depth.fillers import PEERS
from pipeline.types import BoolArray, ByteArray, DepthMap, FloatArray

LEAST_HIDDEN_PX = 50
WITHIN = 0.05
"""Relative error up to which a filled pixel counts as correct."""
SHOWN_PX = 480
"""Length up to which the longer side of a picture is enlarged."""


def hide_job(store: Store, spec: Spec, request: HideRequest) -> Generator[Progress, None, HiddenView]:
    """Hide discs of one node's sensor depth, align without them, fill them, and measure the errors.

    Raises:
        InputError: the node does not exist, or fewer than 50 pixels in the discs are measured.
    """
    rig, nodes = yield from store.stages(spec, "rig", "nodes")
    if not 0 <= request.node < len(rig.frames):
        raise InputError(
            f"There is no node {request.node} among the {len(rig.frames)} nodes; choose another node."
        )
    frame, node = rig.frames[request.node], nodes[request.node]
    hidden = hidden_pixels(frame.depth, request.discs)
    rest = DepthMap(np.where(hidden, np.float32(np.nan), frame.depth.z_m))
    filled_by = partial(
        accepted_depth, node.network.depth, rest, frame.rgb, disparity=node.alignment.disparity, hidden=hidden
    )
    config = spec.config.depth
    shipped = replace(config, completion=None, fill="completion")
    ways: dict[str, Callable[[], DepthMap]] = {
        "ours": partial(filled_by, config),
        **({"shipped": partial(filled_by, shipped)} if config.completion is not None else {}),
        "network": partial(filled_by, replace(config, fill="network")),
        **{name: partial(peer, rest, frame.rgb) for name, peer in PEERS.items()},
    }
    rows, maps = [], {"measured": frame.depth, "hidden": rest}
    for index, (name, fill) in enumerate(ways.items()):
        yield Progress(f"filling the hidden depth: {name}", (index + 1) / (len(ways) + 1))
        started = time.perf_counter()
        filled_m = fill().z_m
        elapsed_s = time.perf_counter() - started
        maps[name] = DepthMap(np.where(hidden, filled_m, frame.depth.z_m).astype(np.float32))
        rows.append(fill_row(name, filled_m[hidden], frame.depth.z_m[hidden], elapsed_s))
    return HiddenView(
        request, frame.name, int(hidden.sum()), tuple(rows), _pictures(maps, frame.depth, request.discs)
    )


def hidden_pixels(sensor: DepthMap, discs: Sequence[Disc]) -> BoolArray:
    """Return (H, W) the measured pixels of all discs.

    Raises:
        InputError: there are fewer than 50.
    """
    rows, columns = sensor.z_m.shape
    y, x = np.ogrid[:rows, :columns]
    hidden = covered(discs, x, y, columns, rows) & sensor.valid
    if hidden.sum() < LEAST_HIDDEN_PX:
        raise InputError(
            f"Only {hidden.sum()} pixels under the brush are measured, and the test needs "
            f"{LEAST_HIDDEN_PX}: move it off the holes, make it larger or paint more."
        )
    return hidden


def accepted_depth(
    inferred: DepthMap,
    rest: DepthMap,
    rgb: ByteArray,
    config: DepthConfig,
    disparity: bool = False,
    hidden: BoolArray | None = None,
) -> DepthMap:
    """Return the inferred depth that these settings accept.

    Args:
        inferred: (H, W) output of the depth network.
        rest: (H, W) sensor depth without the hidden part.
        rgb: (H, W, 3) colours.
        config: the settings.
        disparity: whether the network infers 1/depth.
        hidden: (H, W) True where measured depth was hidden; None: nowhere.
    """
    alignment = align_depth(inferred, rest, config.alignment, disparity)
    completed = completed_by(config, rest, rgb) if config.completes else None
    return judge(alignment, rest, rgb, config.reach, config.least_confidence, completed, hidden).depth


def fill_row(name: str, filled_m: FloatArray, measured_m: FloatArray, elapsed_s: float) -> FillRow:
    """Return the errors of (N,) filled depths, NaN where nothing was filled, against (N,) measured ones."""
    relative = np.abs(filled_m.astype(float) - measured_m) / measured_m
    known = np.isfinite(relative)
    return FillRow(
        name=name,
        abs_rel=float(relative[known].mean()) if known.any() else float("nan"),
        within_share=float(np.mean(known & (np.nan_to_num(relative) < WITHIN))),
        filled_share=float(known.mean()),
        elapsed_s=elapsed_s,
    )


def _pictures(maps: dict[str, DepthMap], sensor: DepthMap, discs: Sequence[Disc]) -> dict[str, Picture]:
    """Draw the discs and their surroundings, all with the colour scale of the measured depth."""
    rows, columns = sensor.z_m.shape
    window = window_around(discs, columns, rows)
    range_m = depth_range_m(DepthMap(sensor.z_m[window]))
    return {
        name: _enlarged(depth_picture(DepthMap(depth.z_m[window]), range_m)) for name, depth in maps.items()
    }


def _enlarged(picture: Picture) -> Picture:
    """Enlarge whole pixels to squares, so that nothing is blurred."""
    times = max(1, SHOWN_PX // max(picture.rgb.shape[:2]))
    rgb = picture.rgb.repeat(times, axis=0).repeat(times, axis=1)
    return Picture(rgb, picture.caption, picture.bar)

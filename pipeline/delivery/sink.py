"""Frames of nodes as the sink knows them, from the received bytes (SPEC 6.4, 6.5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.delivery.coding import DepthArray, Images, Received
from pipeline.kernels.masks import nearest_colors
from pipeline.types import DepthMap, RgbdFrame

UNITS_PER_M = (1000.0, 5000.0, 10_000.0, 256.0, 100.0)
"""Units per metre of depth cameras: the first that represents all depths of an image exactly is used."""
MOST_UNITS = np.iinfo(np.uint16).max
LEAST_DEPTH_SHARE = 0.02
"""Least share of pixels with depth, measured or coarse, for a node to be used."""
LEAST_MEASURED_SHARE = 0.003
"""Least share of pixels with measured depth for a node to be used: a tile in an image of 640 x 480."""


def units_per_m(depth: DepthMap) -> float:
    """Return the units per metre in which a depth image has integer values; millimetres if there are none."""
    z_m = depth.z_m[depth.valid].astype(np.float64)
    for units in UNITS_PER_M:
        counts = np.rint(z_m * units)
        if counts.max(initial=0.0) <= MOST_UNITS and np.array_equal(
            (counts / units).astype(np.float32), depth.z_m[depth.valid]
        ):
            return units
    return UNITS_PER_M[0]


def images_of(frame: RgbdFrame) -> Images:
    """Return the images that a node sends of a frame: colour unchanged, depth in integer units.

    Raises:
        InputError: a depth exceeds 16 bits.
    """
    units = units_per_m(frame.depth)
    counts = np.rint(np.where(frame.depth.valid, frame.depth.z_m, 0.0).astype(np.float64) * units)
    if counts.max(initial=0.0) > MOST_UNITS:
        raise InputError(
            f"{frame.name} measures up to {counts.max() / units:.1f} m, but 16 bits in millimetres end at "
            f"{MOST_UNITS / units:.1f} m; try another depth scale"
        )
    return Images(np.ascontiguousarray(frame.rgb), counts.astype(np.uint16))


def frame_at_sink(frame: RgbdFrame, received: Received) -> RgbdFrame:
    """Return the received frame: unknown depth is invalid, unknown colour is filled in for the depth network.

    Args:
        frame: the node's frame, of which the sink knows everything except the images.
        received: the decoded images.
    """
    known, units = received.rgb_known, units_per_m(frame.depth)
    return replace(
        frame,
        rgb=received.rgb if known.all() else nearest_colors(received.rgb, known),
        depth=_depth_map(received.depth, units),
        rgb_known=None if known.all() else known,
        coarse=_depth_map(received.coarse, units) if received.coarse.any() else None,
    )


def heard(frame: RgbdFrame) -> bool:
    """Return whether enough of a frame's depth has arrived to place its points.

    Coarse depth places them, too, but a surface needs points that were measured.
    """
    known = frame.depth.valid if frame.coarse is None else frame.depth.valid | frame.coarse.valid
    return frame.depth.coverage >= LEAST_MEASURED_SHARE and float(known.mean()) >= LEAST_DEPTH_SHARE


def _depth_map(counts: DepthArray, units: float) -> DepthMap:
    """Convert counts to depth, bit for bit as ``pipeline.io.images.read_depth`` does."""
    z_m = (counts / units).astype(np.float32)
    z_m[counts == 0] = np.nan
    return DepthMap(z_m)

"""Realistic holes: sensor depth hidden in the shapes in which that sensor loses it (SPEC 3.5)."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.types import BoolArray, DepthMap, IntArray

MIN_HOLE_PX = 4
LARGEST_HOLE = 0.05
"""Larger holes (share of the image) are outside the sensor's view, not shapes to move."""
EDGE_STEP = 1.08
"""Ratio of the depths within 5 x 5 pixels that makes a depth edge."""
BLOB_RADII = (0.015, 0.05)
"""Least and largest half axis of a blob, in shares of the image's diagonal."""
LARGEST_SHARE = 0.9
"""Largest share of the measured pixels that can be hidden."""
LEAST_OF_DISC = 0.8
"""Least share of a disc's pixels that have depth to hide."""
MOST_MISSES = 100
"""Consecutive shapes that hide nothing new, after which no more are drawn."""


def hide(sensor: DepthMap, rng: np.random.Generator, share: float) -> BoolArray:
    """Return pixels with sensor depth to hide, so that their filling can be measured.

    Half of the hidden pixels have the shapes of the frame's own holes, all equally often, mirrored at random
    and moved anywhere; the other half are elliptic blobs on depth edges, where structured light fails most
    and filling is hard. A frame without holes gets blobs only, one without depth edges shapes only, and one
    with neither, or with too few edges for the share, gets blobs anywhere.

    Args:
        sensor: (H, W) depth with its own holes.
        rng: draws shapes and places.
        share: share of the pixels with depth to hide, above 0 and at most 0.9; the last shape may exceed it.

    Returns:
        (H, W) True for hidden pixels, all of which have depth.

    Raises:
        InputError: ``share`` is out of range, or no pixel has depth.
    """
    if not 0.0 < share <= LARGEST_SHARE:
        raise InputError(f"A share of {share} of the depth cannot be hidden; try 0.15.")
    valid = sensor.valid
    if not valid.any():
        raise InputError("The sensor depth has no valid pixel to hide; use another frame.")
    shapes, edges = hole_shapes(valid), depth_edges(sensor)
    wanted_px = max(1, round(share * int(valid.sum())))
    hidden = np.zeros(valid.shape, bool)
    if shapes:
        part_px = wanted_px // 2 if edges.any() else wanted_px
        stamp(hidden, valid, np.argwhere(valid), lambda: moved(shapes, rng), part_px, rng)
    for places in (edges, valid):
        if places.any():
            stamp(hidden, valid, np.argwhere(places), lambda: blob(valid.shape, rng), wanted_px, rng)
    return hidden


def disc(sensor: DepthMap, radius_px: float, rng: np.random.Generator) -> BoolArray | None:
    """Return the pixels with depth in a random disc.

    The disc is inside the image and has depth in at least four fifths of its pixels.

    Args:
        sensor: (H, W) depth with its own holes.
        radius_px: radius of the disc.
        rng: draws its place, evenly among all possible ones.

    Returns:
        (H, W) True for pixels to hide; None if there is no place.
    """
    reach_px = int(radius_px)
    across = np.arange(-reach_px, reach_px + 1)
    shape = (across[:, None] ** 2 + across**2 <= radius_px**2).astype(np.float32)
    if min(sensor.valid.shape) < len(shape):
        return None
    share = cv2.filter2D(sensor.valid.astype(np.float32), -1, shape / shape.sum())
    inside = np.s_[reach_px : share.shape[0] - reach_px, reach_px : share.shape[1] - reach_px]
    places = np.argwhere(share[inside] >= LEAST_OF_DISC)
    if not len(places):
        return None
    top, left = places[rng.integers(len(places))]
    hidden = np.zeros(sensor.valid.shape, bool)
    hidden[top : top + len(shape), left : left + len(shape)] = shape > 0.0
    return hidden & sensor.valid


def hole_shapes(valid: BoolArray) -> list[BoolArray]:
    """Return the holes of 4 pixels to 5 % of the image, each as a mask of its bounding box.

    The margin around the bounding box of all valid pixels is no hole.
    """
    field = cv2.boundingRect(valid.astype(np.uint8))
    inside = valid[field[1] : field[1] + field[3], field[0] : field[0] + field[2]]
    count, labels, boxes, _ = cv2.connectedComponentsWithStats((~inside).astype(np.uint8), connectivity=8)
    shapes = []
    for label in range(1, count):
        left, top, width, height, area_px = boxes[label]
        if MIN_HOLE_PX <= area_px <= LARGEST_HOLE * valid.size:
            shapes.append(labels[top : top + height, left : left + width] == label)
    return shapes


def depth_edges(sensor: DepthMap) -> BoolArray:
    """Return (H, W) pixels with depth whose 5 x 5 neighbours' depths differ by more than 8 %."""
    window = np.ones((5, 5), np.uint8)
    nearest_m = cv2.erode(np.where(sensor.valid, sensor.z_m, np.inf).astype(np.float32), window)
    farthest_m = cv2.dilate(np.where(sensor.valid, sensor.z_m, 0.0).astype(np.float32), window)
    return sensor.valid & (nearest_m < farthest_m / EDGE_STEP)


def stamp(
    hidden: BoolArray,
    valid: BoolArray,
    places: IntArray,
    draw: Callable[[], BoolArray],
    wanted_px: int,
    rng: np.random.Generator,
) -> None:
    """Add drawn shapes to ``hidden`` (in place) until it has ``wanted_px`` pixels.

    Stops early after a hundred consecutive shapes that hide nothing new.

    Args:
        hidden: (H, W) pixels hidden so far.
        valid: (H, W) pixels that can be hidden.
        places: (N, 2) row and column of the pixels on which shapes may be centred.
        draw: returns a shape, True where it hides.
        wanted_px: number of hidden pixels to reach.
        rng: draws the places.
    """
    count_px, misses = int(hidden.sum()), 0
    while count_px < wanted_px and misses < MOST_MISSES:
        shape = draw()
        top, left = places[rng.integers(len(places))] - np.array(shape.shape) // 2
        rows = slice(max(0, -top), min(shape.shape[0], hidden.shape[0] - top))
        columns = slice(max(0, -left), min(shape.shape[1], hidden.shape[1] - left))
        there = (slice(top + rows.start, top + rows.stop), slice(left + columns.start, left + columns.stop))
        fresh = shape[rows, columns] & valid[there] & ~hidden[there]
        hidden[there] |= fresh
        count_px += int(fresh.sum())
        misses = 0 if fresh.any() else misses + 1


def moved(shapes: list[BoolArray], rng: np.random.Generator) -> BoolArray:
    """Return a random one of the shapes, mirrored at random left to right and upside down."""
    flips = rng.choice([-1, 1], 2)
    return shapes[rng.integers(len(shapes))][:: flips[0], :: flips[1]]


def blob(size_px: tuple[int, int], rng: np.random.Generator) -> BoolArray:
    """Return the mask of a random ellipse with half axes of 1.5 to 5 % of the (H, W) image's diagonal."""
    axes_px = np.hypot(*size_px) * rng.uniform(*BLOB_RADII, 2)
    reach_px = int(np.ceil(axes_px.max()))
    y, x = np.mgrid[-reach_px : reach_px + 1, -reach_px : reach_px + 1]
    angle = rng.uniform(0.0, np.pi)
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    return (along / axes_px[0]) ** 2 + (across / axes_px[1]) ** 2 <= 1.0

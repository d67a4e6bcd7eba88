"""A recording as a rig: the average of a camera that stands, or the map of one that walks (SPEC 10)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from packetmesh.progress import Progress, part
from pipeline.acquisition.planes import inverse_depth
from pipeline.config import MOST_AVERAGED
from pipeline.importing.recorded import DepthView
from pipeline.io.depth_to_color import register_depth
from pipeline.kernels.geometry import apply, inverse, is_pinhole, pixel_rays, project
from pipeline.recording.recording import Recording, read_ahead, spread
from pipeline.recording.still import Vote, voted
from pipeline.recording.tracking import REPORTED
from pipeline.recording.walk import LEAST_FRAMES, iterate_walk
from pipeline.types import Averaging, ByteArray, DepthMap, FloatArray, RgbdFrame, Rig, Walk

COMPARED = 12
"""Frames that are compared with the first one, evenly chosen."""
SIDE_PX = 8
"""Side of the squares of pixels whose mean depth is compared."""
KNOWN, WITHIN_SD = 0.5, 1.0
"""Least share of a square's pixels that both frames measured, and largest change of their mean depth at rest,
in standard deviations of one pixel: the change of a square's mean has a sixth of it."""
AT_REST = 0.5
"""Least share of the squares that do not change: with Kinect's noise, walks have .4 and less after three
frames, and the frames of a real SR300 .9 until it begins to move."""
SMALL_PX, TEXTURED, ALIKE = 160, 4.0, 0.7
"""Width at which photographs are compared; least standard deviation of a square with texture, grey levels;
least correlation of a square that does not change. A slide without a turn shows in the photographs only."""
CLIPPED_SD = 6.0
"""Largest change of one pixel that counts, in standard deviations."""
MOVED_M = 0.1
"""Given positions farther apart are those of a walk: along a corridor the images may not change."""
PHOTOGRAPHS = 3
"""Photographs of which the median colour is taken: an object that is in one of them only is left out."""
READERS = 2
"""Threads that read depth images: decoding takes longer than their processing."""
LEAST_RESTING = 3
"""Fewest frames at rest that are worth averaging."""
NAME = "camera"
"""Name of the node."""


def iterate_recording(recording: Recording, frames: int = MOST_AVERAGED) -> Generator[Progress, None, Rig]:
    """Turn a recording into a rig, of one node if the camera stands; else its path is tracked.

    Args:
        recording: the frames.
        frames: number of frames that are averaged if the camera stands; if it is below ``MOST_AVERAGED``, the
            camera need not stand after them.

    Raises:
        InputError: as ``iterate_walk``.
    """
    yield Progress("comparing frames", 0.0)
    if not stands(recording, frames):
        rig = yield from iterate_walk(recording)
        return rig if rig.walk is None else replace(rig, walk=_with_rest_note(recording, rig.walk))
    steps = iterate_still(recording, frames)
    frame = yield from part(steps, "a camera that stands", 0.0, 1.0, detail=True)
    return Rig(recording.name, (frame,))


def stands(recording: Recording, frames: int = MOST_AVERAGED) -> bool:
    """Return whether the camera is at rest: in every compared frame most squares of the first one keep their
    distance, and those of its photograph their texture. Frames without depth are not compared.

    Args:
        recording: the frames.
        frames: number of the first frames that are judged if it is below ``MOST_AVERAGED``; else all are.
    """
    count = len(recording.times_s)
    count = min(count, max(frames, LEAST_FRAMES)) if frames < MOST_AVERAGED else count
    if count < LEAST_FRAMES or _walks_by_poses(recording, count):
        return False
    compared = read_ahead(recording, spread(range(count), COMPARED + 1), READERS)
    views = [view for _, view in compared if view.depth.valid.any()]
    shares = [unchanged_share(views[0], other) for other in views[1:]]
    return bool(shares) and min(shares) >= AT_REST and _same_photographs(recording, count)


def _with_rest_note(recording: Recording, walk: Walk) -> Walk:
    """Return a walk with a note on its first frames if it has one keyframe and began at rest."""
    if len(walk.keyframes) > 1:
        return walk
    resting, moving = 1, min(len(recording.times_s), MOST_AVERAGED)
    while moving - resting > 1:
        middle = (resting + moving) // 2
        resting, moving = (middle, moving) if stands(recording, middle) else (resting, middle)
    if resting < LEAST_RESTING:
        return walk
    note = (
        f"The camera hardly moved, and stood in the first {resting} frames: "
        f"`--set recording.frames={resting}` averages these instead of tracking all"
    )
    return replace(walk, notes=(*walk.notes, note))


def _same_photographs(recording: Recording, count: int) -> bool:
    """Return whether a few of the first photographs show the same; those that cannot be read are left out."""
    small = []
    for number in spread(range(count), PHOTOGRAPHS + 1):
        with suppress(InputError):
            small.append(_small(recording.frame(number).rgb))
    return all(alike_share(small[0], other) >= AT_REST for other in small[1:])


def _small(rgb: ByteArray) -> FloatArray:
    """Return an (h, w) grey image ``SMALL_PX`` wide, in which noise is averaged."""
    height_px = round(rgb.shape[0] * SMALL_PX / rgb.shape[1])
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32)
    small: FloatArray = cv2.resize(grey, (SMALL_PX, height_px), interpolation=cv2.INTER_AREA)
    return small


def alike_share(first: FloatArray, other: FloatArray) -> float:
    """Return the share of the first grey image's textured squares that correlate with the other's.

    A change of exposure does not matter. It is 1 without texture, and 0 for other sizes.
    """
    if first.shape != other.shape:
        return 0.0
    one, two = (_squares(image) for image in (first, other))
    one, two = (squares - squares.mean(axis=1, keepdims=True) for squares in (one, two))
    textured = one.std(axis=1) >= TEXTURED
    if not textured.any():
        return 1.0
    lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
    correlation = np.einsum("sp,sp->s", one, two) / np.maximum(lengths, 1e-6)
    return float(np.mean(correlation[textured] >= ALIKE))


def _walks_by_poses(recording: Recording, count: int) -> bool:
    """Return whether given poses of the first frames are apart; their convention does not matter."""
    poses = (recording.T_world_camera or ())[:count]
    at_m = np.array([T[:3, 3] for T in poses if T is not None]).reshape(-1, 3)
    return len(at_m) > 0 and float(np.linalg.norm(at_m - at_m[0], axis=1).max()) > MOVED_M


def unchanged_share(first: DepthView, other: DepthView) -> float:
    """Return the share of the first view's squares with unchanged mean 1/z; 0 if the sizes differ."""
    shape = first.depth.z_m.shape
    if shape != other.depth.z_m.shape:
        return 0.0
    inverse_first, inverse_other = inverse_depth(first.depth), inverse_depth(other.depth)
    known = _squares(inverse_first > 0.0)
    both = known & _squares(inverse_other > 0.0)
    z_m = 1.0 / np.where(inverse_first > 0.0, inverse_first, np.inf)
    sd = first.noise.sd_m(np.maximum(z_m, 1e-6)) * inverse_first**2
    change = _squares((inverse_other - inverse_first) / np.where(sd > 0.0, sd, np.inf))
    total = np.where(both, np.clip(change, -CLIPPED_SD, CLIPPED_SD), 0.0).sum(axis=1)
    seen, counts = known.mean(axis=1) >= KNOWN, both.sum(axis=1)
    same = (both.mean(axis=1) >= KNOWN) & (np.abs(total) <= WITHIN_SD * counts)
    return float(same[seen].mean()) if seen.any() else 0.0


def _squares(image: NDArray[Any]) -> NDArray[Any]:
    """Return (squares, pixels of one) of an (H, W) image, without incomplete squares at its rims."""
    rows, columns = (length // SIDE_PX for length in image.shape)
    cut = image[: rows * SIDE_PX, : columns * SIDE_PX].reshape(rows, SIDE_PX, columns, SIDE_PX)
    return cut.transpose(0, 2, 1, 3).reshape(rows * columns, SIDE_PX**2)


def iterate_still(recording: Recording, frames: int) -> Generator[Progress, None, RgbdFrame]:
    """Average the first frames with depth of a camera that stands; colours are the median of three of them.

    Raises:
        InputError: no frame has depth, no photograph can be read, or nothing keeps its depth.
    """
    available = min(len(recording.times_s), MOST_AVERAGED)
    numbers, stack, view = yield from _iterate_stack(recording, min(frames, available))
    yield Progress(f"averaging {len(numbers)} frames", 0.9)
    vote = voted(stack, view.noise)
    if not vote.depth.valid.any():
        raise InputError(f"No pixel of {recording.name} keeps its depth; try recording.frames=1")
    photographs = _photographs(recording, numbers)
    depth, sd_m = _on_color(vote, view, photographs[0])
    shares = float(vote.moving.mean()), float(vote.flickering.mean())
    averaging = Averaging(sd_m, len(numbers), available, *shares)
    sentence = _sentence(averaging, len(recording.times_s))
    notes = (*recording.notes, sentence, *photographs[0].notes)
    rgb = _median_color([frame.rgb for frame in photographs])
    return replace(photographs[0], name=NAME, rgb=rgb, depth=depth, averaging=averaging, notes=notes)


def _iterate_stack(
    recording: Recording, count: int
) -> Generator[Progress, None, tuple[list[int], FloatArray, DepthView]]:
    """Read the first ``count`` frames with depth; returns N numbers, (N, H, W) 1/z and the first view."""
    numbers: list[int] = []
    for k, view in read_ahead(recording, range(len(recording.times_s)), READERS):
        if k % REPORTED == 0:
            yield Progress(f"reading frame {k}", 0.9 * len(numbers) / count)
        if k == 0:
            stack = np.zeros((count, *view.depth.z_m.shape), np.float32)
        if not numbers:
            first = view
        if view.depth.valid.any() and view.depth.z_m.shape == stack.shape[1:]:
            stack[len(numbers)] = inverse_depth(view.depth)
            numbers.append(k)
        if len(numbers) == count:
            break
    if not numbers:
        raise InputError(f"No frame of {recording.name} has depth; check its depth images and scale")
    return numbers, stack[: len(numbers)], first


def _photographs(recording: Recording, numbers: Sequence[int]) -> list[RgbdFrame]:
    """Read ``PHOTOGRAPHS`` of some frames, evenly chosen, without those that cannot be read.

    Raises:
        InputError: none of them can be read.
    """
    found, errors = list[RgbdFrame](), list[str]()
    for number in spread(numbers, PHOTOGRAPHS):
        try:
            found.append(recording.frame(number))
        except InputError as error:
            errors.append(f"frame {number} gives no colours: {error}")
    if not found:
        raise InputError(errors[0])
    return found


def _median_color(photographs: list[ByteArray]) -> ByteArray:
    """Return the (H, W, 3) median of photographs; the first one if there are fewer than ``PHOTOGRAPHS``."""
    if len(photographs) < PHOTOGRAPHS:
        return photographs[0]
    return np.median(photographs, axis=0).astype(np.uint8)


def _on_color(vote: Vote, view: DepthView, frame: RgbdFrame) -> tuple[DepthMap, FloatArray]:
    """Return depth and its (H, W) standard deviation on the pixel grid of a photograph."""
    camera = frame.intrinsics
    same = view.depth.z_m.shape == frame.rgb.shape[:2] and is_pinhole(camera)
    same = same and np.array_equal(view.camera.matrix, camera.matrix)
    if same and np.array_equal(view.T_color_depth, np.eye(4)):
        return vote.depth, vote.sd_m
    depth = register_depth(vote.depth, view.camera, camera, view.T_color_depth)
    rows, columns = np.nonzero(depth.valid)
    points_m = pixel_rays(camera)[rows, columns] * depth.z_m[rows, columns, None]
    own_m = apply(inverse(view.T_color_depth), points_m)
    u, v = np.rint(np.nan_to_num(project(view.camera, own_m), nan=-1.0)).astype(int).T
    inside = (u >= 0) & (u < view.camera.width_px) & (v >= 0) & (v < view.camera.height_px)
    sd_m = np.full(depth.z_m.shape, np.nan, np.float32)
    sd_m[rows[inside], columns[inside]] = vote.sd_m[v[inside], u[inside]]
    return depth, sd_m


def _sentence(averaging: Averaging, of: int) -> str:
    """Return what was averaged, and what share of the pixels moved and flickers."""
    verb = "was used" if averaging.frames == 1 else "were averaged"
    moving, flickering = 100.0 * averaging.moving_share, 100.0 * averaging.flickering_share
    return (
        f"The camera stands: {averaging.frames} of {of} frames {verb}; {moving:.1f} % of the pixels moved "
        f"and are left out, {flickering:.1f} % were measured in some, but less than a quarter, of the frames"
    )

"""The trials: the quality of a rig's surface if packets or pixels of its images are missing."""

from __future__ import annotations

import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from network_sim.config import LossConfig
from network_sim.radio.losses import LinkLosses
from packetmesh.errors import ReconstructionError
from packetmesh.progress import drain
from pipeline.config import AlignmentMode, DepthConfig, PipelineConfig
from pipeline.delivery import coding_named
from pipeline.delivery.coding import Received
from pipeline.delivery.sink import frame_at_sink, heard, images_of
from pipeline.io.demos import load_demo
from pipeline.placement.outcome import whole_placement
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import compared, run, with_rays, yardstick_of_rig
from pipeline.surface.truth import Yardstick
from pipeline.types import BoolArray, DepthMap, RgbdFrame, Rig

Loss = Literal["random", "burst", "deadline"]
"""Single packets, bursts of packets, or the last packets of each node, which come too late."""
When = Literal["before", "after"]
"""Before fusion: measured depth only; after it: with inferred depth."""
WHENS: tuple[When, ...] = ("before", "after")
BURST_PACKETS = 8.0
"""Mean length of a burst (SPEC 6.5)."""
PIECES = 4
"""Number of pieces along each side of a frame."""
COUNT_OF_PIECES = PIECES * PIECES

Values = dict[str, float | None]
"""Values of a trial by name; None for a missing value."""


@dataclass(frozen=True, slots=True)
class LossTask:
    """A rig's images, coded and sent once; a share of the packets is lost and not sent again."""

    rig: str
    """Name of a demo scene."""
    coding: str
    packet_bytes: int
    """Image bytes in a packet."""
    loss: Loss
    share: float
    """Expected share of lost packets; of ``deadline`` the exact share, up to rounding."""
    seed: int
    """Seed of the losses, which differ between rigs: equal seeds of two rigs are independent."""
    alignment: AlignmentMode = "local"
    """Method that makes inferred depth metric."""


@dataclass(frozen=True, slots=True)
class PieceTask:
    """A rig in which a piece of one node's depth image is missing."""

    rig: str
    node: int
    piece: int
    """Index of the piece, row by row."""


@dataclass(frozen=True, slots=True)
class SubsetTask:
    """A rig in which only some nodes send."""

    rig: str
    nodes: tuple[int, ...]


@cache
def demo(name: str) -> Rig:
    """Return a demo scene, read once per process."""
    return load_demo(name)


@cache
def yardstick(name: str) -> Yardstick | None:
    """Return the reference for a demo scene's surfaces."""
    return yardstick_of_rig(demo(name))


def loss_trial(task: LossTask) -> Values:
    """Encode a rig's images, drop packets, decode the others, and run the chain once on the result."""
    rig = demo(task.rig)
    frames, traffic = frames_left(rig, task)
    return rebuilt(rig, frames, task.alignment) | traffic


def frames_left(rig: Rig, task: LossTask) -> tuple[list[RgbdFrame], Values]:
    """Return the sink's frames after the losses; bytes sent and delivered; packets, and lost ones."""
    coding = coding_named(task.coding)
    streams = [np.frombuffer(coding.encode(images_of(f), task.packet_bytes), np.uint8) for f in rig.frames]
    counts = [-(-stream.size // task.packet_bytes) for stream in streams]
    if task.loss == "deadline":
        lost = [np.arange(count) >= round((1.0 - task.share) * count) for count in counts]
    else:
        losses = LossConfig(task.share, BURST_PACKETS if task.loss == "burst" else 1.0)
        lost = packets_lost(counts, losses, zlib.crc32(f"{task.rig} {task.seed}".encode()))
    frames, delivered = [], 0
    for frame, stream, gone in zip(rig.frames, streams, lost, strict=True):
        there = np.repeat(~gone, task.packet_bytes)[: stream.size]
        delivered += int(there.sum())
        left = np.where(there, stream, 0)
        received = coding.decode(left, there, frame.rgb.shape[:2], task.packet_bytes)
        frames.append(frame_at_sink(frame, received))
    return frames, {
        "bytes_sent": sum(stream.size for stream in streams),
        "bytes_delivered": delivered,
        "packets": sum(counts),
        "packets_lost": int(sum(gone.sum() for gone in lost)),
    }


def packets_lost(counts: Sequence[int], losses: LossConfig, seed: int) -> list[BoolArray]:
    """Return which packets of each node are lost on its own link to the sink, by ``network_sim``'s model.

    Args:
        counts: number of packets of each node.
        losses: share and length of bursts.
        seed: seed of the links.
    """
    links, sink = LinkLosses(losses, seed), len(counts)
    return [
        np.array([links.lost(node, sink) for _ in range(count)], bool) for node, count in enumerate(counts)
    ]


def colorless_trial(rig_name: str) -> Values:
    """Run the chain with all depth of a rig and no colour."""
    rig = demo(rig_name)
    depth_only = [
        replace(Received.nothing(frame.rgb.shape[:2]), depth=images_of(frame).depth) for frame in rig.frames
    ]
    return rebuilt(rig, [frame_at_sink(*both) for both in zip(rig.frames, depth_only, strict=True)])


def piece_trial(task: PieceTask) -> Values:
    """Run the chain without one piece of one node's depth, but with its colour."""
    rig = demo(task.rig)
    frames = list(rig.frames)
    z_m = frames[task.node].depth.z_m.copy()
    z_m[piece_area(z_m.shape, task.piece)] = np.nan
    frames[task.node] = replace(frames[task.node], depth=DepthMap(z_m))
    return rebuilt(rig, frames)


def piece_area(shape: tuple[int, ...], piece: int) -> tuple[slice, slice]:
    """Return the rows and columns of a piece in an image of (H, W) pixels."""
    row, column = divmod(piece, PIECES)
    rows, columns = (np.linspace(0, size, PIECES + 1).astype(int) for size in shape)
    return slice(rows[row], rows[row + 1]), slice(columns[column], columns[column + 1])


def subset_trial(task: SubsetTask) -> Values:
    """Run the chain with only some nodes' images."""
    rig = demo(task.rig)
    nothing = [
        frame_at_sink(frame, Received.nothing(frame.rgb.shape[:2])) if i not in task.nodes else frame
        for i, frame in enumerate(rig.frames)
    ]
    return rebuilt(rig, nothing)


def rebuilt(rig: Rig, frames: Sequence[RgbdFrame], alignment: AlignmentMode = "local") -> Values:
    """Run the chain on the frames at the sink and compare the surface with the rig's truth.

    Args:
        rig: the complete demo scene with its truth.
        frames: arrived data of every node.
        alignment: method that makes inferred depth metric.

    Returns:
        For the surface ``before`` (of measured depth) and ``after`` fusion: ``f`` (F-score at 5 cm),
        ``no_hit`` (share of the rays of all cameras without a surface), ``hole_area_m2`` and
        ``median_depth_error_m``; the number of nodes that were ``heard``; and ``core_s``, CPU seconds.
        If nothing can be rebuilt, F-scores are 0, all rays hit nothing, and other values are None.
    """
    started = time.process_time()
    present = [index for index, frame in enumerate(frames) if heard(frame)]
    values: Values = {"heard": len(present)}
    for when in WHENS:
        values |= {f"f_{when}": 0.0, f"no_hit_{when}": 1.0}
        values |= {f"hole_area_m2_{when}": None, f"median_depth_error_m_{when}": None}
    arrived = Rig(rig.name, tuple(frames[index] for index in present))
    spec = Spec(LoadedRig(arrived), config=PipelineConfig(depth=DepthConfig(alignment=alignment)))
    try:
        results = drain(run(spec, stages=("placement", "before", "after"))) if present else {}
    except ReconstructionError:  # a handful of points has no surface
        results = {}
    if results:
        placement = whole_placement(rig, present, results["placement"].value)
        for when in WHENS:
            surface = results[when].value
            if len(present) < len(frames):
                surface = with_rays(surface, rig, placement)
            truth = compared(rig, placement, surface, yardstick(rig.name))
            if truth is not None:
                values[f"f_{when}"] = truth["f_score_5cm"]
                values[f"no_hit_{when}"] = surface.quality.no_hit_ray_share
                values[f"hole_area_m2_{when}"] = surface.quality.hole_area_m2
                values[f"median_depth_error_m_{when}"] = truth["median_depth_error_m"]
    return values | {"core_s": time.process_time() - started}

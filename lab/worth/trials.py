"""The trials: the surface of the first tiles of an order, and when the sink has them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np

from lab.between_cameras.rigs import rig_named, wrong_poses
from lab.between_cameras.trials import base_views, images_of_rig, yardstick
from lab.claims.delivery.network import patient
from network_sim.config import NetworkConfig
from network_sim.metrics.arrivals import Arrivals, arrivals, until
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import to_s
from packetmesh.errors import PacketMeshError, ReconstructionError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.config import PipelineConfig
from pipeline.delivery import CODINGS, coarse
from pipeline.delivery.base_points import BaseView
from pipeline.delivery.base_poses import place_by_base
from pipeline.delivery.left_out import grid_of, without_tiles
from pipeline.delivery.memory import Memory, places_by_depth
from pipeline.delivery.plan import network_of, placed
from pipeline.delivery.protected import ends_in_stream, first_bytes
from pipeline.delivery.sending import packet_bytes_of
from pipeline.delivery.shared_views import shared_views
from pipeline.delivery.sink import frame_at_sink, heard
from pipeline.delivery.tiled import TILE, Pieces, Tiled, own_order
from pipeline.delivery.worth import order_by_worth, order_bytes
from pipeline.io.demos import load_demo
from pipeline.placement.outcome import whole_placement
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import compared, run, with_rays
from pipeline.types import BoolArray, FloatArray, IntArray, RgbdFrame, Rig

CODING = CODINGS["exact"]
TURN_DEG, SHIFT_M = 2.0, 0.05
"""Error of the given poses of the held-out rooms; the demo rooms' given poses are off by as much."""
LEVELS = (0.015, 0.06, 0.12, 0.22, 0.4, 0.65, 1.0)
"""Shares of each node's bytes of depth at which the surface is measured, as few as bisection needs; between
two of them the F-score is interpolated."""
TARGETS = (0.95, 0.99)
"""Shares of the F-score without losses."""
NETWORKS = ("office", "thesis-link")
LOSSES = (0.0, 0.01, 0.1)
BURST_PACKETS = 8
SEEDS = range(5)
OWN, RANDOM, WORTH = "own", "random", "worth"

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Task:
    """One rig and the orders in which its tiles are sent."""

    rig: str
    """A demo scene, or ``room-SEED``."""
    orders: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Node:
    """The tiles that one node sends, with their sizes."""

    pieces: Pieces
    order: IntArray
    """Its depth tiles in order of sending."""
    sizes: IntArray
    """(T,) bytes of its depth tiles, row after row."""

    def tiles_until(self, share: float) -> int:
        """Return how many tiles of the order hold a share of the bytes of depth."""
        ends = np.cumsum(self.sizes[self.order])
        return int(np.searchsorted(ends, share * ends[-1] - 1e-9)) + 1

    def missing_after(self, share: float, grid: tuple[int, int]) -> BoolArray:
        """Return (rows, columns) the tiles that are missing after a share of the bytes of depth."""
        missing = np.ones(self.sizes.size, np.bool_)
        missing[self.order[: self.tiles_until(share)]] = False
        return missing.reshape(grid)

    def end_bytes(self, share: float, packet_bytes: int) -> tuple[int, int]:
        """Return the bytes of its stream until a share of the bytes of depth, and all of its stream."""
        coding = _coding()
        stream = len(coding.joined(self.pieces, packet_bytes, depth_order=self.order))
        body = int(np.cumsum(self.sizes[self.order])[self.tiles_until(share) - 1])
        end = ends_in_stream(self.pieces.base, stream, packet_bytes, coding.repair_every, body)
        return end, stream


def _coding() -> Tiled:
    assert isinstance(CODING, Tiled)
    return CODING


@cache
def believed(name: str) -> Rig:
    """Return a rig at its given poses, which are off."""
    if not name.startswith("room-"):
        return load_demo(name)
    rig = rig_named(name)
    poses = wrong_poses(rig, TURN_DEG, SHIFT_M)
    frames = (replace(frame, T_world_camera=T) for frame, T in zip(rig.frames, poses, strict=True))
    return replace(rig, frames=tuple(frames))


def judged(task: Task) -> list[Row]:
    """Return one row for each order, target, network, loss and seed of a rig."""
    name, rig = task.rig, believed(task.rig)
    pieces = [_coding().pieces(images) for images in images_of_rig(name)]
    surface = Surface(rig)
    whole = surface.f_score(rig.frames)
    rows: list[Row] = []
    for order, orders in _orders(rig, pieces).items():
        if order not in task.orders:
            continue
        nodes = [
            Node(one, row, np.array([len(tile) for tile in one.depth]))
            for one, row in zip(pieces, orders, strict=True)
        ]
        scores: dict[float, float] = {}
        score = partial(_score, surface, nodes, scores)
        shares = [first_share(score, target * whole) for target in TARGETS]
        row: Row = {"rig": name, "order": order, "f_score": whole, "scores": sorted(scores.items())}
        rows += [row | cost for cost in _costs(rig, nodes, shares, order == WORTH)]
    return rows


def first_share(score: Callable[[float], float], least: float) -> float | None:
    """Return the smallest share at which a score that rises with it is at least ``least``.

    Bisects ``LEVELS``, and interpolates between two of them; None if all of the depth is not enough.
    """
    if score(LEVELS[0]) >= least:
        return LEVELS[0]
    low, high = 0, len(LEVELS)
    while high - low > 1:
        middle = (low + high) // 2
        if score(LEVELS[middle]) >= least:
            high = middle
        else:
            low = middle
    if high == len(LEVELS):
        return None
    before, after = score(LEVELS[low]), score(LEVELS[high])
    return LEVELS[low] + (least - before) / (after - before) * (LEVELS[high] - LEVELS[low])


class Surface:
    """Surfaces of one rig from different parts of its images; what depends on colour alone is kept."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._memory = Memory(places_by_depth(PipelineConfig(), rig))

    def f_score(self, frames: Sequence[RgbdFrame]) -> float:
        """Return the F-score at 5 cm of the frames' surface; 0 without a surface."""
        present = [index for index, frame in enumerate(frames) if heard(frame)]
        if not present:
            return 0.0
        self._memory.look_at([frames[index] for index in present])
        spec = Spec(LoadedRig(Rig(self.rig.name, tuple(frames[index] for index in present))))
        try:
            results = drain(run(spec, self._memory, ("placement", "after")))
        except ReconstructionError:
            return 0.0
        placement = whole_placement(self.rig, present, results["placement"].value)
        surface = with_rays(results["after"].value, self.rig, placement)
        truth = compared(self.rig, placement, surface, yardstick(self.rig.name))
        return 0.0 if truth is None else truth["f_score_5cm"]


def _score(surface: Surface, nodes: Sequence[Node], known: dict[float, float], share: float) -> float:
    """Return the F-score with a share of each node's bytes of depth and the base layers, without colour."""
    if share not in known:
        frames = []
        images_of_nodes = images_of_rig(surface.rig.name)
        for frame, images, node in zip(surface.rig.frames, images_of_nodes, nodes, strict=True):
            grid = grid_of(images.depth.shape, TILE)
            received = without_tiles(images, node.missing_after(share, grid))
            shape = (images.depth.shape[0], images.depth.shape[1])
            small = coarse.read_color(coarse.write_color(images.rgb), shape)
            frames.append(frame_at_sink(frame, replace(received, rgb=small)))
        known[share] = surface.f_score(frames)
    return known[share]


def _orders(rig: Rig, pieces: Sequence[Pieces]) -> dict[str, list[IntArray]]:
    """Return each node's depth tiles in each order."""
    rng = np.random.default_rng([7, *rig.name.encode()])
    count = len(pieces[0].depth)
    views = base_views(rig, [frame.T_world_camera for frame in rig.frames])
    sizes = [np.array([len(tile) for tile in one.depth]) for one in pieces]
    grids = [grid_of(images.depth.shape, TILE) for images in images_of_rig(rig.name)]
    shown = _shown(rig, views)
    worth = [
        order_by_worth(view, size.reshape(grid), own_order(count), mask).order
        for view, size, grid, mask in zip(views, sizes, grids, shown, strict=True)
    ]
    return {
        OWN: [own_order(count) for _ in pieces],
        WORTH: worth,
        RANDOM: [rng.permutation(count) for _ in pieces],
    }


def _shown(rig: Rig, views: Sequence[BaseView]) -> Sequence[BoolArray | None]:
    """Return the tiles that other cameras show, at poses registered by the base layers."""
    colors = [
        coarse.read_color(coarse.write_color(images.rgb), (images.rgb.shape[0], images.rgb.shape[1]))
        for images in images_of_rig(rig.name)
    ]
    try:
        placement = place_by_base(views, colors)
    except PacketMeshError:
        return [None] * len(views)
    poses: dict[int, FloatArray] = dict(
        placement.placed(list(zip(range(len(views)), placement.T_world_camera, strict=True)))
    )
    found = shared_views([replace(views[index], T_world_camera=T) for index, T in poses.items()]).leave_out
    by_index = dict(zip(poses, found, strict=True))
    return [by_index.get(index) for index in range(len(views))]


def _costs(rig: Rig, nodes: Sequence[Node], shares: Sequence[float | None], requested: bool) -> list[Row]:
    """Return the bytes, seconds and joules until the sink has each share of all depth; None is everything."""
    rows: list[Row] = []
    for name in NETWORKS:
        packet_bytes = packet_bytes_of(PRESETS[name])
        sizes = [node.end_bytes(1.0, packet_bytes)[1] for node in nodes]
        ends = [
            sizes if share is None else [node.end_bytes(share, packet_bytes)[0] for node in nodes]
            for share in shares
        ]
        first = [first_bytes(node.pieces.base, packet_bytes) for node in nodes] if requested else []
        requests = [order_bytes(int((node.sizes > 0).sum())) for node in nodes] if requested else []
        for loss in LOSSES:
            for seed in SEEDS:
                burst = f"loss.burst_packets={BURST_PACKETS}"
                changed = with_settings(PRESETS[name], [f"loss.share={loss}", burst, f"run.seed={seed}"])
                network = placed(rig, patient(changed), range(len(nodes)))
                spent = _spent(network_of(rig, sizes, network, first, requests), ends)
                run_of: Row = {"network": name, "loss": loss, "seed": seed, "request_bytes": sum(requests)}
                for target, share, end, cost in zip(TARGETS, shares, ends, spent, strict=True):
                    what = {"target": target, "share": share, "image_bytes": sum(end)}
                    rows.append(run_of | what | cost)
    return rows


def _spent(network: NetworkConfig, ends: Sequence[Sequence[int]]) -> list[Row]:
    """Return the cost until the sink has as many bytes of each node as each of ``ends`` says.

    Lost packets are sent again at the end; bytes that come in their place count for them. Empty if the bytes
    never come.
    """
    trace = simulate(network)
    came = arrivals(trace)
    rows: list[Row] = []
    for end in ends:
        times_ns = [_time_ns(came, node, size) for node, size in enumerate(end)]
        if None in times_ns:
            rows.append({"air_bytes": None, "seconds": None, "joules": None})
            continue
        last_ns = max(time_ns for time_ns in times_ns if time_ns is not None)
        spent = until(trace, last_ns)
        joules = float(spent.radio_j + spent.platform_j)
        rows.append({"air_bytes": int(spent.sent_bytes), "seconds": to_s(last_ns), "joules": joules})
    return rows


def _time_ns(came: Arrivals, node: int, size: int) -> int | None:
    """Return when the sink has had ``size`` bytes of a node; None if it never has."""
    mine = came.node == node
    total = np.cumsum(came.byte_count[mine])
    at = int(np.searchsorted(total, size))
    return int(came.t_ns[mine][at]) if at < len(total) else None

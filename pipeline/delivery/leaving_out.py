"""A delivery in which the sink requests the nodes' tiles by their base layers (SPEC 13.2, 13.3).

Every node first sends its base layer. When the sink has those of all nodes, it registers the cameras by them
and finds the tiles that another camera shows. It sends each node one bit a tile for those that are left out,
or the order of the tiles by what they add to the surface, or both; the node then sends them.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from network_sim.config import NetworkConfig
from network_sim.metrics.requests import Requested, requested
from network_sim.simulate import simulate
from network_sim.trace.log import NetworkTrace
from network_sim.types import to_s
from packetmesh.errors import InputError, PacketMeshError
from pipeline.config import PipelineConfig
from pipeline.delivery import coarse
from pipeline.delivery.base_points import BaseView
from pipeline.delivery.base_poses import place_by_base
from pipeline.delivery.coding import Images
from pipeline.delivery.left_out import all_tiles, base_view, grid_of
from pipeline.delivery.plan import network_of
from pipeline.delivery.protected import MOST_UNIT_BYTES, first_bytes
from pipeline.delivery.shared_views import SharedViews, request_bytes, shared_views
from pipeline.delivery.sink import images_of, units_per_m
from pipeline.delivery.tiled import TILE, Pieces, Tiled, own_order
from pipeline.delivery.worth import Worth, order_by_worth, order_bytes
from pipeline.types import BoolArray, ByteArray, IntArray, Rig

ONLY_CODING = "exact"
Order = Literal["own", "worth"]
"""Order of a node's depth tiles: that of the coding, or that of ``worth``, which the sink requests."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Tiles that a rig's nodes did not send because another camera shows them, and how that was decided."""

    tiles: tuple[BoolArray, ...]
    """(rows, columns) of each node's depth tiles, True for those left out."""
    whole_bytes: tuple[int, ...]
    """Bytes of each node's images with all tiles."""
    left_out_bytes: tuple[int, ...]
    """How many of them were left out."""
    request_bytes: tuple[int, ...]
    """Bytes of the sink's request to each node, without headers."""
    requested_s: float | None
    """Time of these requests; None if the sink has sent none, because nothing arrived."""
    base_arrived: tuple[bool, ...]
    """Whether the sink had a node's base layer when it decided; without it, the node sends all."""
    placed: tuple[bool, ...]
    """Whether the sink knew the pose of a node's camera from the base layers; else the node sends all."""
    answered: tuple[bool, ...]
    """Whether a node has received its request; without it, it has sent its base layer only."""
    shown_by: IntArray
    """(N, N) number of tiles that node i left out and node j shows, in whole or in part."""

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of tiles that each node left out."""
        return tuple(int(mask.sum()) for mask in self.tiles)


@dataclass(frozen=True, slots=True)
class Ordered:
    """The order of depth tiles that the sink requested of a rig's nodes, and how it was decided."""

    worth: tuple[Worth | None, ...]
    """Of each node; None if its base layer was late or lost: it sends its tiles in the coding's own order."""
    request_bytes: tuple[int, ...]
    """Bytes of the order in the sink's request to each node, without headers."""
    requested_s: float | None
    """Time of these requests; None if the sink has sent none, because nothing arrived."""
    answered: tuple[bool, ...]
    """Whether a node has received its request; without it, it has sent its base layer only."""


@dataclass(frozen=True, slots=True)
class Sender:
    """A node that sends, as the sink and the node themselves know it."""

    images: Images
    pieces: Pieces
    view: BaseView
    """Its base layer at its given pose."""
    pose_known: bool


@dataclass(frozen=True, slots=True)
class Decision:
    """What the sink decides, by the senders' base layers that it has."""

    shared: SharedViews
    """The tiles that other cameras show, whether or not they are left out."""
    placed: tuple[bool, ...]
    worth: tuple[Worth | None, ...]
    """Order of each sender's tiles; None if its base layer is not there."""


@dataclass(frozen=True, slots=True)
class Sent:
    """Outcome of such a delivery."""

    streams: tuple[bytes, ...]
    """Of each node of the rig."""
    trace: NetworkTrace
    left_out: LeftOut | None
    """None if all tiles are sent."""
    ordered: Ordered | None
    """None if they are sent in the coding's own order."""


def check_can_request(coding: str, network: NetworkConfig, leave_out_seen: bool) -> None:
    """Check that a coding has tiles that can be requested, and that the sink can send nodes its request.

    Args:
        coding: name of the coding.
        network: the network.
        leave_out_seen: whether tiles are to be left out, or only to be put into another order.

    Raises:
        InputError: one of them does not allow it.
    """
    if coding != ONLY_CODING:
        what = (
            f"Tiles that another camera showed can be left out of the coding {ONLY_CODING} only"
            if leave_out_seen
            else f"The sink can request the order of tiles of the coding {ONLY_CODING} only"
        )
        raise InputError(f"{what}, not of {coding}; try --coding {ONLY_CODING}")
    kind = network.mac.kind
    if not network.mac.reaches_nodes:
        confirmed = " with mac.ack=true" if kind == "lora" else ""
        raise InputError(
            f"Over {kind}{confirmed} the sink sends nodes no packets in this model, so it cannot tell them "
            f"{'which tiles to leave out' if leave_out_seen else 'the order of their tiles'}; try another "
            "preset, such as thesis-link, office or greenhouse"
        )
    packet_bytes = network.nodes.payload_bytes - network.nodes.header_bytes
    if packet_bytes > MOST_UNIT_BYTES:
        raise InputError(
            f"Packets of {packet_bytes} bytes hold more than a base layer, so nothing is left to "
            f"{'leave out' if leave_out_seen else 'request'}; try nodes.payload_bytes of at most "
            f"{MOST_UNIT_BYTES}"
        )


def send_requested(
    rig: Rig,
    coding: Tiled,
    senders: Sequence[int],
    network: NetworkConfig,
    config: PipelineConfig,
    leave_out_seen: bool,
    order: Order,
) -> Sent:
    """Encode a rig's images and run the network, with the sink's requests.

    The run until the requests does not depend on them. So a first run shows which base layers the sink has
    then; if some are missing, the decision is made again without them, and the run repeated.

    Args:
        rig: the nodes.
        coding: coding of their images, with a base layer.
        senders: indices of the nodes that send, in their order in the network.
        network: network with the positions of these nodes.
        config: settings by which the sink registers the cameras.
        leave_out_seen: whether tiles that another camera shows are left out; else all are sent.
        order: order of the depth tiles; with ``worth`` those that another camera shows come last.

    Raises:
        InputError: tiles are to be left out and fewer than two nodes send, or the network cannot be used.
    """
    if leave_out_seen and len(senders) < 2:
        raise InputError(
            "Only one camera sends images, so no other camera can have shown its tiles; add a camera, or "
            "send all tiles"
        )
    packet_bytes = network.nodes.payload_bytes - network.nodes.header_bytes
    nodes = [_sender(rig, coding, node) for node in range(len(rig.frames))]
    sending = [nodes[node] for node in senders]
    part = Rig(rig.name, tuple(rig.frames[node] for node in senders))
    first = [first_bytes(node.pieces.base, packet_bytes) for node in sending]
    known: Set[int] = set(range(len(sending)))
    while True:
        decision = _decision(sending, known, config)
        if not leave_out_seen:
            decision = replace(decision, shared=_nothing_of(decision.shared))
        if order == "own":
            decision = replace(decision, worth=(None,) * len(sending))
        streams = [
            _stream(node, coding, packet_bytes, mask, worth)
            for node, mask, worth in zip(sending, decision.shared.leave_out, decision.worth, strict=True)
        ]
        trace = simulate(
            network_of(part, [len(stream) for stream in streams], network, first, _sizes(sending, decision))
        )
        asked = requested(trace)
        had = {node for node in known if asked.first_arrived[node]}
        if had == known:
            break
        known = had
    whole = [coding.joined(node.pieces, packet_bytes) for node in nodes]
    all_streams = list(whole)
    for node, stream in zip(senders, streams, strict=True):
        all_streams[node] = stream
    saved = [len(one) - len(other) for one, other in zip(whole, all_streams, strict=True)]
    return Sent(
        tuple(all_streams),
        trace,
        _left_out(nodes, senders, whole, saved, asked, decision) if leave_out_seen else None,
        _ordered(nodes, senders, asked, decision) if order == "worth" else None,
    )


def _nothing_of(shared: SharedViews) -> SharedViews:
    """Return the record of no tile left out."""
    return SharedViews(
        tuple(np.zeros_like(mask) for mask in shared.leave_out), np.zeros_like(shared.shown_by)
    )


def _stream(
    node: Sender, coding: Tiled, packet_bytes: int, leave_out: BoolArray, worth: Worth | None
) -> bytes:
    missing = tiles_of(leave_out, node.images.depth.shape, coding)
    return coding.joined(node.pieces, packet_bytes, missing, None if worth is None else worth.order)


def _sizes(sending: Sequence[Sender], decision: Decision) -> list[int]:
    """Return the bytes of the request to each sender."""
    masks = decision.shared.leave_out
    orders = [
        _order_bytes(node, mask, worth)
        for node, mask, worth in zip(sending, masks, decision.worth, strict=True)
    ]
    return [one + other for one, other in zip(request_bytes(masks), orders, strict=True)]


def _order_bytes(node: Sender, leave_out: BoolArray, worth: Worth | None) -> int:
    """Return the bytes of the order of the tiles that a node sends, without those that have no bytes."""
    if worth is None:
        return 0
    return order_bytes(int((~leave_out & (_tile_bytes(node) > 0)).sum()))


def _tile_bytes(node: Sender) -> IntArray:
    """Return (rows, columns) the bytes of a node's depth tiles, which its protected part lists."""
    sizes = np.array([len(tile) for tile in node.pieces.depth])
    return sizes.reshape(grid_of(node.images.depth.shape, TILE))


def tiles_of(mask: BoolArray, shape: tuple[int, ...], coding: Tiled) -> BoolArray:
    """Return (T,) the depth and colour tiles of an (H, W) image that are not sent."""
    return all_tiles(mask, grid_of(shape, coding.colors.side_px))


def _sender(rig: Rig, coding: Tiled, node: int) -> Sender:
    frame = rig.frames[node]
    images = images_of(frame)
    view = base_view(images, units_per_m(frame.depth), frame.intrinsics, frame.T_world_camera, frame.noise)
    return Sender(images, coding.pieces(images), view, frame.pose_known)


def _decision(sending: Sequence[Sender], known: Set[int], config: PipelineConfig) -> Decision:
    """Find the tiles that other cameras show and order all tiles, by the base layers that the sink has."""
    masks = [np.zeros(grid_of(node.images.depth.shape, TILE), np.bool_) for node in sending]
    shown_by = np.zeros((len(sending), len(sending)), np.int64)
    placed = _placed([sending[node] for node in sorted(known)], config)
    usable = [(node, view) for node, view in zip(sorted(known), placed, strict=True) if view is not None]
    if len(usable) > 1:
        shared = shared_views([view for _, view in usable])
        for row, (node, _) in enumerate(usable):
            masks[node] = shared.leave_out[row]
            shown_by[node, [other for other, _ in usable]] = shared.shown_by[row]
    found = {node for node, _ in usable}
    worth = [
        order_by_worth(node.view, _tile_bytes(node), own_order(len(node.pieces.depth)), mask)
        if index in known
        else None
        for index, (node, mask) in enumerate(zip(sending, masks, strict=True))
    ]
    placed_too = tuple(node in found for node in range(len(sending)))
    return Decision(SharedViews(tuple(masks), shown_by), placed_too, tuple(worth))


def _placed(nodes: Sequence[Sender], config: PipelineConfig) -> list[BaseView | None]:
    """Return the base layers at poses registered by them; None for cameras that could not be placed."""
    views = [node.view for node in nodes]
    if len(nodes) < 2:
        return [None] * len(nodes)
    try:
        colors = [_base_color(node.images) for node in nodes]
        placement = place_by_base(views, colors, config, [node.pose_known for node in nodes])
    except PacketMeshError:
        return [None] * len(nodes)
    found = placement.placed(list(zip(range(len(nodes)), placement.T_world_camera, strict=True)))
    at = dict(found)
    return [
        replace(view, T_world_camera=at[index]) if index in at else None for index, view in enumerate(views)
    ]


def _base_color(images: Images) -> ByteArray:
    return coarse.read_color(coarse.write_color(images.rgb), (images.rgb.shape[0], images.rgb.shape[1]))


def _left_out(
    nodes: Sequence[Sender],
    senders: Sequence[int],
    whole: Sequence[bytes],
    saved: Sequence[int],
    asked: Requested,
    decision: Decision,
) -> LeftOut:
    """Return what all nodes of the rig left out; ``asked`` and ``decision`` are of those that send."""
    tiles = [np.zeros(grid_of(node.images.depth.shape, TILE), np.bool_) for node in nodes]
    shown_by = np.zeros((len(nodes), len(nodes)), np.int64)
    shown_by[np.ix_(senders, senders)] = decision.shared.shown_by
    for mask, node in zip(decision.shared.leave_out, senders, strict=True):
        tiles[node] = mask
    row = {node: index for index, node in enumerate(senders)}

    def of_all(values: Sequence[bool]) -> tuple[bool, ...]:
        return tuple(node in row and values[row[node]] for node in range(len(nodes)))

    return LeftOut(
        tiles=tuple(tiles),
        whole_bytes=tuple(map(len, whole)),
        left_out_bytes=tuple(saved),
        request_bytes=request_bytes(tiles),
        requested_s=None if asked.requested_ns is None else to_s(asked.requested_ns),
        base_arrived=of_all(asked.first_arrived),
        placed=of_all(decision.placed),
        answered=of_all(asked.answered),
        shown_by=shown_by,
    )


def _ordered(
    nodes: Sequence[Sender], senders: Sequence[int], asked: Requested, decision: Decision
) -> Ordered:
    """Return the orders of all nodes of the rig; ``asked`` and ``decision`` are of those that send."""
    row = {node: index for index, node in enumerate(senders)}
    sent = [row.get(node) for node in range(len(nodes))]
    masks = decision.shared.leave_out
    return Ordered(
        worth=tuple(None if index is None else decision.worth[index] for index in sent),
        request_bytes=tuple(
            0 if index is None else _order_bytes(node, masks[index], decision.worth[index])
            for node, index in zip(nodes, sent, strict=True)
        ),
        requested_s=None if asked.requested_ns is None else to_s(asked.requested_ns),
        answered=tuple(index is not None and asked.answered[index] for index in sent),
    )

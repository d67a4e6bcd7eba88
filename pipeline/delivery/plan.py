"""Positions of a rig's nodes in a network, and the bytes that they send."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from network_sim.config import NetworkConfig
from network_sim.radio.places import place_nodes
from packetmesh.errors import InputError
from pipeline.types import FloatArray, Rig

SAME_PLACE_M = 1e-6
_NO_SIZES: dict[str, Any] = {
    "bytes_by_node": (),
    "first_bytes_by_node": (),
    "request_bytes_by_node": (),
    "image_times_s": (),
    "bytes_by_image": (),
}
"""Settings of one value for each node of another rig."""


def poses_known(rig: Rig) -> bool:
    """Return whether the nodes' positions differ; a rig without pose files has all nodes at one place."""
    places_m = np.array([frame.T_world_camera[:3, 3] for frame in rig.frames])
    return len(places_m) == 1 or bool(np.ptp(places_m, axis=0).max() > SAME_PLACE_M)


def check_collects(network: NetworkConfig) -> None:
    """Check that a network's nodes stand still.

    Raises:
        InputError: they are vehicles.
    """
    if network.scenario != "collection":
        raise InputError(
            f"A network of the scenario {network.scenario} has no cameras that stand still; try a preset "
            "such as office, thesis-link or greenhouse"
        )


def network_of(
    rig: Rig,
    sizes_bytes: Sequence[int],
    network: NetworkConfig,
    first_bytes: Sequence[int] = (),
    request_bytes: Sequence[int] = (),
) -> NetworkConfig:
    """Configure a network with the rig's cameras as nodes, each with one image to send.

    Nodes are at ``nodes.places_m`` if it is given; else at their cameras' x and y, with the sink
    ``nodes.spacing_m`` behind their centre; if the poses are unknown, by ``nodes.layout``. If some nodes of
    a rig are down, ``placed`` computes the positions of the others.

    Args:
        rig: one to 200 nodes; the world's third axis points up.
        sizes_bytes: bytes of each node's encoded images.
        network: a preset, or any other network that collects images from fixed nodes.
        first_bytes: bytes of each that it sends before it waits for a request; empty sends all at once.
        request_bytes: bytes of these requests.

    Raises:
        InputError: the network's nodes are vehicles, or the sink cannot send them requests.
    """
    check_collects(network)
    believed_places_m = places_of(rig, network.nodes.spacing_m) if poses_known(rig) else ()
    nodes = replace(
        network.nodes,
        count=len(rig.frames),
        images=1,
        interval_s=0.0,
        image_times_s=(),
        bytes_by_image=(),
        bytes_by_node=tuple(sizes_bytes),
        first_bytes_by_node=tuple(first_bytes),
        request_bytes_by_node=tuple(request_bytes),
        places_m=network.nodes.places_m or believed_places_m,
    )
    return replace(network, nodes=nodes, run=replace(network.run, keep="all", warmup_s=0.0))


def replaced_settings(network: NetworkConfig) -> dict[str, str]:
    """Return the reason for each setting of a network that ``network_of`` replaces."""
    image = (
        "in a delivery every node of the rig sends its own image, once, and the camera of a recording its "
        "keyframes, each at its own time"
    )
    own = (
        "nodes.images",
        "nodes.interval_s",
        "nodes.image_bytes",
        "nodes.depth_bytes",
        "nodes.bytes_by_node",
        "nodes.first_bytes_by_node",
        "nodes.request_bytes_by_node",
        "nodes.image_times_s",
        "nodes.bytes_by_image",
    )
    reasons = dict.fromkeys(own, image)
    reasons |= dict.fromkeys(("run.keep", "run.warmup_s"), "a delivery needs every event from the start")
    if not network.nodes.places_m:
        reasons["nodes.count"] = "the rig has the nodes; the camera of a recording is one"
    return reasons


def places_of(rig: Rig, spacing_m: float) -> tuple[float, ...]:
    """Return x and y in metres of every camera and, last, of the sink."""
    cameras_m: FloatArray = np.array([frame.T_world_camera[:2, 3] for frame in rig.frames])
    ahead = np.mean([frame.T_world_camera[:2, 2] for frame in rig.frames], axis=0)
    length = float(np.hypot(*ahead))
    behind = -ahead / length if length > 0.0 else np.array([0.0, -1.0])
    sink_m = cameras_m.mean(axis=0) + spacing_m * behind
    return tuple(np.vstack([cameras_m, sink_m]).ravel().tolist())


def placed(rig: Rig, network: NetworkConfig, senders: Sequence[int]) -> NetworkConfig:
    """Return the network with positions for the nodes that send; nodes that are down do not move the others.

    Raises:
        InputError: ``nodes.places_m`` has another number of nodes than the rig.
    """
    nodes, count = network.nodes, len(rig.frames)
    if nodes.places_m:
        places_m = np.reshape(nodes.places_m, (-1, 2))
        if len(places_m) != count + 1:
            raise InputError(
                f"nodes.places_m places {len(places_m) - 1} nodes and the sink, and there are {count} nodes; "
                f"try {2 * (count + 1)} numbers and nodes.count={count}"
            )
    elif poses_known(rig):
        places_m = np.reshape(places_of(rig, nodes.spacing_m), (-1, 2))
    elif len(senders) < count:
        whole = replace(nodes, count=count, **_NO_SIZES)
        places_m = place_nodes(whole, np.random.default_rng(network.run.seed)).positions_m
    else:
        return network
    some_m = tuple(places_m[[*senders, count]].ravel().tolist())
    return replace(network, nodes=replace(nodes, count=len(senders), places_m=some_m, **_NO_SIZES))

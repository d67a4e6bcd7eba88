"""The network of a recording whose camera walks: one node, which sends its keyframes when it has taken them.

The camera has one radio, one queue and one account of energy. It takes each keyframe at the frame's own time,
counted from the recording's first frame, and queues it behind those before. The radio model has no moving
nodes: the node stands in the middle of its keyframes' places (SPEC 6.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from network_sim.config import NetworkConfig
from packetmesh.errors import InputError
from pipeline.delivery.plan import check_collects, places_of, poses_known
from pipeline.types import FloatArray, Rig

CAMERA = "camera"
"""Name of the node of a recording."""


def image_times_s(rig: Rig) -> FloatArray:
    """Return (S,) times at which the images of a walk were taken, seconds since the recording's first frame.

    Raises:
        InputError: the rig is no walk, or one of its nodes is no keyframe of the recording.
    """
    walk = rig.walk
    if walk is None:
        raise InputError(f"The cameras of {rig.name} stand still, so that their images have no times")
    numbers: list[int] = []
    for frame in rig.frames:
        later = (k for k in walk.keyframes if not numbers or k > numbers[-1])
        number = next((k for k in later if _same_pose(walk.T_world_camera[k], frame.T_world_camera)), None)
        if number is None:
            raise InputError(
                f"{frame.name} stands at no later keyframe of {rig.name} than the image before it; try the "
                "images of the recording in their order"
            )
        numbers.append(number)
    times_s: FloatArray = walk.times_s[numbers] - walk.times_s[0]
    return times_s


def _same_pose(one: FloatArray | None, other: FloatArray) -> bool:
    return one is not None and np.array_equal(one, other)


def walk_network(rig: Rig, sizes_bytes: Sequence[int], network: NetworkConfig) -> NetworkConfig:
    """Configure a network whose only node is the walking camera, which sends all images of the rig.

    The node stands at ``nodes.places_m`` if it is given; else in the middle of the images' places, with the
    sink ``nodes.spacing_m`` behind it, against the mean direction of view. The run goes on for
    ``run.horizon_s`` after the last image.

    Args:
        rig: the recording's images in their order; the world's third axis points up.
        sizes_bytes: (S,) bytes of each image, as encoded.
        network: a preset, or any other network that collects images from fixed nodes.

    Raises:
        InputError: the network's nodes are vehicles, or it places more than one node and the sink.
    """
    check_collects(network)
    times_s, places_m = image_times_s(rig), network.nodes.places_m
    if places_m and len(places_m) != 4:
        raise InputError(
            f"nodes.places_m places {len(places_m) // 2 - 1} nodes and the sink, but the camera of a "
            "recording is one node; try 4 numbers and nodes.count=1"
        )
    if not places_m and poses_known(rig):
        around_m = np.reshape(places_of(rig, network.nodes.spacing_m), (-1, 2))
        places_m = (*around_m[:-1].mean(axis=0).tolist(), *around_m[-1].tolist())
    nodes = replace(
        network.nodes,
        count=1,
        images=len(rig.frames),
        interval_s=0.0,
        bytes_by_node=(),
        first_bytes_by_node=(),
        request_bytes_by_node=(),
        image_times_s=tuple(times_s.tolist()),
        bytes_by_image=tuple(sizes_bytes),
        places_m=places_m,
    )
    after_s = network.run.horizon_s - sum(network.nodes.image_times_s[-1:])  # the network may be of a walk
    run = replace(network.run, keep="all", warmup_s=0.0, horizon_s=after_s + float(times_s[-1]))
    return replace(network, nodes=nodes, run=run)


def check_sends_all(rig: Rig, leave_out_seen: bool, order: str) -> None:
    """Check that a walking camera is not asked for what needs several cameras, or requests of the sink.

    Raises:
        InputError: it is.
    """
    if leave_out_seen:
        raise InputError(
            f"{rig.name} is a recording of one walking camera, so no other camera can have shown its tiles; "
            "send all tiles"
        )
    if order != "own":
        raise InputError(
            f"{rig.name} is a recording of one walking camera, which sends each keyframe as soon as it is "
            "taken: the sink requests the order of tiles of cameras with one image each only; try the order "
            "own"
        )

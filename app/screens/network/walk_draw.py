"""Where the walking camera of a recording is drawn: at the keyframe that it took last."""

from __future__ import annotations

import numpy as np

from app.dock.dock import time_text
from app.screens.network.delivery_view import CameraNode, DeliveryView, NodeMoment
from pipeline.types import FloatArray, IntArray


def places_at(view: DeliveryView, places_m: FloatArray, now_ns: int) -> FloatArray:
    """Return (N, 3) places of the network's members at a time.

    Args:
        view: the delivery; without a walk all places stay.
        places_m: (N, 3) their places, of a walking camera the first row.
        now_ns: the time.
    """
    if not view.walk or view.sent.network.nodes.places_m:
        return places_m
    taken = sum(node.ready_ns <= now_ns for node in view.nodes)
    now_m = places_m.copy()
    now_m[0] = view.nodes[max(taken - 1, 0)].T_world_camera[:3, 3]
    return now_m


def routes_m(view: DeliveryView, places_m: FloatArray, pairs: IntArray) -> FloatArray:
    """Return (L, 2, 3) ends of the lines from senders to receivers; a walking camera sends from each
    keyframe.

    Args:
        view: the delivery.
        places_m: (N, 3) places of the network's members.
        pairs: (L, 2) senders and receivers.
    """
    if not view.walk or view.sent.network.nodes.places_m:
        return places_m[pairs]
    receivers = pairs[pairs[:, 0] == 0, 1]
    keyframes_m = [node.T_world_camera[:3, 3] for node in view.nodes] if len(receivers) else []
    lines_m = [[one_m, places_m[receivers[0]]] for one_m in keyframes_m]
    others_m = places_m[pairs[(pairs != 0).all(axis=1)]]
    return np.concatenate([np.reshape(lines_m, (-1, 2, 3)), others_m])


def keyframe_label(node: CameraNode, now: NodeMoment) -> str:
    """Return the label of a keyframe: when it was taken, and the share of its bytes that has arrived."""
    percent = 100.0 * now.delivered_bytes / max(node.total_bytes, 1)
    return f"{node.name} · {time_text(node.ready_ns)} · {percent:.0f} %"

"""Reception or loss of each frame on the air, with the cause."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from network_sim.trace.log import Events
from network_sim.types import Cause

NOT_HEARD = (Cause.COLLISION, Cause.NOISE, Cause.RANGE, Cause.NODE_DOWN, Cause.UPLINK, Cause.LINK)
"""Causes of a LOSS in which the frame itself did not reach its receiver."""


def fates(frames: Events, losses: Events) -> NDArray[np.int8]:
    """Find why each frame was lost.

    Args:
        frames: (F,) events AIR.
        losses: events LOSS; each belongs to the latest frame with the same sender and packet.

    Returns:
        (F,) a ``Cause`` for each frame; ``NONE`` for a frame that was received.
    """
    cause = np.full(len(frames), Cause.NONE, np.int8)
    unheard = losses.where(np.isin(losses.cause, np.array(NOT_HEARD, np.int8)))
    if not len(frames) or not len(unheard):
        return cause
    sent, lost = _place(frames, unheard)
    order = np.argsort(sent)
    at = np.searchsorted(sent[order], lost, side="right") - 1
    frame = order[np.maximum(at, 0)]
    same = (at >= 0) & (frames.node[frame] == unheard.node) & (frames.packet[frame] == unheard.packet)
    cause[frame[same]] = unheard.cause[same]
    return cause


def _place(frames: Events, losses: Events) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return sort keys (F,) and (L,) that order frames and losses by node, then packet, then time."""
    count = len(frames)
    node = np.append(frames.node, losses.node).astype(np.int64)
    packet = np.append(frames.packet, losses.packet).astype(np.int64)
    _, pair = np.unique(node * (packet.max() + 1) + packet, return_inverse=True)
    times, rank = np.unique(np.append(frames.t_ns, losses.t_ns), return_inverse=True)
    place = pair * len(times) + rank
    return place[:count], place[count:]

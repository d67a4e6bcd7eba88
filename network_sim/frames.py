"""Frames on the air, and what became of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from network_sim.trace import Events
from network_sim.types import Cause

NOT_HEARD = (Cause.COLLISION, Cause.NOISE, Cause.RANGE, Cause.NODE_DOWN, Cause.UPLINK, Cause.LINK)
"""Causes for which a frame did not reach its receiver."""


def fates(frames: Events, losses: Events) -> NDArray[np.int8]:
    """Why the receiver did not get each frame.

    Args:
        frames: (F,) events AIR.
        losses: events LOSS; each belongs to the last frame of its sender with its packet.

    Returns:
        (F,) a ``Cause``; ``NONE`` for a frame that was received.
    """
    cause = np.full(len(frames), Cause.NONE, np.int8)
    unheard = losses.where(np.isin(losses.cause, np.array(NOT_HEARD, np.int8)))
    if not len(frames) or not len(unheard):
        return cause
    order = np.lexsort((frames.t_ns, frames.node))
    span_ns = int(max(frames.t_ns.max(), unheard.t_ns.max())) + 1
    begun = (frames.node.astype(np.int64) * span_ns + frames.t_ns)[order]
    at = np.searchsorted(begun, unheard.node.astype(np.int64) * span_ns + unheard.t_ns, side="right") - 1
    frame = order[np.maximum(at, 0)]
    same = (at >= 0) & (frames.node[frame] == unheard.node) & (frames.packet[frame] == unheard.packet)
    cause[frame[same]] = unheard.cause[same]
    return cause

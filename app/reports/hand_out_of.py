"""The hand-out of a delivery, made from the delivery's record."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.reports.delivery import delivery_animation, delivery_page
from app.reports.hand_out import FramesOnAir, HandOut, HandOutMoment, HandOutNode, thumbnail
from network_sim.trace.frames import fates
from network_sim.trace.log import NetworkTrace
from network_sim.types import NS_PER_S, Cause, EventKind, to_s
from packetmesh.files import atomic_path
from pipeline.deliver import Delivery
from pipeline.delivery.moments import Moment
from pipeline.delivery.sending import Sending, nodes_of, received_at
from pipeline.folders.delivery import left_out_sentences, ordered_sentences, summary

RECEIVED = "received"
PAGE, ANIMATION = "delivery.html", "delivery.gif"


def write_hand_out(delivery: Delivery, folder: Path) -> Path:
    """Write the page that plays a delivery, and a GIF of it for slides; return the page's path.

    Raises:
        InputError: the folder cannot be written.
    """
    hand_out = hand_out_of(delivery)
    with atomic_path(folder / PAGE) as sibling:
        sibling.write_text(delivery_page(hand_out), encoding="utf-8")
    with atomic_path(folder / ANIMATION) as sibling:
        sibling.write_bytes(delivery_animation(hand_out))
    return folder / PAGE


def _requests(sending: Sending) -> list[str]:
    """Describe what the sink requested of all nodes together."""
    return [*left_out_sentences(sending)[:1], *ordered_sentences(sending)[:1]]


def hand_out_of(delivery: Delivery) -> HandOut:
    """Return the data of a delivery's hand-out."""
    sending, truth = delivery.sending, delivery.lossless.truth_after
    rig, poses = sending.rig, delivery.lossless.placement.T_world_camera
    return HandOut(
        title=f"{rig.name}: from packets to a surface",
        sentence=f"{_cameras(sending)} colour and depth images ({sending.coding.title}); the "
        f"surface is rebuilt from the data that have arrived. Result: {summary(delivery)}."
        + "".join(f" {one[0].upper()}{one[1:]}." for one in _requests(sending)),
        nodes=tuple(
            HandOutNode(name, frame.intrinsics, pose)
            for name, frame, pose in zip(_names(sending), rig.frames, poses, strict=True)
        ),
        moments=tuple(_moment(sending, index, moment) for index, moment in enumerate(delivery.moments)),
        frames=_frames(sending.trace, len(nodes_of(rig)), by_image=rig.walk is not None),
        end_s=to_s(sending.trace.horizon_ns),
        lossless_f_score=None if truth is None else truth["f_score_5cm"],
    )


def _moment(sending: Sending, index: int, moment: Moment) -> HandOutMoment:
    received = received_at(sending, int(sending.times_ns[index]))
    return HandOutMoment(
        t_s=moment.t_s,
        sent_bytes=moment.sent_bytes,
        delivered_bytes=moment.delivered_bytes,
        packets_lost=moment.packets_lost,
        energy_j=moment.energy_j,
        surface=moment.surface,
        thumbnails=tuple(thumbnail(one.rgb, one.rgb_known) for one in received),
        f_score=None if moment.truth is None else moment.truth["f_score_5cm"],
        no_hit_share=None if moment.surface is None else moment.surface.quality.no_hit_ray_share,
    )


def _frames(trace: NetworkTrace, nodes: int, by_image: bool) -> FramesOnAir:
    """Return the frames of the cameras; those of the sink, which request missing packets, are left out.

    With ``by_image`` the rows are the images of the only camera.
    """
    frames = trace.events.of(EventKind.AIR)
    frames = frames.where(frames.node < nodes)
    words = (RECEIVED, *(cause.name.lower().replace("_", " ") for cause in Cause if cause))
    return FramesOnAir(
        node=frames.image if by_image else frames.node,
        start_s=frames.t_ns / NS_PER_S,
        end_s=(frames.t_ns + frames.duration_ns) / NS_PER_S,
        cause=fates(frames, trace.events.of(EventKind.LOSS)).astype(np.int64),
        causes=words,
    )


def _names(sending: Sending) -> list[str]:
    """Return a name for each image: its node's; of a recording, when its camera took it."""
    names = [frame.name for frame in sending.rig.frames]
    if sending.rig.walk is None:
        return names
    return [f"{name} at {ready_s:.3g} s" for name, ready_s in zip(names, sending.ready_s, strict=True)]


def _cameras(sending: Sending) -> str:
    count = len(sending.rig.frames)
    if sending.rig.walk is not None:
        return (
            f"A walking camera, one node with one radio, sends {count} of its keyframes in order, each from "
            "the time at which it took it, as"
        )
    return "One camera sends its" if count == 1 else f"{count} cameras send their"

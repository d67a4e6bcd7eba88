"""The job that sends the rig's images through a network: the frames first, then moment after moment."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace
from functools import partial

import cv2
import numpy as np

from app.compute.records import Stage, sample
from app.compute.state import Sent, Spec
from app.compute.store import Store
from app.drawing.cameras import stage_around
from app.drawing.colors import NEUTRAL
from app.drawing.meshes import surface_glb
from app.drawing.pictures import cividis, depth_range_m
from app.screens.network.delivery_view import (
    PICTURE_PX,
    CameraNode,
    DeliveryView,
    Lossless,
    MomentView,
    NodeMoment,
    PacketView,
)
from app.screens.network.run_view import run_view
from network_sim.metrics.arrivals import energy_by_node_j
from network_sim.types import to_ns
from packetmesh.errors import ReconstructionError
from packetmesh.progress import Progress, part
from pipeline.acquisition import back_project
from pipeline.delivery.coding import Received
from pipeline.delivery.moments import Moment, NodeArrival, Rebuilder, lossless_spec
from pipeline.delivery.sending import (
    DeliverySpec,
    Sending,
    frames_at_sink,
    nodes_of,
    received_at,
    send,
    senders_of,
)
from pipeline.folders.delivery import left_out_sentences, ordered_sentences, walk_sentences
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.spec import key as spec_key
from pipeline.types import (
    BoolArray,
    ByteArray,
    DepthMap,
    FloatArray,
    PointCloud,
    RgbdFrame,
    SurfaceResult,
)

NODE_POINTS = 6000
"""Most points of the cloud of one node."""
CURVE_POINTS = 400
"""Most points of the curve of bytes."""
NOTHING_YET = (48, 52, 58)
"""Colour of pixels that have not arrived."""
Steps = Generator[Progress | DeliveryView | MomentView, None, DeliveryView]


def delivery_job(store: Store, spec: Spec) -> Steps:
    """Return a delivery; yield the frames as soon as they are simulated, then every moment.

    The last moment is computed first: it shows what the losses cost.
    """
    return (yield from store.remember(("delivery", spec.key("network")), partial(_delivered, store, spec)))


def packet_job(
    store: Store, spec: Spec, row: int, first_byte: int, byte_count: int
) -> Generator[Progress, None, PacketView]:
    """Return the pixels and points of an image that need one packet, when all others have arrived.

    Args:
        store: store of the results.
        spec: spec of the delivery.
        row: index of the image in the rig.
        first_byte: first byte of the packet.
        byte_count: number of bytes of the packet.
    """
    sending = yield from sending_of(store, spec)
    frame, stream = sending.rig.frames[row], sending.streams[row]
    there = np.ones(len(stream), np.bool_)
    whole = sending.decoded(row, there)
    there[first_byte : first_byte + byte_count] = False
    without = sending.decoded(row, there)
    depth = (whole.depth > 0) & (without.depth == 0)
    color = whole.rgb_known & (~without.rgb_known | (whole.rgb != without.rgb).any(axis=2))
    cloud = cloud_of(replace(frame, depth=DepthMap(np.where(depth, frame.depth.z_m, np.nan))))
    return PacketView(row, depth, color, _lit(frame.rgb, depth | color), cloud.points_m.astype(np.float32))


def sending_of(store: Store, spec: Spec) -> Generator[Progress, None, Sending]:
    """Return the sent images and the simulated run."""
    key = ("sending", spec_key(spec, "rig"), spec.sent)
    return (yield from store.remember(key, partial(_send, store, spec)))


def _send(store: Store, spec: Spec) -> Generator[Progress, None, Sending]:
    rig = yield from store.stage(spec, "rig")
    yield Progress("sending the images", 0.02)
    sent = _sent_of(spec)
    how = sent.network, sent.coding, sent.moments, sent.down, sent.leave_out_seen, sent.order
    return send(DeliverySpec(spec, *how), rig)


def _delivered(store: Store, spec: Spec) -> Steps:
    yield from store.stage(spec, "rig")
    started = time.perf_counter()
    sending = yield from sending_of(store, spec)
    view = _first_view(sending, _sent_of(spec), time.perf_counter() - started)
    yield view
    rebuilder, count = Rebuilder(sending), len(sending.times_ns)
    moments: list[MomentView] = []
    for done, index in enumerate((count - 1, *range(count - 1))):
        moment = yield from moment_of(store, spec, rebuilder, index, done)
        moments.append(_moment_view(sending, moment, int(sending.times_ns[index])))
        yield moments[-1]
    moments.sort(key=lambda one: one.t_ns)
    return replace(view, moments=tuple(moments), lossless=(yield from _lossless(store, spec, sending)))


def moment_of(
    store: Store, spec: Spec, rebuilder: Rebuilder, index: int, done: int
) -> Generator[Progress, None, Moment]:
    """Return one of the moments, after ``done`` others have been computed."""
    count = len(rebuilder.sending.times_ns)
    stage, low, high = f"moment {done + 1} of {count}", (done + 0.5) / (count + 1), (done + 1.5) / (count + 1)
    compute = partial(part, rebuilder.moment(index), stage, low, high)
    return (yield from store.remember(("moment", spec.key("network"), index), compute))


def _sent_of(spec: Spec) -> Sent:
    assert spec.sent is not None
    return spec.sent


def reconstruction_of(store: Store, sending: Sending) -> Generator[Progress, None, Reconstruction]:
    """Return the reconstruction of the images before coding. That of a walk's keyframes, which no other
    screen needs, is not stored.
    """
    cache = store if sending.rig.walk is None else None
    return (yield from iterate_reconstruction(lossless_spec(sending), cache))


def _lossless(store: Store, spec: Spec, sending: Sending) -> Generator[Progress, None, Lossless | None]:
    key = ("lossless", spec_key(spec, "truth"))
    try:
        return (yield from store.remember(key, partial(_measured, store, sending)))
    except ReconstructionError:
        return None


def _measured(store: Store, sending: Sending) -> Generator[Progress, None, Lossless]:
    result = yield from reconstruction_of(store, sending)
    score = None if result.truth_after is None else result.truth_after["f_score_5cm"]
    return Lossless(result.after.quality.no_hit_ray_share, score)


def _first_view(sending: Sending, sent: Sent, elapsed_s: float) -> DeliveryView:
    rig, down, left_out = sending.rig, sending.spec.down, sending.left_out
    senders = senders_of(rig, down)
    names = tuple(nodes_of(rig)[node] for node in senders) + sending.trace.names[len(senders) :]
    ready_s = sending.ready_s or [0.0] * len(rig.frames)
    run = replace(run_view(sending.trace, elapsed_s), names=names)
    nodes = tuple(
        CameraNode(
            name=frame.name,
            T_world_camera=frame.T_world_camera,
            fov_rad=2.0 * float(np.arctan2(frame.intrinsics.height_px / 2, frame.intrinsics.fy_px)),
            aspect=frame.intrinsics.width_px / frame.intrinsics.height_px,
            total_bytes=len(stream),
            row=0 if sending.ready_s else senders.index(row) if row in senders else -1,
            ready_ns=to_ns(ready_s[row]),
            left_out_tiles=0 if left_out is None else left_out.counts[row],
            left_out_bytes=0 if left_out is None else left_out.left_out_bytes[row],
        )
        for row, (frame, stream) in enumerate(zip(rig.frames, sending.streams, strict=True))
    )
    came = sending.arrivals
    total = np.cumsum(came.byte_count)
    some = np.unique(np.linspace(0, len(total) - 1, min(len(total), CURVE_POINTS)).astype(int))
    return DeliveryView(
        sent,
        run,
        nodes,
        _stage(rig.frames),
        tuple(sending.times_ns.tolist()),
        came.t_ns[some],
        total[some],
        left_out=tuple(left_out_sentences(sending)),
        ordered=tuple(ordered_sentences(sending)),
        walk="".join(walk_sentences(sending)),
    )


def _stage(frames: Sequence[RgbdFrame]) -> Stage:
    clouds = [sample(back_project(frame).points_m, None, NODE_POINTS).points_m for frame in frames]
    return stage_around([cloud.astype(float) for cloud in clouds], [f.T_world_camera for f in frames])


def _moment_view(sending: Sending, moment: Moment, t_ns: int) -> MomentView:
    received = received_at(sending, t_ns)
    frames = frames_at_sink(sending, received)
    surface, truth = moment.surface, moment.truth
    used_j = energy_by_node_j(sending.trace, [t_ns])[0]
    senders = senders_of(sending.rig, sending.spec.down)
    energy_j = [used_j[senders.index(row)] if row in senders else 0.0 for row in range(len(frames))]
    if sending.ready_s:  # one node took all images
        energy_j = [used_j[0]] * len(frames)
    return MomentView(
        t_ns=t_ns,
        sent_bytes=moment.sent_bytes,
        delivered_bytes=moment.delivered_bytes,
        packets_lost=moment.packets_lost,
        radio_j=float(moment.radio_j),
        energy_j=float(moment.energy_j),
        nodes=tuple(
            _node_moment(
                frame, got.rgb_known, node, moment.T_world_camera.get(frame.name), whole, float(used)
            )
            for frame, got, node, whole, used in zip(
                frames, received, moment.nodes, sending.rig.frames, energy_j, strict=True
            )
        ),
        glb=b"" if surface is None else surface_glb(surface, _colors(surface, received), photographed=True),
        triangles=0 if surface is None else len(surface.triangles),
        no_hit_share=None if surface is None else surface.quality.no_hit_ray_share,
        f_score=None if truth is None else truth["f_score_5cm"],
    )


def _colors(surface: SurfaceResult, received: Sequence[Received]) -> ByteArray | None:
    """Return the colours of the surface's vertices; None before any colour has arrived."""
    return surface.colors if any(one.rgb_known.any() for one in received) else None


def _node_moment(
    frame: RgbdFrame,
    known: BoolArray,
    arrival: NodeArrival,
    T_world_camera: FloatArray | None,
    whole: RgbdFrame,
    energy_j: float,
) -> NodeMoment:
    cloud = cloud_of(frame)
    thin = sample(cloud.points_m, cloud.colors, NODE_POINTS)
    colors = thin.colors if thin.colors is not None else np.zeros((0, 3), np.uint8)
    if not known.any():
        colors = np.broadcast_to(np.array(NEUTRAL, np.uint8), colors.shape).copy()
    return NodeMoment(
        delivered_bytes=arrival.delivered_bytes,
        color_share=arrival.color_share,
        depth_share=arrival.depth_share,
        coarse_share=arrival.coarse_share,
        picture=_picture(frame, known, depth_range_m(whole.depth)),
        points_m=thin.points_m,
        colors=colors,
        T_world_camera=whole.T_world_camera if T_world_camera is None else T_world_camera,
        energy_j=energy_j,
    )


def cloud_of(frame: RgbdFrame) -> PointCloud:
    """Return the frame's points; the cloud may be empty."""
    if not frame.depth.valid.any():
        return PointCloud(np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
    return back_project(frame)


def _picture(frame: RgbdFrame, known: BoolArray, range_m: tuple[float, float]) -> ByteArray:
    """Return the arrived picture: colour, or depth as brightness where only depth has arrived, or dark."""
    near_m, far_m = range_m
    z_m = frame.depth.z_m
    if frame.coarse is not None:
        z_m = np.where(np.isfinite(z_m), z_m, frame.coarse.z_m)
    depth = np.isfinite(z_m)
    level = np.clip((np.nan_to_num(z_m) - near_m) / (far_m - near_m), 0.0, 1.0)
    rgb = cividis((255 * level).astype(np.uint8))
    rgb[~depth] = NOTHING_YET
    rgb[known] = frame.rgb[known]
    return _small(rgb)


def _small(rgb: ByteArray) -> ByteArray:
    height, width = rgb.shape[:2]
    size = (PICTURE_PX, max(1, round(PICTURE_PX * height / width)))
    return cv2.resize(np.ascontiguousarray(rgb), size, interpolation=cv2.INTER_AREA)


LIT = np.array((255, 230, 0), np.uint8)


def _lit(rgb: ByteArray, pixels: BoolArray) -> ByteArray:
    """Return the picture dimmed, with these pixels bright and thick enough to be visible when small."""
    shown = (0.45 * rgb).astype(np.uint8)
    shown[cv2.dilate(pixels.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0] = LIT
    return _small(shown)

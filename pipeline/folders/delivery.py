"""Output folder of a delivery: the run folder of all that arrived, and a table of moments."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.files import atomic_path, write_json
from packetmesh.settings import settings
from pipeline.deliver import Delivery
from pipeline.delivery.leaving_out import LeftOut, Ordered
from pipeline.delivery.moments import Moment, NodeArrival
from pipeline.delivery.sending import Sending
from pipeline.delivery.walked import CAMERA
from pipeline.delivery.worth import Worth
from pipeline.folders.run import (
    METRICS,
    MOMENTS,
    config_of,
    metrics_of,
    surface_metrics,
    write_run_folder,
)


def delivery_metrics(delivery: Delivery) -> dict[str, Any]:
    """Return the metrics of a delivery: lengths in metres, shares from 0 to 1."""
    lossless, sending = delivery.lossless, delivery.sending
    return {
        "moments": [_moment(moment, sending.ready_s) for moment in delivery.moments],
        "lossless": surface_metrics(lossless.after)
        | {"f_score_5cm": _f_score(lossless.truth_after), "bytes": raw_bytes(delivery)},
        "bytes": sum(len(stream) for stream in delivery.sending.streams),
        "packet_bytes": delivery.sending.packet_bytes,
    } | (_walk(sending) | _left_out(sending) | _ordered(sending))


def raw_bytes(delivery: Delivery) -> int:
    """Return the bytes of all colour images at 8 bits per channel and all depth images at 16 bits."""
    return sum(5 * frame.rgb.shape[0] * frame.rgb.shape[1] for frame in delivery.sending.rig.frames)


def write_delivery_folder(delivery: Delivery, metrics: dict[str, Any], preset: str, folder: Path) -> None:
    """Write everything but the report into ``folder``, each file whole or not at all.

    Call ``clear_run_folder`` first if the folder may contain an earlier run. Writes what ``packetmesh
    reconstruct`` writes, for all that arrived; if that was too little for a surface, only config.json,
    metrics.json and moments.csv.

    Raises:
        InputError: the folder cannot be written.
    """
    spec = delivery.sending.spec
    config = (
        config_of(spec.spec)
        | {"coding": spec.coding, "moments": spec.moments, "network": preset}
        | ({"leave_out_seen": True} if spec.leave_out_seen else {})
        | ({} if spec.order == "own" else {"order": spec.order})
        | {"network_settings": settings(delivery.sending.trace.config)}
    )
    _write_table(delivery.moments, folder / MOMENTS)
    if delivery.last is not None:
        record = metrics_of(delivery.last) | {"delivery": metrics}
        write_run_folder(delivery.last, record, folder, config)
        return
    write_json(folder / "config.json", config)
    write_json(folder / METRICS, metrics)


def summary(delivery: Delivery) -> str:
    """Describe in a sentence what arrived and how good its surface is."""
    last, sent = delivery.moments[-1], sum(len(stream) for stream in delivery.sending.streams)
    if not last.delivered_bytes:
        return f"of {sent:,} bytes none arrived within {last.t_s:.3g} s"
    share = f"{last.delivered_bytes / sent:.1%} of {sent:,} bytes arrived in {last.t_s:.3g} s"
    if last.surface is None:
        return f"{share}, too little for a surface"
    holes = f"{last.surface.quality.no_hit_ray_share:.1%} of the rays are without a surface"
    whole = "without losses" if delivery.sending.left_out is None else "with all tiles and without losses"
    return f"{share}: {holes}, {delivery.lossless.after.quality.no_hit_ray_share:.1%} {whole}"


def walk_sentences(sending: Sending) -> list[str]:
    """Describe how the camera of a recording sends its keyframes; no sentence for a rig."""
    walk, times_s = sending.rig.walk, sending.ready_s
    if walk is None:
        return []
    keyframes = len(walk.keyframes)
    return [
        f"one walking camera with one radio sends {len(times_s)} of its {keyframes} "
        f"keyframe{'s' * (keyframes != 1)} in order, each from the time at which it was taken, "
        f"{times_s[0]:.3g} to {times_s[-1]:.3g} s after the recording began; in the radio model it stands in "
        f"the middle of their places, {_sink_distance_m(sending):.3g} m from the sink"
    ]


def _sink_distance_m(sending: Sending) -> float:
    """Return the distance of the first node from the sink."""
    trace = sending.trace
    places_m = np.asarray(trace.positions_m)
    return float(np.linalg.norm(places_m[0] - places_m[trace.names.index("sink")]))


def left_out_sentences(sending: Sending) -> list[str]:
    """Describe what each node left out, and whose tiles show it; no sentence if nodes send all."""
    left_out, names = sending.left_out, [frame.name for frame in sending.rig.frames]
    if left_out is None:
        return []
    if left_out.requested_s is None:
        return ["no base layer reached the sink, so it requested nothing"]
    share = sum(left_out.left_out_bytes) / sum(left_out.whole_bytes)
    sentences = [
        "the sink decided by the base layers which tiles another camera shows, and sent its requests of "
        f"{sum(left_out.request_bytes)} bytes after {left_out.requested_s:.3g} s: {sum(left_out.counts)} "
        f"tiles with {sum(left_out.left_out_bytes):,} bytes, {share:.1%} of all, were left out"
    ]
    for node, name in enumerate(names):
        if name not in sending.spec.down:
            sentences.append(f"{name}: {_left_out_of(left_out, node, names)}")
    return sentences


def ordered_sentences(sending: Sending) -> list[str]:
    """Describe the order in which the sink requested each node's depth tiles; none in the coding's own."""
    ordered = sending.ordered
    if ordered is None:
        return []
    if ordered.requested_s is None:
        return ["no base layer reached the sink, so it requested no order"]
    sentences = [
        "the sink requested the depth tiles that add most surface first, in "
        f"{sum(ordered.request_bytes)} bytes after {ordered.requested_s:.3g} s"
    ]
    for node, frame in enumerate(sending.rig.frames):
        if frame.name not in sending.spec.down:
            sentences.append(f"{frame.name}: {_ordered_of(ordered, node)}")
    return sentences


def _ordered_of(ordered: Ordered, node: int) -> str:
    worth = ordered.worth[node]
    if worth is None:
        return "its base layer was late or lost, so that it was to send its tiles in the coding's own order"
    if not ordered.answered[node]:
        return "the sink's request did not reach it, so that it sent no more than its base layer"
    return f"{_tiles_of_half(worth)} of its {worth.area_m2.size} tiles hold half of what is to be added"


def _tiles_of_half(worth: Worth) -> int:
    """Return how many tiles, counted from the first sent, add half of the area that all tiles add."""
    added = np.cumsum(worth.area_m2.ravel()[worth.order])
    return int(np.searchsorted(added, 0.5 * added[-1])) + 1


def _left_out_of(left_out: LeftOut, node: int, names: list[str]) -> str:
    if not left_out.base_arrived[node]:
        return "its base layer was late or lost, so that it was to send all"
    if not left_out.placed[node]:
        return "its camera could not be placed by the base layers, so that it was to send all"
    count = left_out.counts[node]
    if not left_out.answered[node]:
        return "the sink's request did not reach it, so that it sent no more than its base layer"
    if not count:
        return "sent all tiles, as no other camera shows them well enough"
    shown = [
        f"{number} shown by {names[other]}"
        for other, number in enumerate(left_out.shown_by[node].tolist())
        if number
    ]
    return f"left out {count} tiles with {left_out.left_out_bytes[node]:,} bytes ({', '.join(shown)})"


def _left_out(sending: Sending) -> dict[str, Any]:
    """Return what was left out and by whose decision; nothing if all nodes send all without a request."""
    left_out, names = sending.left_out, [frame.name for frame in sending.rig.frames]
    if left_out is None:
        return {}
    found = {
        "tiles": sum(left_out.counts),
        "bytes": sum(left_out.left_out_bytes),
        "whole_bytes": sum(left_out.whole_bytes),
        "decided_by": "sink",
        "requested_s": left_out.requested_s,
        "nodes": [
            {
                "name": name,
                "tiles": left_out.counts[node],
                "bytes": left_out.left_out_bytes[node],
                "whole_bytes": left_out.whole_bytes[node],
                "request_bytes": left_out.request_bytes[node],
                "base_arrived": left_out.base_arrived[node],
                "placed": left_out.placed[node],
                "answered": left_out.answered[node],
                "shown_by": dict(zip(names, left_out.shown_by[node].tolist(), strict=True)),
            }
            for node, name in enumerate(names)
        ],
    }
    return {"left_out": found}


def _ordered(sending: Sending) -> dict[str, Any]:
    """Return the order that the sink requested; nothing if nodes send in the coding's own order."""
    ordered = sending.ordered
    if ordered is None:
        return {}
    nodes = [
        {
            "name": frame.name,
            "request_bytes": ordered.request_bytes[node],
            "answered": ordered.answered[node],
            "tiles": None if worth is None else worth.order.tolist(),
            "added_m2": None if worth is None else worth.area_m2.ravel()[worth.order].tolist(),
        }
        for node, (frame, worth) in enumerate(zip(sending.rig.frames, ordered.worth, strict=True))
    ]
    return {"ordered": {"by": "sink", "requested_s": ordered.requested_s, "nodes": nodes}}


def _walk(sending: Sending) -> dict[str, Any]:
    """Return the node and the images of a recording; nothing for a rig."""
    if sending.rig.walk is None:
        return {}
    images = [
        {"name": frame.name, "ready_s": ready_s, "bytes": len(stream)}
        for frame, ready_s, stream in zip(sending.rig.frames, sending.ready_s, sending.streams, strict=True)
    ]
    return {"walk": {"node": CAMERA, "keyframes": len(sending.rig.walk.keyframes), "images": images}}


def _moment(moment: Moment, ready_s: tuple[float, ...]) -> dict[str, Any]:
    return {
        "t_s": moment.t_s,
        "sent_bytes": moment.sent_bytes,
        "delivered_bytes": moment.delivered_bytes,
        "packets_lost": moment.packets_lost,
        "radio_j": moment.radio_j,
        "energy_j": moment.energy_j,
        "nodes": [_walking_node(moment, ready_s)] if ready_s else _images(moment),
        "surface": None if moment.surface is None else surface_metrics(moment.surface),
        "f_score_5cm": _f_score(moment.truth),
    }


def _images(moment: Moment) -> list[dict[str, Any]]:
    return [_node(node, node.name in moment.T_world_camera) for node in moment.nodes]


def _walking_node(moment: Moment, ready_s: tuple[float, ...]) -> dict[str, Any]:
    """Return the node of a recording with its images, each with the time at which it was taken."""
    return {
        "name": CAMERA,
        "total_bytes": sum(node.total_bytes for node in moment.nodes),
        "delivered_bytes": moment.delivered_bytes,
        "images": [
            {"ready_s": time_s} | image for time_s, image in zip(ready_s, _images(moment), strict=True)
        ],
    }


def _node(node: NodeArrival, used: bool) -> dict[str, Any]:
    return {
        "name": node.name,
        "total_bytes": node.total_bytes,
        "delivered_bytes": node.delivered_bytes,
        "color_share": node.color_share,
        "depth_share": node.depth_share,
        "coarse_share": node.coarse_share,
        "used": used,
    }


def _f_score(truth: dict[str, float] | None) -> float | None:
    return None if truth is None else truth["f_score_5cm"]


def _write_table(moments: tuple[Moment, ...], path: Path) -> None:
    """Write one row per moment; shares from 0 to 1, empty without surface or truth."""
    rows = [_row(moment) for moment in moments]
    with atomic_path(path) as sibling, sibling.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _row(moment: Moment) -> dict[str, Any]:
    surface = moment.surface
    return {
        "t_s": moment.t_s,
        "sent_bytes": moment.sent_bytes,
        "delivered_bytes": moment.delivered_bytes,
        "packets_lost": moment.packets_lost,
        "radio_j": moment.radio_j,
        "energy_j": moment.energy_j,
        "nodes": len(moment.T_world_camera),
        "triangles": 0 if surface is None else len(surface.triangles),
        "no_hit_ray_share": 1.0 if surface is None else surface.quality.no_hit_ray_share,
        "hole_area_m2": None if surface is None else surface.quality.hole_area_m2,
        "f_score_5cm": _f_score(moment.truth),
    }

"""Output folder of a delivery: the run folder of all that arrived, and a table of moments."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from packetmesh.files import atomic_path, write_json
from packetmesh.settings import settings
from pipeline.deliver import Delivery
from pipeline.delivery.moments import Moment, NodeArrival
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
    lossless = delivery.lossless
    return {
        "moments": [_moment(moment) for moment in delivery.moments],
        "lossless": surface_metrics(lossless.after)
        | {"f_score_5cm": _f_score(lossless.truth_after), "bytes": raw_bytes(delivery)},
        "bytes": sum(len(stream) for stream in delivery.sending.streams),
        "packet_bytes": delivery.sending.packet_bytes,
    }


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
    return f"{share}: {holes}, {delivery.lossless.after.quality.no_hit_ray_share:.1%} without losses"


def _moment(moment: Moment) -> dict[str, Any]:
    return {
        "t_s": moment.t_s,
        "sent_bytes": moment.sent_bytes,
        "delivered_bytes": moment.delivered_bytes,
        "packets_lost": moment.packets_lost,
        "radio_j": moment.radio_j,
        "energy_j": moment.energy_j,
        "nodes": [_node(node, node.name in moment.T_world_camera) for node in moment.nodes],
        "surface": None if moment.surface is None else surface_metrics(moment.surface),
        "f_score_5cm": _f_score(moment.truth),
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

"""The hand-out of a delivery: one page that plays it without PacketMesh and without a network."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from app.reports.delivery_animation import delivery_animation
from app.reports.hand_out import FramesOnAir, HandOut, HandOutMoment, HandOutNode, thumbnail, viewpoint
from app.reports.offline_page import offline_page
from app.reports.packed_mesh import Box, pack_within
from app.web.markup import Markup
from pipeline.types import Surface

__all__ = [
    "FramesOnAir",
    "HandOut",
    "HandOutMoment",
    "HandOutNode",
    "delivery_animation",
    "delivery_page",
    "thumbnail",
]

MOST_BYTES = 15_000_000
"""Most bytes of the page."""
MOST_FRAMES = 1_000_000
"""Most frames on the timeline; later ones are left out, and the page shows a note."""
_TICK_S = 1e-6
_BASE64 = 4 / 3
_PARTS = (
    *("hand_out.css", "offline_page.js", "hand_out_view.js"),
    *("hand_out_stage.js", "hand_out_dock.js", "hand_out.js"),
)


def delivery_page(hand_out: HandOut) -> Markup:
    """Return a self-contained HTML document of at most ``MOST_BYTES``.

    Meshes that would make it larger are thinned, the last one least. Pictures and frames stay as given:
    if they take nearly all bytes, the document is larger.
    """
    meshes = [moment.surface or _NOTHING for moment in hand_out.moments]
    box = Box.around(_corners_m(hand_out, meshes))
    frames, tick_s, until_s = _frames(hand_out)
    blocks = {"frames": frames}
    for row, moment in enumerate(hand_out.moments):
        blocks |= {f"picture-{row}-{node}": jpeg for node, jpeg in enumerate(moment.thumbnails) if jpeg}
    record = _record(hand_out, meshes, box) | {"tick_s": tick_s, "frames_until_s": until_s}
    around = _page(hand_out, record, blocks)
    left = int((MOST_BYTES - len(around.encode()) - 100 * len(meshes)) / _BASE64)
    blocks |= {f"mesh-{row}": data for row, data in enumerate(pack_within(meshes, box, left))}
    return _page(hand_out, record, blocks)


_NOTHING = Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros((0, 3), np.uint8))


def _corners_m(hand_out: HandOut, meshes: list[Surface]) -> np.ndarray:
    """Return (C, 3) points whose bounding box is that of all meshes; without any, the cameras' places."""
    corners = [
        edge(mesh.vertices_m, axis=0) for mesh in meshes if len(mesh.vertices_m) for edge in (np.min, np.max)
    ]
    return np.array(corners or [node.T_world_camera[:3, 3] for node in hand_out.nodes])


def _record(hand_out: HandOut, meshes: list[Surface], box: Box) -> dict[str, Any]:
    """Return the page's data besides pictures, meshes and frames."""
    return {
        "end_s": max(hand_out.end_s, hand_out.moments[-1].t_s),
        "causes": list(hand_out.frames.causes),
        "lossless_f_score": hand_out.lossless_f_score,
        "box": {"low_m": box.low_m.tolist(), "step_m": box.step_m},
        "view": viewpoint(hand_out).record(),
        "nodes": [
            {
                "name": node.name,
                "T_world_camera": np.asarray(node.T_world_camera, float).tolist(),
                "matrix": np.asarray(node.intrinsics.matrix, float).tolist(),
                "size_px": [node.intrinsics.width_px, node.intrinsics.height_px],
            }
            for node in hand_out.nodes
        ],
        "moments": [
            {
                "t_s": float(moment.t_s),
                "sent_bytes": int(moment.sent_bytes),
                "delivered_bytes": int(moment.delivered_bytes),
                "packets_lost": int(moment.packets_lost),
                "energy_j": float(moment.energy_j),
                "f_score": _finite(moment.f_score),
                "no_hit_share": _finite(moment.no_hit_share),
                "triangles": len(mesh.triangles),
            }
            for moment, mesh in zip(hand_out.moments, meshes, strict=True)
        ],
    }


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)


def _frames(hand_out: HandOut) -> tuple[bytes, float, float]:
    """Return the frames in deflated columns, the tick of their times, and the end of the stored frames,
    seconds.

    The columns, by node and start: the ``uint32`` number of frames of every node; then as byte planes
    (``packed_mesh``) starts, as differences to the previous frame of the same node, and durations, both in
    ticks, 32 bits; the cause, 8 bits.
    """
    frames, until_s = hand_out.frames, hand_out.end_s
    tick_s = max(_TICK_S, float(frames.end_s.max(initial=0.0)) / 2**32)
    order = np.lexsort((frames.start_s, frames.node))
    if len(order) > MOST_FRAMES:
        until_s = float(np.partition(frames.start_s, MOST_FRAMES)[MOST_FRAMES])
        order = order[frames.start_s[order] < until_s]
    counts = np.bincount(frames.node[order], minlength=len(hand_out.nodes))
    start = np.rint(frames.start_s[order] / tick_s).astype(np.int64)
    duration = np.rint(frames.end_s[order] / tick_s).astype(np.int64) - start
    first = (np.cumsum(counts) - counts)[counts > 0]
    since = np.diff(start, prepend=0)
    since[first] = start[first]
    columns = (since.astype("<u4"), duration.astype("<u4"), frames.cause[order].astype(np.uint8))
    planes = (column.view(np.uint8).reshape(len(column), column.itemsize).T.tobytes() for column in columns)
    return zlib.compress(counts.astype("<u4").tobytes() + b"".join(planes), 9), tick_s, until_s


def _page(hand_out: HandOut, record: dict[str, Any], blocks: dict[str, bytes]) -> Markup:
    words = {"title": hand_out.title, "sentence": hand_out.sentence}
    return offline_page(f"{hand_out.title} · PacketMesh", "hand_out.html", words, _PARTS, record, blocks)

"""A delivery made up: a wall that grows to the right while two nodes send."""

from __future__ import annotations

import numpy as np

from app.reports.hand_out import FramesOnAir, HandOut, HandOutMoment, HandOutNode, thumbnail
from pipeline.types import CameraIntrinsics, Surface

K = CameraIntrinsics.pinhole(300, 300, 159.5, 119.5, 320, 240)
RED = (220, 40, 40)
CAUSES = ("", "collision", "out of range")
END_S = 10.0


def wall(columns: int, rows: int = 12, seed: int = 0) -> Surface:
    """A rough wall 2 m before a camera at the origin, a tenth of a metre for each column."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    vertices_m = np.column_stack([0.1 * x.ravel() - 0.6, 0.1 * y.ravel() - 0.6, np.full(x.size, 2.0)])
    vertices_m += rng.normal(0.0, 0.004, vertices_m.shape)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    below = corner + columns + 1
    triangles = np.vstack(
        [np.column_stack([corner, below, corner + 1]), np.column_stack([corner + 1, below, below + 1])]
    )
    colors = np.clip(np.array(RED) + rng.integers(-20, 20, (len(vertices_m), 3)), 0, 255).astype(np.uint8)
    return Surface(vertices_m, triangles[rng.permutation(len(triangles))].astype(np.int32), colors)


def node(name: str, x_m: float = 0.0) -> HandOutNode:
    T_world_camera = np.eye(4)
    T_world_camera[0, 3] = x_m
    return HandOutNode(name, K, T_world_camera)


def frames(count: int = 200, seed: int = 1) -> FramesOnAir:
    """Of two nodes, in no order; a fifth is lost."""
    rng = np.random.default_rng(seed)
    start_s = rng.uniform(0.0, 0.99 * END_S, count)
    cause = np.where(rng.random(count) < 0.2, rng.integers(1, 3, count), 0)
    return FramesOnAir(rng.integers(0, 2, count), start_s, start_s + 0.004, cause, CAUSES)


def hand_out(
    widths: tuple[int, ...] = (0, 3, 7, 12),
    title: str = "A wall",
    names: tuple[str, str] = ("left", "right"),
    on_air: FramesOnAir | None = None,
) -> HandOut:
    """A moment for each width of the wall, the first without a surface."""
    rgb = np.full((240, 320, 3), RED, np.uint8)
    moments = []
    for row, width in enumerate(widths):
        share = (row + 1) / len(widths)
        known = np.broadcast_to(np.arange(320) < share * 320, (240, 320))
        surface = wall(width) if width else None
        pictures = (thumbnail(rgb, known), thumbnail(rgb, known & (share > 0.5)))
        moments.append(
            HandOutMoment(
                t_s=share * END_S,
                sent_bytes=round(2_000_000 * share),
                delivered_bytes=round(1_500_000 * share),
                packets_lost=10 * row,
                energy_j=5.0 * share,
                surface=surface,
                thumbnails=pictures,
                f_score=0.9 * share if width else None,
                no_hit_share=1.0 - share,
            )
        )
    nodes = (node(names[0]), node(names[1], 0.8))
    air = frames() if on_air is None else on_air
    return HandOut(title, "A wall grows.", nodes, tuple(moments), air, END_S, 0.95)

"""A delivery as a GIF for slides, made without a display: mesh, clock and numbers."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import pairwise

import cv2
import numpy as np
from PIL import Image, ImageDraw

from app.drawing.colors import BACKGROUND, DELIVERED, LOSS, TARGET
from app.reports.captioned import EDGE_PX, INK, PAPER, SOFT, font, gif, on_background
from app.reports.hand_out import HandOut, HandOutMoment, viewpoint
from app.reports.projecting import camera_of, project
from pipeline.kernels.rays import Camera
from pipeline.surface.pictures import mesh_picture
from pipeline.types import ByteArray

SIZE_PX = (960, 540)
PLAYS_S = 10.0
"""Duration of all moments together. Each is shown in proportion to its time in the network, but at least
``_SHORTEST_S``."""
LAST_S = 3.0
"""Duration of the last moment."""
_SHORTEST_S = 0.06
_HEAD_PX, _FOOT_PX = 44, 16
_ROOM_PX = (640, 480)


def delivery_animation(hand_out: HandOut) -> bytes:
    """Return a GIF of ``SIZE_PX`` that repeats without end."""
    camera = camera_of(viewpoint(hand_out), _ROOM_PX)
    frames = [_frame(hand_out, moment, camera) for moment in hand_out.moments]
    return gif(frames, [round(1000 * stay_s) for stay_s in _stays_s(hand_out)])


def _stays_s(hand_out: HandOut) -> Iterator[float]:
    """Yield how long each moment is shown, seconds."""
    t_s = [moment.t_s for moment in hand_out.moments]
    for since_s, until_s in pairwise(t_s):
        yield max(PLAYS_S * (until_s - since_s) / max(hand_out.end_s, 1e-9), _SHORTEST_S)
    yield LAST_S


def _frame(hand_out: HandOut, moment: HandOutMoment, camera: Camera) -> Image.Image:
    picture = Image.new("RGB", SIZE_PX, PAPER)
    pen = ImageDraw.Draw(picture)
    pen.text((EDGE_PX, _HEAD_PX // 2), hand_out.title, INK, font(24), anchor="lm")
    picture.paste(Image.fromarray(_room(hand_out, moment, camera)), (0, _HEAD_PX))
    left = _ROOM_PX[0] + EDGE_PX
    _thumbnails(picture, moment, left, _numbers(pen, hand_out, moment, left, _HEAD_PX))
    top = SIZE_PX[1] - _FOOT_PX
    pen.rectangle((0, top, SIZE_PX[0], SIZE_PX[1]), BACKGROUND)
    share = min(moment.t_s / max(hand_out.end_s, 1e-9), 1.0)
    pen.rectangle((0, top, round(share * SIZE_PX[0]), SIZE_PX[1]), DELIVERED)
    return picture


def _room(hand_out: HandOut, moment: HandOutMoment, camera: Camera) -> ByteArray:
    """Draw the mesh, and the cameras' frusta over it."""
    rgb = np.full((_ROOM_PX[1], _ROOM_PX[0], 3), BACKGROUND, np.uint8)
    if moment.surface is not None and len(moment.surface.triangles):
        rgb = on_background(mesh_picture(moment.surface, camera))
    depth_m = 0.1 * float(np.linalg.norm(viewpoint(hand_out).middle_m - camera.T_world_camera[:3, 3]))
    for node in hand_out.nodes:
        K = node.intrinsics
        corners = np.array([[0, 0], [K.width_px, 0], [K.width_px, K.height_px], [0, K.height_px]], float)
        rays = (corners - (K.cx_px, K.cy_px)) / (K.fx_px, K.fy_px)
        local_m = depth_m * np.vstack([np.zeros(3), np.column_stack([rays, np.ones(4)])])
        world_m = local_m @ node.T_world_camera[:3, :3].T + node.T_world_camera[:3, 3]
        at, _ = project(world_m, camera)
        ways = [[at[0], at[i], at[j]] for i, j in ((1, 2), (2, 3), (3, 4), (4, 1))]
        cv2.polylines(rgb, [np.rint(way).astype(np.int32) for way in ways], True, INK, 2, cv2.LINE_AA)
    return rgb


def _numbers(pen: ImageDraw.ImageDraw, hand_out: HandOut, moment: HandOutMoment, left: int, top: int) -> int:
    """Draw the numbers below each other. Returns the next free height of the column."""
    sent = _megabytes(moment.sent_bytes)
    rows = [
        ("network time", f"{moment.t_s:.3g} s", f"of {hand_out.end_s:.3g} s", INK),
        (
            "delivered",
            _megabytes(moment.delivered_bytes),
            f"of {sent} sent",
            DELIVERED,
        ),
        ("frames lost", f"{moment.packets_lost:,}", "", LOSS),
        ("energy of all nodes", f"{moment.energy_j:,.3g} J", "", INK),
    ]
    if any(each.f_score is not None for each in hand_out.moments):
        rows.append(("F-score at 5 cm", _percent(moment.f_score), "", TARGET))
    if any(each.no_hit_share is not None for each in hand_out.moments):
        rows.append(("rays without a surface", _percent(moment.no_hit_share), "", LOSS))
    for label, value, small, color in rows:
        pen.text((left, top), label, SOFT, font(17))
        pen.text((left, top + 19), value, color, font(34))
        pen.text((left + pen.textlength(value, font(34)) + 8, top + 33), small, SOFT, font(17))
        top += 64
    return top


def _thumbnails(picture: Image.Image, moment: HandOutMoment, left: int, top: int) -> None:
    """Draw the nodes' received pictures in one row as wide as the column."""
    room = SIZE_PX[0] - left - EDGE_PX
    width = min(room // len(moment.thumbnails) - 4, 120)
    for row, jpeg in enumerate(moment.thumbnails):
        if not jpeg:
            continue
        image = Image.open(io.BytesIO(jpeg))
        small = image.resize((width, round(width * image.height / image.width)))
        picture.paste(small, (left + row * (width + 4), top))


def _megabytes(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.0f} kB"


def _percent(share: float | None) -> str:
    return "–" if share is None or not np.isfinite(share) else f"{100 * share:.1f} %"

"""The timeline of a network: a row for each node, painted for the window that is looked at.

However many events a window holds, the picture has a fixed number of pixels, so its cost hardly grows with
them: every pixel is as strong as the share of its time that is taken. Failures are marked below the bars.
"""

from __future__ import annotations

import base64
import html
import math
from dataclasses import dataclass

import cv2
import numpy as np

from app.drawing.colors import DELIVERED, LOSS, css
from app.screens.network.labels import ANSWER, CAUSES, PACKET_COLORS, PACKET_NAMES
from app.screens.network.view import FAILURES, NetworkView, Pieces, What
from network_sim.types import Cause, PacketKind
from pipeline.types import ByteArray, FloatArray

WIDTH_PX = 720
"""Of the picture, which is stretched to the panel."""
LABELS_PX = 62
PAPER, STRIPE = (246, 248, 250), (236, 239, 242)
WAITING, DOWN, TAKEN, THROWN = (247, 220, 160), (190, 190, 190), (140, 146, 152), (225, 180, 170)
NOW = (30, 30, 30)
"""Colour of the player's place."""
MARKS = {
    What.CAPTURE: TAKEN,
    What.EXPIRE: THROWN,
    What.ARRIVE: DELIVERED,
    What.LOSS: LOSS,
    What.DROP: LOSS,
}
"""Below the bars; the later ones cover the earlier ones."""
FAINTEST = 0.3
"""Strength of a pixel of whose time hardly anything is taken."""
MOST_AREAS = 400
"""Places with a text of their own; beyond, texts sum up what is in their part of the row."""
TICKS = 5


@dataclass(frozen=True, slots=True)
class Window:
    """The part of the simulated time that is looked at."""

    start_ns: int
    span_ns: int

    @property
    def end_ns(self) -> int:
        """Where it ends."""
        return self.start_ns + self.span_ns

    def share(self, t_ns: int) -> float:
        """Where in the window a time is: 0 at its start, 1 at its end."""
        return (t_ns - self.start_ns) / self.span_ns


def row_px(rows: int) -> int:
    """Height of a row on the screen."""
    return min(max(320 // rows, 6), 26)


def height_px(view: NetworkView) -> int:
    """Height of the picture on the screen."""
    return len(view.names) * row_px(len(view.names))


def visible(pieces: Pieces, window: Window) -> Pieces:
    """The pieces of which something lies in the window."""
    return pieces.where((pieces.start_ns < window.end_ns) & (pieces.end_ns >= window.start_ns))


def paint(pieces: Pieces, rows: int, window: Window) -> ByteArray:
    """(rows * row_px, WIDTH_PX, 3) RGB of the pieces of a window."""
    bars, marks = _paper(rows), _paper(rows)
    what = pieces.what
    _blend(bars, _taken(pieces.where(what == What.DOWN), rows, window), DOWN)
    _blend(bars, _taken(pieces.where(what == What.WAIT), rows, window), WAITING)
    _blend(bars, _taken(pieces.where(what == What.ACK), rows, window), ANSWER)
    for kind, color in PACKET_COLORS.items():
        frames = pieces.where((what == What.AIR) & (pieces.carries == kind))
        _blend(bars, _taken(frames, rows, window), color)
    for happened, color in MARKS.items():
        marks[_marked(pieces.where(what == happened), rows, window)] = color
    row = row_px(rows)
    mark = max(1, round(0.3 * row))
    gap = np.full((rows, 1, WIDTH_PX, 3), 255.0)
    parts = [np.repeat(bars[:, None], row - mark - 1, 1), np.repeat(marks[:, None], mark, 1), gap]
    return np.concatenate(parts, axis=1).reshape(rows * row, WIDTH_PX, 3).astype(np.uint8)


def _paper(rows: int) -> FloatArray:
    """(rows, W, 3), every other row a little darker."""
    paper = np.empty((rows, WIDTH_PX, 3))
    paper[0::2], paper[1::2] = PAPER, STRIPE
    return paper


def _place(t_ns: np.ndarray, window: Window) -> FloatArray:
    """Pixels from the left edge, not beyond the edges."""
    return np.clip((t_ns - window.start_ns) * (WIDTH_PX / window.span_ns), 0.0, WIDTH_PX)


def _taken(pieces: Pieces, rows: int, window: Window) -> FloatArray:
    """(rows, W) share of each pixel's time that the pieces take."""
    sums = np.zeros(rows * (WIDTH_PX + 2))
    for t_ns, sign in ((pieces.start_ns, 1.0), (pieces.end_ns, -1.0)):
        x = _place(t_ns, window)
        pixel = x.astype(np.int64)
        at = pieces.node.astype(np.int64) * (WIDTH_PX + 2) + pixel
        part = x - pixel
        sums += np.bincount(at, sign * (1.0 - part), len(sums))
        sums += np.bincount(at + 1, sign * part, len(sums))
    return np.clip(np.cumsum(sums.reshape(rows, -1), axis=1)[:, :WIDTH_PX], 0.0, 1.0)


def _marked(pieces: Pieces, rows: int, window: Window) -> np.ndarray:
    """(rows, W) where something happened; marks are two pixels wide."""
    marked = np.zeros((rows, WIDTH_PX), bool)
    pixel = np.minimum(_place(pieces.start_ns, window).astype(np.int64), WIDTH_PX - 2)
    for beside in (0, 1):
        marked[pieces.node, pixel + beside] = True
    return marked


def _blend(paper: FloatArray, share: FloatArray, color: tuple[int, int, int]) -> None:
    strength = np.where(share > 1e-7, FAINTEST + (1.0 - FAINTEST) * share, 0.0)[..., None]
    paper += strength * (np.array(color) - paper)


# What the pointer shows.


def areas(view: NetworkView, pieces: Pieces, window: Window) -> list[tuple[float, int, float, str]]:
    """Left end in pixels, row, width in pixels and text of the places that have one."""
    if len(pieces) <= MOST_AREAS:
        # Long waits first: what lies above them is to be reached.
        order = np.argsort(pieces.start_ns - pieces.end_ns, kind="stable")
        left, right = _place(pieces.start_ns, window), _place(pieces.end_ns, window)
        width = np.maximum(right - left, 4.0)
        return [
            (float(left[i]), int(pieces.node[i]), float(width[i]), piece_text(view, pieces, int(i)))
            for i in order
        ]
    return _summaries(view, pieces, window)


def piece_text(view: NetworkView, pieces: Pieces, i: int) -> str:
    """A sentence about one piece."""
    start_s = f"{pieces.start_ns[i] / 1e9:.6f} s"
    took = _duration(int(pieces.end_ns[i] - pieces.start_ns[i]))
    what, cause = What(int(pieces.what[i])), CAUSES[Cause(int(pieces.cause[i]))]
    node, peer = view.names[pieces.node[i]], int(pieces.peer[i])
    way = f"{node} → {view.names[peer]}" if peer >= 0 and what not in (What.CAPTURE, What.EXPIRE) else node
    size = f"{pieces.size_bytes[i]:,} B"
    packet = f"{PACKET_NAMES[PacketKind(int(pieces.carries[i]))]} packet {pieces.packet[i]}"
    if pieces.image[i] >= 0:
        packet += f" of image {pieces.image[i]} from byte {pieces.first_byte[i]:,}"
    texts = {
        What.WAIT: f"{node}: {packet} waited {took} from {start_s}",
        What.DOWN: f"{node}: down for {took} from {start_s}",
        What.AIR: f"{way}: {packet}, {size}, on the air {took} from {start_s}",
        What.ACK: f"{way}: acknowledgement, {size}, on the air {took} from {start_s}",
        What.CAPTURE: f"{node}: took image {pieces.image[i]}, {size}, at {start_s}",
        What.ARRIVE: f"{way}: image {pieces.image[i]} complete at {start_s}",
        What.LOSS: f"{way}: an attempt with {packet} failed at {start_s}: {cause}",
        What.DROP: f"{node}: gave {packet} up at {start_s}: {cause}",
        What.EXPIRE: f"{node}: gave image {pieces.image[i]} up at {start_s}: {cause}",
    }
    lost = what == What.AIR and pieces.cause[i] != Cause.NONE
    return texts[what] + (f"; not received: {cause}" if lost else "")


def _duration(span_ns: int) -> str:
    return f"{span_ns / 1e9:.3f} s" if span_ns >= 1e9 else f"{span_ns / 1e6:.3f} ms"


def _summaries(view: NetworkView, pieces: Pieces, window: Window) -> list[tuple[float, int, float, str]]:
    """The same for equal parts of each row, with numbers of frames and of failures by cause."""
    rows = len(view.names)
    parts = max(4, MOST_AREAS // rows)
    part = np.minimum(_place(pieces.start_ns, window) * (parts / WIDTH_PX), parts - 1).astype(np.int64)
    cell = pieces.node.astype(np.int64) * parts + part
    frames = np.bincount(cell[pieces.what == What.AIR], minlength=rows * parts)
    failed = np.isin(pieces.what, FAILURES)
    causes = np.zeros((rows * parts, len(Cause)), np.int64)
    np.add.at(causes, (cell[failed], pieces.cause[failed]), 1)
    width = WIDTH_PX / parts
    areas = []
    for i in np.flatnonzero(frames + causes.sum(axis=1)).tolist():
        row, column = divmod(i, parts)
        from_s, to_s = (
            (window.start_ns + window.span_ns * edge / parts) / 1e9 for edge in (column, column + 1)
        )
        text = f"{view.names[row]}, {from_s:.6g} to {to_s:.6g} s: {frames[i]:,} frames"
        counts = [f"{n:,} {CAUSES[Cause(c)]}" for c, n in enumerate(causes[i].tolist()) if n]
        if counts:
            text += f"; failures: {', '.join(counts)}"
        areas.append((column * width, row, width, text))
    return areas


# The page.


def gantt_html(view: NetworkView, window: Window, title: str = "") -> str:
    """The rows of a window, with names, times and texts under the pointer."""
    rows = len(view.names)
    row, height = row_px(rows), height_px(view)
    pieces = visible(view.pieces, window)
    encoded = cv2.imencode(".png", cv2.cvtColor(paint(pieces, rows, window), cv2.COLOR_RGB2BGR))[1]
    picture = f"data:image/png;base64,{base64.b64encode(encoded.tobytes()).decode()}"
    texts = "".join(
        f'<rect x="{left:.1f}" y="{index * row}" width="{width:.1f}" height="{row}">'
        f"<title>{html.escape(text)}</title></rect>"
        for left, index, width, text in areas(view, pieces, window)
    )
    return (
        f'<div style="padding: 0 0.8em; font-size: 11px"><b>{html.escape(title)}</b>'
        f'<div style="display: flex"><div style="flex: 0 0 {LABELS_PX}px">{_labels(view, row)}</div>'
        f'<div style="flex: 1; position: relative; height: {height}px">'
        f'<img alt="timeline" decoding="sync" src="{picture}" style="position: absolute; width: 100%; '
        f'height: {height}px; image-rendering: pixelated">'
        f'<svg viewBox="0 0 {WIDTH_PX} {height}" preserveAspectRatio="none" fill="transparent" '
        f'style="position: absolute; width: 100%; height: {height}px">{texts}</svg></div></div>'
        f'<div style="margin-left: {LABELS_PX}px; display: flex; justify-content: space-between">'
        f"{_ticks(window)}</div></div>"
    )


def cursor_html(view: NetworkView, window: Window, now_ns: int) -> str:
    """A line over the timeline right above, which moves without painting the rows again."""
    share = window.share(now_ns)
    if not 0.0 <= share <= 1.0:
        return ""
    left = f"calc({LABELS_PX}px + {100.0 * share:.3f}% - {share * LABELS_PX:.2f}px)"
    return (
        '<div style="padding: 0 0.8em; height: 0; font-size: 11px; pointer-events: none">'
        '<div style="position: relative">'
        f'<div class="packetmesh-now" style="position: absolute; bottom: 1.55em; left: {left}; width: 1.5px; '
        f'height: {height_px(view)}px; background: {css(NOW)}"></div></div></div>'
    )


def _labels(view: NetworkView, row: int) -> str:
    every = math.ceil(10 / row)
    look = f"height: {row}px; line-height: {row}px; white-space: nowrap; overflow: visible"
    return "".join(
        f'<div style="{look}">{html.escape(short(name)) if index % every == 0 else ""}</div>'
        for index, name in enumerate(view.names)
    )


def short(name: str) -> str:
    """A node's name in a narrow column."""
    return name.replace("access point", "AP").replace("vehicle", "veh.")


def _ticks(window: Window) -> str:
    span_s = window.span_ns / 1e9
    digits = max(0, math.ceil(-math.log10(span_s / (TICKS - 1))) + 1)
    at_s = [window.start_ns / 1e9 + span_s * index / (TICKS - 1) for index in range(TICKS)]
    return "".join(
        f"<span>{time_s:.{digits}f}{' s' if index == TICKS - 1 else ''}</span>"
        for index, time_s in enumerate(at_s)
    )


def legend_html(kinds: set[PacketKind]) -> str:
    """What the colours of the timeline and of the moving packets mean."""
    boxes = [(PACKET_COLORS[kind], PACKET_NAMES[kind]) for kind in sorted(kinds)]
    boxes += [(ANSWER, "acknowledgement"), (WAITING, "waiting"), (TAKEN, "image taken")]
    boxes += [(DELIVERED, "image complete"), (LOSS, "packet lost or given up")]
    boxes += [(THROWN, "image given up or thrown away")]
    box = "display: inline-block; width: 0.8em; height: 0.8em; margin-right: 0.3em; border-radius: 2px"
    words = " &emsp;".join(
        f'<span style="white-space: nowrap"><span style="{box}; background: {css(color)}"></span>'
        f"{name}</span>"
        for color, name in boxes
    )
    return f'<div style="padding: 0 0.8em 0.5em; font-size: 12px">{words}</div>'

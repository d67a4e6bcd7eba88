"""Descriptions of single frames: their content, their fate, and its cause."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.dock.dock import time_text
from app.drawing.colors import css
from app.screens.network.delivery_view import PacketView
from app.screens.network.labels import CAUSES, PACKET_NAMES
from app.screens.network.view import NetworkView, Pieces, What
from app.web.markup import Markdown, Markup
from network_sim.types import Cause, PacketKind

ANSWER_WITHIN_NS = 2_000_000
"""Time after a frame's end within which an acknowledgement belongs to it."""


class Frames:
    """The frames of a run by their index on the timeline."""

    def __init__(self, view: NetworkView) -> None:
        self._view, pieces = view, view.pieces
        self.pieces: Pieces = pieces.where(pieces.what == What.AIR)
        self._waits = pieces.where(pieces.what == What.WAIT)
        self._answers = pieces.where(pieces.what == What.ACK)
        taken = pieces.where(pieces.what == What.CAPTURE)
        self._cameras = dict(zip(taken.image.tolist(), taken.node.tolist(), strict=True))

    def line(self, item: int) -> str:
        """Return one line about a frame, which the timeline shows at the pointer."""
        one, names = self.pieces, self._view.names
        return f"{names[one.node[item]]} → {names[one.peer[item]]}: {self._content(item)}; {self._fate(item)}"

    def carries_image(self, item: int) -> bool:
        """Whether it carries a piece of a camera's images."""
        return self.pieces.carries[item] == PacketKind.IMAGE

    def story(self, item: int) -> Markdown:
        """Return markdown about a frame, for the inspector."""
        one, names = self.pieces, self._view.names
        tries = np.flatnonzero((one.packet == one.packet[item]) & (one.node == one.node[item]))
        took_ns = int(one.end_ns[item] - one.start_ns[item])
        size = int(one.size_bytes[item])
        headers = f", {self._view.header_bytes} of them headers" if self.carries_image(item) else ""
        fate = self._fate(item)
        return Markdown("\n\n").join(
            [
                Markdown("**{} → {}** at {}: {}").format(
                    names[one.node[item]],
                    names[one.peer[item]],
                    time_text(int(one.start_ns[item])),
                    self._content(item),
                ),
                f"{size:,} bytes{headers}; {time_text(took_ns)} on the air",
                f"Attempt {1 + int(np.searchsorted(tries, item))} of {len(tries)}; "
                f"waited {self._waited(item, int(tries[0]))} in the node",
                Markdown("**{}**").format(f"{fate[0].upper()}{fate[1:]}"),
            ]
        )

    def bytes_of(self, item: int) -> tuple[int, int]:
        """Return the first byte and the number of bytes of the image that the frame carries."""
        return int(self.pieces.first_byte[item]), int(self.pieces.size_bytes[item]) - self._view.header_bytes

    def camera_of(self, item: int) -> int:
        """Return the node that took the image of which the frame carries a piece; -1 if it is unknown."""
        return int(self._cameras.get(int(self.pieces.image[item]), -1))

    def _content(self, item: int) -> str:
        one = self.pieces
        kind = PacketKind(int(one.carries[item]))
        if kind is not PacketKind.IMAGE:
            return f"a {PACKET_NAMES[kind]}"
        first, count = self.bytes_of(item)
        return f"bytes {first:,} to {first + count - 1:,} of image {int(one.image[item]) + 1}"

    def _waited(self, item: int, first_try: int) -> str:
        waits, one = self._waits, self.pieces
        mine = np.flatnonzero((waits.packet == one.packet[item]) & (waits.node == one.node[item]))
        if not len(mine):
            return "not at all"
        return time_text(int(one.start_ns[first_try] - waits.start_ns[mine[0]]))

    def _fate(self, item: int) -> str:
        one, answers = self.pieces, self._answers
        cause = Cause(int(one.cause[item]))
        if cause is not Cause.NONE:
            return f"lost: {CAUSES[cause]}"
        end_ns = int(one.end_ns[item])
        first, last = np.searchsorted(answers.start_ns, (end_ns, end_ns + ANSWER_WITHIN_NS))
        back = answers.node[first:last] == one.peer[item]
        if (back & (answers.peer[first:last] == one.node[item])).any():
            return "arrived and was acknowledged"
        return "arrived"


def packet_sentence(packet: PacketView) -> str:
    """Return a sentence on the part of an image that needs a packet."""
    parts = []
    for what, pixels in (("depth", packet.depth), ("colour", packet.color)):
        rows = np.flatnonzero(pixels.any(axis=1))
        if len(rows):
            where = f"row {rows[0] + 1}" if rows[0] == rows[-1] else f"rows {rows[0] + 1} to {rows[-1] + 1}"
            parts.append(f"{what} of {int(pixels.sum()):,} pixels in {where}")
    if not parts:
        return "No pixel needs this packet: it holds none that was measured, or other packets replace it."
    return (
        f"Without this packet the {' and the '.join(parts)} would be missing or coarse "
        "(yellow in the picture and the cloud)."
    )


def legend_html(colors: Sequence[tuple[str, tuple[int, int, int]]]) -> Markup:
    """Return HTML of the drawing's legend."""
    words = Markup(" &ensp; ").join(
        Markup("<span style='white-space: nowrap'><b style='color: {}'>●</b> {}</span>").format(
            css(color), name
        )
        for name, color in colors
    )
    return Markup("<div style='padding: 0 0.8em 0.8em; font-size: 12px'>{}</div>").format(words)

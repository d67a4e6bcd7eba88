"""Tables and sentences on a delivery: at the clock, at the end, and compared with another delivery."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.dock.dock import time_text
from app.drawing.colors import LOSS
from app.drawing.timeline import Color
from app.screens.network.delivery_view import DeliveryView, MomentView
from app.screens.network.labels import ANSWER, CAUSES, PACKET_COLORS, PACKET_NAMES
from app.screens.network.state_colors import BUSY, DOWN, EMPTY, FULL
from app.screens.network.view import What
from app.web.markup import Markdown, Markup
from app.window.tables import Head, Row, number, table
from network_sim.config import NetworkConfig
from network_sim.types import Cause
from packetmesh.settings import differences

REASONS = {
    Cause.COLLISION: (
        "Two nodes sent at the same time. This happens on every shared channel, even with the loss slider "
        "at 0. Radios with acknowledgements send such frames again."
    ),
    Cause.NOISE: "The signal was too weak for all bits to be read.",
    Cause.RANGE: "The receiver was too far away, or behind a wall.",
    Cause.LINK: "Lost at the rate that the slider above sets.",
    Cause.ACK_LOST: "The frame arrived, but its acknowledgement did not.",
}
"""Explanation of each cause of a loss."""
BYTES_MB = 1e-6
MOST_CHANGES = 4
"""Most changes that are named one by one."""
END = "The last moment: no more bytes arrive after it."


def moment_table(view: DeliveryView, now: MomentView | None) -> Markup:
    """Return a table of the main numbers in HTML: of the moment ``now`` that the clock shows, of the last
    moment, and without losses.
    """
    end = view.moment_at(view.times_ns[-1])
    done = end is not None and end.t_ns == view.times_ns[-1]
    columns = (_head(now), (f"end, {time_text(view.times_ns[-1])}", END), "no loss")
    last, best = end if done else None, view.lossless
    rows: list[Row] = [
        (
            "Bytes at the sink",
            "Bytes of all cameras' encoded images, each counted once.",
            _megabytes(None if now is None else now.delivered_bytes),
            _megabytes(None if last is None else last.delivered_bytes),
            _megabytes(view.total_bytes),
        ),
        *_left_out(view),
        (
            "Frames lost",
            "Transmissions that failed until the column's time; most are sent again.",
            _count(None if now is None else now.packets_lost),
            _count(None if last is None else last.packets_lost),
            "0",
        ),
        *_by_cause(view, now, last),
        (
            "Energy",
            "Energy of all nodes' radios, computers and cameras until the column's time.",
            number(None if now is None else now.energy_j, 1, "J"),
            number(None if last is None else last.energy_j, 1, "J"),
            "–",
        ),
        (
            "Rays without a surface",
            "Share of the rays through all cameras' pixels that meet no triangle: the holes.",
            *_shares(
                None if now is None else now.no_hit_share,
                None if last is None else last.no_hit_share,
                None if best is None else best.no_hit_share,
            ),
        ),
    ]
    if any(one.f_score is not None for one in view.moments) or (
        None if best is None else best.f_score is not None
    ):
        rows.append(
            (
                "F-score at 5 cm",
                "Harmonic mean of the surface's accuracy and its coverage of the true surface.",
                *_shares(
                    None if now is None else now.f_score,
                    None if last is None else last.f_score,
                    None if best is None else best.f_score,
                ),
            )
        )
    return table(rows, columns)


def _head(now: MomentView | None) -> Head:
    """Return the head of the clock's column."""
    if now is None:
        return "nothing yet"
    return f"by {time_text(now.t_ns)}", "The last moment before the clock at which the surface is rebuilt."


def _left_out(view: DeliveryView) -> list[Row]:
    """Return the row of the bytes that were left out; none if every node sends all."""
    if not view.left_out:
        return []
    text = "Bytes of tiles that the sink told the cameras not to send, because another camera shows them."
    return [("Left out", text, "", _megabytes(view.left_out_bytes), "0")]


def _by_cause(view: DeliveryView, now: MomentView | None, last: MomentView | None) -> list[Row]:
    """Return rows with the causes of lost frames, the most frequent first."""
    pieces = view.run.pieces
    lost = pieces.where((pieces.what == What.LOSS) & (pieces.start_ns <= view.times_ns[-1]))
    counts = np.bincount(lost.cause, minlength=1)

    def until(moment: MomentView | None, cause: int) -> str:
        if moment is None:
            return "–"
        return f"{int(np.count_nonzero(lost.cause[lost.start_ns <= moment.t_ns] == cause)):,}"

    causes = [Cause(row) for row in np.argsort(-counts, kind="stable").tolist() if counts[row]]
    return [
        (f"· {CAUSES[cause]}", REASONS.get(cause, ""), until(now, cause), until(last, cause), "0")
        for cause in causes
    ]


def more_rows(view: DeliveryView, now: MomentView | None) -> Markup:
    """Return a table in HTML: shares of each camera's data at the sink, sent bytes, energy of the radios."""
    if now is None:
        return Markup("")
    rows = [
        (
            f"{node.name}, taken at {time_text(node.ready_ns)}" if view.walk else node.name,
            "Depth: share of the measured pixels; colour and coarse depth: share of all pixels.",
            _percent(one.depth_share),
            _percent(one.color_share),
            _percent(one.coarse_share),
        )
        for node, one in zip(view.nodes, now.nodes, strict=True)
    ]
    energy = (
        "Radios alone",
        "Energy of all nodes' radios until the last moment before the clock.",
        number(now.radio_j, 2, "J"),
        "",
        "",
    )
    sent = ("Sent on the air", "Bytes with headers and retransmissions.", _megabytes(now.sent_bytes), "", "")
    left_out = [
        (
            f"{node.name}: left out",
            f"Tiles that another camera shows, and their bytes. {sentence}.",
            f"{node.left_out_tiles} tiles",
            _megabytes(node.left_out_bytes),
            "",
        )
        for node, sentence in zip(view.senders, view.left_out[1:], strict=False)
    ]
    return table([*rows, *left_out, sent, energy], ("depth", "colour", "coarse"))


def summary(view: DeliveryView) -> Markdown:
    """Return a sentence on the computed part of the delivery."""
    computed, planned = len(view.moments), len(view.times_ns)
    who = "One node" if view.walk else f"{len(view.senders)} nodes"
    sentence = Markdown("{} sent {:.2f} MB in {:,} packets; simulated in {:.1f} s.").format(
        who,
        sum(node.total_bytes for node in view.senders) * BYTES_MB,
        view.run.packets,
        view.run.elapsed_s,
    )
    for first in (*([view.walk] if view.walk else ()), *view.left_out[:1], *view.ordered[:1]):
        sentence += Markdown(" {}.").format(first[0].upper() + first[1:])
    if not view.run.series or not len(view.run.pieces):
        sentence += " No frame was sent in that time."
    if computed < planned:
        sentence += f" Rebuilding the surface: {computed} of {planned} moments."
    elif not any(one.triangles for one in view.moments):
        sentence += " Too little arrived for a surface."
    return sentence


def difference(before: DeliveryView, after: DeliveryView, what: str) -> Markdown:
    """Return a sentence on the effect of a setting on network and mesh; empty while unknown."""
    one, two = (view.moment_at(view.times_ns[-1]) for view in (before, after))
    if one is None or two is None or two.t_ns != after.times_ns[-1]:
        return Markdown("")
    network = [
        f"the last byte came after {time_text(two.t_ns)} instead of {time_text(one.t_ns)}",
        f"{_percent(two.delivered_bytes / after.total_bytes)} of the bytes arrived instead of "
        f"{_percent(one.delivered_bytes / before.total_bytes)}",
        f"{two.packets_lost:,} frames were lost instead of {one.packets_lost:,}",
        f"it took {two.energy_j:.0f} J instead of {one.energy_j:.0f} J",
    ]
    mesh = [
        f"{_percent(two.no_hit_share)} of the rays are without a surface instead of "
        f"{_percent(one.no_hit_share)}"
    ]
    if one.f_score is not None and two.f_score is not None:
        mesh.append(f"the F-score is {_percent(two.f_score)} instead of {_percent(one.f_score)}")
    return Markdown("**{}**: {}; in the mesh, {}.").format(what, ", ".join(network), " and ".join(mesh))


def changes(before: DeliveryView, after: DeliveryView) -> str:
    """Return the settings that differ, in a few words."""
    words = [f"{name} off" for name in after.sent.down if name not in before.sent.down]
    if before.sent.coding != after.sent.coding:
        words.append(f"coding {after.sent.coding} instead of {before.sent.coding}")
    if before.sent.leave_out_seen != after.sent.leave_out_seen:
        words.append("shown tiles left out" if after.sent.leave_out_seen else "all tiles sent again")
    if before.sent.order != after.sent.order:
        words.append("most surface first" if after.sent.order == "worth" else "tiles in the coding's order")
    words += [f"{name} on again" for name in before.sent.down if name not in after.sent.down]
    changed = _network_changes(before.sent.network, after.sent.network)
    words += changed[:MOST_CHANGES] + (["and more"] if len(changed) > MOST_CHANGES else [])
    return ", ".join(words) or "Other settings of the reconstruction"


def _network_changes(before: NetworkConfig, after: NetworkConfig) -> list[str]:
    """Return changed places and walls in words, and other settings as they are written."""
    words, described = [], {"nodes.count", "nodes.places_m", "radio.walls_m", "radio.wall_db"}
    if before.mac.kind != after.mac.kind:  # which brings its radio's power
        described |= {f"energy.{state}_w" for state in ("tx", "rx", "idle", "sleep")}
    if before.nodes.places_m != after.nodes.places_m:
        words.append("radios moved" if after.nodes.places_m else "radios at their cameras again")
    walls = [
        (radio.walls_m, radio.wall_db if radio.walls_m else 0.0) for radio in (before.radio, after.radio)
    ]
    if walls[0] != walls[1]:
        words.append(f"a wall of {after.radio.wall_db:g} dB" if after.radio.walls_m else "no wall")
    return words + [word for word in differences(after, before) if word.partition("=")[0] not in described]


def _shares(*shares: float | None) -> tuple[str, ...]:
    return tuple(_percent(share) for share in shares)


def _percent(share: float | None) -> str:
    return number(share, 1, "%", 100.0)


def _megabytes(count: int | None) -> str:
    return number(count, 2, "MB", BYTES_MB)


def _count(count: int | None) -> str:
    return "–" if count is None else f"{count:,}"


def legend(view: DeliveryView) -> Sequence[tuple[str, Color]]:
    """Return the names and colours of the drawing's legend."""
    some = [("camera, nothing arrived", BUSY), ("camera, all arrived", FULL)]
    if any(node.row < 0 for node in view.nodes):
        some.append(("camera down", DOWN))
    pieces = view.run.pieces
    flying = [
        (f"{name} on the air", PACKET_COLORS[kind])
        for kind, name in PACKET_NAMES.items()
        if np.any((pieces.what == What.AIR) & (pieces.carries == kind))
    ]
    if np.any(pieces.what == What.ACK):
        answers = "acknowledgement, RTS or CTS" if view.run.config.mac.rts else "acknowledgement"
        flying.append((f"{answers} on the air", ANSWER))
    most = "an empty battery" if view.sent.network.energy.battery_j else "the most of any node"
    return [*some, *flying, ("lost here", LOSS), (f"ball: energy used, from none to {most}", EMPTY)]


def most_j(view: DeliveryView) -> float:
    """Return a node's battery capacity, joules; without one, the most energy that any node uses."""
    battery_j = view.sent.network.energy.battery_j
    used_j = [node.energy_j for moment in view.moments for node in moment.nodes]
    return max(used_j, default=0.0) if battery_j is None else battery_j

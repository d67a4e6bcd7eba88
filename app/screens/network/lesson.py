"""The lessons of the network: the settings of their stops, the numbers of their texts, their files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from app.dock.dock import time_text
from app.lesson.files import LESSONS, NUMBER, SCENE, Kind, Numbers, Setting, choice, quantity, sets
from app.screens.network.delivery_view import DeliveryView, MomentView
from app.screens.network.labels import ACCESS, CAUSES, CODINGS, NETWORKS, SCHEMES
from app.screens.network.numbers import verdict
from app.screens.network.packets import Frames
from app.screens.network.planning import lesson as plan_lesson
from app.screens.network.planning.lesson import PlanLook
from app.screens.network.view import FAILURES, NetworkView, What
from app.window.in_address import STOP
from app.window.tables import UNKNOWN, number
from network_sim.types import Cause

CROSSING, LOST_PACKET = LESSONS / "how-images-cross-a-network.md", LESSONS / "what-one-lost-packet-costs.md"
PLACING = LESSONS / "where-should-the-camera-stand.md"
SHIPPED = {STOP: CROSSING, f"{STOP}-lost": LOST_PACKET, f"{STOP}-camera": PLACING}
"""The lessons by their keys in the address."""
_ON_OFF = {"on": True, "off": False}
_CAUSES = {words: cause for cause, words in CAUSES.items()}


@dataclass(frozen=True, slots=True)
class Place:
    """A stop's place on the timeline."""

    kind: Literal["share", "frame", "answer", "cause"] = "share"
    """A share of the run, the N-th frame with image bytes or its acknowledgement, or the first loss by a
    cause."""
    value: float = 1.0


@dataclass(frozen=True, slots=True)
class NetworkLook:
    """State of the screen at a stop: the network and the place; the default is the screen's first state."""

    preset: str = "office"
    way: str = ""
    """Title of the medium access or scheme; empty is the preset's own."""
    beside: str = ""
    """Scheme of a second run; empty is none."""
    coding: str = "exact"
    lose_percent: float = 0.0
    burst_frames: int = 8
    again: bool = True
    """Whether lost packets are sent again."""
    off: str = ""
    """Name of the failed camera; empty if none failed."""
    settings: tuple[str, ...] = ()
    """Settings without a control, ``key=value``."""
    at: Place = Place()
    window_s: float | None = None
    """Length of the shown part of the timeline; None is all."""
    plan: PlanLook = field(default_factory=PlanLook)


def find(place: Place, run: NetworkView, frames: Frames) -> tuple[int, int]:
    """Return a stop's time in ns and its frame, or -1; the end of the run if the place does not exist."""
    air, pieces, value = frames.pieces, run.pieces, int(place.value)
    if place.kind == "share":
        return run.start_ns + round(place.value * (run.end_ns - run.start_ns)), -1
    if place.kind == "cause":
        lost = np.flatnonzero(air.cause == value)
        if len(lost):
            return int(air.end_ns[lost[0]]), int(lost[0])
        failed = np.flatnonzero(np.isin(pieces.what, FAILURES) & (pieces.cause == value))
        return (int(pieces.start_ns[failed[0]]), -1) if len(failed) else (run.end_ns, -1)
    images = [item for item in range(min(len(air.node), 50 * value)) if frames.carries_image(item)]
    if len(images) < value:
        return run.end_ns, -1
    item = images[value - 1]
    if place.kind == "frame":
        return int(air.start_ns[item] + air.end_ns[item]) // 2, item
    answers = pieces.where(pieces.what == What.ACK)
    after = np.flatnonzero((answers.start_ns >= air.end_ns[item]) & (answers.peer == air.node[item]))
    if not len(after):
        return int(air.end_ns[item]), item
    return int(answers.start_ns[after[0]] + answers.end_ns[after[0]]) // 2, item


def _place(text: str) -> Place:
    if text in ("start", "end"):
        return Place("share", 0.0 if text == "start" else 1.0)
    if text in _CAUSES:
        return Place("cause", float(_CAUSES[text]))
    share = re.fullmatch(rf"{NUMBER} ?%", text)
    if share is not None and float(share[1]) <= 100.0:
        return Place("share", float(share[1]) / 100.0)
    kind, _, number = text.partition(" ")
    if kind not in ("frame", "answer") or not number.isdecimal() or int(number) < 1:
        raise ValueError(
            f"try start, end, for example '40 %', 'frame 1' or 'answer 1', or a cause: {', '.join(_CAUSES)}"
        )
    return Place("frame" if kind == "frame" else "answer", float(number))


def _burst(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 50:
        raise ValueError("try a whole number of frames from 1 to 50")
    return int(text)


def _setting(look: NetworkLook, text: str) -> NetworkLook:
    if "=" not in text:
        raise ValueError("try key=value")
    return replace(look, settings=(*look.settings, text))


_WAYS = {way: way for way in (*ACCESS, *SCHEMES)}
SETTINGS: dict[str, Setting[NetworkLook]] = {
    "preset": sets("preset", choice({name: name for name in NETWORKS})),
    "access": sets("way", choice(_WAYS)),
    "scheme": sets("way", choice(_WAYS)),
    "beside": sets("beside", choice(_WAYS)),
    "coding": sets("coding", choice({name: name for name in CODINGS})),
    "lose": sets("lose_percent", quantity("%", 50.0)),
    "bursts": sets("burst_frames", _burst),
    "again": sets("again", choice(_ON_OFF)),
    "off": sets("off", str),
    "setting": _setting,
    "at": sets("at", _place),
    "window": sets("window_s", quantity("ms", 60_000.0, per_unit=1000.0, above_zero=True)),
    **plan_lesson.SETTINGS,
}
"""The settings of a stop, by their names in the file."""


SHARES = ("arrived", "color", "depth", "missed", "f_score", "missed_lossless", "f_score_lossless", "collided")
NUMBERS = (
    *(
        "cameras",
        "megabytes",
        "payload",
        "packets",
        "packets_about",
        "packets_tenfold",
        "frame_time",
        "least",
    ),
    *("tries", "collisions", "lost", "last", "bytes_time", "radio", "energy", "other", "worst_camera"),
    *("worst_depth", "verdict"),
    *("relayed", "crossings"),
    *SHARES,
    "cost",
)
"""Fields of the texts and choices of all lessons that are of a delivery."""
LEFT_SHARE, SEEN_SHARE = 0.05, 0.005
"""Share of arrived depth below which a camera counts as lost, and least increase of the share of rays without
a surface that counts."""


class DeliveryNumbers:
    """The numbers of the delivery that is shown, kept while a ghost of its plan is dragged."""

    def __init__(self) -> None:
        self._of: tuple[str, DeliveryView] | None = None
        self._values: Numbers = {}

    def with_plan(self, scene: str, view: DeliveryView, frames: Frames, planned: Numbers) -> Numbers:
        """Return ``numbers`` and those of the plan; empty until the delivery's last moment is computed."""
        if self._of is None or self._of[0] != scene or self._of[1] is not view:
            self._of, self._values = (scene, view), numbers(scene, view, frames)
        return {**self._values, **planned} if self._values else {}


def numbers(scene: str, view: DeliveryView, frames: Frames) -> Numbers:
    """Return the fields' values for a delivery of a scene; empty until its last moment is computed."""
    end = view.moment_at(view.times_ns[-1])
    if end is None or end.t_ns != view.times_ns[-1]:
        return {}
    best, total = view.lossless, max(1, view.total_bytes)
    values = dict.fromkeys(NUMBERS, UNKNOWN) | _frame_numbers(view, frames)
    shares = {
        "arrived": end.delivered_bytes / total,
        "color": float(np.mean([node.color_share for node in end.nodes])),
        "depth": float(np.mean([node.depth_share for node in end.nodes])),
        "missed": end.no_hit_share,
        "f_score": end.f_score,
        "missed_lossless": None if best is None else best.no_hit_share,
        "f_score_lossless": None if best is None else best.f_score,
    }
    values |= {name: number(share, 1, "%", 100.0) for name, share in shares.items()}
    return {
        **values,
        SCENE: scene,
        "cameras": str(len(view.node_names)),
        "megabytes": number(view.total_bytes, 2, "MB", 1e-6),
        "lost": f"{end.packets_lost:,}",
        "last": time_text(end.t_ns),
        "radio": number(end.radio_j, 1, "J"),
        "energy": number(end.energy_j, 1, "J"),
        "other": number(end.energy_j - end.radio_j, 1, "J"),
        **_worst(view, end),
        "cost": _cost(view, end),
    }


def _frame_numbers(view: DeliveryView, frames: Frames) -> dict[str, str]:
    """Return the numbers of the frames; empty if no frame carried an image."""
    air = frames.pieces
    images = [item for item in range(len(air.node)) if frames.carries_image(item)]
    if not images:
        return {}
    first = images[0]
    payload = frames.bytes_of(first)[1]
    packets = sum(-(-node.total_bytes // payload) for node in view.senders)
    sent_bytes = sum(node.total_bytes for node in view.senders)
    frame_ns = int(air.end_ns[first] - air.start_ns[first])
    collisions = int(np.count_nonzero(air.cause[images] == Cause.COLLISION))
    crossings = {(frames.camera_of(item), int(air.node[item])) for item in images}
    digit = 10 ** (len(str(packets)) - 1)
    return {
        "payload": f"{payload:,} bytes",
        "packets": f"{packets:,}",
        "packets_about": f"{round(packets / digit) * digit:,}",
        "packets_tenfold": f"{round(packets / digit) * digit * 10:,}",
        "frame_time": time_text(frame_ns),
        "least": time_text(packets * frame_ns),
        "bytes_time": time_text(round(8e9 * sent_bytes / view.run.config.mac.rate_bps)),
        "relayed": str(len({camera for camera, sender in crossings if sender != camera})),
        "crossings": str(len(crossings)),
        "tries": f"{len(images):,}",
        "collisions": f"{collisions:,}",
        "collided": number(collisions / len(images), 1, "%", 100.0),
    }


def _worst(view: DeliveryView, end: MomentView) -> dict[str, str]:
    """Return the camera of whose measured depth the smallest share arrived, and that share, as texts."""
    name, node = min(
        zip((one.name for one in view.nodes), end.nodes, strict=True), key=lambda one: one[1].depth_share
    )
    return {"worst_camera": name, "worst_depth": number(node.depth_share, 1, "%", 100.0)}


def _cost(view: DeliveryView, end: MomentView) -> str:
    """Return the loss: "camera" (one camera's depth), "spread" (more holes), "nothing", or unknown."""
    if min(node.depth_share for node in end.nodes) < LEFT_SHARE:
        return "camera"
    if view.lossless is None or end.no_hit_share is None:
        return UNKNOWN
    return "spread" if end.no_hit_share - view.lossless.no_hit_share > SEEN_SHARE else "nothing"


def street_numbers(scene: str, runs: tuple[NetworkView, ...]) -> Numbers:
    """Return the fields' values for runs on streets."""
    names = (*NUMBERS, *plan_lesson.NUMBERS)
    return {**dict.fromkeys(names, UNKNOWN), SCENE: scene, "verdict": verdict(runs)}


def statement(values: Mapping[str, str]) -> str:
    """Return what the delivery brought, for screen readers."""
    if values["arrived"] == UNKNOWN:
        return "" if values["verdict"] == UNKNOWN else values["verdict"]
    lossless = f", and {values['missed_lossless']} where nothing is lost"
    return (
        f"{values[SCENE]}: {values['arrived']} of {values['megabytes']} arrive, the last after "
        f"{values['last']}. {values['missed']} of the rays are without a surface"
        f"{'' if values['missed_lossless'] == UNKNOWN else lossless}."
    )


WORDS = {"cost": ("camera", "spread", "nothing")}
KIND = Kind("network", SETTINGS, NetworkLook(), (*NUMBERS, *plan_lesson.NUMBERS), statement, WORDS)

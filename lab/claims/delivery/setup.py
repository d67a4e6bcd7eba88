"""The trials of the delivery claims: the default subset, and all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from lab.claims.delivery.network import NETWORKS, SendTask
from lab.claims.delivery.trials import Loss, LossTask
from network_sim.presets import PRESETS
from pipeline.config import AlignmentMode
from pipeline.delivery.sending import packet_bytes_of
from pipeline.io.demos import CALIBRATED_SCENES

RIGS = CALIBRATED_SCENES
CODINGS = ("raw", "raw-rows", "raw-tiles", "png", "jpeg", "tiles", "layered", "exact")
LOSSLESS = ("raw", "raw-rows", "raw-tiles", "png")
"""Lossless codings: without lost packets they give equal images, so one trial stands for all."""
HEADLINE = ("raw", "tiles", "layered")
"""Codings whose exchange rates are compared."""
SHARES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5)
RATE_SHARE = 0.1
"""Largest loss share over which the slope is fitted (SPEC 6.5)."""
LARGE, SMALL = (packet_bytes_of(PRESETS[name]) for name in ("office", "thesis-link"))
"""Image bytes in a packet of 802.11b and of 802.15.4."""
SEEDS = 5
"""Number of seeds of all codings at a tenth lost in bursts, of the headline codings at every share of their
exchange rate, and of all trials that ``full`` adds except deadlines. All other trials have one seed."""
UNCORRECTED: AlignmentMode = "affine_depth"
"""The best alignment without the local correction (SPEC 3.5)."""
UNCORRECTED_SHARE = 0.25


def lossless(rig: str, coding: str) -> LossTask:
    """Return the trial without losses with which others of a rig and coding are compared."""
    return LossTask(rig, "raw" if coding in LOSSLESS else coding, LARGE, "random", 0.0, 0)


def loss_tasks(full: bool = False, rigs: Sequence[str] = RIGS) -> list[LossTask]:
    """Return the task of every trial once, the lossless ones of the default chain first.

    Args:
        full: add every coding with every share of every kind of loss, and small packets; takes hours.
        rigs: demo scenes.
    """
    tasks = [lossless(rig, coding) for rig in rigs for coding in CODINGS]
    for rig in rigs:
        tasks += _few(rig)
        tasks += _uncorrected(rig)
        tasks += _all(rig) if full else ()
    return list(dict.fromkeys(tasks))


def send_tasks(rig: str = RIGS[0]) -> list[SendTask]:
    """Return a task for every coding of one rig on each network."""
    return [SendTask(rig, coding, network) for network in NETWORKS for coding in CODINGS]


def _few(rig: str) -> Iterator[LossTask]:
    for coding in HEADLINE:
        for share in SHARES:
            for seed in range(SEEDS if share <= RATE_SHARE else 1):
                yield LossTask(rig, coding, LARGE, "burst", share, seed)
        yield LossTask(rig, coding, LARGE, "random", RATE_SHARE, 0)
        for share in (0.25, 0.5):
            yield LossTask(rig, coding, LARGE, "deadline", share, 0)
    for coding in CODINGS:
        for seed in range(SEEDS):
            yield LossTask(rig, coding, LARGE, "burst", RATE_SHARE, seed)
    for coding in ("png", "jpeg"):
        yield LossTask(rig, coding, LARGE, "burst", 0.02, 0)


def _uncorrected(rig: str) -> Iterator[LossTask]:
    """Yield the trials of the chain without the local correction: one lossless, one with losses."""
    yield replace(lossless(rig, "raw"), alignment=UNCORRECTED)
    yield LossTask(rig, "raw", LARGE, "burst", UNCORRECTED_SHARE, 0, UNCORRECTED)


def _all(rig: str) -> Iterator[LossTask]:
    losses: tuple[Loss, ...] = ("random", "burst")
    for coding in CODINGS:
        for loss in losses:
            for share in SHARES:
                for seed in range(SEEDS):
                    yield LossTask(rig, coding, LARGE, loss, share, seed)
        for share in SHARES:
            yield LossTask(rig, coding, LARGE, "deadline", share, 0)
    for coding in HEADLINE:
        for seed in range(SEEDS):
            yield LossTask(rig, coding, SMALL, "burst", RATE_SHARE, seed)

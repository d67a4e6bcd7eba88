"""D07: the worth and the energy of each of the sixteen pieces of a depth image."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from lab.claims.claim import Claim, Outcome
from lab.claims.delivery.network import SendTask, send_trial
from lab.claims.delivery.setup import RIGS, lossless
from lab.claims.delivery.statistics import estimate, mean_terms
from lab.claims.delivery.study import DATA
from lab.claims.delivery.trials import (
    COUNT_OF_PIECES,
    PIECES,
    PieceTask,
    Values,
    loss_trial,
    piece_area,
    piece_trial,
)
from lab.claims.delivery.views import STRIDE_PX, sees, sparse_points
from lab.claims.exhibits import Table
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.delivery import rvl
from pipeline.delivery.sink import images_of
from pipeline.io.demos import load_demo
from pipeline.types import FloatArray, IntArray, Rig

NETWORK = "office"
CODING = "tiles"
"""Coding that gives the energy per byte of a piece."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """The sixteen pieces of one node's frame, row by row."""

    rig: str
    node: int
    worth: FloatArray
    """(16,) points of F-score that the fused surface loses without the piece's depth."""
    worth_sensor: FloatArray
    """(16,) points that the surface of measured depth loses."""
    alone: FloatArray
    """(16,) share of its pixels whose surface only this node has measured."""
    joules: FloatArray
    """(16,) radios' energy for its depth in RVL coding."""


def alone_shares(rig: Rig, node: int) -> FloatArray:
    """Return (16,) the share of each piece's pixels whose surface this node alone has measured."""
    cloud, shape = sparse_points(rig.frames[node]), rig.frames[node].depth.z_m.shape
    others = [frame for index, frame in enumerate(rig.frames) if index != node]
    alone = ~np.any([sees(other, cloud.points_m) for other in others], axis=0)
    assert cloud.pixels is not None
    marks = np.zeros(shape, bool)
    marks[cloud.pixels[:, 1], cloud.pixels[:, 0]] = alone
    areas = [piece_area(shape, piece) for piece in range(COUNT_OF_PIECES)]
    return np.array([marks[area].sum() * STRIDE_PX**2 / marks[area].size for area in areas])


def piece_bytes(rig: Rig, node: int) -> FloatArray:
    """Return (16,) sizes of each piece's depth in RVL coding, bytes."""
    depth = images_of(rig.frames[node]).depth
    return np.array(
        [len(rvl.encode(depth[piece_area(depth.shape, piece)])) for piece in range(COUNT_OF_PIECES)], float
    )


def piece_study(
    folder: Path, scheduler: str | None, rigs: Sequence[str] = RIGS[:1]
) -> Generator[Progress, None, list[Pieces]]:
    """Leave out each piece of every node of some rigs in turn, and send the rigs' images for their energy."""
    run = partial(iterate_trials, folder=folder, scheduler=scheduler, data=DATA)
    loaded = {name: load_demo(name) for name in rigs}
    tasks = [
        PieceTask(name, node, piece)
        for name, rig in loaded.items()
        for node in range(len(rig.frames))
        for piece in range(COUNT_OF_PIECES)
    ]
    whole: list[Values] = yield from run(
        "D07, all pieces", loss_trial, [lossless(name, "raw") for name in rigs]
    )
    found: list[Values] = yield from run("D07, a piece left out", piece_trial, tasks)
    sent: list[Values] = yield from run(
        "D07, on the air", send_trial, [SendTask(name, CODING, NETWORK) for name in rigs]
    )
    pieces = []
    for (name, rig), best, cost in zip(loaded.items(), whole, sent, strict=True):
        joules_a_byte = float(cost["radio_j"] or np.nan) / float(cost["bytes"] or np.nan)
        for node in range(len(rig.frames)):
            mine = [
                values
                for task, values in zip(tasks, found, strict=True)
                if (task.rig, task.node) == (name, node)
            ]
            pieces.append(
                Pieces(
                    *(name, node, _worth(best, mine, "f_after"), _worth(best, mine, "f_before")),
                    alone_shares(rig, node),
                    joules_a_byte * piece_bytes(rig, node),
                )
            )
    return pieces


def full_piece_study(folder: Path, scheduler: str | None) -> Generator[Progress, None, list[Pieces]]:
    """Run ``piece_study`` with all rigs."""
    return (yield from piece_study(folder, scheduler, RIGS))


def _worth(whole: Values, without: Sequence[Values], name: str) -> FloatArray:
    return np.array([100.0 * (float(whole[name] or 0.0) - float(one[name] or 0.0)) for one in without])


def judge(pieces: Sequence[Pieces]) -> Outcome:
    """Return D07's numbers and verdict."""
    rigs = tuple(dict.fromkeys(one.rig for one in pieces))
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for name in ("worth", "worth_sensor"):
        by_rig = [[one for one in pieces if one.rig == rig] for rig in rigs]
        key = f"rank_correlation_{name}_alone"
        ours[key], ci95[key] = estimate(
            [
                mean_terms(float(spearmanr(one.alone, getattr(one, name)).statistic) for one in nodes)
                for nodes in by_rig
            ]
        )
    worth, joules = (np.concatenate([getattr(one, name) for one in pieces]) for name in ("worth", "joules"))
    order = np.argsort(-worth / joules)
    gained = np.cumsum(worth[order]) / worth.sum() if worth.sum() > 0.0 else np.full(len(worth), np.nan)
    ours |= {
        "pieces": len(worth),
        "most_points": float(worth.max()),
        "median_points": float(np.median(worth)),
        "least_points": float(worth.min()),
        "worth_nothing_share": float(np.mean(worth <= 0.0)),
        "points_per_joule_best_quarter": _per_joule(worth, joules, order[: len(order) // 4]),
        "points_per_joule_all": _per_joule(worth, joules, order),
        "worth_of_best_quarter": float(gained[len(order) // 4 - 1]),
    }
    key = "rank_correlation_worth_alone"
    low, high = ci95[key]
    return Outcome(
        ours,
        ci95,
        low > 0.0,
        f"rank correlation {ours[key]:.2f} [{low:.2f}, {high:.2f}] over {len(pieces)} nodes of {len(rigs)} "
        f"rigs; of {len(worth)} pieces the median is worth {ours['median_points']:.2f} points of F-score, "
        f"the best {worth.max():.2f}, and {ours['worth_nothing_share']:.0%} nothing or less than nothing "
        f"(down to {worth.min():.2f}, which is the noise of thinning and registration)",
        (_table(pieces),),
    )


def _per_joule(worth: FloatArray, joules: FloatArray, rows: IntArray) -> float:
    return float(worth[rows].sum() / joules[rows].sum())


def _table(pieces: Sequence[Pieces]) -> Table:
    rows = []
    for one in pieces:
        for row in range(PIECES):
            at = slice(row * PIECES, (row + 1) * PIECES)
            cells = [
                f"{worth:+.2f} / {alone:.0%} / {1000.0 * joules:.0f} mJ"
                for worth, alone, joules in zip(one.worth[at], one.alone[at], one.joules[at], strict=True)
            ]
            rows.append((f"{one.rig}, node {one.node}, row {row + 1}", *cells))
    return Table(
        "What each sixteenth of a depth image is worth",
        ("", *(f"column {column + 1}" for column in range(PIECES))),
        tuple(rows),
        "Points of F-score at 5 cm, fused, that are lost without it, its colour still there / share of its "
        "pixels whose surface no other camera has measured / energy of the nodes' radios for its depth as "
        f"RVL, at the joules a byte of the coding {CODING} by 802.11b.",
    )


D07 = Claim(
    id="D07",
    claim="A piece of a depth image is worth the more, the more of it no other camera sees",
    thesis="ours beyond the thesis",
    tolerance="rank correlation of worth in F-score, fused, and share seen alone above 0 with its interval",
    experiment=judge,
    prepare=piece_study,
    prepare_full=full_piece_study,
)

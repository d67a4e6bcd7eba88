"""D08: the choice of M of a rig's N cameras if the budget does not suffice for all."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from lab.claims.claim import Claim, Outcome
from lab.claims.delivery.setup import LARGE, RIGS
from lab.claims.delivery.statistics import estimate, mean_terms
from lab.claims.delivery.study import DATA
from lab.claims.delivery.trials import SubsetTask, Values, subset_trial
from lab.claims.delivery.views import rig_quality
from lab.claims.exhibits import Table
from lab.trials import iterate_trials
from network_sim.fixed.selection import FloatArray, greedy, greedy_by_cost, nearest
from network_sim.presets import PRESETS
from packetmesh.progress import Progress
from pipeline.delivery import coding_named
from pipeline.delivery.plan import places_of
from pipeline.delivery.sink import images_of
from pipeline.io.demos import load_demo
from pipeline.types import Rig

CODING = "layered"
"""Coding that gives the cameras' costs."""
PROGRAMS = ("greedy", "greedy by sight", "greedy by bytes", "nearest", "random", "best")
Scores = dict[tuple[int, ...], float]
"""F-score of the fused surface by the set of received cameras."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Data from which a program chooses among a rig's cameras before any of them sends."""

    q: FloatArray
    """(N, V) quality with which each camera sees each voxel."""
    distances_m: FloatArray
    """(N,) distances to the sink."""
    costs: FloatArray
    """(N,) sizes of the images, bytes."""


Found = dict[str, tuple[Choice, Scores]]
"""Choice and scores by rig."""


def choice(rig: Rig) -> Choice:
    """Return the data for the choice among a rig's cameras."""
    places_m = np.array(places_of(rig, PRESETS["office"].nodes.spacing_m)).reshape(-1, 2)
    coding = coding_named(CODING)
    costs = [float(len(coding.encode(images_of(frame), LARGE))) for frame in rig.frames]
    return Choice(
        rig_quality(rig).astype(np.float64),
        np.linalg.norm(places_m[:-1] - places_m[-1], axis=1),
        np.array(costs, float),
    )


def subset_study(folder: Path, scheduler: str | None) -> Generator[Progress, None, Found]:
    """Run the chain with every subset of every rig's cameras."""
    rigs = {name: load_demo(name) for name in RIGS}
    tasks = [SubsetTask(name, nodes) for name, rig in rigs.items() for nodes in _subsets(len(rig.frames))]
    found: list[Values] = yield from iterate_trials(
        "D08, some of the cameras", subset_trial, tasks, folder, scheduler, data=DATA
    )
    scores: dict[str, Scores] = {name: {} for name in RIGS}
    for task, values in zip(tasks, found, strict=True):
        scores[task.rig][task.nodes] = float(values["f_after"] or 0.0)
    return {name: (choice(rig), scores[name]) for name, rig in rigs.items()}


def _subsets(count: int) -> list[tuple[int, ...]]:
    return [nodes for size in range(1, count + 1) for nodes in combinations(range(count), size)]


def chosen(cameras: Choice, scores: Scores, m: int) -> dict[str, float]:
    """Return the F-score, 0 to 1, of ``m`` cameras by program; ``random`` is the mean of all sets of ``m``.

    ``greedy`` takes quality as in SPEC 6.3; ``greedy by sight`` counts a voxel fully once a camera sees it.
    ``greedy by bytes`` may spend the bytes of ``m`` mean images, on any number of cameras.
    """
    budget = m * float(cameras.costs.mean())
    sets = {
        "greedy": greedy(cameras.q, m).cameras,
        "greedy by sight": greedy((cameras.q > 0.0).astype(float), m).cameras,
        "greedy by bytes": greedy_by_cost(cameras.q, cameras.costs, budget).cameras
        if budget >= cameras.costs.min()
        else (),
        "nearest": nearest(cameras.q, m, cameras.distances_m).cameras,
    }
    of_size = [score for nodes, score in scores.items() if len(nodes) == m]
    by_program = {name: scores.get(tuple(sorted(nodes)), 0.0) for name, nodes in sets.items()}
    return by_program | {"random": float(np.mean(of_size)), "best": max(of_size)}


def judge(found: Found) -> Outcome:
    """Return D08's numbers and verdict."""
    ours: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    rows: list[tuple[str | float, ...]] = []
    fewer = range(1, max(len(cameras.q) for cameras, _ in found.values()))
    leads, hits = [], 0
    for m in fewer:
        by_rig = {rig: chosen(cameras, scores, m) for rig, (cameras, scores) in found.items()}
        for program in PROGRAMS:
            found_f = [100.0 * scores[program] for scores in by_rig.values()]
            name = f"f_{program.replace(' ', '_')}_{m}"
            ours[name], ci95[name] = estimate([mean_terms([f]) for f in found_f])
            rows.append((f"{m}, {program}", *found_f, ours[name]))
        leads.append(np.mean([scores["greedy"] - scores["random"] for scores in by_rig.values()]))
        hits += sum(scores["greedy"] == scores["best"] for scores in by_rig.values())
    whole = [100.0 * max(scores.items(), key=lambda item: len(item[0]))[1] for _, scores in found.values()]
    rows.append(("all", *whole, float(np.mean(whole))))
    ours["f_all"] = float(np.mean(whole))
    return Outcome(
        ours | {"greedy_is_best": hits, "choices": len(fewer) * len(found)},
        ci95,
        bool(min(leads) > 0.0),
        "mean F-score of the greedy choice less that of a random one: "
        + ", ".join(f"{100 * lead:+.2f} points with {m}" for m, lead in zip(fewer, leads, strict=True))
        + f"; greedy is the best choice in {hits} of {len(fewer) * len(found)} cases, of which chance alone "
        f"gives a third with three cameras; all cameras have {ours['f_all']:.1f}",
        (
            Table(
                "F-score of some of the cameras",
                ("number of cameras, program", *found, "mean"),
                tuple(rows),
                "F-score at 5 cm of the fused surface, in per cent, against all that the rig's cameras could "
                "see. Greedy maximises the view quality of SPEC 6.3, which rises with a second view of a "
                "surface; greedy by sight counts a surface fully from its first view on. Programs choose by "
                "depth at an eighth of the resolution and the believed poses. Random is the mean of all "
                "sets, best the best of them. Greedy by bytes may spend the bytes of as many mean layered "
                "images. In a network of one hop a joule of the radio buys the same bytes at every node, so "
                "that a budget of joules chooses the same. Three cameras leave three choices: "
                "this shows no more than that a choice is not worse than none.",
            ),
        ),
    )


D08 = Claim(
    id="D08",
    claim="Cameras chosen greedily by what they see give a better mesh than as many chosen at random",
    thesis="ours beyond the thesis, which has M of N cameras send (3.6.2) without a number",
    tolerance="mean F-score at 5 cm over the rigs above that of all sets of that size, for each M below N",
    experiment=judge,
    prepare=subset_study,
)

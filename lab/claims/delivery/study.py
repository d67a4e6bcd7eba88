"""The trials of D01 to D06 and D11, and the values computed from them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lab.claims.delivery.network import SendTask, send_trial
from lab.claims.delivery.setup import LARGE, RATE_SHARE, RIGS, loss_tasks, lossless, send_tasks
from lab.claims.delivery.statistics import slope_terms
from lab.claims.delivery.trials import LossTask, Values, colorless_trial, loss_trial
from lab.trials import iterate_trials
from packetmesh.progress import Progress
from pipeline.depth.completion import SHIPPED_COMPLETION
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.io.demos import SCENES
from pipeline.types import FloatArray

DATA = (SHIPPED_MODEL, SHIPPED_COMPLETION, SCENES)
"""Files that every trial depends on, besides the code."""


@dataclass(frozen=True, slots=True)
class Study:
    """The tasks of all trials, each with its values."""

    losses: dict[LossTask, Values]
    colorless: dict[str, Values]
    """Values by rig of the trials in which all depth arrives, and no colour."""
    sent: dict[SendTask, Values]

    @property
    def rigs(self) -> tuple[str, ...]:
        """Rigs in the order of the trials."""
        return tuple(dict.fromkeys(task.rig for task in self.losses))

    def tasks(
        self, coding: str, loss: str = "burst", packet_bytes: int = LARGE, rigs: Iterable[str] = ()
    ) -> list[LossTask]:
        """Return the tasks with losses of a coding, by the default chain."""
        of_rigs = tuple(rigs) or self.rigs
        return [
            task
            for task in self.losses
            if (task.coding, task.loss, task.packet_bytes) == (coding, loss, packet_bytes)
            and task.share > 0.0
            and task.alignment == "local"
            and task.rig in of_rigs
        ]

    def value(self, task: LossTask, name: str) -> float:
        """Return one value of a trial; NaN without one."""
        value = self.losses[task][name]
        return float("nan") if value is None else float(value)

    def lost_percent(self, task: LossTask) -> float:
        """Return the share of all nodes' packets that were really lost, %."""
        return 100.0 * self.value(task, "packets_lost") / self.value(task, "packets")

    def cost(self, task: LossTask, when: str) -> float:
        """Return the points of F-score that a trial loses against its rig and coding without losses."""
        name = f"f_{when}"
        return 100.0 * (self.value(lossless(task.rig, task.coding), name) - self.value(task, name))

    def rate_tasks(self, coding: str, rig: str) -> list[LossTask]:
        """Return a rig's tasks with bursts of up to 10 %: shares that every seed has, unlike larger ones."""
        return [task for task in self.tasks(coding, rigs=(rig,)) if task.share <= RATE_SHARE]

    def rate_terms(self, coding: str, when: str) -> list[FloatArray]:
        """Return each rig's (S, 2) slope terms by seed: F-score points over % lost in bursts, up to 10 %."""
        return [
            self.terms_by_seed(self.rate_tasks(coding, rig), lambda task: self.cost(task, when))
            for rig in self.rigs
        ]

    def terms_by_seed(self, tasks: Iterable[LossTask], effect: Callable[[LossTask], float]) -> FloatArray:
        """Return (S, 2) slope terms of an effect over % lost, one row for all shares of a seed.

        The shares of a seed have the same random numbers, so they are one repetition.
        """
        by_seed: dict[int, list[LossTask]] = {}
        for task in tasks:
            by_seed.setdefault(task.seed, []).append(task)
        return np.stack(
            [
                slope_terms(map(self.lost_percent, some), map(effect, some))
                for _, some in sorted(by_seed.items())
            ]
        )


def delivery_study(
    folder: Path, scheduler: str | None, full: bool = False
) -> Generator[Progress, None, Study]:
    """Run the trials of D01 to D06 and D11: the default subset, or all."""
    run = partial(iterate_trials, folder=folder, scheduler=scheduler, data=DATA)
    tasks, sending = loss_tasks(full), send_tasks()
    losses = yield from run("D01 to D06, lost packets", loss_trial, tasks)
    colorless = yield from run("D06, no colour", colorless_trial, RIGS)
    sent = yield from run("D01, on the air", send_trial, sending)
    return Study(
        dict(zip(tasks, losses, strict=True)),
        dict(zip(RIGS, colorless, strict=True)),
        dict(zip(sending, sent, strict=True)),
    )


def full_delivery_study(folder: Path, scheduler: str | None) -> Generator[Progress, None, Study]:
    """Run all trials of D01 to D06 and D11."""
    return (yield from delivery_study(folder, scheduler, full=True))
